//! Programs over fragments: the stream editor.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::color::{Color, ValueKind};
use crate::fragment::{Around, Columns, Fragments, Hiding, LightLayers, Shader};
use crate::key::Key;
use crate::stream::{Parameter, Program, ProgramFault, Variable};
use crate::text::{list, names_object, nearest};

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
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    channels: BTreeMap<String, ValueKind>,
}

impl TryFrom<Saved> for Stream {
    type Error = ProgramFault;
    fn try_from(saved: Saved) -> Result<Stream, ProgramFault> {
        let program = Program::new(&saved.code, &saved.parameters, &saved.channels)?;
        Ok(Stream { saved, program })
    }
}

impl Serialize for Stream {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.saved.serialize(serializer)
    }
}

impl Stream {
    /// A program with parameters, and the channels that it may read and make.
    ///
    /// # Errors
    /// As [`Program::new`].
    pub fn new(
        code: &str,
        parameters: BTreeMap<String, Parameter>,
        channels: BTreeMap<String, ValueKind>,
    ) -> Result<Stream, ProgramFault> {
        Saved { code: code.to_owned(), parameters, channels }.try_into()
    }

    /// Whether it makes alphas: whether what lies behind may come to be seen.
    pub fn makes_alpha(&self) -> bool {
        self.program.makes()[1]
    }

    /// The names that the program asks for and nothing has, of the objects and materials that there are, if these are
    /// known: in words, with those that there are.
    pub fn names_of_nothing(
        &self,
        known: impl FnOnce() -> Option<[BTreeSet<String>; 2]>,
    ) -> Vec<String> {
        let asked = self.program.reads().filter_map(|variable| match variable {
            Variable::ObjectFits(number) => Some(("object", 0, number)),
            Variable::MaterialFits(number) => Some(("material", 1, number)),
            _ => None,
        });
        let asked: Vec<(&str, usize, u32)> = asked.collect();
        let known = if asked.is_empty() { None } else { known() };
        let Some(known) = known else { return Vec::new() };
        let missing = |(what, which, number): (&str, usize, u32)| {
            let pattern = &self.program.patterns()[number as usize];
            let names = &known[which];
            if names.iter().any(|name| names_object(pattern, name)) {
                return None;
            }
            // Guessed by the last part, which most write.
            let last = |name: &'_ String| name.rsplit('/').next().unwrap_or_default().to_owned();
            let parts: Vec<String> =
                names.iter().map(last).filter(|part| !part.is_empty()).collect();
            let cure = match nearest(pattern, parts.iter().map(String::as_str)) {
                Some(near) => format!("did you mean '{near}'?"),
                None => {
                    let named = names.iter().map(String::as_str).filter(|name| !name.is_empty());
                    format!("there are {}", list(named))
                }
            };
            Some(format!("{what}('{pattern}') fits nothing: {cure}"))
        };
        asked.into_iter().filter_map(missing).collect()
    }
}

