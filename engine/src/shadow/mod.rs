//! Shadow volumes: what of the spans on a line the light of one place does not reach, exactly.
//!
//! Every convex piece of a face casts a volume of its own (\[D], "Shading display with shadow", takes the
//! contours of closed bodies instead; most scenes are not closed, and what is counted wrong leaks). The
//! planes that bound a volume, through the light and the piece's edges and through the piece itself, are
//! affine on the screen along a visible face once multiplied by rho. So a volume takes one interval of a
//! line, its ends known exactly with their slopes, and a shadow is the *union* of intervals: nothing is
//! counted, and it does not matter where the eye is.
//!
//! CasterSearch come from the tree of [`Casters`] over the space between a patch of a face, a few rows high
//! and some dozens of pixels wide, and the light. The spans of the image are not cut: intervals stand beside
//! them, light by light, and fragments take the share of their area that is lit.

mod piece;

use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

use crate::camera::{Plane, View};
use crate::fragment::{Casting, Stage, Surfaces, World, stack};
use crate::span::layer::Segment;
use crate::span::{FaceId, SpanImage, slopes};
use crate::trace::{CasterSearch, Casters, Shaft, Spaces, Toward, Turn, spaces_of};
use crate::watch::Watch;
pub(crate) use piece::{Way, lies_in, opacity};

/// The width of a patch in pixels. Narrower, there are more patches to look for; wider, each has more
/// casters around it.
const TILE: f64 = 128.0;

/// An end of a shadow on a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct End {
    /// Where it is, in pixels from the left.
    pub(crate) x: f64,
    /// Pixels to the right per pixel downwards.
    pub(crate) slope: f64,
}

/// A part of a line where a face is in shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dark {
    /// The face.
    pub(crate) face: FaceId,
    /// Where it begins.
    pub(crate) start: End,
    /// Where it ends.
    pub(crate) end: End,
    /// The share of the light that still arrives.
    pub(crate) through: f32,
}

/// A visible part of a face on a line.
#[derive(Clone, Copy, Debug)]
struct VisiblePart {
    face: FaceId,
    tile: u32,
    k: u32,
    from: f64,
    to: f64,
}

/// A boundary of a volume along a face: inside where it is not negative.
type Boundary = Plane;

/// The shadows of lines: by line, sorted by face and then from left to right.
pub(crate) type Lines = Vec<Vec<Dark>>;

/// The visible parts of faces on some lines, patch by patch: the same for all lights.
#[derive(Debug, Default)]
pub(crate) struct Patches(Vec<VisiblePart>);

