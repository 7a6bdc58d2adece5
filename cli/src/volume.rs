//! `spandrel info` of a volume.

use spandrel_engine::Result;
use spandrel_engine::volume::surface::{Level, Surface};
use spandrel_engine::volume::{Inside, Measure, Volume, measure};
use std::fmt::Write;

use crate::args::Info;
use crate::print;

pub(crate) fn info(args: &Info) -> Result<String> {
    let volume = Volume::read(&args.file, args.component)?;
    let mut out = format!("{}: a volume\n", args.file.display());
    let [columns, rows, layers] = volume.counts();
    let count = print::grouped(volume.samples().len() as u64);
    let _ = writeln!(out, "  {columns} x {rows} x {layers} samples ({count})");
    let unit = &volume.unit_name;
    let (low, high) = volume.bounds();
    let place = |p: glam::DVec3| format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z);
    let _ = writeln!(
        out,
        "  from {} to {} {unit}, shown as {} m each",
        place(low),
        place(high),
        volume.unit
    );
    let steps = volume.steps();
    let steps =
        [steps.x_axis, steps.y_axis, steps.z_axis].map(|step| format!("{:.6}", step.length()));
    let _ = writeln!(out, "  steps of {} {unit}", steps.join(", "));
    match volume.range() {
        Some((least, greatest)) => {
            let _ = writeln!(out, "  values from {least} to {greatest}");
        }
        None => {
            let _ = writeln!(out, "  no sample is a number");
        }
    }
    let missing = volume.samples().iter().filter(|sample| sample.is_nan()).count();
    if missing > 0 {
        let _ = writeln!(
            out,
            "  {} of them no numbers: surfaces are open there",
            print::grouped(missing as u64)
        );
    }
    for line in volume.about.iter().filter(|line| !line.is_empty()) {
        let _ = writeln!(out, "  {line}");
    }
    let level =
        |value: &f64| Level { value: *value, inside: Inside::Above, material: Default::default() };
    let surface = Surface {
        levels: args.level.iter().map(level).collect(),
        step: args.step,
        ..Surface::default()
    };
    for (value, mesh) in args.level.iter().zip(surface.meshes(&volume)?) {
        let Measure { triangles, area, volume: held, euler, open_edges, parts, .. } =
            measure(&mesh);
        let _ = writeln!(
            out,
            "at {value}: {}, area {area:.6} {unit}^2, volume {held:.6} {unit}^3, {}, Euler number {euler}, {}",
            print::count(triangles, "triangle"),
            print::count(parts, "part"),
            match open_edges {
                0 => "closed".to_owned(),
                open => format!("{} open", print::count(open, "edge")),
            }
        );
    }
    for note in &volume.notes {
        let _ = writeln!(out, "note: {note}");
    }
    Ok(out)
}
