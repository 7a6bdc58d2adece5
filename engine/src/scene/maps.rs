//! Pictures on surfaces: what they change of a place (\[N], "Texture mapping": colour, bump, reflection and
//! transparency maps; \[D], colour, bump and optical attributes by pictures and functions).

use glam::{DAffine3, DVec2, DVec3};
use std::collections::HashMap;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::absent::{is_there, without_pictures};
use super::library::Library;
use super::material::{AlphaMode, Map, Material, Picture};
use crate::color::Color;
use crate::error::{Error, FirstError, Result};
use crate::fragment::{Columns, Finish, Gloss};
use crate::image::file::Encoded;
use crate::image::texels::Texels;
use crate::key::{Key, KeyHasher};
use crate::math;
use crate::open;
use crate::texture::{
    Footprint, Meaning, Opened, PictureSource, SurfacePoint, TextureFilter, Wrap, store,
};

/// What a map changes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    Color,
    Alpha,
    Normal,
    Bump,
    MetallicRoughness,
    Occlusion,
    Emission,
    Reflection,
    Reflect,
    Refract,
}

const NAMES: [(&str, What); 10] = [
    ("color", What::Color),
    ("alpha", What::Alpha),
    ("normal", What::Normal),
    ("bump", What::Bump),
    ("metallic_roughness", What::MetallicRoughness),
    ("occlusion", What::Occlusion),
    ("emission", What::Emission),
    ("reflection", What::Reflection),
    ("reflect", What::Reflect),
    ("refract", What::Refract),
];

impl What {
    /// The texel that changes nothing.
    fn nothing(self) -> [f32; 4] {
        match self {
            What::Normal => [0.5, 0.5, 1.0, 1.0],
            What::Bump | What::Reflection => [0.0; 4],
            _ => [1.0; 4],
        }
    }
}

fn named(name: &str) -> Option<What> {
    NAMES.iter().find(|(known, _)| *known == name).map(|(_, what)| *what)
}

/// Whether a map of a material can be.
///
/// # Errors
/// If nothing is called so, or a number is out of range.
pub(super) fn check(name: &str, map: &Map) -> Result<()> {
    let Some(what) = named(name) else {
        let names = NAMES.map(|(name, _)| name).join(", ");
        return Err(Error::invalid(format!("there is no such map: a material has {names}")));
    };
    if !map.strength.is_finite() {
        return Err(Error::invalid("`strength` must be finite"));
    }
    // These may be exaggerated or turned round; a share outside of 0 to 1 would make light.
    let is_share = !matches!(what, What::Normal | What::Bump | What::Reflection);
    if is_share && !(0.0..=1.0).contains(&map.strength) {
        return Err(Error::invalid(format!("`strength` is {}: must be 0 to 1", map.strength)));
    }
    if let Picture::Wave(right, up) = map.picture
        && !(right.is_finite() && up.is_finite() && right.abs().max(up.abs()) < 1e6)
    {
        return Err(Error::invalid("a Wave has a number of waves from -1000000 to 1000000"));
    }
    if map.picture.file() == Some("") {
        return Err(Error::invalid("it names no file"));
    }
    map.mapping.check()
}

/// The bytes that pictures take as pyramids, at most, told by their heads: each file is asked once.
pub(super) struct Sizes<'l> {
    reader: &'l dyn Library,
    known: HashMap<Key, u64>,
    /// Of the pictures that a file holds.
    embedded: HashMap<PathBuf, Vec<u64>>,
}

