//! What `spandrel info` says of the lights of scenes and graphs, and of a scene's environment.

use spandrel_engine::color::Color;
use spandrel_engine::fragment::Environment;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::{Graph, Run, Schedule, Value};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::list::MakeLamp;
use spandrel_engine::math;
use spandrel_engine::scene::Scene;
use spandrel_engine::trace::Toward;
use spandrel_engine::values::Lamps;
use std::collections::BTreeMap;

/// A lamp in words: where it stands or shines from, and whether it is on.
fn about(lamp: &Lamp) -> String {
    let rounded = |point: glam::DVec3| {
        let [x, y, z] = point.to_array().map(|v| (v * 1e3).round() / 1e3 + 0.0);
        format!("({x:.3}, {y:.3}, {z:.3})")
    };
    let mut words = Vec::new();
    match lamp.light.toward() {
        Some(Toward::Direction(toward)) => {
            let up = 90.0 - math::acos(toward.y.clamp(-1.0, 1.0)).to_degrees();
            words.push(format!("from direction {}, {up:.1} degrees high", rounded(toward)));
            let lux = f64::from(lamp.strength.luminance());
            let [r, g, b] = lamp.strength.to_array();
            let colored = if r == g && g == b { "" } else { " with its colour" };
            words.push(format!("{} lux{colored}", (lux * 10.0).round() / 10.0));
        }
        Some(Toward::Point(point)) => words.push(format!("at {}", rounded(point))),
        None => {}
    }
    if let Some(sun) = lamp.light.sun() {
        words.push(format!("a sky whose sun is in direction {}", rounded(sun)));
    }
    if !lamp.shines() {
        words.push("gives no light".to_owned());
    }
    words.join(", ")
}

fn line(name: &str, kind: &str, lamp: &Lamp) -> String {
    match about(lamp) {
        words if words.is_empty() => format!("\"{name}\": {kind}"),
        words => format!("\"{name}\": {kind} {words}"),
    }
}

/// The lights of a scene's list, a line each.
pub(crate) fn of_scene(scene: &Scene) -> Vec<String> {
    let lights = scene.lights.iter();
    let told = lights.map(|(name, light)| match light.lamp(name, &scene.directory) {
        Ok(lamp) => line(name, light.kind(), &lamp),
        Err(fault) => {
            let error = spandrel_engine::Error::from(fault);
            format!("\"{name}\": {}: {error}", light.kind())
        }
    });
    told.collect()
}

/// The lights of a graph in words, by node: those that can be made, of lights at most, so that nothing is rendered.
pub(crate) fn of_graph(graph: &Graph) -> BTreeMap<&str, String> {
    let lights: BTreeMap<&str, Vec<&str>> = graph
        .nodes()
        .filter(|node| node.output == Lamps::NAME)
        .map(|node| (node.id, node.uses))
        .collect();
    let run = Run::new();
    let about_node = |id: &str| {
        let mut wishes = Wishes::new();
        wishes.want::<Lamps>(id, ());
        let plan = Schedule::new(graph, &wishes).ok()?;
        let done = run.evaluate(graph, &plan, &()).ok()?;
        match &done.value::<Lamps>(0).0[..] {
            [lamp] => Some(about(lamp)),
            _ => None,
        }
    };
    let is_made_of_lights = |uses: &[&str]| uses.iter().all(|used| lights.contains_key(used));
    let known = lights.iter().filter(|(_, uses)| is_made_of_lights(uses));
    known.filter_map(|(id, _)| Some((*id, about_node(id)?))).collect()
}

/// A scene's environment record (\[D], "Rendering condition data").
pub(crate) fn environment(environment: &Environment) -> String {
    let Environment { ambient, background, fog, overcast, shadows } = environment;
    let color = |color: &Color| {
        let [r, g, b] = color.to_array();
        format!("({r}, {g}, {b})")
    };
    let shadows = if *shadows { "shadows" } else { "no shadows" };
    format!(
        "ambient {}, background {}, fog {fog} per metre, overcast {overcast}, {shadows}",
        color(ambient),
        color(background)
    )
}
