//! `spandrel pick`: what is seen in a pixel (\[D], "Applications": the user picks a visible polygon).

use serde_json::json;
use spandrel_engine::fragment::FacePart;
use spandrel_engine::graph::{Graph, Registry};
use spandrel_engine::resolve::pick::{Picked, pick};
use spandrel_engine::span::SpanImage;
use spandrel_engine::{Error, Result};
use std::fmt::Write as _;

use crate::args::Pick;
use crate::print;
use crate::spans::{self, Chosen};

pub(crate) fn run(registry: &Registry, args: &Pick) -> u8 {
    spans::look(registry, &args.look, |graph| tell(graph, args))
}

/// What is known of a face.
struct Known {
    object: String,
    material: String,
    /// The scene's file and plan.
    file: Option<String>,
    plan: Option<String>,
    part: Option<FacePart>,
    sees_front: bool,
    /// Whether it stands behind everything, so that its distance says nothing.
    is_beyond: bool,
}

impl Known {
    fn new(image: &SpanImage, picked: &Picked) -> Known {
        let (source, face) = image.face(picked.face);
        let surfaces = &source.surfaces;
        let provenance = surfaces.provenance();
        let origin = provenance.and_then(|provenance| provenance.origin());
        let plan =
            origin.as_ref().and_then(|origin| origin.how.get("plan")?.as_str().map(str::to_owned));
        Known {
            object: source.object(face.ordinal),
            material: surfaces.material(face.ordinal, face.sees_front, None),
            file: origin.map(|origin| origin.file.display().to_string()),
            plan,
            part: provenance.and_then(|provenance| provenance.part(face.ordinal)),
            sees_front: face.sees_front,
            is_beyond: surfaces.beyond().is_some_and(|(beyond, _)| beyond == face.ordinal),
        }
    }

    /// The part of its object in words.
    fn part(&self) -> String {
        let Some(FacePart { face, seal, is_edge }) = self.part else { return String::new() };
        let of = seal.map_or(String::new(), |seal| format!(", seal {seal}"));
        let edge = if is_edge { ", edge" } else { "" };
        let side = if self.sees_front { "" } else { ", from behind" };
        format!(", face {face}{of}{edge}{side}")
    }
}

fn tell(graph: &Graph, args: &Pick) -> Result<()> {
    let Chosen { node, raster, plan } = spans::choose(graph, &args.look)?;
    let [column, row] = args.pixel;
    if column >= raster.width || row >= raster.height {
        let (width, height) = (raster.width, raster.height);
        return Err(Error::invalid(format!(
            "pixel {column},{row}: {node} has {width} columns and {height} rows, from 0"
        )));
    }
    let evaluated = spans::of_row(graph, &[node], (raster, plan), row)?;
    let image = evaluated.value::<SpanImage>(0);
    let found = pick(&image, args.pixel)?;
    let all: Vec<(Picked, Known)> =
        found.into_iter().map(|picked| (picked, Known::new(&image, &picked))).collect();
    if args.json {
        let faces: Vec<serde_json::Value> = all
            .iter()
            .map(|(picked, known)| {
                json!({
                    "share": picked.share,
                    "behind": picked.behind,
                    "object": known.object,
                    "material": known.material,
                    "face": known.part.map(|part| part.face),
                    "seal": known.part.and_then(|part| part.seal),
                    "edge": known.part.is_some_and(|part| part.is_edge),
                    "front": known.sees_front,
                    "file": known.file,
                    "plan": known.plan,
                    "distance": (!known.is_beyond).then_some(picked.distance),
                    "point": (!known.is_beyond).then(|| picked.point.to_array()),
                })
            })
            .collect();
        let told = json!({"image": node, "pixel": args.pixel, "size": [raster.width, raster.height], "faces": faces});
        print::out(&format!("{told}\n"));
        return Ok(());
    }
    let mut text = format!("{node}, pixel {column},{row} of {}x{}:\n", raster.width, raster.height);
    if all.is_empty() {
        text.push_str("  nothing is seen there\n");
    }
    for (picked, known) in &all {
        let behind = match picked.behind {
            0 => String::new(),
            count => format!(", behind {}", print::count(count, "translucent face")),
        };
        let material = match known.material.as_str() {
            "" => String::new(),
            name => format!(", material \"{name}\""),
        };
        let place = match (known.is_beyond, picked.point.to_array()) {
            (true, _) => ", behind everything".to_owned(),
            (false, [x, y, z]) => {
                format!(", {:.3} m away at ({x:.3}, {y:.3}, {z:.3})", picked.distance)
            }
        };
        let (share, object, part) = (picked.share * 100.0, &known.object, known.part());
        let _ = writeln!(text, "  {share:5.1} %  {object}{part}{material}{place}{behind}");
    }
    print::out(&text);
    Ok(())
}
