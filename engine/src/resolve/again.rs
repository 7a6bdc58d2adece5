//! What is as it was in the picture before (\[N]: "the compositing is done by recalculating only moving elements").
//!
//! Of each way of resolving, the last image and its picture are kept. Bands of rows on which the next image shows the
//! same faces at the same cells, shaded alike, are taken from that picture: bit for bit what they would be. A shader
//! that looks around makes a band another if something that moved may cast a shadow on what is seen there.

use glam::DVec3;
use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::paint::IdNames;
use super::rule::{Framing, Rule};
use crate::cache::Shelf;
use crate::camera::{Plane, View};
use crate::fragment::{Compared, Member, Shading, Stage, World};
use crate::image::{Channel, Samples};
use crate::key::Key;
use crate::raster::Rows;
use crate::span::{Face, FaceId, Source, SpanImage, matched};
use crate::trace::{Casters, Toward, part_in};
use crate::watch::Watch;

/// The channels of one maker.
type MadeValues = Vec<(String, Samples)>;

/// A picture that was made, and the image that it is of.
pub(super) struct Last {
    image: SpanImage,
    /// By maker of channels, as the picture has them.
    pub(super) values: Vec<MadeValues>,
    /// By band.
    pub(super) names: Vec<IdNames>,
}

/// How pictures are made that may have parts in common.
pub(super) fn key(
    image: &SpanImage,
    (rule, framing): (Rule, &Framing),
    channels: &BTreeSet<Channel>,
    values: &[MadeValues],
) -> Key {
    let names: Vec<&str> = values.iter().flatten().map(|(name, _)| name.as_str()).collect();
    let raster = image.view().raster();
    let how = format!("{rule:?} {framing:?} {raster:?}");
    Key::of(&(how, image.view().camera(), channels, names))
}

impl Last {
    /// What was made last in a way.
    pub(super) fn of(key: Key, watch: &Watch) -> Option<Arc<Last>> {
        Shelf::of_work(watch)?.get(key, 0)?.downcast().ok()
    }

    /// Keeps what was made in a way, instead of what was before.
    pub(super) fn keep(
        key: Key,
        image: &SpanImage,
        (values, names): (&[MadeValues], &[IdNames]),
        (watch, seconds): (&Watch, f64),
    ) {
        let Some(shelf) = Shelf::of_work(watch).filter(|_| !watch.is_stopped()) else { return };
        let samples: usize = values.iter().flatten().map(|(_, samples)| samples.len() * 4).sum();
        let bytes = image.bytes() + samples;
        let (values, names) = (values.to_vec(), names.to_vec());
        let last = Last { image: image.clone(), values, names };
        shelf.renew((key, 0), Arc::new(last), bytes, seconds);
    }

    /// Which bands of rows of another image's picture are those of this one.
    pub(super) fn same(
        &self,
        image: &SpanImage,
        framing: &Framing,
        bands: &[(u32, Rows)],
    ) -> Vec<bool> {
        let before = &self.image;
        let is_alike = before.plan() == image.plan()
            && before.rows() == image.rows()
            && before.limits() == image.limits()
            && before.view().camera() == image.view().camera()
            && before.view().raster() == image.view().raster();
        if !is_alike {
            return vec![false; bands.len()];
        }
        let matched = Matched::of(before, image);
        bands
            .iter()
            .map(|(_, rows)| {
                let part = Framing { rows: rows.clone(), ..framing.clone() };
                let rows = part.raster_rows(image.view().raster());
                matched.is_same(before, image, rows)
            })
            .collect()
    }
}

/// The faces of an image that an image before had too.
struct Matched {
    /// Of each face, which it was; `NONE` if it is new, or is shaded in another way.
    was: Vec<FaceId>,
    /// Of each source, where shadows of what moved may come from.
    moved: Vec<Vec<MovedCaster>>,
}

/// Something that casts other shadows than before, and a light.
#[derive(Clone)]
struct MovedCaster {
    toward: Toward,
    /// Its least and its greatest coordinates, before or now.
    bounds: [DVec3; 2],
}

