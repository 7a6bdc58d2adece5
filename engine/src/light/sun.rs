//! Where the sun stands.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::math;

/// A moment, in days from noon of the first of January 2000, universal time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment(pub f64);

impl Moment {
    /// From a text such as `2026-06-21T12:00+09:00`: date, time of day, and by how much the clock is ahead
    /// of universal time (`Z` for not).
    ///
    /// # Errors
    /// If the text is not of this form or names no moment.
    pub fn parse(text: &str) -> Result<Moment> {
        let fault = |what: &str| {
            Error::invalid(format!(
                "the time \"{text}\" {what}: write it as 2026-06-21T12:00+09:00, with the clock's lead over \
                 universal time, or Z"
            ))
        };
        let (date, rest) = text.split_once('T').ok_or_else(|| fault("has no T"))?;
        let at = rest.find(['Z', '+', '-']).ok_or_else(|| fault("has no time zone"))?;
        let (clock, zone) = rest.split_at(at);
        // Rust's own numbers may also be `1e1`, `inf` and signed; no clock writes these.
        let numbers = |text: &str, by: char| -> Option<Vec<f64>> {
            let is_plain = |part: &str| {
                !part.is_empty() && part.chars().all(|c| c.is_ascii_digit() || c == '.')
            };
            text.split(by).map(|p| is_plain(p).then(|| p.parse().ok())?).collect()
        };
        let date = numbers(date, '-').ok_or_else(|| fault("has no date"))?;
        let clock = numbers(clock, ':').ok_or_else(|| fault("has no time of day"))?;
        let [year, month, day] = date[..] else { return Err(fault("has no date")) };
        let (hour, minute, second) = match clock[..] {
            [hour, minute] => (hour, minute, 0.0),
            [hour, minute, second] => (hour, minute, second),
            _ => return Err(fault("has no time of day")),
        };
        let lead = match zone {
            "Z" => 0.0,
            zone => {
                let is_zone = |parts: &Vec<f64>| {
                    !zone.starts_with('Z')
                        && parts.len() <= 2
                        && parts[1..].iter().all(|m| *m < 60.0)
                };
                let parts = numbers(&zone[1..], ':').filter(is_zone);
                let parts = parts.ok_or_else(|| fault("has no time zone"))?;
                let hours = parts[0] + parts.get(1).unwrap_or(&0.0) / 60.0;
                if zone.starts_with('-') { -hours } else { hours }
            }
        };
        let is_leap = (year % 4.0 == 0.0 && year % 100.0 != 0.0) || year % 400.0 == 0.0;
        let days = match month as u32 {
            2 => 28.0 + f64::from(u8::from(is_leap)),
            4 | 6 | 9 | 11 => 30.0,
            _ => 31.0,
        };
        let is_moment = [year, month, day].iter().all(|v| v.fract() == 0.0)
            && (1600.0..=2400.0).contains(&year)
            && (1.0..=12.0).contains(&month)
            && (1.0..=days).contains(&day)
            && (0.0..24.0).contains(&hour)
            && (0.0..60.0).contains(&minute)
            && (0.0..60.0).contains(&second)
            && lead.abs() <= 14.0;
        if !is_moment {
            return Err(fault("is no moment of the years 1600 to 2400"));
        }
        // The day number, counted from the first of March.
        let (y, m) = if month > 2.0 { (year, month) } else { (year - 1.0, month + 12.0) };
        let century = (y / 100.0).floor();
        // Meeus' formula for the Gregorian calendar. 30.6001 and not 30.6, which rounding could
        // take below a whole number.
        let julian = (365.25 * (y + 4716.0)).floor() + (30.6001 * (m + 1.0)).floor() + day + 2.0
            - century
            + (century / 4.0).floor()
            - 1524.5;
        let hours = hour + minute / 60.0 + second / 3600.0 - lead;
        Ok(Moment(julian - 2_451_545.0 + hours / 24.0))
    }
}