impl Patches {
    /// The patches of an image on the lines `lines`, of whose `layers` these are seen. Only faces of sources that
    /// are lit in the world receive its shadows.
    pub(crate) fn new<'l>(
        image: &SpanImage,
        world: &World,
        lines: Range<u32>,
        layers: impl Fn(u32) -> &'l [Segment],
    ) -> Patches {
        let looks_around = |stage: &Stage| match stage {
            Stage::Shade(shading) => shading.world().is_some_and(|w| w.key() == world.key()),
            _ => false,
        };
        let sources = image.sources().iter();
        let receives: Vec<bool> = sources.map(|s| s.stack.iter().any(looks_around)).collect();
        let raster = image.view().raster();
        let mut seen = Vec::new();
        for k in lines {
            let line = image.lines().line(k);
            let ends = line.iter().skip(1).map(|span| span.x).chain([raster.cells()]);
            let spans = line.iter().zip(ends).map(|(span, end)| (span.face, span.x, end));
            let layers = layers(k).iter().map(|s| (s.face, s.start, s.end));
            for (face, start, end) in spans.chain(layers) {
                if face.is_some() && receives[image.locate(face).0] {
                    let (mut left, end) = (raster.pixels(start), raster.pixels(end));
                    // Tiles begin at multiples of their width, whatever the span: lines above each
                    // other share them.
                    while left < end {
                        let tile = (left / TILE).floor();
                        let right = ((tile + 1.0) * TILE).min(end);
                        seen.push(VisiblePart {
                            face,
                            tile: tile as u32,
                            k,
                            from: left,
                            to: right,
                        });
                        left = right;
                    }
                }
            }
        }
        let key = |seen: &VisiblePart| (seen.face, seen.tile, seen.k);
        seen.sort_unstable_by(|a, b| key(a).cmp(&key(b)).then(a.from.total_cmp(&b.from)));
        Patches(seen)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

/// The shadows that fall on the faces of an image on the lines `lines`, from everything in a world, in the
/// light from one place.
pub(crate) fn cast(
    image: &SpanImage,
    patches: &Patches,
    casting: &Casting<'_>,
    lines: Range<u32>,
    watch: &Watch,
) -> Lines {
    let casters = casting.world.casters().map(|(member, casters)| {
        let spaces = match (casting.less.candidates, casting.from) {
            (CasterSearch::SixSpaces, Toward::Point(light)) => Some(casters.spaces(light)),
            _ => None,
        };
        Caster { member, casters, spaces, of_cluster: Vec::new() }
    });
    let casters: Vec<Caster<'_>> = casters.collect();
    let mut dark: Lines = vec![Vec::new(); lines.len()];
    let mut work = ShadowTask { image, casting, casters, sides: Vec::new() };
    let source = |seen: &VisiblePart| image.locate(seen.face).0;
    // [N], "Shadow processing": cluster by cluster, with only the volumes that can fall on its
    // visible faces.
    for cluster in patches.0.chunk_by(|a, b| source(a) == source(b)) {
        let patches = || cluster.chunk_by(|a, b| (a.face, a.tile) == (b.face, b.tile));
        let made = || patches().filter_map(|spans| Patch::new(image, spans, casting.from));
        if casting.less.candidates == CasterSearch::Clusters {
            work.look_around(made());
        }
        for spans in patches().take_while(|_| !watch.is_stopped()) {
            work.patch(spans, lines.start, &mut dark);
        }
    }
    let half = 0.5 / f64::from(image.plan().per_row);
    for (k, line) in lines.zip(&mut dark) {
        unite(line);
        for of_face in line.chunk_by_mut(|a, b| a.face == b.face) {
            settle(of_face, image, k, half);
        }
        line.shrink_to_fit();
    }
    dark
}

/// Flattens the slopes of the ends of a face's shadows so that, within half a strip up and down, they
/// neither meet nor leave the span that they lie in. What is lost above is lost below, so that areas stay.
fn settle(mut dark: &mut [Dark], image: &SpanImage, k: u32, half: f64) {
    let is_upright = |dark: &Dark| dark.start.slope == 0.0 && dark.end.slope == 0.0;
    if dark.iter().all(is_upright) {
        return;
    }
    let (mut middle, mut top, mut bottom) = (Vec::new(), Vec::new(), Vec::new());
    while let Some(first) = dark.first() {
        let (left, right) = span_of(image, k, first);
        let count = dark.iter().take_while(|dark| dark.start.x < right).count().max(1);
        let (inside, rest) = dark.split_at_mut(count);
        dark = rest;
        // The sides of the span, and between them all ends; two shadows that touch share one.
        let wall = |x| End { x, slope: 0.0 };
        let mut ends: Vec<End> = vec![wall(left.min(inside[0].start.x))];
        for Dark { start, end, .. } in inside.iter() {
            if start.x > ends[ends.len() - 1].x || ends.len() == 1 {
                ends.push(*start);
            }
            ends.push(*end);
        }
        ends.push(wall(right.max(ends[ends.len() - 1].x)));
        middle.clear();
        middle.extend(ends.iter().map(|end| end.x));
        top.clear();
        top.extend(ends.iter().map(|end| end.x - end.slope * half));
        bottom.clear();
        bottom.extend(ends.iter().map(|end| end.x + end.slope * half));
        // The walls are upright, so nothing moves them: an end that would cross one is turned until
        // it does not.
        slopes::separate(&middle, f64::INFINITY, &mut top, &mut bottom);
        let slope = |at: usize| (bottom[at] - top[at]) / (2.0 * half);
        let mut at = 0;
        for Dark { start, end, .. } in inside {
            if start.x > ends[at].x || at == 0 {
                at += 1;
            }
            start.slope = slope(at);
            at += 1;
            end.slope = slope(at);
        }
    }
}

/// From where to where the face of a shadow is seen around its beginning, in pixels.
fn span_of(image: &SpanImage, k: u32, dark: &Dark) -> (f64, f64) {
    let raster = image.view().raster();
    let line = image.lines().line(k);
    let at = line.partition_point(|span| raster.pixels(span.x) <= dark.start.x).max(1) - 1;
    if line[at].face == dark.face {
        let right = line.get(at + 1).map_or(raster.cells(), |span| span.x);
        return (raster.pixels(line[at].x), raster.pixels(right));
    }
    let layers = image.layers().line(k).iter().filter(|s| s.face == dark.face);
    let mut around = layers.map(|s| (raster.pixels(s.start), raster.pixels(s.end)));
    let found = around.find(|(from, to)| *from <= dark.start.x && dark.start.x < *to);
    found.unwrap_or((dark.start.x, dark.end.x))
}

struct ShadowTask<'a> {
    image: &'a SpanImage,
    casting: &'a Casting<'a>,
    casters: Vec<Caster<'a>>,
    sides: Vec<Boundary>,
}

