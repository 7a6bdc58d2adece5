//! `spandrel info` of a measured lamp: its numbers, and its intensities as drawn in catalogues.

use glam::DVec3;
use spandrel_engine::light::photometry::{Goniometer, Photometry};
use spandrel_engine::{Result, math, output};
use std::fmt::Write;
use std::path::Path;

use crate::print::{self, escape};

/// Whether a file is one of photometry.
pub(crate) fn is_lamp(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["ies", "ldt"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// What is known of a lamp; its drawing goes to a file, if one is named.
pub(crate) fn info(path: &Path, drawing: Option<&Path>) -> Result<String> {
    let lamp = Photometry::read(path)?;
    if let Some(drawing) = drawing {
        let text = svg(&lamp, &path.display().to_string());
        output::write(drawing, |out| {
            std::io::Write::write_all(out, text.as_bytes())
                .map_err(|e| spandrel_engine::Error::output(drawing, e))
        })?;
    }
    Ok(text(&lamp, path))
}

/// The direction at an angle from the aim in the plane of an angle round it.
fn direction(angle: f64, round: f64) -> DVec3 {
    let (angle, round) = (angle.to_radians(), round.to_radians());
    let sine = math::sin(angle);
    DVec3::new(sine * math::cos(round), sine * math::sin(round), math::cos(angle))
}

fn text(lamp: &Photometry, path: &Path) -> String {
    let about = &lamp.about;
    let mut out = format!("{}: a lamp, {}\n", path.display(), about.format);
    for line in about.text.iter().take(8) {
        let _ = writeln!(out, "  {line}");
    }
    let (kind, planes, angles) = (lamp.kind, lamp.horizontal.len(), lamp.vertical.len());
    let _ = writeln!(out, "  type {kind:?}, {planes} planes of {angles} angles");
    let flux = lamp.flux();
    let _ = writeln!(out, "  {flux:.0} lm by integration, at most {:.0} cd", lamp.peak());
    if let Some(stated) = about.stated_flux {
        let off = 100.0 * (flux / stated - 1.0);
        let _ = writeln!(out, "  {stated:.0} lm leave it by the file: {off:+.2} %");
    }
    if let Some(bare) = about.lamp_flux {
        let share = 100.0 * flux / bare;
        let _ = writeln!(out, "  {bare:.0} lm of its bare lamps: {share:.1} % leave it");
    }
    if let Some(angle) = beam(lamp) {
        let _ =
            writeln!(out, "  half of its intensity along the aim at {angle:.1} degrees from it");
    }
    let [width, length, height] = about.size;
    let _ = writeln!(out, "  {width} x {length} x {height} m shine, {} W", about.watts);
    let _ = writeln!(out, "candela by degrees from the aim, in the planes 0 and 90");
    let peak = f64::from(lamp.peak()).max(1e-30);
    let last = match lamp.kind {
        Goniometer::C => lamp.vertical.last().copied().unwrap_or(0.0),
        Goniometer::A | Goniometer::B => 90.0,
    };
    for angle in (0..=180).step_by(5).map(f64::from).filter(|angle| *angle <= last) {
        let [a, b] = [0.0, 90.0].map(|round| lamp.intensity(direction(angle, round)));
        let bar = |v: f64| "#".repeat((v / peak * 24.0).round() as usize);
        let _ = writeln!(out, "  {angle:4} {a:10.0} {:24} {b:10.0} {}", bar(a), bar(b));
    }
    out
}

/// Where intensity falls to half of what it is along the aim, the mean over all planes.
fn beam(lamp: &Photometry) -> Option<f64> {
    let half = lamp.intensity(DVec3::Z) / 2.0;
    if half <= 0.0 {
        return None;
    }
    let of_plane = |round: f64| {
        let angles = (0..1800).map(|i| f64::from(i) / 10.0);
        { angles }.find(|angle| lamp.intensity(direction(*angle, round)) < half)
    };
    let angles: Option<Vec<f64>> = (0..24).map(|i| of_plane(f64::from(i) * 15.0)).collect();
    angles.map(|angles| angles.iter().sum::<f64>() / 24.0)
}

/// A polar diagram: the planes 0 to 180 and 90 to 270, the aim downwards.
fn svg(lamp: &Photometry, name: &str) -> String {
    let (size, radius) = (520.0, 210.0);
    let middle = (size / 2.0, size / 2.0 + 10.0);
    let peak = f64::from(lamp.peak()).max(1e-30);
    // Rings at 1, 2 or 5 times a power of ten.
    let power = 10f64.powi((peak / 4.0).log10().floor() as i32);
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| peak / s <= 5.0);
    let step = step.unwrap_or(10.0 * power);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{size}\" height=\"{size}\" \
         viewBox=\"0 0 {size} {size}\" font-family=\"system-ui, sans-serif\" font-size=\"11\">\n\
         <rect width=\"{size}\" height=\"{size}\" fill=\"#fff\"/>\n\
         <text x=\"16\" y=\"22\" font-size=\"14\" fill=\"#222\">{}: candela</text>\n",
        escape(name)
    );
    let mut ring = step;
    while ring <= peak * 1.0001 {
        let r = ring / peak * radius;
        let (x, y) = middle;
        let _ = writeln!(
            out,
            "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r:.1}\" fill=\"none\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#888\">{}</text>",
            x + 3.0,
            y - r - 2.0,
            print::grouped(ring.round() as u64)
        );
        ring += step;
    }
    for angle in (0..360).step_by(30) {
        let turn = f64::from(angle).to_radians();
        let (x, y) = (middle.0 + radius * math::sin(turn), middle.1 + radius * math::cos(turn));
        let _ = writeln!(
            out,
            "<line x1=\"{}\" y1=\"{}\" x2=\"{x:.1}\" y2=\"{y:.1}\" stroke=\"#eee\"/>",
            middle.0, middle.1
        );
    }
    for (round, color) in [(0.0, "#3367a3"), (90.0, "#c06a2c")] {
        let mut points = String::new();
        for angle in -180..=180 {
            let angle = f64::from(angle);
            let side = if angle < 0.0 { round + 180.0 } else { round };
            let r = lamp.intensity(direction(angle.abs(), side)) / peak * radius;
            let turn = angle.to_radians();
            let (x, y) = (middle.0 + r * math::sin(turn), middle.1 + r * math::cos(turn));
            let _ = write!(points, "{x:.1},{y:.1} ");
        }
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.6\"/>\
             <text x=\"16\" y=\"{}\" fill=\"{color}\">plane {round} to {}</text>",
            points.trim_end(),
            40.0 + round / 6.0,
            round + 180.0
        );
    }
    out + "</svg>\n"
}
