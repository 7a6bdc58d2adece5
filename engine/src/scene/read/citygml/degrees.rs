//! Positions in degrees, laid on a plane in metres.

use glam::{DMat3, DVec3};

use super::super::reader::Reader;
use crate::error::Result;
use crate::math;
use crate::scene::library::ReadOptions;

/// Reference systems in degrees of latitude and longitude, by EPSG number: the world's, Europe's, Japan's, America's,
/// Australia's and China's.
const DEGREES: [u32; 13] =
    [4326, 4979, 4258, 4937, 6697, 6668, 6667, 4612, 4269, 6318, 4283, 7844, 4490];

/// Whether a reference system, by a name with its number, has degrees.
pub(in crate::scene::read) fn is_degrees(system: &str) -> bool {
    let mut numbers = system.split(|c: char| !c.is_ascii_digit()).map(str::parse);
    numbers.any(|number| number.is_ok_and(|number: u32| DEGREES.contains(&number)))
}

/// Takes latitudes, longitudes and heights to metres east, north and up.
pub(super) fn flat(
    reader: &mut Reader,
    positions: &[[f64; 3]],
    options: &mut ReadOptions,
) -> Result<Vec<[f64; 3]>> {
    // Across the meridian of 180 degrees they go on.
    let is_across = positions.iter().any(|p| p[1] > 90.0) && positions.iter().any(|p| p[1] < -90.0);
    let shift =
        |p: &[f64; 3]| if is_across && p[1] < 0.0 { [p[0], p[1] + 360.0, p[2]] } else { *p };
    let positions: Vec<[f64; 3]> = positions.iter().map(shift).collect();
    let bound = |axis: usize| {
        let values = positions.iter().map(|position| position[axis]);
        let low = values.clone().fold(f64::INFINITY, f64::min);
        (low, values.fold(f64::NEG_INFINITY, f64::max))
    };
    let bounds = [bound(0), bound(1)];
    if positions.is_empty() {
        return Ok(Vec::new());
    }
    for ((low, high), most) in bounds.into_iter().zip([90.0, if is_across { 360.0 } else { 180.0 }])
    {
        if low < -most || high > most {
            return Err(reader.fault(format!(
                "its reference system is in degrees, and positions go from {low} to {high}"
            )));
        }
    }
    let origin = options.origin.take().unwrap_or_else(|| {
        let [latitude, longitude] =
            // Rounded to some ten metres, so that it can be typed for other files.
            bounds.map(|(low, high)| ((low + high) / 2.0 * 1e4).round() / 1e4);
        reader.note(format!(
            "its positions are in degrees; its origin is at latitude {latitude}, longitude {longitude}: \
             `origin: ({latitude}, {longitude}, 0)` puts other files beside it"
        ));
        [latitude, longitude, 0.0]
    });
    reader.degrees = Some(origin);
    // East, north and up at the origin, in axes from the earth's middle.
    let axes = {
        let (north, east) = (turn(origin[0]), turn(origin[1]));
        DMat3::from_cols(
            DVec3::new(-east.0, east.1, 0.0),
            DVec3::new(-north.0 * east.1, -north.0 * east.0, north.1),
            DVec3::new(north.1 * east.1, north.1 * east.0, north.0),
        )
    };
    let middle = on_ellipsoid(origin[0], origin[1]);
    let place = |[latitude, longitude, height]: &[f64; 3]| {
        let off = axes.transpose() * (on_ellipsoid(*latitude, *longitude) - middle);
        // Heights are taken as they are. On the plane itself the earth's curve would sink what is
        // far: 8 cm at 1 km.
        [off.x, off.y, height - origin[2]]
    };
    Ok(positions.iter().map(place).collect())
}

/// Sine and cosine of an angle in degrees.
fn turn(degrees: f64) -> (f64, f64) {
    let angle = degrees.to_radians();
    (math::sin(angle), math::cos(angle))
}

/// A place on the ellipsoid of GRS 80 and WGS 84, in metres from the earth's middle.
fn on_ellipsoid(latitude: f64, longitude: f64) -> DVec3 {
    const EQUATOR: f64 = 6_378_137.0;
    const FLATTENING: f64 = 1.0 / 298.257_222_101;
    let square = FLATTENING * (2.0 - FLATTENING);
    let ((sin_n, cos_n), (sin_e, cos_e)) = (turn(latitude), turn(longitude));
    let radius = EQUATOR / (1.0 - square * sin_n * sin_n).sqrt();
    DVec3::new(radius * cos_n * cos_e, radius * cos_n * sin_e, radius * (1.0 - square) * sin_n)
}
