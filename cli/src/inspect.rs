//! `spandrel inspect`: one line of an image, drawn: its depths and its spans, as \[N] figs. 5 and 6 do for
//! two images and their composite.

use spandrel_engine::graph::{Graph, Registry};
use spandrel_engine::span::{FaceId, SpanImage, line};
use spandrel_engine::{Error, Result, output};
use std::fmt::Write as _;
use std::io::Write as _;
use std::ops::Range;

use crate::args::Inspect;
use crate::print::escape;
use crate::spans::{self, Chosen};
use crate::{exit, print};

pub(crate) fn run(registry: &Registry, args: &Inspect) -> u8 {
    if let Some(Err(code)) = args.output.as_ref().map(|file| exit::check_output(file, &["svg"])) {
        return code;
    }
    spans::look(registry, &args.look, |graph| inspect(graph, args))
}

fn inspect(graph: &Graph, args: &Inspect) -> Result<()> {
    let Chosen { node, raster, plan } = spans::choose(graph, &args.look)?;
    if !(0.0..f64::from(raster.height)).contains(&args.line) {
        let height = raster.height;
        return Err(Error::invalid(format!("line {}: the image has 0 to {height}", args.line)));
    }
    let row = args.line as u32;
    // Below the last line of a row there is none in it: then the last is drawn.
    let k = plan.first_at_or_below(args.line).min(plan.lines(&(row..row + 1)).end - 1);
    let mut ids: Vec<&str> = inputs(graph, node);
    ids.push(node);
    let evaluated = spans::of_row(graph, &ids, (raster, plan), row)?;
    let columns = match args.columns {
        Some([from, to]) if from < to && to <= raster.width => from..to,
        Some([from, to]) => {
            let width = raster.width;
            return Err(Error::invalid(format!("columns {from} to {to} of 0 to {width}")));
        }
        None => 0..raster.width,
    };
    let images: Vec<_> = (0..ids.len()).map(|i| evaluated.value::<SpanImage>(i)).collect();
    let panels: Vec<Panel> =
        ids.iter().zip(&images).map(|(id, image)| Panel::new(id, image, k, &columns)).collect();
    let svg = draw(&panels, &columns, plan.y(k));
    match &args.output {
        None => print::out(&svg),
        Some(path) => {
            output::write(path, |out| {
                out.write_all(svg.as_bytes()).map_err(|e| Error::output(path, e))
            })?;
        }
    }
    Ok(())
}

/// The span images that a node is made of.
fn inputs<'g>(graph: &'g Graph, node: &str) -> Vec<&'g str> {
    let uses = graph.nodes().find(|n| n.id == node).map_or(Vec::new(), |node| node.uses);
    let makes_spans = |id: &&str| graph.nodes().any(|n| n.id == *id && n.output == "SpanImage");
    uses.into_iter().filter(makes_spans).collect()
}

/// A segment as it is drawn.
struct Drawn {
    /// From and to, in pixels.
    x: Range<f64>,
    /// Depth rho at both ends.
    depth: [f64; 2],
    object: String,
    is_layer: bool,
}

/// One image's line.
struct Panel {
    title: String,
    segments: Vec<Drawn>,
    distance: Box<dyn Fn(f64) -> f64>,
}

impl Panel {
    fn new(id: &str, image: &SpanImage, k: u32, columns: &Range<u32>) -> Panel {
        let raster = image.view().raster();
        let (low, high) = (f64::from(columns.start), f64::from(columns.end));
        let y = image.plan().y(k);
        let mut segments = Vec::new();
        let mut add = |cells: Range<u32>, face: FaceId, is_layer: bool| {
            let x = raster.pixels(cells.start).max(low)..raster.pixels(cells.end).min(high);
            if face.is_some() && x.start < x.end {
                let (source, known) = image.face(face);
                let depth = [x.start, x.end].map(|x| known.plane.depth(x, y));
                let object = source.object(known.ordinal);
                segments.push(Drawn { x, depth, object, is_layer });
            }
        };
        let spans = image.lines().line(k);
        for (cells, face) in line::segments(spans, raster.cells()) {
            add(cells, face, false);
        }
        for segment in image.layers().line(k) {
            add(segment.start..segment.end, segment.face, true);
        }
        let title = format!("{id}: {}", print::count(spans.len(), "span"));
        let view = image.view().clone();
        Panel { title, segments, distance: Box::new(move |rho| view.distance(rho)) }
    }
}

const WIDTH: f64 = 900.0;
const LEFT: f64 = 70.0;
const RIGHT: f64 = 20.0;
/// Heights of a panel's depths, its bar of spans, and the room between panels.
const DEPTHS: f64 = 150.0;
const BAR: f64 = 14.0;
const GAP: f64 = 44.0;
/// Objects that are named below.
const LEGEND: usize = 12;

