//! Programs over fragments: the stream editor.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Around, Columns, Fragments, Layers, Shader};
use crate::stream::{Parameter, Program, Variable};
use crate::text::names_object;

/// Runs a program over fragments. Where it changes a colour that lights made, each light's share of it
/// changes by the same factor.
#[derive(Debug, Deserialize)]
#[serde(try_from = "Saved")]
pub struct Stream {
    saved: Saved,
    program: Program,
}

/// How it is saved.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Saved {
    code: String,
    parameters: BTreeMap<String, Parameter>,
}

impl TryFrom<Saved> for Stream {
    type Error = Error;
    fn try_from(saved: Saved) -> Result<Stream> {
        let program = Program::new(&saved.code, &saved.parameters)?;
        Ok(Stream { saved, program })
    }
}

impl Serialize for Stream {
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        self.saved.serialize(serializer)
    }
}

impl Stream {
    /// A program with parameters.
    ///
    /// # Errors
    /// As [`Program::new`].
    pub fn new(code: &str, parameters: BTreeMap<String, Parameter>) -> Result<Stream> {
        Saved { code: code.to_owned(), parameters }.try_into()
    }
}

#[typetag::serde]
impl Shader for Stream {
    fn reads(&self) -> Columns {
        let one = |variable: Variable| match variable {
            Variable::World(_) | Variable::Eye(_) => Columns::POSITION,
            Variable::Object(_) => Columns::LOCAL,
            Variable::Normal(_) => Columns::NORMAL,
            Variable::Texture(_) => Columns::UV,
            // Places are told apart by depth.
            Variable::Screen(_) | Variable::Depth => Columns::DEPTH,
            Variable::Width | Variable::WidthOf(2) => Columns::FACING | Columns::POSITION,
            Variable::WidthOf(0) => Columns::FACING | Columns::LOCAL,
            Variable::WidthOf(_) => Columns::FACING | Columns::UV,
            Variable::Fits(_) => Columns::NAMES,
            Variable::Color(_) | Variable::Alpha | Variable::Face | Variable::Front => {
                Columns::COLOR
            }
        };
        let [.., makes_normal] = self.program.makes();
        let made = if makes_normal { Columns::NORMAL } else { Columns::NONE };
        self.program.reads().map(one).fold(Columns::COLOR | made, |all, one| all | one)
    }

    fn lessens_alpha(&self) -> bool {
        self.program.makes()[1]
    }