impl<'l> Sizes<'l> {
    /// Of no picture yet.
    pub(super) fn new(library: &'l dyn Library) -> Sizes<'l> {
        Sizes { reader: library, known: HashMap::new(), embedded: HashMap::new() }
    }

    /// Of a picture that is a file, or has a number in one.
    pub(super) fn of(&mut self, key: Key, path: &Path, number: Option<u32>) -> u64 {
        let Some(number) = number else {
            return *self.known.entry(key).or_insert_with(|| mapped_bytes(path));
        };
        let held = self.embedded.entry(path.to_owned());
        let held = held.or_insert_with(|| self.reader.picture_sizes(path).unwrap_or_default());
        held.get(number as usize).copied().unwrap_or(0)
    }
}

/// The bytes that a picture takes as a map, at most; 0 if its head is not to be read.
fn mapped_bytes(path: &Path) -> u64 {
    Encoded::open(path).and_then(|picture| picture.head()).map_or(0, |head| head.mapped)
}

/// The maps of a material.
#[derive(Debug)]
pub(super) struct Maps {
    maps: Vec<ReadyMap>,
    /// Whether alpha is that of the pictures.
    is_cut: bool,
    /// The first picture that could not be read.
    fault: FirstError,
}

#[derive(Debug)]
struct ReadyMap {
    what: What,
    map: Map,
    /// The picture's file, and the picture, if it is none that is computed.
    source: Option<(PathBuf, PictureSource)>,
}

/// What is seen of a place.
pub(super) struct Appearance {
    pub(super) color: Color,
    pub(super) alpha: f32,
    /// The unit normal on the front.
    pub(super) normal: DVec3,
    pub(super) finish: Finish,
}

/// A place on a surface.
pub(super) struct At<'a> {
    pub(super) object_from_world: &'a DAffine3,
    /// The place in the world.
    pub(super) point: DVec3,
    /// From there by one pixel to the right and down.
    pub(super) steps: [DVec3; 2],
    /// The unit normal of the face's front.
    pub(super) facing: DVec3,
    /// The same in the object.
    pub(super) front: DVec3,
    /// The coordinates of the vertices, at points of the object.
    pub(super) uv: &'a dyn Fn(DVec3) -> DVec2,
    /// The unit normal of the front without maps, and the unit vector to where it is seen from, if it is moved on the
    /// face.
    pub(super) seen_from: &'a dyn Fn(DVec3) -> (DVec3, DVec3),
    pub(super) sees_front: bool,
    pub(super) filter: TextureFilter,
}

impl At<'_> {
    /// What a pixel covers of a picture if it is moved on the face.
    fn footprint(&self, map: &Map, moved: DVec3) -> Footprint {
        let matrix = &self.object_from_world.matrix3;
        map.mapping.footprint(&SurfacePoint {
            point: self.object_from_world.transform_point3(self.point + moved),
            steps: self.steps.map(|step| *matrix * step),
            normal: self.front,
            uv: self.uv,
        })
    }
}

impl Maps {
    /// The maps of a material; `None` if it has none.
    pub(super) fn of(material: &Material, library: &Arc<dyn Library>) -> Option<Maps> {
        let ready = |(name, map): (&String, &Map)| {
            let what = named(name)?;
            let meaning = match (what, material.alpha_mode) {
                (What::Color | What::Alpha, AlphaMode::Mask(from)) if from > 0.0 => {
                    Meaning::CutOut(from / material.alpha.max(1e-6))
                }
                (What::Color | What::Emission | What::Reflection, _)
                | (What::Reflect | What::Refract, _) => Meaning::Color,
                _ => Meaning::Numbers,
            };
            Some(ReadyMap {
                what,
                map: map.clone(),
                source: source(&map.picture, what, meaning, library),
            })
        };
        let maps: Vec<ReadyMap> = material.maps.iter().filter_map(ready).collect();
        let is_cut = material.is_cut();
        (!maps.is_empty()).then(|| Maps { maps, is_cut, fault: FirstError::default() })
    }

    /// What differs from place to place.
    pub(super) fn varying(&self) -> Columns {
        let one = |map: &ReadyMap| match map.what {
            What::Color | What::Alpha => Columns::COLOR,
            What::Normal | What::Bump => Columns::NORMAL,
            _ => Columns::FINISH,
        };
        self.maps.iter().map(one).fold(Columns::NONE, |all, one| all | one)
    }

    /// Whether all files are there.
    ///
    /// # Errors
    /// If one is not; `material` is what the error says of whose it is.
    pub(super) fn offers(&self, material: &str) -> Result<()> {
        for (path, _) in self.maps.iter().filter_map(|map| map.source.as_ref()) {
            is_there(path, format_args!("for material \"{material}\""))?;
        }
        Ok(())
    }

