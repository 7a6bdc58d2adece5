//! Images of spans that commands look at: which one is meant, and its lines in a row.

use spandrel_engine::graph::demand::{Failure, Wishes};
use spandrel_engine::graph::report::Evaluated;
use spandrel_engine::graph::{Graph, Registry, Run, Schedule};
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Delivery, Override, SpanDemand};
use spandrel_engine::{Error, Result};

use crate::args::Look;
use crate::{check, exit, print};

/// An image of a graph, and where its lines lie.
pub(crate) struct Chosen<'g> {
    pub(crate) node: &'g str,
    pub(crate) raster: Raster,
    pub(crate) plan: LinePlan,
}

/// Reads the graph that a command looks at, lets it work, and tells what goes wrong.
pub(crate) fn look(
    registry: &Registry,
    look: &Look,
    work: impl FnOnce(&Graph) -> Result<()>,
) -> u8 {
    let graph = match check::read(registry, &look.graph, &look.set, look.frame.as_ref()) {
        Ok(graph) => graph,
        Err(code) => return code,
    };
    if let Some(name) = &look.write
        && graph.nodes().all(|node| node.id != name)
    {
        return check::unknown("-w", name, graph.nodes().map(|node| node.id));
    }
    match work(&graph) {
        Ok(()) => exit::DONE,
        Err(error) => {
            print::error(format!("{}: {error}", check::name(&look.graph)));
            exit::of(&error)
        }
    }
}

/// The image of spans that is meant, and where its lines lie when the graph's pictures are made. Without a name, the one
/// that is resolved first.
pub(crate) fn choose<'g>(graph: &'g Graph, look: &Look) -> Result<Chosen<'g>> {
    let (name, size) = (look.write.as_deref(), look.size);
    let mut wishes = Wishes::new();
    for node in graph.nodes().filter(|node| node.output == "File") {
        wishes.want::<Delivery>(node.id, Override { size, ..Override::default() });
    }
    let plan = Schedule::new(graph, &wishes).map_err(|e| Error::invalid(e.to_string()))?;
    let makes_spans = |id: &str| graph.nodes().any(|n| n.id == id && n.output == "SpanImage");
    let asks = plan.asks(graph);
    // Users stand before what they use: the first image is the one that is resolved.
    let asked = asks.iter().find(|asked| match name {
        Some(name) => asked.node == name,
        None => makes_spans(asked.node),
    });
    let Some(asked) = asked.filter(|asked| makes_spans(asked.node)) else {
        let name = name.unwrap_or("an image");
        return Err(Error::invalid(format!("{name} is no span image that a picture needs")));
    };
    let number = |pointer: &str| asked.demand.pointer(pointer).and_then(|v| v.as_u64());
    let raster = number("/raster/width").zip(number("/raster/height"));
    let (width, height) = raster.unwrap_or((0, 0));
    let is_centred = asked.demand.pointer("/plan/phase").is_some_and(|phase| phase == "Centre");
    let phase = if is_centred { Phase::Centre } else { Phase::Border };
    let per_row = number("/plan/per_row").unwrap_or(0);
    let raster = Raster::new(width as u32, height as u32)?;
    Ok(Chosen { node: asked.node, raster, plan: LinePlan::new(per_row as u32, phase)? })
}

/// The images of some nodes over a row.
pub(crate) fn of_row(
    graph: &Graph,
    nodes: &[&str],
    (raster, plan): (Raster, LinePlan),
    row: u32,
) -> Result<Evaluated> {
    let mut wishes = Wishes::new();
    for id in nodes {
        let rows = row..row + 1;
        wishes.want::<SpanImage>(id, SpanDemand { raster, plan, rows, layered: false });
    }
    let fail = |failure: Failure| Error::invalid(failure.to_string());
    let wanted = Schedule::new(graph, &wishes).map_err(fail)?;
    Run::new().evaluate(graph, &wanted, &()).map_err(fail)
}