impl Matched {
    fn of(before: &SpanImage, image: &SpanImage) -> Matched {
        let mut was = Vec::with_capacity(image.face_count());
        let mut moved = Vec::new();
        for source in image.sources() {
            let faces = source.faces.faces();
            let known = before
                .sources()
                .iter()
                .enumerate()
                .find_map(|(at, old)| Some((at, old, changed(old, source)?)));
            let Some((at, old, casters)) = known else {
                was.extend(faces.iter().map(|_| FaceId::NONE));
                moved.push(Vec::new());
                continue;
            };
            moved.push(casters);
            let is_same_scene = Arc::ptr_eq(&old.surfaces, &source.surfaces);
            if is_same_scene && Arc::ptr_eq(&old.faces, &source.faces) {
                was.extend((0..faces.len()).map(|place| before.id(at, place)));
                continue;
            }
            let compared = (!is_same_scene).then(|| Compared::of(&source.surfaces, &old.surfaces));
            let ordinal = |face: &Face| match &compared {
                Some(compared) => compared.was(face.ordinal),
                None => Some(face.ordinal),
            };
            let places = matched(&source.faces, &old.faces);
            was.extend(faces.iter().zip(places).map(|(face, place)| {
                // What looks the same on the screen may be another face, or of another colour.
                let is_it =
                    |place: &u32| ordinal(face) == Some(old.faces.faces()[*place as usize].ordinal);
                place.filter(is_it).map_or(FaceId::NONE, |place| before.id(at, place as usize))
            }));
        }
        Matched { was, moved }
    }

    /// Whether rows of the raster show what they showed.
    fn is_same(&self, before: &SpanImage, image: &SpanImage, rows: Rows) -> bool {
        let was = |face: FaceId| match face.is_some() {
            true => Some(self.was[face.0 as usize]).filter(|was| was.is_some()),
            false => Some(FaceId::NONE),
        };
        let lines = image.plan().lines(&rows);
        let held = image.lines().range();
        let lines = lines.start.max(held.start)..lines.end.min(held.end);
        for k in lines.clone() {
            let (a, b) = (before.lines().line(k), image.lines().line(k));
            let is_line = a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| a.x == b.x && was(b.face) == Some(a.face));
            let (a, b) = (before.layers().line(k), image.layers().line(k));
            let are_layers = a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| {
                    (a.start, a.end) == (b.start, b.end) && was(b.face) == Some(a.face)
                });
            let (a, b) = (before.cuts().line(k), image.cuts().line(k));
            let are_cuts = a.len() == b.len()
                && a.iter().zip(b).all(|(a, b)| a.x == b.x && was(b.face) == Some(a.face));
            if !(is_line && are_layers && are_cuts) {
                return false;
            }
        }
        self.moved.iter().all(Vec::is_empty) || !self.is_reached(image, lines)
    }

    /// Whether a shadow of something that moved may fall on what is seen on lines.
    fn is_reached(&self, image: &SpanImage, lines: std::ops::Range<u32>) -> bool {
        let raster = image.view().raster();
        // Each face has many spans: how far left and right they reach, and up and down.
        let mut seen: HashMap<FaceId, [[f64; 2]; 2]> = HashMap::new();
        for k in lines {
            let y = image.y(k);
            let line = image.lines().line(k);
            let ends = line.iter().skip(1).map(|span| span.x).chain([raster.cells()]);
            let opaque = line.iter().zip(ends).map(|(span, end)| (span.face, span.x, end));
            let layers = image.layers().line(k).iter();
            let layers = layers.map(|segment| (segment.face, segment.start, segment.end));
            for (face, start, end) in opaque.chain(layers).filter(|(face, ..)| face.is_some()) {
                let [from, to] = [raster.pixels(start), raster.pixels(end)];
                let [across, down] = seen.entry(face).or_insert([[from, to], [y, y]]);
                *across = [across[0].min(from), across[1].max(to)];
                *down = [down[0].min(y), down[1].max(y)];
            }
        }
        seen.into_iter().any(|(face, [across, down])| {
            let (source, place) = image.locate(face);
            let moved = &self.moved[source];
            if moved.is_empty() {
                return false;
            }
            let extent = Extent::of(&image.sources()[source], place);
            let Some(points) = extent.around(image.view(), across, down) else { return true };
            let low = points.into_iter().fold(DVec3::INFINITY, DVec3::min);
            let high = points.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
            moved.iter().any(|caster| caster.may_shade([low, high]))
        })
    }
}

/// Where a face lies on the screen, and how deep.
struct Extent {
    plane: Plane,
    x: [f64; 2],
    y: [f64; 2],
    rho: [f64; 2],
}

impl Extent {
    fn of(source: &Source, place: usize) -> Extent {
        let face = &source.faces.faces()[place];
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let mut extent = Extent { plane: face.plane, x: none, y: none, rho: none };
        let join = |range: &mut [f64; 2], value: f64| {
            *range = [range[0].min(value), range[1].max(value)];
        };
        for point in source.faces.outline(face).points() {
            join(&mut extent.x, point.x);
            join(&mut extent.y, point.y);
            join(&mut extent.rho, face.plane.depth(point.x, point.y));
        }
        extent
    }