/// What casts of one member of the world.
struct Caster<'a> {
    member: usize,
    casters: &'a Casters,
    /// Its pieces around the light.
    spaces: Option<Arc<Spaces>>,
    /// Its pieces between the light and the cluster at hand.
    of_cluster: Vec<u32>,
}

impl ShadowTask<'_> {
    /// Finds what stands between the light and all patches of a cluster: around their ball.
    fn look_around<'p>(&mut self, patches: impl Iterator<Item = Patch<'p>>) {
        let corners: Vec<DVec3> =
            patches.flat_map(|patch| patch.corners().unwrap_or_default()).collect();
        let low = corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
        let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
        let (centre, radius) = ((low + high) / 2.0, (high - low).length() / 2.0);
        let shaft = shaft_of_ball(centre, radius, self.casting.from);
        for Caster { casters, of_cluster, .. } in &mut self.casters {
            of_cluster.clear();
            casters.within(&shaft, |piece| of_cluster.push(piece as u32));
        }
    }

    /// Finds the shadows on a patch of a face.
    fn patch(&mut self, spans: &[VisiblePart], first: u32, dark: &mut Lines) {
        let ShadowTask { image, casting, casters, sides } = self;
        let Casting { from, world, less } = **casting;
        let Some(patch) = Patch::new(image, spans, from) else { return };
        let shaft = patch.shaft();
        for Caster { member, casters, spaces, of_cluster } in casters.iter() {
            let surfaces = &*world.members()[*member].surfaces;
            let mut cast = |piece: usize| {
                if casters.pieces()[piece].opacity == 0.0 {
                    return;
                }
                let corners = casters.corners(piece, from);
                // All of it may be outside one plane of the shaft.
                let is_outside = |(normal, offset): &(DVec3, f64)| {
                    corners.clone().all(|corner| normal.dot(corner) + offset < 0.0)
                };
                if shaft.planes.iter().any(is_outside) {
                    return;
                }
                // What comes out of a closed body went into it.
                if less.contours && casters.goes_in(piece, from) == Some(false) {
                    return;
                }
                sides.clear();
                if !patch.volume(casters, piece, sides) {
                    return;
                }
                // What differs from place to place is taken pixel by pixel.
                let differs = casters.pieces()[piece].opacity.is_nan();
                for line in spans.chunk_by(|a, b| a.k == b.k) {
                    let (y, dark) = (image.y(line[0].k), &mut dark[(line[0].k - first) as usize]);
                    let whole = line[0].from..line[line.len() - 1].to;
                    let Some((low, high)) = interval(sides, y, whole) else { continue };
                    // Of the parts that the face is seen in, those that the volume meets.
                    let met = line.partition_point(|seen| seen.to <= low.x);
                    for seen in line[met..].iter().take_while(|seen| seen.from < high.x) {
                        let bound = |x| End { x, slope: 0.0 };
                        let mut start = if low.x > seen.from { low } else { bound(seen.from) };
                        let last = if high.x < seen.to { high } else { bound(seen.to) };
                        while start.x < last.x {
                            let next = if differs { start.x.floor() + 1.0 } else { f64::INFINITY };
                            let end = if next < last.x { bound(next) } else { last };
                            let middle = (start.x + end.x) / 2.0;
                            let opacity = patch.opacity(surfaces, casters, piece, middle, y);
                            if opacity > 0.0 {
                                let (face, through) = (seen.face, 1.0 - opacity);
                                dark.push(Dark { face, start, end, through });
                            }
                            start = end;
                        }
                    }
                }
            };
            match (less.candidates, from) {
                (CasterSearch::Shafts, _) => casters.within(&shaft, cast),
                (CasterSearch::Clusters, _) => of_cluster.iter().for_each(|p| cast(*p as usize)),
                (CasterSearch::SixSpaces, Toward::Point(light)) => {
                    let Some((spaces, corners)) = spaces.as_ref().zip(patch.corners()) else {
                        (0..casters.pieces().len()).for_each(cast);
                        continue;
                    };
                    let mut pieces: Vec<u32> = spaces_of(corners.iter().map(|c| *c - light))
                        .flat_map(|space| spaces[space].iter().copied())
                        .collect();
                    pieces.sort_unstable();
                    pieces.dedup();
                    pieces.into_iter().for_each(|piece| cast(piece as usize));
                }
                (CasterSearch::SixSpaces | CasterSearch::All, _) => {
                    (0..casters.pieces().len()).for_each(cast);
                }
            }
        }
    }
}

