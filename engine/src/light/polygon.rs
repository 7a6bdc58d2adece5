//! Light from surfaces: planar polygons with holes, and closed bodies.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

use super::{Body, Light, Receiver, Sample};
use crate::color::Color;
use crate::error::{Error, Result};
use crate::math;
use crate::polygon::{self, Area, Cone, Corner, area_vector};
use crate::trace::Toward;

/// Planar polygons of 1 cd/m2, diffuse: Lambert's law (\[N], "area sources" and "polyhedral sources").
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Surface {
    polygons: Vec<Polygon>,
    /// Whether they shine to both sides.
    two_sided: bool,
    #[serde(skip)]
    triangles: OnceLock<Triangles>,
    #[serde(skip)]
    hides_itself: OnceLock<bool>,
}

/// A planar polygon with holes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Polygon {
    /// Its corners, counter-clockwise seen from the front, in metres.
    pub outline: Vec<DVec3>,
    /// Its holes, either way round.
    #[serde(default)]
    pub holes: Vec<Vec<DVec3>>,
}

/// The surface in parts of known area.
#[derive(Clone, Debug, Default)]
struct Triangles {
    corners: Vec<[DVec3; 3]>,
    /// Twice the areas of a triangle and all before it.
    sums: Vec<f64>,
}

impl Polygon {
    fn normal(&self) -> DVec3 {
        area_vector(self.outline.iter().copied()).normalize_or_zero()
    }

    /// The corners of all rings, and where those of holes begin.
    fn points(&self) -> (Vec<DVec3>, Vec<u32>) {
        let mut points = self.outline.clone();
        let mut holes = Vec::new();
        for hole in &self.holes {
            holes.push(points.len() as u32);
            points.extend(hole);
        }
        (points, holes)
    }

    /// What is there of it: polygons of which no ring crosses another or itself.
    fn areas(self, normal: DVec3) -> Vec<Polygon> {
        let (points, holes) = self.points();
        let corner = |corner| match corner {
            Corner::Given(at) => points[at as usize],
            Corner::Made(point) => point,
        };
        let ring = |ring: Vec<Corner>| -> Vec<DVec3> { ring.into_iter().map(corner).collect() };
        // None: it already is one area.
        let Some(areas) = polygon::areas(&points, &holes, normal) else { return vec![self] };
        let area = |area: Area| Polygon {
            outline: ring(area.outline),
            holes: area.holes.into_iter().map(ring).collect(),
        };
        areas.into_iter().map(area).collect()
    }

    /// The outline and the holes, with whether each runs counter-clockwise.
    fn rings(&self) -> impl Iterator<Item = (&[DVec3], f64)> {
        let normal = self.normal();
        let holes = self.holes.iter().map(move |hole| {
            let turns = area_vector(hole.iter().copied()).dot(normal);
            (&hole[..], if turns > 0.0 { -1.0 } else { 1.0 })
        });
        std::iter::once((&self.outline[..], 1.0)).chain(holes)
    }

    fn triangles(&self) -> Vec<[DVec3; 3]> {
        let (points, holes) = self.points();
        let corner = |corner| match corner {
            Corner::Given(at) => points[at as usize],
            Corner::Made(point) => point,
        };
        let triangles = polygon::triangles(&points, &holes, self.normal()).into_iter();
        triangles.map(|triangle| triangle.map(corner)).collect()
    }
}

impl Surface {
    /// A source of polygons, each of which shines where it is: inside its outline by the even-odd rule, outside
    /// of its holes.
    ///
    /// # Errors
    /// If a polygon has fewer than three corners, no area, a corner that is not finite or lies off its
    /// plane, or holes that leave nothing of it.
    pub fn new(polygons: Vec<Polygon>, two_sided: bool) -> Result<Surface> {
        let count = polygons.len();
        let mut areas = Vec::new();
        for (at, polygon) in polygons.into_iter().enumerate() {
            let which = if count == 1 { String::new() } else { format!("face {at}: ") };
            let rings = || std::iter::once(&polygon.outline).chain(&polygon.holes);
            if rings().any(|ring| ring.len() < 3) {
                return Err(Error::invalid(format!("{which}an outline has fewer than 3 corners")));
            }
            if !rings().flatten().all(|p| math::is_within_reach(*p)) {
                let reach = math::REACH;
                let message = format!("{which}a corner is not finite, or lies beyond {reach:e} m");
                return Err(Error::invalid(message));
            }
            let low = polygon.outline.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
            let high = polygon.outline.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
            let reach = (high - low).length();
            let Some(normal) = polygon::plane_normal(polygon.outline.iter().copied()) else {
                return Err(Error::invalid(format!("{which}the outline has no area")));
            };
            let origin = polygon.outline[0];
            let off = rings().flatten().map(|p| (*p - origin).dot(normal).abs());
            if off.fold(0.0, f64::max) > 1e-3 * reach {
                return Err(Error::invalid(format!("{which}the corners are not in one plane")));
            }
            // Rings that cross would be counted with the wrong sign, or twice.
            let left = polygon.areas(normal);
            if left.is_empty() {
                return Err(Error::invalid(format!("{which}the holes leave nothing of it")));
            }
            areas.extend(left);
        }
        if areas.is_empty() {
            return Err(Error::invalid("it has no faces"));
        }
        let (triangles, hides_itself) = (OnceLock::new(), OnceLock::new());
        Ok(Surface { polygons: areas, two_sided, triangles, hides_itself })
    }