    /// The first fault since the last time.
    pub(super) fn fault(&self) -> Option<Error> {
        self.fault.take().map(without_pictures)
    }

    /// Its pictures, and the bytes that each takes at most.
    pub(super) fn pictures(&self, sizes: &mut Sizes<'_>) -> Vec<(Key, u64)> {
        let one = |map: &ReadyMap| {
            let (path, source) = map.source.as_ref()?;
            let number = match map.map.picture {
                Picture::Embedded(_, number) => Some(number),
                Picture::File(_) | Picture::Raw(_) | Picture::Wave(..) => None,
            };
            Some((source.key, sizes.of(source.key, path, number)))
        };
        self.maps.iter().filter_map(one).collect()
    }

    /// The pictures at hand, for a batch of fragments.
    pub(super) fn open(&self) -> Vec<Option<Opened<'_>>> {
        self.maps.iter().map(|map| self.open_one(map)).collect()
    }

    fn open_one<'m>(&self, map: &'m ReadyMap) -> Option<Opened<'m>> {
        let (_, source) = map.source.as_ref()?;
        self.fault.sift(store().open(source))
    }

    /// Changes what is seen of a place.
    pub(super) fn apply(
        &self,
        opened: &[Option<Opened<'_>>],
        wanted: Columns,
        at: &At<'_>,
        seen: &mut Appearance,
    ) {
        for (map, picture) in self.maps.iter().zip(opened) {
            let is_wanted = match map.what {
                What::Color | What::Alpha => wanted.contains(Columns::COLOR),
                What::Normal | What::Bump => wanted.contains(Columns::NORMAL),
                _ => wanted.contains(Columns::FINISH),
            };
            if is_wanted {
                self.apply_one(map, picture.as_ref(), at, seen);
            }
        }
    }

    fn apply_one(
        &self,
        ready: &ReadyMap,
        picture: Option<&Opened<'_>>,
        at: &At<'_>,
        seen: &mut Appearance,
    ) {
        let (map, strength) = (&ready.map, ready.map.strength);
        let sample = |footprint: Footprint| self.sample(ready, picture, &footprint, at.filter);
        let texel = || sample(at.footprint(map, DVec3::ZERO));
        let faded = |share: f32| 1.0 - strength + strength * share;
        let shares = |[r, g, b, _]: [f32; 4]| Color::new(faded(r), faded(g), faded(b));
        match ready.what {
            What::Color => {
                let [r, g, b, a] = texel();
                if self.is_cut {
                    seen.alpha *= faded(a);
                }
                // Colours come with associated alpha. A decal shows the material beside it: what is
                // missing is white, which changes nothing. Elsewhere the picture's own colour
                // counts, wherever it is transparent.
                let is_decal = map.mapping.wrap.contains(&Wrap::Nothing) && !self.is_cut;
                let texel = if is_decal {
                    [r, g, b].map(|v| v + (1.0 - a))
                } else {
                    [r, g, b].map(|v| if a > 0.0 { v / a } else { 0.0 })
                };
                let [r, g, b] = texel;
                seen.color = seen.color * shares([r, g, b, 1.0]);
            }
            What::Alpha => {
                if self.is_cut {
                    seen.alpha *= faded(texel()[3].clamp(0.0, 1.0));
                }
            }
            What::Normal => {
                let [x, y, z, _] = texel().map(|v| f64::from(v * 2.0 - 1.0));
                let lean = f64::from(strength);
                if let Some([right, up]) = self.tangents(map, at, seen.normal) {
                    // A z below 0 would look into the surface.
                    let normal = right * (x * lean) + up * (y * lean) + seen.normal * z.max(0.0);
                    seen.normal = normal.try_normalize().unwrap_or(seen.normal);
                }
            }
            What::Bump => {
                let height = |moved: DVec3| f64::from(sample(at.footprint(map, moved))[0]);
                // Blinn (1978): the normal leans away from where heights grow.
                let slope = self.slope(map, picture, at, &height);
                let normal = seen.normal - slope * f64::from(strength);
                seen.normal = normal.try_normalize().unwrap_or(seen.normal);
            }
            What::MetallicRoughness => {
                let [_, g, b, _] = texel();
                if let Gloss::Microfacets { roughness, metal, .. } = &mut seen.finish.gloss {
                    *roughness = (*roughness * faded(g)).clamp(0.0, 1.0);
                    *metal = (*metal * faded(b)).clamp(0.0, 1.0);
                }
            }
            What::Occlusion => seen.finish.ambient *= faded(texel()[0]),
            What::Emission => seen.finish.glow = seen.finish.glow * shares(texel()),
            What::Reflection => {
                let bounce = |normal: DVec3, to_eye: DVec3| {
                    let normal = if at.sees_front { normal } else { -normal };
                    normal * (2.0 * normal.dot(to_eye)) - to_eye
                };
                let (smooth, to_eye) = (at.seen_from)(DVec3::ZERO);
                let here = bounce(smooth, to_eye);
                // How what is mirrored moves from pixel to pixel: as the eye's rays spread, and as the surface curves.
                let moves = at.steps.map(|step| {
                    let (normal, to_eye) = (at.seen_from)(step);
                    bounce(normal, to_eye) - here
                });
                let [r, g, b, _] = sample(around(bounce(seen.normal, to_eye), moves));
                seen.finish.glow = seen.finish.glow + Color::new(r, g, b) * strength;
            }
            What::Reflect | What::Refract => {
                let shares = shares(texel());
                if let Some(optics) = &mut seen.finish.optics {
                    let share = match ready.what {
                        What::Reflect => &mut optics.reflect,
                        _ => &mut optics.refract,
                    };
                    *share = *share * shares;
                }
            }
        }
    }

    /// What a pixel sees of a map's picture, and what changes nothing where there is none.
    fn sample(
        &self,
        ready: &ReadyMap,
        picture: Option<&Opened<'_>>,
        footprint: &Footprint,
        filter: TextureFilter,
    ) -> [f32; 4] {
        let map = &ready.map;
        if let Picture::Wave(right, up) = map.picture {
            let value = wave(right, up, footprint) as f32;
            return [value, value, value, 1.0];
        }
        let nothing = ready.what.nothing();
        let Some(picture) = picture else { return nothing };
        let seen = footprint.see(picture, filter, map.mapping.wrap);
        let [r, g, b, a, covered] = self.fault.sift(seen).unwrap_or_default();
        let beside = nothing.map(|v| v * (1.0 - covered));
        [r + beside[0], g + beside[1], b + beside[2], a + beside[3]]
    }

    /// How much the places of a picture move for steps along two directions on a face, and these.
    fn plane(at: &At<'_>) -> [DVec3; 2] {
        let (u, v) = at.facing.any_orthonormal_pair();
        [u, v]
    }

    /// The unit directions to the right and upwards of a picture, across a normal.
    fn tangents(&self, map: &Map, at: &At<'_>, normal: DVec3) -> Option<[DVec3; 2]> {
        let axes = Maps::plane(at);
        // By about a pixel: much shorter steps would be lost in rounding, far from the origin.
        let step = at.steps[0].length().max(at.steps[1].length()).max(1e-9);
        let middle = at.footprint(map, DVec3::ZERO).at;
        let [a, b] = axes.map(|axis| (at.footprint(map, axis * step).at - middle) / step);
        let area = a.perp_dot(b);
        if !area.is_finite() || area == 0.0 {
            return None;
        }
        // The inverse of what takes steps on the face to places of the picture.
        let right = (axes[0] * b.y - axes[1] * a.y) / area;
        let up = (axes[1] * a.x - axes[0] * b.x) / area;
        // Brought to the tangent plane of the smooth normal, not of the face.
        let across = |way: DVec3| (way - normal * way.dot(normal)).try_normalize();
        Some([across(right)?, across(up)?])
    }

    /// By how much a height grows per metre, along the face.
    fn slope(
        &self,
        map: &Map,
        picture: Option<&Opened<'_>>,
        at: &At<'_>,
        height: &dyn Fn(DVec3) -> f64,
    ) -> DVec3 {
        let axes = Maps::plane(at);
        // Half a pixel or half a texel to both sides, whichever is more.
        let pixel = at.steps[0].length().max(at.steps[1].length());
        let texel = match (picture, &map.picture) {
            (Some(picture), _) => DVec2::new(f64::from(picture.size.0), f64::from(picture.size.1)),
            // A wave has no texels. A sixty-fourth of its length is fine enough for its slope.
            (None, Picture::Wave(right, up)) => DVec2::new(*right, *up).abs() * 64.0,
            (None, _) => DVec2::ONE,
        };
        let probe = pixel.max(1e-9);
        let middle = at.footprint(map, DVec3::ZERO).at;
        let moved = axes.map(|axis| (at.footprint(map, axis * probe).at - middle) / probe * texel);
        let texels = moved[0].length().max(moved[1].length());
        let step = (pixel / 2.0).max(if texels > 0.0 { 0.5 / texels } else { 0.0 });
        if !(step > 0.0 && step.is_finite()) {
            return DVec3::ZERO;
        }
        let along =
            |axis: DVec3| axis * ((height(axis * step) - height(axis * -step)) / (2.0 * step));
        along(axes[0]) + along(axes[1])
    }
}

