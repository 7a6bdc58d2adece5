//! Cards: upright pictures that turn about the vertical to whoever looks at them, the eye, a light or a mirror
//! (\[N], trees from photographs on transparent polygons).

use glam::DVec3;

use super::{Ray, Toward};

/// The sine of the steepest height from which a card is still upright: 60 degrees.
const STEEP: f64 = 0.866_025_403_784_438_6;

/// An upright rectangle that turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Card {
    /// The middle of its lower edge, in metres.
    pub foot: DVec3,
    /// Half of its width, in metres.
    pub half_width: f64,
    /// Its height, in metres.
    pub height: f64,
}

/// How a card stands when it is turned to somebody: its middle, and unit vectors to the right and upwards as it
/// is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    /// Its middle.
    pub middle: DVec3,
    /// To the right.
    pub right: DVec3,
    /// Upwards, or nearly.
    pub up: DVec3,
}

/// The directions of all cards that are turned in one direction: to the right, and upwards or nearly.
#[derive(Clone, Copy, Debug)]
pub(super) struct CardAxes {
    right: DVec3,
    up: DVec3,
}

impl CardAxes {
    /// Of cards turned to where a way leads.
    pub(super) fn toward(way: DVec3) -> CardAxes {
        let way = way.try_normalize().unwrap_or(DVec3::Z);
        let (rise, run) = (way.y.abs(), DVec3::new(way.x, 0.0, way.z).length());
        // From straight above no side is the front one; what looks up from below sees the same card.
        let level = DVec3::Z * way.y.signum();
        let flat = if run > 1e-6 { DVec3::new(way.x, 0.0, way.z) / run } else { level };
        let up = if rise <= STEEP {
            DVec3::Y
        } else {
            // Sine and cosine of what the height has beyond 60 degrees.
            let (sine, cosine) = (rise * 0.5 - run * STEEP, run * 0.5 + rise * STEEP);
            DVec3::Y * cosine - flat * (sine * way.y.signum())
        };
        CardAxes { right: DVec3::Y.cross(flat), up }
    }
}

impl Card {
    /// Its middle, about which it turns.
    pub fn middle(&self) -> DVec3 {
        self.foot + DVec3::Y * (self.height / 2.0)
    }

    /// How it stands, turned to a place or direction. From above 60 degrees, where an upright picture would be
    /// thin, it leans over by as much as that is exceeded; from straight above it faces +z below.
    pub fn turned(&self, toward: Toward) -> Turned {
        let middle = self.middle();
        let CardAxes { right, up } = CardAxes::toward(toward.from(middle).0);
        Turned { middle, right, up }
    }

    /// The way along a ray to where it meets the card, as it stands when it is turned to whom the ray turns cards.
    pub(super) fn meet(&self, ray: &Ray) -> Option<f64> {
        let middle = self.middle();
        let CardAxes { right, up } = match ray.turns() {
            // All cards that are turned in one direction stand alike: found once for a ray.
            Toward::Direction(_) => *ray.level(),
            Toward::Point(light) => CardAxes::toward(light - middle),
        };
        let normal = right.cross(up);
        let t = normal.dot(middle - ray.origin) / normal.dot(ray.direction);
        let place = ray.at(t) - middle;
        let is_on =
            place.dot(right).abs() <= self.half_width && place.dot(up).abs() <= self.height / 2.0;
        (is_on && t > 0.0 && t < ray.reach).then_some(t)
    }

    /// What becomes of its places when it is turned from one to another.
    pub fn turn(&self, from: Toward, to: Toward) -> Turn {
        let (from, to) = (self.turned(from), self.turned(to));
        // Its left stays on the left, whoever looks from behind.
        let sign = if from.right.dot(to.right) < 0.0 { -1.0 } else { 1.0 };
        Turn { from, right: to.right * sign, up: to.up, facing: to.right.cross(to.up) }
    }

    /// The least and the greatest corner of all that it takes, however it is turned.
    pub fn bounds(&self) -> [DVec3; 2] {
        // Leaning, half of its height reaches sideways by sin 30.
        let lean = self.height / 4.0;
        let reach = (self.half_width * self.half_width + lean * lean).sqrt();
        let half = DVec3::new(reach, self.height / 2.0, reach);
        [self.middle() - half, self.middle() + half]
    }