    /// Points of the world around what may be seen of the face near a part of the screen; `None` if that has no end.
    fn around(&self, view: &View, x: [f64; 2], y: [f64; 2]) -> Option<[DVec3; 8]> {
        // A fragment lies within a pixel and a row of the cells and the line on which it was found, and within its face.
        let within = |value: f64, [low, high]: [f64; 2]| value.max(low).min(high);
        let x = [x[0] - 1.0, x[1] + 1.0].map(|x| within(x, self.x));
        let y = [y[0] - 1.0, y[1] + 1.0].map(|y| within(y, self.y));
        let corners = [(x[0], y[0]), (x[1], y[0]), (x[0], y[1]), (x[1], y[1])];
        let depths = corners.map(|(x, y)| within(self.plane.depth(x, y), self.rho));
        let least = depths.into_iter().fold(f64::INFINITY, f64::min);
        let most = depths.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // Each corner at both depths: whatever lies between is in the box around them.
        let points = std::array::from_fn(|i| {
            let (x, y) = corners[i % 4];
            view.world_point(x, y, if i < 4 { least } else { most })
        });
        let has_end = (view.is_parallel() || least > 0.0)
            && points.iter().all(|point: &DVec3| point.is_finite());
        has_end.then_some(points)
    }
}

impl MovedCaster {
    /// Whether its shadow may fall into a box.
    fn may_shade(&self, [low, high]: [DVec3; 2]) -> bool {
        let [from, to] = self.bounds;
        match self.toward {
            // A place in the box, and some way on to the light is in the caster's.
            Toward::Direction(way) => {
                let between = [from - high, to - low];
                part_in((DVec3::ZERO, way), between, 0.0..f64::INFINITY).is_some()
            }
            Toward::Point(light) => {
                let (low, high) = (low.min(light), high.max(light));
                low.cmple(to).all() && high.cmpge(from).all()
            }
        }
    }
}

/// What casts other shadows on a source than it did; `None` if it is not of the same scene, or was shaded in another way.
fn changed(old: &Source, new: &Source) -> Option<Vec<MovedCaster>> {
    let is_same = (&old.label, old.matte, &old.held) == (&new.label, new.matte, &new.held)
        && old.stack.len() == new.stack.len();
    if !is_same {
        return None;
    }
    let mut moved = Vec::new();
    for stages in old.stack.iter().zip(&new.stack) {
        match stages {
            (Stage::Shade(a), Stage::Shade(b)) => moved.extend(other_shadows(a, b)?),
            (a, b) => (a.key() == b.key()).then_some(())?,
        }
    }
    Some(moved)
}

fn other_shadows(old: &Shading, new: &Shading) -> Option<Vec<MovedCaster>> {
    let is_same = Arc::ptr_eq(old.shader(), new.shader())
        || Key::of(&**old.shader()) == Key::of(&**new.shader());
    if !is_same {
        return None;
    }
    let (Some(a), Some(b)) = (old.world(), new.world()) else {
        return (old.world().is_none() && new.world().is_none()).then(Vec::new);
    };
    if a.key() == b.key() {
        return Some(Vec::new());
    }
    let lights = new.shader().looks_toward()?;
    let boxes = differing(a, b)?;
    let toward = |toward: &Toward| {
        let toward = *toward;
        boxes.iter().map(move |bounds| MovedCaster { toward, bounds: *bounds })
    };
    Some(lights.iter().flat_map(toward).collect())
}

/// Boxes around what only one of two worlds casts; `None` if that is not known.
fn differing(old: &World, new: &World) -> Option<Vec<[DVec3; 2]>> {
    let casters =
        |world| World::casters(world).map(|(at, casters)| (&world.members()[at], casters));
    let mut gone: Vec<(&Member, &Casters)> = casters(old).collect();
    let mut boxes = Vec::new();
    for (member, all) in casters(new) {
        let Some(at) = gone.iter().position(|(was, _)| was.label == member.label) else {
            boxes.extend(all.bounds());
            continue;
        };
        let (was, _) = gone.swap_remove(at);
        if !Arc::ptr_eq(&was.surfaces, &member.surfaces) {
            boxes.extend(Compared::of(&member.surfaces, &was.surfaces).differing()?.boxes());
        }
    }
    boxes.extend(gone.iter().filter_map(|(_, all)| all.bounds()));
    Some(boxes)
}