/// Waves between 0 and 1, with the mean of what a pixel covers.
fn wave(right: f64, up: f64, footprint: &Footprint) -> f64 {
    let along = |count: f64, place: f64, sides: [f64; 2]| {
        // The mean of a wave over a length is a wave, lower by sinc of it; the sides of a parallelogram one
        // after the other.
        let lower = |side: f64| match PI * count * side {
            0.0 => 1.0,
            angle => math::sin(angle) / angle,
        };
        math::cos(TAU * count * place) * lower(sides[0]) * lower(sides[1])
    };
    let Footprint { at, right: r, down: d } = footprint;
    0.5 + 0.5 * along(right, at.x, [r.x, d.x]) * along(up, at.y, [r.y, d.y])
}

/// What is seen of a panorama in a direction, which moves so much to the next pixel on the right and below: its middle
/// lies towards -z, its top is the zenith.
fn around(direction: DVec3, moves: [DVec3; 2]) -> Footprint {
    let place = |way: DVec3| {
        let up = way.normalize_or_zero().y.clamp(-1.0, 1.0);
        DVec2::new(math::atan2(way.x, -way.z) / TAU + 0.5, 1.0 - math::acos(up) / PI)
    };
    let at = place(direction);
    let [right, down] = moves.map(|step| {
        let step = place(direction + step) - at;
        // Across the seam behind, u jumps by 1.
        DVec2::new(step.x - step.x.round(), step.y)
    });
    Footprint { at, right, down }
}