    /// The surface of a closed body.
    ///
    /// # Errors
    /// As [`Surface::new`], or if an edge has not two faces that run it in opposite directions, or the
    /// faces look inwards.
    pub fn of_body(polygons: Vec<Polygon>) -> Result<Surface> {
        let rings = polygons.iter().map(|polygon| polygon.outline.iter().copied());
        let volume = polygon::volume(rings).ok_or_else(|| {
            Error::invalid(
                "the body is not closed: every edge belongs to two faces that run it in opposite directions",
            )
        })?;
        let surface = Surface::new(polygons, false)?;
        if volume <= 0.0 {
            return Err(Error::invalid(
                "the faces look inwards: they run counter-clockwise seen from outside",
            ));
        }
        Ok(surface)
    }

    /// The polygons.
    pub fn polygons(&self) -> &[Polygon] {
        &self.polygons
    }

    /// Whether they shine to both sides.
    pub fn is_two_sided(&self) -> bool {
        self.two_sided
    }

    /// All of it in triangles that face the front.
    fn triangles(&self) -> &Triangles {
        self.triangles.get_or_init(|| {
            let mut all = Triangles::default();
            let mut sum = 0.0;
            for [a, b, c] in self.polygons.iter().flat_map(Polygon::triangles) {
                sum += (b - a).cross(c - a).length();
                all.corners.push([a, b, c]);
                all.sums.push(sum);
            }
            all
        })
    }

    /// Whether a part of it may stand before another: some corner lies before the front of some face.
    fn hides_itself(&self) -> bool {
        *self.hides_itself.get_or_init(|| {
            let corners = || self.polygons.iter().flat_map(|polygon| &polygon.outline);
            let low = corners().fold(DVec3::INFINITY, |low, p| low.min(*p));
            let high = corners().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
            // Corners of the face itself lie on its plane only up to rounding.
            let slack = (high - low).length() * 1e-9;
            self.polygons.iter().any(|polygon| {
                let (normal, origin) = (polygon.normal(), polygon.outline[0]);
                corners().any(|corner| (*corner - origin).dot(normal) > slack)
            })
        })
    }

    /// The triangles that are turned to a receiver.
    fn seen(&self, at: &Receiver) -> impl Iterator<Item = &[DVec3; 3]> + Clone {
        let (position, two_sided) = (at.position, self.two_sided);
        self.triangles().corners.iter().filter(move |corners| {
            let way = position - corners[0];
            let front = way.dot(area_vector(corners.iter().copied()).normalize_or_zero());
            // Seen edge-on a triangle gives nothing, but its sign would be noise.
            front.abs() > 1e-9 * way.length() && (front > 0.0 || two_sided)
        })
    }

    /// Whether the surface itself stands between a receiver and a point of a triangle of it.
    fn is_hidden(&self, at: &Receiver, point: DVec3, own: &[DVec3; 3]) -> bool {
        let way = point - at.position;
        self.seen(at).filter(|corners| *corners != own).any(|corners| {
            let seen = corners.map(|corner| corner - at.position);
            // On which side of the way each edge passes: all on one side means through the
            // triangle.
            let turns = [0, 1, 2].map(|i| way.dot(seen[i].cross(seen[(i + 1) % 3])));
            let normal = (seen[1] - seen[0]).cross(seen[2] - seen[0]);
            let t = normal.dot(seen[0]) / normal.dot(way);
            let is_within = turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0);
            // The point lies on the surface too, at 1.
            is_within && t > 0.0 && t < 1.0 - 1e-9
        })
    }
}

