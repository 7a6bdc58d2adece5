//! Patches of visible faces, and the volumes that pieces cast on them.

use glam::DVec3;
use std::ops::Range;

use super::{End, VisiblePart, lies_in, opacity, piece::Way};
use crate::camera::{Plane, View};
use crate::fragment::{Surfaces, stack};
use crate::key::{Key, KeyHasher};
use crate::span::SpanImage;
use crate::trace::{Casters, Shaft, Toward, Turn};

/// A boundary of a volume along a face: inside where it is not negative.
pub(super) type Boundary = Plane;

/// The space between a ball and a light: planes that touch the ball.
pub(super) fn shaft_of_ball(centre: DVec3, radius: f64, from: Toward) -> Shaft {
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
pub(super) struct Patch<'a> {
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
    /// The patch of some spans; `None` if it faces away from the light, lets nothing through, and is dark by itself.
    pub(super) fn new<'a>(
        image: &'a SpanImage,
        spans: &[VisiblePart],
        from: Toward,
    ) -> Option<Patch<'a>> {
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
        // What falls on its back may come through.
        let is_behind = faces_light < 0.0 && source.surfaces.transmits(face.ordinal);
        let (normal, faces_light) = match is_behind {
            true => (-normal, -faces_light),
            false => (normal, faces_light),
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

    /// What it is: all that the shadows on it depend on, beside the view, the light and what casts.
    pub(super) fn key(&self, spans: &[VisiblePart]) -> Key {
        let Patch { depth, moved, plane: (normal, point), turn, .. } = self;
        let mut key = KeyHasher::new("patch");
        let Plane { a, b, c } = depth;
        let face = [a, b, c].into_iter().chain(moved).copied();
        let numbers = face.chain(normal.to_array()).chain(point.to_array());
        let mut bytes = vec![u8::from(turn.is_some())];
        bytes.extend(numbers.flat_map(f64::to_le_bytes));
        for seen in spans {
            bytes.extend_from_slice(&seen.k.to_le_bytes());
            bytes.extend([seen.from, seen.to].into_iter().flat_map(f64::to_le_bytes));
        }
        key.bytes(&bytes);
        key.finish()
    }

    /// The space between it and the light.
    pub(super) fn shaft(&self) -> Shaft {
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
    pub(super) fn corners(&self) -> Option<[DVec3; 4]> {
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
    pub(super) fn volume(
        &self,
        casters: &Casters,
        piece: usize,
        sides: &mut Vec<Boundary>,
    ) -> bool {
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
    pub(super) fn opacity(
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
pub(super) fn interval(sides: &[Boundary], y: f64, within: Range<f64>) -> Option<(End, End)> {
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
