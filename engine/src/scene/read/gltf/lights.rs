//! Cameras, and the lights of `KHR_lights_punctual`.
//!
//! Lights are in a scene's light list, by their own names or those of their nodes. Their units are those of the
//! format: candela for points and spots (1 if absent), lux for directional lights (1 if absent). A spot's cone is
//! whole to `innerConeAngle` (0 if absent) and gone at `outerConeAngle` (45 degrees); between them it falls off as
//! `SpotLight` does. `range` is a hint for programs that cannot afford all lights, and means nothing here.

use ::gltf::json::camera::Camera as Lens;
use glam::DAffine3;
use serde_json::Value;

use crate::camera::Camera;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::light::list::{LightEntry, MakeLamp, ParallelLight, PointLight, SpotLight};

/// A light in its place.
///
/// # Errors
/// If it is of no known kind, or a number is out of range.
pub(super) fn light(light: &Value, world: &DAffine3) -> Result<LightEntry> {
    let number = |value: Option<&Value>, absent: f64| value.map_or(Some(absent), Value::as_f64);
    let of = |value: &Value, field: &str, absent: f64| {
        number(value.get(field), absent)
            .ok_or_else(|| Error::invalid(format!("its {field} is no number")))
    };
    let intensity = of(light, "intensity", 1.0)?;
    let color = match light.get("color") {
        None => Color::WHITE,
        Some(color) => serde_json::from_value::<[f32; 3]>(color.clone())
            .map(|[r, g, b]| Color::new(r, g, b))
            .map_err(|_| Error::invalid("its color is not three numbers"))?,
    };
    let position = world.translation;
    let direction = -world.matrix3.z_axis;
    let entry = match light.get("type").and_then(Value::as_str) {
        Some("directional") => LightEntry::ParallelLight(ParallelLight {
            direction,
            illuminance: intensity,
            color,
            ..ParallelLight::default()
        }),
        Some("point") => LightEntry::PointLight(PointLight {
            position,
            intensity: Some(intensity),
            color,
            ..PointLight::default()
        }),
        Some("spot") => {
            let none = Value::Null;
            let cone = light.get("spot").unwrap_or(&none);
            let inner = of(cone, "innerConeAngle", 0.0)?.to_degrees();
            let angle = of(cone, "outerConeAngle", std::f64::consts::FRAC_PI_4)?.to_degrees();
            LightEntry::SpotLight(SpotLight {
                position,
                direction,
                angle,
                inner_angle: Some(inner),
                intensity,
                color,
                ..SpotLight::default()
            })
        }
        other => {
            return Err(Error::invalid(format!("it is of type {other:?}, which is not known")));
        }
    };
    entry.check()?;
    Ok(entry)
}

/// A camera in its place.
pub(super) fn camera(lens: &Lens, world: &DAffine3) -> Camera {
    let position = world.translation;
    let mut view = Camera {
        position,
        look_at: position - world.matrix3.z_axis,
        up: world.matrix3.y_axis,
        ..Camera::default()
    };
    if let Some(lens) = &lens.perspective {
        view.field_of_view = f64::from(lens.yfov).to_degrees();
        view.front = f64::from(lens.znear);
        view.back = lens.zfar.map(f64::from);
    } else if let Some(lens) = &lens.orthographic {
        view.parallel_height = Some(2.0 * f64::from(lens.ymag));
        view.front = f64::from(lens.znear);
        view.back = Some(f64::from(lens.zfar));
    }
    view
}