/// The irradiance that a ring of unit luminance gives, signed by the way round that it is seen (Lambert
/// 1760): half the sum over its edges of the angle that the edge takes, times the cosine between the
/// receiver's normal and that of the edge's plane through the receiver.
pub(super) fn ring(ring: &[DVec3], at: &Receiver) -> f64 {
    // First the part above the receiver's horizon is kept: Lambert's sum holds for that alone.
    let height = |p: DVec3| at.normal.dot(p);
    let mut above: Vec<DVec3> = Vec::with_capacity(ring.len() + 2);
    let relative = |p: &DVec3| *p - at.position;
    let Some(mut last) = ring.last().map(relative) else { return 0.0 };
    for point in ring.iter().map(relative) {
        let (from, to) = (height(last), height(point));
        // The signs differ, so the divisor is not 0.
        if (from > 0.0) != (to > 0.0) {
            above.push(last + (point - last) * (from / (from - to)));
        }
        if to > 0.0 {
            above.push(point);
        }
        last = point;
    }
    let Some(mut last) = above.last().copied() else { return 0.0 };
    let mut sum = 0.0;
    for point in above {
        let across = last.cross(point);
        let sine = across.length();
        if sine > 0.0 {
            // Not by an arc cosine, which loses half of the digits of small angles.
            sum += math::atan2(sine, last.dot(point)) * at.normal.dot(across) / sine;
        }
        last = point;
    }
    sum / 2.0
}

#[typetag::serde(name = "Surface")]
impl Light for Surface {
    fn toward(&self) -> Option<Toward> {
        None
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        if self.hides_itself() {
            let facets = self.facets(at).unwrap_or_default().into_iter();
            return Color::grey(facets.map(|facet| ring(&facet, at).abs()).sum::<f64>() as f32);
        }
        let lux = self.polygons.iter().map(|polygon| {
            let way = at.position - polygon.outline[0];
            let front = way.dot(polygon.normal());
            // In its own plane it is seen edge-on, whatever rounding says.
            if front.abs() <= 1e-9 * way.length() || (front < 0.0 && !self.two_sided) {
                return 0.0;
            }
            // Seen from the front, an outline runs counter-clockwise: against the receiver's sense.
            let rings = polygon.rings().map(|(points, sign)| sign * ring(points, at));
            (-rings.sum::<f64>() * front.signum()).max(0.0)
        });
        Color::grey(lux.sum::<f64>() as f32)
    }

    fn facets(&self, at: &Receiver) -> Option<Vec<Vec<DVec3>>> {
        let relative = |corners: &[DVec3; 3]| corners.map(|corner| corner - at.position).to_vec();
        if !self.hides_itself() {
            return Some(self.seen(at).map(|corners| corners.to_vec()).collect());
        }
        let mut all = Vec::new();
        let mut cone = Cone::default();
        for own in self.seen(at) {
            // Each facet is what is left of a triangle behind the cones of all others.
            let mut parts = vec![relative(own)];
            for before in self.seen(at).filter(|before| *before != own) {
                let normal = area_vector(before.iter().copied());
                if !cone.behind(normal, relative(before).into_iter()) {
                    continue;
                }
                // From the end: what is cut off goes to the end, and is outside of this cone.
                for i in (0..parts.len()).rev() {
                    if cone.meets(&parts[i]) {
                        let part = parts.swap_remove(i);
                        cone.cut(part, |left| parts.push(left));
                    }
                }
            }
            let placed = |part: Vec<DVec3>| part.into_iter().map(|point| point + at.position);
            all.extend(parts.into_iter().map(|part| placed(part).collect::<Vec<_>>()));
        }
        Some(all)
    }

    fn of_facet(&self, points: &[DVec3], at: &Receiver) -> Color {
        Color::grey(ring(points, at).abs() as f32)
    }

    fn body(&self, _: f64) -> Option<Body> {
        let (polygons, two_sided) = (self.polygons.clone(), self.two_sided);
        Some(Body { polygons, luminance: 1.0, two_sided, casts: true })
    }

    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample {
        let Triangles { corners, sums } = self.triangles();
        let total = sums.last().copied().unwrap_or(0.0);
        let wanted = choice.x * total;
        let which = sums.partition_point(|sum| *sum <= wanted).min(sums.len().saturating_sub(1));
        let Some([a, b, c]) = corners.get(which).copied() else {
            let toward = Toward::Point(at.position);
            return Sample { toward, irradiance: Color::BLACK };
        };
        let before = if which == 0 { 0.0 } else { sums[which - 1] };
        // The place within the triangle: the rest of one number, and the other.
        // The root makes places equally likely by area: a triangle widens away from its corner.
        let s = ((wanted - before) / (sums[which] - before)).clamp(0.0, 1.0).sqrt();
        let point = a + (b - a) * (s * (1.0 - choice.y)) + (c - a) * (s * choice.y);
        let way = point - at.position;
        let distance = way.length();
        let direction = way / distance;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let leaves = -normal.dot(direction);
        let leaves = if self.two_sided { leaves.abs() } else { leaves.max(0.0) };
        let lux = total / 2.0 * leaves * at.normal.dot(direction).max(0.0) / distance / distance;
        let is_hidden = || self.hides_itself() && self.is_hidden(at, point, &[a, b, c]);
        let lux = if lux.is_finite() && lux > 0.0 && !is_hidden() { lux as f32 } else { 0.0 };
        Sample { toward: Toward::Point(point), irradiance: Color::grey(lux) }
    }
}