/// The space between a ball and a light: planes that touch the ball.
fn shaft_of_ball(centre: DVec3, radius: f64, from: Toward) -> Shaft {
    let (way, reach) = from.from(centre);
    let distance = way.length() * reach;
    let Some(toward) = way.try_normalize().filter(|_| centre.is_finite()) else {
        return Shaft::default();
    };
    // The sine of the angle that the ball takes, seen from the light.
    let sine = if distance.is_finite() { radius / distance } else { 0.0 };
    if sine >= 1.0 {
        return Shaft::default();
    }
    let cosine = (1.0 - sine * sine).sqrt();
    let (u, v) = toward.any_orthonormal_pair();
    let mut planes = vec![(toward, radius - toward.dot(centre))];
    for side in [u, -u, v, -v] {
        let inward = side * cosine - toward * sine;
        planes.push((inward, radius - inward.dot(centre)));
    }
    Shaft { planes }
}

/// A patch of a face that is turned to the light.
struct Patch<'a> {
    view: &'a View,
    /// The face's depth where it was lit.
    depth: Plane,
    /// How far it was moved since, in pixels.
    moved: [f64; 2],
    /// Its plane in the world: the unit normal on the side that is seen, and a point. Of a card, as it stands to the
    /// light.
    plane: (DVec3, DVec3),
    /// What becomes of a card in the light.
    turn: Option<Turn>,
    from: Toward,
    /// What it takes of the screen, in pixels.
    x: [f64; 2],
    y: [f64; 2],
}

