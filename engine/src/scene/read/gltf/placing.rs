//! Where textures lie: `KHR_texture_transform`.

use glam::DVec2;
use serde::Deserialize;
use serde_json::Value;

use crate::math;
use crate::texture::{Mapping, Wrap};

/// How a texture lies, as the extension KHR_texture_transform says.
#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Placed {
    offset: [f64; 2],
    rotation: f64,
    scale: [f64; 2],
}

impl Default for Placed {
    fn default() -> Placed {
        Placed { offset: [0.0; 2], rotation: 0.0, scale: [1.0; 2] }
    }
}

/// How a texture lies: by which texture coordinates, what is done to these, and what of it is not as the file says.
pub(super) fn place(
    transform: Option<&Value>,
    uv_set: u32,
    wrap: [Wrap; 2],
) -> (Mapping, u32, Option<String>) {
    let plain = Mapping { wrap, ..Mapping::default() };
    let Some(value) = transform else {
        return (plain, uv_set, None);
    };
    // Which coordinates holds even where what is done to them cannot be.
    let own_set = value.get("texCoord").and_then(Value::as_u64).and_then(|set| set.try_into().ok());
    let uv_set = own_set.unwrap_or(uv_set);
    let placed = serde_json::from_value(value.clone()).map_err(|error| error.to_string());
    match placed.and_then(|placed: Placed| placed.mapping(wrap)) {
        Ok(mapping) => (mapping, uv_set, None),
        Err(what) => (plain, uv_set, Some(format!("KHR_texture_transform: {what}"))),
    }
}

impl Placed {
    /// What it does to coordinates.
    fn mapping(self, wrap: [Wrap; 2]) -> std::result::Result<Mapping, String> {
        let Placed { offset: [left, up], rotation, scale: [x, y] } = self;
        // There v goes down, and is stretched before it is turned; here v goes up, and is stretched afterwards. The two
        // can be exchanged where nothing is skewed.
        let (sin, cos) = (math::sin(rotation), math::cos(rotation));
        let is_even = (x.abs() - y.abs()).abs() <= 1e-6 * x.abs().max(y.abs());
        // A turn goes the other way in a mirror.
        let turn = if is_even && x * y < 0.0 { rotation } else { -rotation };
        let scale = match (cos.abs() > 1.0 - 1e-9, sin.abs() > 1.0 - 1e-9) {
            (is_straight, _) if is_straight || is_even => DVec2::new(x, y),
            (_, true) => DVec2::new(y, x),
            _ => {
                return Err(
                    "it is turned and stretched unevenly, which skews it: give its vertices \
                 the coordinates instead"
                        .to_owned(),
                );
            }
        };
        // Where (0, 0) of ours, which is (0, 1) of theirs, comes to lie, with v turned over again.
        let offset = DVec2::new(left + sin * y, 1.0 - cos * y - up);
        let turn = turn.to_degrees();
        let mapping = Mapping { wrap, turn, scale, offset, ..Mapping::default() };
        mapping.check().map_err(|error| error.to_string())?;
        Ok(mapping)
    }
}