    fn changes(&self) -> Columns {
        let [.., makes_normal] = self.program.makes();
        if makes_normal { Columns::ALL } else { Columns::COLOR }
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        let raster = fragments.view.raster();
        let patterns = self.program.patterns();
        let steps: Vec<[f64; 2]> = match self.program.reads().any(is_width) {
            true => (0..fragments.len()).map(|i| sides(fragments, i)).collect(),
            false => Vec::new(),
        };
        let width = |i: usize| (steps[i][0] + steps[i][1]) / 2.0;
        let each = |out: &mut [f32], first: usize, of: &dyn Fn(usize) -> f32| {
            out.iter_mut().zip(first..).for_each(|(out, i)| *out = of(i));
        };
        let read = |variable: Variable, first: usize, out: &mut [f32]| match variable {
            Variable::World(k) => {
                each(out, first, &|i| fragments.position[i][k as usize] as f32);
            }
            Variable::Object(k) => each(out, first, &|i| {
                fragments.local.get(i).map_or(0.0, |local| local.point[k as usize] as f32)
            }),
            Variable::Normal(k) => each(out, first, &|i| fragments.normal[i][k as usize]),
            Variable::Eye(k) => each(out, first, &|i| fragments.to_eye(i)[k as usize] as f32),
            Variable::Texture(k) => each(out, first, &|i| {
                fragments.uv.get(i).map_or(0.0, |uv| uv.at[k as usize] as f32)
            }),
            Variable::Screen(0) => {
                each(out, first, &|i| (fragments.x[i] / f64::from(raster.width)) as f32);
            }
            Variable::Screen(_) => {
                each(out, first, &|i| (fragments.y[i] / f64::from(raster.height)) as f32);
            }
            Variable::Color(k) => {
                let colors = &fragments.color[first..];
                let pairs = out.iter_mut().zip(colors);
                match k {
                    0 => pairs.for_each(|(out, color)| *out = color.r),
                    1 => pairs.for_each(|(out, color)| *out = color.g),
                    _ => pairs.for_each(|(out, color)| *out = color.b),
                }
            }
            Variable::Alpha => each(out, first, &|i| fragments.alpha[i]),
            Variable::Depth => {
                each(out, first, &|i| fragments.view.distance(fragments.depth[i]) as f32);
            }
            Variable::Width => each(out, first, &|i| width(i) as f32),
            Variable::WidthOf(0) => each(out, first, &|i| {
                fragments.local.get(i).map_or(0.0, |local| (width(i) * local.scale) as f32)
            }),
            Variable::WidthOf(1) => each(out, first, &|i| {
                fragments.uv.get(i).map_or(0.0, |uv| (width(i) * uv.scale) as f32)
            }),
            Variable::WidthOf(_) => out.fill((fragments.pixel.x / f64::from(raster.width)) as f32),
            Variable::Face => each(out, first, &|i| fragments.ordinal[i] as f32),
            Variable::Front => {
                each(out, first, &|i| f32::from(u8::from(fragments.sees_front[i])));
            }
            Variable::Fits(pattern) => {
                let pattern = &patterns[pattern as usize];
                // Fragments of one object stand together.
                let mut last: Option<(&str, f32)> = None;
                for (out, i) in out.iter_mut().zip(first..) {
                    let name = fragments.names.get(i).map_or("", |name| name);
                    let known = last.filter(|(known, _)| *known == name);
                    let fits = || f32::from(u8::from(names_object(pattern, name)));
                    *out = known.map_or_else(fits, |(_, fits)| fits);
                    last = Some((name, *out));
                }
            }
        };
        let made = self.program.run(fragments.len(), read);
        if !made.alpha.is_empty() {
            fragments.alpha = made.alpha;
        }
        for (normal, made) in fragments.normal.iter_mut().zip(&made.normal) {
            *normal = glam::Vec3::from(*made).try_normalize().unwrap_or(*normal);
        }
        if made.color.is_empty() {
            return;
        }
        let old = std::mem::replace(&mut fragments.color, made.color);
        if let Some(layers) = &mut fragments.layers {
            let factor = |old: f32, new: f32| if old > 0.0 { new / old } else { 0.0 };
            let new = &fragments.color;
            layers.map(|i, layer| {
                let (o, n) = (old[i], new[i]);
                layer * Color::new(factor(o.r, n.r), factor(o.g, n.g), factor(o.b, n.b))
            });
            // What was black has no shares.
            let rest = layers.layer(Layers::REST, old.len());
            for (i, rest) in rest.iter_mut().enumerate() {
                let left = |old: f32, new: f32| if old > 0.0 { 0.0 } else { new };
                let (o, n) = (old[i], new[i]);
                *rest = *rest + Color::new(left(o.r, n.r), left(o.g, n.g), left(o.b, n.b));
            }
        }
    }
}

fn is_width(variable: Variable) -> bool {
    matches!(variable, Variable::Width | Variable::WidthOf(0 | 1))
}

/// The sides of what a pixel covers of a fragment's face, in metres.
fn sides(fragments: &Fragments<'_>, i: usize) -> [f64; 2] {
    let position = fragments.point(i);
    let facing = fragments.facing.get(i).copied();
    let facing = facing.or_else(|| fragments.normal.get(i).map(|normal| normal.as_dvec3()));
    let facing = facing.unwrap_or_else(|| fragments.to_eye_from(i, position));
    fragments.footprint(i, position, facing).map(glam::DVec3::length)
}