impl Patch<'_> {
    /// The patch of some spans; `None` if it faces away from the light, and is dark by itself.
    fn new<'a>(image: &'a SpanImage, spans: &[VisiblePart], from: Toward) -> Option<Patch<'a>> {
        let view = image.view();
        let (source, face) = image.face(spans[0].face);
        // What moved it came after what lights it: the world knows of no moves.
        let (depth, moved) = stack::unmoved(&source.stack, &face.plane);
        let card = source.surfaces.card(face.ordinal);
        let turn = card.map(|card| card.turn(Toward::eye(view), from));
        let (normal, point) = match &turn {
            Some(turn) => turn.plane(),
            None => view.world_plane(&depth)?,
        };
        let faces_light = match from {
            Toward::Direction(toward) => normal.dot(toward),
            Toward::Point(light) => normal.dot(light - point),
        };
        if faces_light.is_nan() || faces_light <= 0.0 {
            return None;
        }
        let x = spans.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], seen| {
            [low.min(seen.from), high.max(seen.to)]
        });
        let half = 0.5 / f64::from(image.plan().per_row);
        let y = [image.y(spans[0].k) - half, image.y(spans[spans.len() - 1].k) + half];
        Some(Patch { view, depth, moved, plane: (normal, point), turn, from, x, y })
    }

    /// The space between it and the light.
    fn shaft(&self) -> Shaft {
        let Patch { from, plane: (normal, point), .. } = *self;
        // Before the face, before the light, and inside the four sides through the light and the
        // patch's edges.
        let mut planes = vec![(normal, -normal.dot(point))];
        if let Some(at) = self.corners() {
            let centre = at.iter().sum::<DVec3>() / 4.0;
            if let Toward::Point(light) = from {
                let away = centre - light;
                planes.push((away, -away.dot(light)));
            }
            for (i, corner) in at.iter().enumerate() {
                let along = at[(i + 1) % 4] - *corner;
                let side = along.cross(from.from(*corner).0);
                let inside = side.dot(centre - *corner);
                // A side that the centre all but lies in has no sure inside, and bounds nothing:
                // the shaft is wider than it need be, never narrower.
                if inside.abs() > 1e-9 * side.length() * (centre - *corner).length() {
                    let side = side * inside.signum();
                    planes.push((side, -side.dot(*corner)));
                }
            }
        }
        Shaft { planes }
    }

    /// Its corners in the world; beyond the horizon of its plane it has none.
    fn corners(&self) -> Option<[DVec3; 4]> {
        let x = self.x.map(|x| x - self.moved[0]);
        let y = self.y.map(|y| y - self.moved[1]);
        let corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])];
        let (least, most) = self.depth.range(x, y);
        let has_corners = self.view.is_parallel() || least > 1e-6 * most;
        has_corners.then(|| corners.map(|(x, y)| self.place(x, y)))
    }

    /// Where what is seen at a place on the screen receives light.
    fn place(&self, x: f64, y: f64) -> DVec3 {
        let point = self.view.world_point(x, y, self.depth.depth(x, y));
        self.turn.map_or(point, |turn| turn.place(point))
    }

    /// The sides of the volume that a piece casts, as seen along the face. False if it casts none on it.
    fn volume(&self, casters: &Casters, piece: usize, sides: &mut Vec<Boundary>) -> bool {
        if lies_in(casters, piece, self.plane) {
            return false;
        }
        let normal = casters.normal(piece, self.from);
        let mut corners = casters.corners(piece, self.from);
        let Some(first) = corners.next() else { return false };
        let away = match self.from {
            Toward::Direction(toward) => -normal.dot(toward) / normal.length(),
            Toward::Point(light) => {
                normal.dot(first - light) / (normal.length() * (first - light).length())
            }
        };
        // A light in the plane of the piece sees it edge-on.
        if away.is_nan() || away.abs() < 1e-12 {
            return false;
        }
        // The volume lies on the far side of the piece, as the light sees it. Corners that run
        // round the other way turn all sides over.
        let sign = away.signum();
        // Nothing of the patch is inside if one side has all of it outside.
        let mut add = |normal: DVec3, point: DVec3| {
            let before = match &self.turn {
                Some(turn) => turn.before(normal * sign, point),
                None => Ok((normal * sign, point)),
            };
            // A side is affine on the screen once it is multiplied by rho, which is above 0 and
            // keeps its sign.
            let Plane { a, b, c } = match before {
                Ok((normal, point)) => self.view.side_of(normal, point, &self.depth),
                Err(side) => Plane::constant(side),
            };
            let side = Plane { a, b, c: c - a * self.moved[0] - b * self.moved[1] };
            sides.push(side);
            side.range(self.x, self.y).1 >= 0.0
        };
        if !add(normal, first) {
            return false;
        }
        let mut last = first;
        for corner in corners.chain([first]) {
            // The same for both pieces that share an edge, but for its sign.
            let (side, through) = match self.from {
                Toward::Direction(toward) => {
                    let is_first = last.to_array() < corner.to_array();
                    ((corner - last).cross(toward), if is_first { last } else { corner })
                }
                Toward::Point(light) => ((last - light).cross(corner - light), light),
            };
            if !add(side, through) {
                return false;
            }
            last = corner;
        }
        true
    }

    /// How much a piece holds back of the light to a point of the patch.
    fn opacity(
        &self,
        surfaces: &dyn Surfaces,
        casters: &Casters,
        piece: usize,
        x: f64,
        y: f64,
    ) -> f32 {
        opacity(surfaces, self.view, casters, piece, || {
            let (x, y) = (x - self.moved[0], y - self.moved[1]);
            let depth = self.depth.depth(x, y);
            let from = self.place(x, y);
            let (along, reach) = self.from.from(from);
            let normal = casters.normal(piece, self.from);
            let corner = casters.corners(piece, self.from).next().unwrap_or_default();
            let way = normal.dot(corner - from) / normal.dot(along);
            // Towards a light at one place what a pixel stands for narrows.
            let narrows = 1.0 - (way / reach).clamp(0.0, 1.0);
            let width = self.view.pixel_width(self.view.distance(depth)).0 * narrows;
            Way { from, along, position: from + along * way, width: width as f32 }
        })
    }
}