/// A coordinate of a place; `eye` is how far out whoever sees it stands. What differs from 0 by no more than rounding is 0: a pattern on
/// a floor at 0 does not flicker between the two sides of it.
fn coordinate(point: DVec3, axis: u32, eye: f64) -> f32 {
    let v = point[axis as usize];
    let rounding = 1e-9 * (eye + point.abs().max_element());
    if v.abs() <= rounding { 0.0 } else { v as f32 }
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
            Variable::ObjectFits(_) | Variable::ObjectNumber => Columns::NAMES,
            Variable::MaterialFits(_) | Variable::MaterialNumber => Columns::MATERIALS,
            Variable::Coverage => Columns::COVERAGE,
            Variable::Color(_)
            | Variable::Alpha
            | Variable::Face
            | Variable::Front
            | Variable::Channel(..) => Columns::COLOR,
        };
        let [.., makes_normal] = self.program.makes();
        let made = if makes_normal { Columns::NORMAL } else { Columns::NONE };
        self.program.reads().map(one).fold(Columns::COLOR | made, |all, one| all | one)
    }

    fn hiding(&self) -> Hiding {
        if self.program.makes()[1] { Hiding::Changes } else { Hiding::Keeps }
    }

    fn makes_channels(&self) -> Vec<(String, ValueKind)> {
        let channels = self.program.makes_channels();
        channels.map(|(_, name)| (name.to_owned(), self.saved.channels[name])).collect()
    }

    fn reads_channels(&self) -> Vec<String> {
        let reads = |number: usize| {
            let is_it = |v| matches!(v, Variable::Channel(k, _) if k as usize == number);
            self.program.reads().any(is_it)
        };
        let made: Vec<usize> = self.program.makes_channels().map(|(number, _)| number).collect();
        let all = self.saved.channels.keys().enumerate();
        let wanted = all.filter(|(number, _)| !made.contains(number) && reads(*number));
        wanted.map(|(_, name)| name.clone()).collect()
    }

    fn changes(&self) -> Columns {
        let [.., makes_normal] = self.program.makes();
        if makes_normal { Columns::ALL } else { Columns::COLOR }
    }

    fn shade(&self, fragments: &mut Fragments<'_>, around: &Around<'_>) {
        let raster = fragments.view.raster();
        let patterns = self.program.patterns();
        let names: Vec<&String> = self.saved.channels.keys().collect();
        let steps: Vec<[f64; 2]> = match self.program.reads().any(is_width) {
            true => (0..fragments.len()).map(|i| sides(fragments, i)).collect(),
            false => Vec::new(),
        };
        let width = |i: usize| (steps[i][0] + steps[i][1]) / 2.0;
        let camera = fragments.view.camera().position.abs().max_element();
        let eye = |i: usize| {
            fragments.sight.as_ref().map_or(camera, |sight| sight.from[i].abs().max_element())
        };
        let read = |variable: Variable, first: usize, out: &mut [f32]| match variable {
            Variable::World(k) => {
                each(out, first, |i| coordinate(fragments.position[i], k, eye(i)));
            }
            Variable::Object(k) => each(out, first, |i| {
                fragments
                    .local
                    .get(i)
                    .map_or(0.0, |local| coordinate(local.point, k, eye(i) * local.scale))
            }),
            Variable::Normal(k) => each(out, first, |i| fragments.normal[i][k as usize]),
            Variable::Eye(k) => each(out, first, |i| fragments.to_eye(i)[k as usize] as f32),
            Variable::Texture(k) => {
                each(out, first, |i| fragments.uv.get(i).map_or(0.0, |uv| uv.at[k as usize] as f32))
            }
            Variable::Screen(0) => {
                each(out, first, |i| (fragments.x[i] / f64::from(raster.width)) as f32);
            }
            Variable::Screen(_) => {
                each(out, first, |i| (fragments.y[i] / f64::from(raster.height)) as f32);
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
            Variable::Alpha => each(out, first, |i| fragments.alpha[i]),
            Variable::Depth => {
                each(out, first, |i| fragments.view.distance(fragments.depth[i]) as f32);
            }
            Variable::Width => each(out, first, |i| width(i) as f32),
            Variable::WidthOf(0) => each(out, first, |i| {
                fragments.local.get(i).map_or(0.0, |local| (width(i) * local.scale) as f32)
            }),
            Variable::WidthOf(1) => each(out, first, |i| {
                fragments.uv.get(i).map_or(0.0, |uv| (width(i) * uv.scale) as f32)
            }),
            Variable::WidthOf(_) => out.fill((fragments.pixel.x / f64::from(raster.width)) as f32),
            Variable::Face => each(out, first, |i| fragments.ordinal[i] as f32),
            Variable::Front => {
                each(out, first, |i| f32::from(u8::from(fragments.sees_front[i])));
            }
            Variable::Coverage => each(out, first, |i| around.batch.coverage(i)),
            Variable::ObjectNumber => of_names(&fragments.names, out, first, number_of),
            Variable::MaterialNumber => of_names(&fragments.materials, out, first, number_of),
            Variable::ObjectFits(pattern) => {
                of_names(&fragments.names, out, first, fits(&patterns[pattern as usize]));
            }
            Variable::MaterialFits(pattern) => {
                of_names(&fragments.materials, out, first, fits(&patterns[pattern as usize]));
            }
            Variable::Channel(k, part) => {
                match names.get(k as usize).and_then(|name| fragments.channels.get(*name)) {
                    Some(values) => each(out, first, |i| values[i].to_array()[part as usize]),
                    None => out.fill(0.0),
                }
            }
        };
        let made = self.program.run(fragments.len(), read);
        if !made.alpha.is_empty() {
            fragments.alpha = made.alpha;
        }
        for (normal, made) in fragments.normal.iter_mut().zip(&made.normal) {
            *normal = glam::Vec3::from(made.to_array()).try_normalize().unwrap_or(*normal);
        }
        for (name, values) in names.iter().zip(made.channels) {
            if !values.is_empty() {
                fragments.channels.insert((*name).clone(), values);
            }
        }
        if made.color.is_empty() {
            return;
        }
        let old = std::mem::replace(&mut fragments.color, made.color);
        if let Some(layers) = &mut fragments.layers {
            // Layers are to go on summing to the colour.
            let factor = |old: f32, new: f32| if old > 0.0 { new / old } else { 0.0 };
            let new = &fragments.color;
            layers.map(|i, layer| {
                let (o, n) = (old[i], new[i]);
                layer * Color::new(factor(o.r, n.r), factor(o.g, n.g), factor(o.b, n.b))
            });
            // What was black has no shares.
            let rest = layers.layer(LightLayers::REST, old.len());
            for (i, rest) in rest.iter_mut().enumerate() {
                let left = |old: f32, new: f32| if old > 0.0 { 0.0 } else { new };
                let (o, n) = (old[i], new[i]);
                *rest = *rest + Color::new(left(o.r, n.r), left(o.g, n.g), left(o.b, n.b));
            }
        }
    }
}

fn each(out: &mut [f32], first: usize, of: impl Fn(usize) -> f32) {
    out.iter_mut().zip(first..).for_each(|(out, i)| *out = of(i));
}

/// A number of each name; fragments of one name stand together.
fn of_names(names: &[Arc<str>], out: &mut [f32], first: usize, of: impl Fn(&str) -> f32) {
    let mut last: Option<(&str, f32)> = None;
    for (out, i) in out.iter_mut().zip(first..) {
        let name = names.get(i).map_or("", |name| name);
        let known = last.filter(|(known, _)| *known == name);
        *out = known.map_or_else(|| of(name), |(_, number)| number);
        last = Some((name, *out));
    }
}

/// A number that 24 bits hold, so that a float does.
fn number_of(name: &str) -> f32 {
    (Key::id_of_name(name) >> 8) as f32
}

fn fits(pattern: &str) -> impl Fn(&str) -> f32 + '_ {
    |name| f32::from(u8::from(names_object(pattern, name)))
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