/// The unit vector to the sun from a place: degrees of latitude (north positive) and longitude (east
/// positive). North is `north` degrees clockwise, seen from above, from -z; at 0 east is +x. Good to a
/// hundredth of a degree from 1950 to 2050 (Astronomical Almanac), without refraction.
///
/// # Errors
/// If there is no such place.
pub fn direction(moment: Moment, latitude: f64, longitude: f64, north: f64) -> Result<DVec3> {
    if !((-90.0..=90.0).contains(&latitude) && (-180.0..=180.0).contains(&longitude)) {
        return Err(Error::invalid(format!(
            "there is no place at latitude {latitude} and longitude {longitude}: -90 to 90, -180 to 180"
        )));
    }
    let n = moment.0;
    let turn = |degrees: f64| degrees.rem_euclid(360.0).to_radians();
    // The Almanac's low precision formulas: mean longitude and anomaly, the correction for the
    // ellipse, the tilt of the axis.
    let mean = 280.460 + 0.985_647_4 * n;
    let anomaly = turn(357.528 + 0.985_600_3 * n);
    let longitude_of_sun =
        turn(mean + 1.915 * math::sin(anomaly) + 0.020 * math::sin(2.0 * anomaly));
    let tilt = (23.439 - 4e-7 * n).to_radians();
    let (sin, cos) = (math::sin(longitude_of_sun), math::cos(longitude_of_sun));
    let ascension = math::atan2(math::cos(tilt) * sin, cos);
    // The sine of the declination.
    let s = math::sin(tilt) * sin;
    let sidereal = turn(280.460_618_37 + 360.985_647_366_29 * n + longitude);
    let hour = sidereal - ascension;
    // The cosine of the declination.
    let c = (1.0 - s * s).sqrt();
    let (sin_place, cos_place) =
        (math::sin(latitude.to_radians()), math::cos(latitude.to_radians()));
    let to_east = -c * math::sin(hour);
    let to_north = s * cos_place - c * math::cos(hour) * sin_place;
    let up = s * sin_place + c * math::cos(hour) * cos_place;
    let (sin_north, cos_north) = (math::sin(north.to_radians()), math::cos(north.to_radians()));
    // North lies at (sin, -cos) of x and z, east a quarter turn on.
    Ok(DVec3::new(
        to_north * sin_north + to_east * cos_north,
        up,
        to_east * sin_north - to_north * cos_north,
    ))
}

/// The illuminance of a surface that faces a clear sun, in lux (IES Lighting Handbook, daylight): 127.5 klx
/// beyond the air, which takes 21 % per mass of it. 0 below the horizon.
pub fn illuminance(toward: DVec3) -> f64 {
    if toward.y <= 0.0 { 0.0 } else { 127_500.0 * math::exp(-0.21 / toward.y) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles(time: &str, latitude: f64, longitude: f64) -> (f64, f64) {
        let d = direction(Moment::parse(time).unwrap(), latitude, longitude, 0.0).unwrap();
        let azimuth = math::atan2(d.x, -d.z).to_degrees().rem_euclid(360.0);
        (90.0 - math::acos(d.y).to_degrees(), azimuth)
    }

    #[test]
    fn the_sun_stands_where_the_almanac_says() {
        // NREL's SPA example (Reda and Andreas 2004): zenith 50.11 with refraction, azimuth 194.34.
        let (up, azimuth) = angles("2003-10-17T12:30:30-07:00", 39.742_476, -105.178_6);
        assert!((up - 39.872).abs() < 0.03 && (azimuth - 194.340).abs() < 0.03, "{up} {azimuth}");
        // At the June solstice the sun is over the tropic at noon.
        let (up, _) = angles("2026-06-21T12:02:00Z", 23.44, 0.0);
        assert!(up > 89.8, "{up}");
        // In the morning it is in the east, which is +x.
        let d = direction(Moment::parse("2026-03-20T06:30Z").unwrap(), 0.0, 0.0, 0.0).unwrap();
        assert!(d.x > 0.9 && d.y > 0.0, "{d}");
        // With north to +x, east is +z.
        let d = direction(Moment::parse("2026-03-20T06:30Z").unwrap(), 0.0, 0.0, 90.0).unwrap();
        assert!(d.z > 0.9, "{d}");
    }

    #[test]
    fn what_is_no_moment_is_refused() {
        for text in [
            "2026-06-21T12:00Z05:00",
            "2026-06-21T12:00+09:75",
            "",
            "2026",
            "2026-06-21",
            "2026-06-21T12:00",
            "2026-13-01T12:00Z",
            "2025-02-29T12:00Z",
            "2026-06-21T24:00Z",
            "2026-06-21T12Z",
            "2026-06-21T1e1:00Z",
            "2026-06-21T12:00+15:00",
            "26-06-21T12:00Z",
            "x-y-zT1:1Z",
        ] {
            assert!(Moment::parse(text).is_err(), "{text}");
        }
        assert!(direction(Moment(0.0), 91.0, 0.0, 0.0).is_err());
        assert!(direction(Moment(0.0), 0.0, f64::NAN, 0.0).is_err());
    }
}