/// The part of a line inside all sides.
#[inline]
fn interval(sides: &[Boundary], y: f64, within: Range<f64>) -> Option<(End, End)> {
    // A volume is convex: what a line has of it is one interval, from the last side that it comes
    // in by to the first that it leaves by.
    let mut start = End { x: within.start, slope: 0.0 };
    let mut end = End { x: within.end, slope: 0.0 };
    for Plane { a, b, c } in sides {
        let rest = b * y + c;
        if *a > 0.0 {
            let x = -rest / a;
            if x > start.x {
                start = End { x, slope: -b / a };
            }
        } else if *a < 0.0 {
            let x = -rest / a;
            if x < end.x {
                end = End { x, slope: -b / a };
            }
        } else if rest < 0.0 || rest.is_nan() {
            return None;
        }
    }
    (start.x < end.x).then_some((start, end))
}

/// Ends nearer than this, in pixels, are one: what rounding parts.
const TOUCHING: f64 = 1e-9;

/// Unites the shadows of a line face by face, so that none overlap and there is no end where as much light
/// arrives on both sides.
fn unite(line: &mut Vec<Dark>) {
    if line.len() < 2 {
        return;
    }
    line.sort_unstable_by(|a, b| {
        let key = |dark: &Dark| (dark.face, dark.start.x);
        let ((face, x), (other_face, other_x)) = (key(a), key(b));
        face.cmp(&other_face)
            .then(x.total_cmp(&other_x))
            // The rest makes the order, and so the products below, independent of how casters were
            // found.
            .then(b.end.x.total_cmp(&a.end.x))
            .then(a.through.total_cmp(&b.through))
    });
    // Where all casters are opaque, intervals need only be joined.
    if line.iter().all(|dark| dark.through == 0.0) {
        let mut kept = 0;
        for i in 1..line.len() {
            let next = line[i];
            let last = &mut line[kept];
            if last.face == next.face && next.start.x <= last.end.x + TOUCHING {
                if next.end.x > last.end.x {
                    last.end = next.end;
                }
            } else {
                kept += 1;
                line[kept] = next;
            }
        }
        line.truncate(kept + 1);
        return;
    }
    // Where translucent casters lie over each other their shares multiply.
    let mut all: Vec<Dark> = Vec::new();
    for of_face in line.chunk_by(|a, b| a.face == b.face) {
        let mut ends: Vec<End> = of_face.iter().flat_map(|dark| [dark.start, dark.end]).collect();
        ends.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
        // Between two neighbouring ends no caster begins or ends, and as much light arrives
        // everywhere.
        ends.dedup_by(|a, b| a.x - b.x <= TOUCHING);
        let (mut active, mut next): (Vec<&Dark>, usize) = (Vec::new(), 0);
        for pair in ends.windows(2) {
            let middle = (pair[0].x + pair[1].x) / 2.0;
            while let Some(dark) = of_face.get(next).filter(|dark| dark.start.x <= middle) {
                active.push(dark);
                next += 1;
            }
            active.retain(|dark| middle < dark.end.x);
            let through: f32 = active.iter().map(|dark| dark.through).product();
            let (face, start, end) = (of_face[0].face, pair[0], pair[1]);
            match all.last_mut() {
                _ if through == 1.0 => {}
                Some(last) if (last.face, last.through, last.end) == (face, through, start) => {
                    last.end = end;
                }
                _ => all.push(Dark { face, start, end, through }),
            }
        }
    }
    *line = all;
}
