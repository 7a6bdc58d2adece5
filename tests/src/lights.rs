//! Lights for tests.

use glam::DVec3;
use spandrel_engine::color::Color;
use spandrel_engine::light::sky::Ambient;
use spandrel_engine::light::{Lamp, Light, point};
use spandrel_engine::shade::{Bounces, Fog, FogLaw, Illuminate, Shadows};
use spandrel_engine::trace::Reductions;
use std::sync::Arc;

/// Asserts that two numbers differ by no more than a share.
pub fn close(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within * b.abs(), "{a} is not {b} within {within}");
}

/// A lamp of strength 1.
pub fn lamp(light: impl Light + 'static) -> Lamp {
    Lamp::new("lamp", true, Color::WHITE, Arc::new(light))
}

/// Parallel light that travels along a direction.
pub fn sun(direction: impl Into<DVec3>, color: Color) -> Lamp {
    let toward = -direction.into().normalize();
    Lamp::new("sun", true, color, Arc::new(point::Parallel { toward }))
}

/// Lamps, and light from above and below, without shadows.
pub fn illuminate(mut lamps: Vec<Lamp>, above: Color, below: Color) -> Illuminate {
    lamps.push(Lamp::new("ambient", true, Color::WHITE, Arc::new(Ambient { above, below })));
    Illuminate {
        lamps,
        white: 1.0,
        shadows: Shadows::Off,
        samples: 16,
        less: Reductions::default(),
        bounces: Bounces::default(),
    }
}

/// Fog that is not there: to be changed.
pub fn no_fog() -> Fog {
    let law = FogLaw::Exponential;
    Fog { density: 0.0, color: Color::WHITE, start: 0.0, law, height: None, sky: None }
}
