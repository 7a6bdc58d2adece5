//! What `spandrel info` says of the lights of scenes and graphs, and of a scene's environment.

use spandrel_engine::color::Color;
use spandrel_engine::fragment::Environment;
use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::{Graph, Plan, Run};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::list::MakeLamp;
use spandrel_engine::math;
use spandrel_engine::scene::Scene;
use spandrel_engine::trace::Toward;
use spandrel_engine::values::Lamps;

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
            words.push(format!("towards {}, {up:.1} degrees high", rounded(toward)));
            let lux = f64::from(lamp.strength.luminance());
            words.push(format!("{} lux", (lux * 10.0).round() / 10.0));
        }
        Some(Toward::Point(point)) => words.push(format!("at {}", rounded(point))),
        None => {}
    }
    if let Some(sun) = lamp.light.sun() {
        words.push(format!("a sky whose sun stands towards {}", rounded(sun)));
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

/// What a light of a graph gives, if it is one and can be made.
pub(crate) fn of_node(graph: &Graph, id: &str) -> Option<String> {
    let mut wishes = Wishes::new();
    wishes.want::<Lamps>(id, ());
    let plan = Plan::new(graph, &wishes).ok()?;
    let done = Run::new().evaluate(graph, &plan, &()).ok()?;
    match &done.value::<Lamps>(0).0[..] {
        [lamp] => Some(about(lamp)),
        _ => None,
    }
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