/// A picture that can be read.
fn source(
    picture: &Picture,
    what: What,
    meaning: Meaning,
    library: &Arc<dyn Library>,
) -> Option<(PathBuf, PictureSource)> {
    let (path, number) = match picture {
        Picture::File(path) | Picture::Raw(path) => (PathBuf::from(path), None),
        Picture::Embedded(path, number) => (PathBuf::from(path), Some(*number)),
        Picture::Wave(..) => return None,
    };
    let mut key = KeyHasher::new("picture");
    let is_alpha = what == What::Alpha;
    let is_raw = !matches!(picture, Picture::File(_));
    // What it holds counts, and not what it is called; one that is not there is none that is.
    let contents = open::contents(&path);
    let absent = contents.is_none().then_some(&path);
    key.value(&(contents, absent, number, meaning, is_alpha, is_raw));
    let (from, library) = (path.clone(), library.clone());
    let read = move || -> Result<Texels> {
        let texels = match number {
            None => Encoded::open(&from)?.texels(is_raw),
            Some(number) => {
                let fault =
                    |e: Error| Error::in_file(&from, format!("picture {number}: {}", e.message()));
                let bytes = library.picture(&from, number)?;
                Encoded::of(&from, &bytes).and_then(|picture| picture.texels(true)).map_err(fault)
            }
        }?;
        Ok(if is_alpha { texels.into_alpha() } else { texels })
    };
    Some((path, PictureSource { key: key.finish(), meaning, read: Box::new(read) }))
}
