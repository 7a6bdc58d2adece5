//! EULUMDAT (Stockmar 1990): one value per line, in a fixed order.

use super::{About, Goniometer, MAX_ANGLES, Photometry, check_angles};
use crate::error::{Error, Result};

struct Lines<'t> {
    lines: Vec<&'t str>,
    next: usize,
}

impl<'t> Lines<'t> {
    fn text(&mut self, what: &str) -> Result<&'t str> {
        let line = self.lines.get(self.next).ok_or_else(|| {
            Error::invalid(format!("line {}: the file ends before {what}", self.lines.len()))
        })?;
        self.next += 1;
        // DOS ended texts with this letter.
        Ok(line.trim().trim_end_matches('\u{1a}'))
    }

    fn fault(&self, what: &str) -> Error {
        Error::invalid(format!("line {}: {what}", self.next))
    }

    fn number(&mut self, what: &str) -> Result<f64> {
        let text = self.text(what)?;
        // Some makers write decimals with a comma.
        let value = text.replace(',', ".").parse::<f64>().ok().filter(|v| v.is_finite());
        value.ok_or_else(|| self.fault(&format!("{what} is \"{text}\", not a number")))
    }

    fn whole(&mut self, what: &str, least: usize, most: usize) -> Result<usize> {
        let value = self.number(what)?;
        if value.fract() != 0.0 || !(least as f64..=most as f64).contains(&value) {
            return Err(self.fault(&format!("{what} is {value}: must be {least} to {most}")));
        }
        Ok(value as usize)
    }

    fn angles(&mut self, what: &str, count: usize, most: f64) -> Result<Vec<f64>> {
        let mut angles = Vec::new();
        for _ in 0..count {
            let angle = self.number(&format!("a {what} angle"))?;
            if !(0.0..=most).contains(&angle) {
                return Err(self.fault(&format!("a {what} angle of {angle}: must be 0 to {most}")));
            }
            angles.push(angle);
        }
        check_angles(what, &angles).map_err(|e| self.fault(&e))?;
        Ok(angles)
    }
}

pub(super) fn parse(text: &str) -> Result<Photometry> {
    let mut lines = Lines { lines: text.lines().collect(), next: 0 };
    let maker = lines.text("the maker")?.to_owned();
    lines.number("the type")?;
    let symmetry = lines.whole("the symmetry", 0, 4)?;
    let planes = lines.whole("the number of C planes", 1, MAX_ANGLES)?;
    lines.number("the distance of C planes")?;
    let count = lines.whole("the number of angles in a plane", 1, MAX_ANGLES)?;
    lines.number("the distance of angles")?;
    let mut about = vec![maker];
    for what in ["the report", "the luminaire's name", "its number", "the file's name", "the date"]
    {
        about.push(lines.text(what)?.to_owned());
    }
    for what in ["length", "width", "height"] {
        lines.number(&format!("the luminaire's {what}"))?;
    }
    let length = lines.number("the luminous length")?.abs() / 1000.0;
    let width = lines.number("the luminous width")?.abs() / 1000.0;
    let mut height = 0.0f64;
    for plane in [0, 90, 180, 270] {
        height = height.max(lines.number(&format!("the luminous height at C{plane}"))? / 1000.0);
    }
    lines.number("the downward flux fraction")?;
    let output = lines.number("the light output ratio")?;
    if output < 0.0 {
        return Err(lines.fault(&format!("a light output ratio of {output} %")));
    }
    let factor = lines.number("the conversion factor")?;
    if factor < 0.0 {
        return Err(lines.fault(&format!("a conversion factor of {factor}: must not be negative")));
    }
    lines.number("the tilt")?;
    let sets = lines.whole("the number of sets of lamps", 1, 100)?;
    let (mut flux, mut watts) = (0.0, 0.0);
    for set in 0..sets {
        lines.number("the number of lamps")?;
        about.push(lines.text("the type of lamps")?.to_owned());
        let of_set = lines.number("the flux of the lamps")?;
        if of_set < 0.0 {
            return Err(lines.fault(&format!("a flux of {of_set} lumen: must not be negative")));
        }
        about.push(lines.text("the colour of the lamps")?.to_owned());
        lines.text("the colour rendering of the lamps")?;
        let of_set_watts = lines.number("the watts of the lamps")?;
        // Sets are alternatives; the intensities are those of the first.
        if set == 0 {
            (flux, watts) = (of_set, of_set_watts);
        }
    }
    for _ in 0..10 {
        lines.number("a direct ratio")?;
    }
    // All planes are listed, also those that symmetry leaves out of the intensities.
    let all = lines.angles("C", planes, 360.0)?;
    let vertical = lines.angles("gamma", count, 180.0)?;
    // Which planes are there.
    let fault = |lines: &Lines<'_>| {
        let what = format!("{planes} planes do not fit the symmetry {symmetry}");
        lines.fault(&what)
    };
    let (first, stored) = match symmetry {
        0 => (0, planes),
        1 => (0, 1),
        2 if planes % 2 == 0 => (0, planes / 2 + 1),
        3 if planes % 4 == 0 => (3 * planes / 4, planes / 2 + 1),
        4 if planes % 4 == 0 => (0, planes / 4 + 1),
        _ => return Err(fault(&lines)),
    };
    // Intensities are in candela per 1000 lumen of the lamps. A factor of 0 means none.
    let per_kilolumen = flux / 1000.0 * if factor > 0.0 { factor } else { 1.0 };
    let mut read: Vec<(f64, Vec<f32>)> = Vec::new();
    for plane in 0..stored {
        let angle = all[(first + plane) % planes];
        let mut candela = Vec::new();
        for gamma in &vertical {
            let value = lines.number(&format!("the intensity at C{angle}, {gamma} degrees"))?;
            if value < 0.0 {
                return Err(lines.fault(&format!("{value} cd/klm: must not be negative")));
            }
            candela.push((value * per_kilolumen).min(f64::from(f32::MAX)) as f32);
        }
        read.push((angle, candela));
    }
    if symmetry == 3 {
        // From C270 by C0 to C90: the other half is its mirror image.
        let mirrored: Vec<(f64, Vec<f32>)> =
            read.iter().map(|(angle, c)| ((540.0 - angle).rem_euclid(360.0), c.clone())).collect();
        read.extend(mirrored);
        read.sort_by(|a, b| a.0.total_cmp(&b.0));
        read.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
    }
    if symmetry == 1 {
        read[0].0 = 0.0;
    }
    let horizontal = read.iter().map(|(angle, _)| *angle).collect();
    let candela = read.into_iter().flat_map(|(_, candela)| candela).collect();
    about.retain(|line| !line.is_empty());
    let about = About {
        format: "EULUMDAT".to_owned(),
        text: about,
        lamp_flux: Some(flux),
        stated_flux: Some(flux * output / 100.0),
        watts,
        size: [width, length, height],
    };
    Ok(Photometry::new(Goniometer::C, vertical, horizontal, candela, about))
}