    /// Its corners as it stands turned, from the lower left on, counter-clockwise as they are seen.
    pub fn corners(&self, toward: Toward) -> [DVec3; 4] {
        let Turned { middle, right, up } = self.turned(toward);
        let (side, half) = (right * self.half_width, up * (self.height / 2.0));
        [middle - side - half, middle + side - half, middle + side + half, middle - side + half]
    }
}

/// A card on its way from how it is seen to how it stands to a light. It receives light as it stands to the light,
/// as it casts: a tree is round, and what falls on it is not stretched along a plane that light barely meets.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    from: Turned,
    /// To the right and upwards, afterwards.
    right: DVec3,
    up: DVec3,
    facing: DVec3,
}

impl Turn {
    /// Its plane afterwards: the unit normal to whom it was turned, and its middle.
    pub fn plane(&self) -> (DVec3, DVec3) {
        (self.facing, self.from.middle)
    }

    /// Where a place on it goes.
    pub fn place(&self, point: DVec3) -> DVec3 {
        let Turned { middle, right, up } = self.from;
        let way = point - middle;
        middle + self.right * way.dot(right) + self.up * way.dot(up)
    }

    /// The plane whose places on the card go to those of a plane given by normal and point: normal and point, or on
    /// which side all places are if they are all on one.
    pub fn before(&self, normal: DVec3, point: DVec3) -> Result<(DVec3, DVec3), f64> {
        let Turned { middle, right, up } = self.from;
        let old = right * normal.dot(self.right) + up * normal.dot(self.up);
        let rest = normal.dot(middle - point);
        let square = old.length_squared();
        // The card is level with the plane: less than rounding of its place is no slope.
        if square <= 1e-24 * normal.length_squared() {
            return Err(rest);
        }
        Ok((old, middle - old * (rest / square)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_face_whoever_looks_and_never_grow_thinner_than_at_sixty_degrees() {
        let foot = DVec3::new(3.0, 0.5, -2.0);
        let card = Card { foot, half_width: 1.5, height: 6.0 };
        let [low, high] = card.bounds();
        for i in 0..400 {
            let (a, b) = (f64::from(i) * 0.37, f64::from(i) * 0.0157 - 3.1);
            let (sin, cos) = (crate::math::sin(b), crate::math::cos(b));
            let way = DVec3::new(crate::math::cos(a) * cos, sin, crate::math::sin(a) * cos);
            for toward in [Toward::Direction(way), Toward::Point(card.middle() + way * 9.0)] {
                let Turned { right, up, .. } = card.turned(toward);
                assert!((right.length() - 1.0).abs() < 1e-12 && (up.length() - 1.0).abs() < 1e-12);
                assert!(right.dot(up).abs() < 1e-12 && right.dot(way).abs() < 1e-9);
                let seen = right.cross(up).dot(way);
                assert!(seen >= 0.5 - 1e-9, "{way}: {seen}");
                if way.y.abs() < STEEP {
                    assert_eq!(up, DVec3::Y);
                }
                for corner in card.corners(toward) {
                    assert!(corner.cmpge(low - 1e-9).all() && corner.cmple(high + 1e-9).all());
                }
            }
        }
    }

    #[test]
    fn what_is_on_a_side_of_a_plane_afterwards_was_on_that_of_the_plane_before() {
        let card = Card { foot: DVec3::new(30.0, 1.0, -20.0), half_width: 2.0, height: 5.0 };
        for i in 0..500 {
            let unit = |k: u32| f64::from((i * 7 + k * 131) % 97) / 48.0 - 1.0;
            let way = |k: u32| DVec3::new(unit(k), unit(k + 1), unit(k + 2)).normalize_or(DVec3::X);
            let turn = card.turn(Toward::Direction(way(0)), Toward::Direction(way(3)));
            let Turned { middle, right, up } = turn.from;
            let place = middle + right * unit(6) * 2.0 + up * unit(7) * 2.5;
            let after = turn.place(place);
            assert!(((after - middle).length() - (place - middle).length()).abs() < 1e-9);
            assert!(turn.plane().0.dot(way(3)) > 0.49 && turn.right.dot(right) >= 0.0);
            let (normal, point) = (way(8), middle + way(11) * 3.0);
            let side = normal.dot(after - point);
            let before = match turn.before(normal, point) {
                Ok((normal, point)) => normal.dot(place - point),
                Err(side) => side,
            };
            assert!((side - before).abs() < 1e-9, "{side} {before}");
        }
    }
}