fn draw(panels: &[Panel], columns: &Range<u32>, y: f64) -> String {
    let all = || panels.iter().flat_map(|panel| &panel.segments);
    let depths = || all().flat_map(|drawn| drawn.depth);
    let low = depths().fold(f64::INFINITY, f64::min);
    let high = depths().fold(f64::NEG_INFINITY, f64::max);
    let (low, high) = if low < high { (low, high) } else { (low - 1.0, low + 1.0) };
    let (low, high) = (low - (high - low) * 0.05, high + (high - low) * 0.05);
    let mut objects: Vec<&str> = all().map(|drawn| drawn.object.as_str()).collect();
    objects.sort_unstable();
    objects.dedup();
    let color = |object: &str| {
        let at = objects.iter().position(|known| *known == object).unwrap_or(0);
        // Neighbours in the list are far apart on the wheel.
        format!("hsl({} 52% {}%)", (at * 137) % 360, 38 + (at % 3) * 8)
    };
    let width = f64::from(columns.end - columns.start);
    let at = |x: f64| LEFT + (x - f64::from(columns.start)) / width * (WIDTH - LEFT - RIGHT);
    let legend = objects.len().min(LEGEND).div_ceil(3) as f64 * 18.0;
    let height = 30.0 + panels.len() as f64 * (DEPTHS + BAR + GAP) + 24.0 + legend;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
         viewBox=\"0 0 {WIDTH} {height}\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n\
         <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n"
    );
    let mut top = 30.0;
    for panel in panels {
        let place = |rho: f64| top + DEPTHS - (rho - low) / (high - low) * DEPTHS;
        let (right, bottom) = (WIDTH - RIGHT, top + DEPTHS);
        let _ = writeln!(
            out,
            "<text x=\"{LEFT}\" y=\"{:.1}\" fill=\"#222\">{}</text>\n\
             <rect x=\"{LEFT}\" y=\"{top}\" width=\"{:.1}\" height=\"{DEPTHS}\" fill=\"#f6f6f4\"/>",
            top - 8.0,
            escape(&panel.title),
            right - LEFT
        );
        for i in 0..=3 {
            let rho = low + (high - low) * (f64::from(i) / 3.0 * 0.9 + 0.05);
            let distance = (panel.distance)(rho);
            let _ = writeln!(
                out,
                "<path d=\"M{LEFT} {0:.1}H{right}\" stroke=\"#dedede\"/><text x=\"{1:.1}\" y=\"{2:.1}\" \
                 text-anchor=\"end\" fill=\"#666\">{distance:.2} m</text>",
                place(rho),
                LEFT - 6.0,
                place(rho) + 4.0
            );
        }
        for Drawn { x, depth, object, is_layer } in &panel.segments {
            let (from, to, color) = (at(x.start), at(x.end), color(object));
            let dash = if *is_layer { " stroke-dasharray=\"5 3\"" } else { "" };
            let _ = writeln!(
                out,
                "<g><title>{}, pixels {:.3} to {:.3}, {:.4} to {:.4} m</title>\
                 <path d=\"M{from:.2} {:.2}L{to:.2} {:.2}\" stroke=\"{color}\" stroke-width=\"2\"{dash}/>\
                 <rect x=\"{from:.2}\" y=\"{:.1}\" width=\"{:.2}\" height=\"{}\" fill=\"{color}\"{}/></g>",
                escape(object),
                x.start,
                x.end,
                (panel.distance)(depth[0]),
                (panel.distance)(depth[1]),
                place(depth[0]),
                place(depth[1]),
                bottom + 4.0 + if *is_layer { BAR / 2.0 } else { 0.0 },
                to - from,
                if *is_layer { BAR / 2.0 } else { BAR },
                if *is_layer { " opacity=\"0.75\"" } else { "" },
            );
        }
        top += DEPTHS + BAR + GAP;
    }
    let _ = writeln!(
        out,
        "<text x=\"{LEFT}\" y=\"{0:.1}\" fill=\"#666\">x = {1}</text>\
         <text x=\"{2:.1}\" y=\"{0:.1}\" text-anchor=\"end\" fill=\"#666\">x = {3}; the line at y = {y:.4}; \
         above each bar of spans their depths, nearer is higher</text>",
        top,
        columns.start,
        WIDTH - RIGHT,
        columns.end
    );
    for (i, object) in objects.iter().take(LEGEND).enumerate() {
        let (x, y) = (LEFT + (i % 3) as f64 * 275.0, top + 14.0 + (i / 3) as f64 * 18.0);
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"10\" height=\"10\" fill=\"{}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#444\">{}</text>",
            color(object),
            x + 15.0,
            y + 9.0,
            escape(object)
        );
    }
    out.push_str("</svg>\n");
    out
}
