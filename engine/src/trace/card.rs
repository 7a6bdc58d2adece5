//! Cards: upright pictures that turn about the vertical to whoever looks at them, the eye, a light or a mirror
//! (\[N], trees from photographs on transparent polygons).

use glam::DVec3;

use super::Toward;

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

impl Card {
    /// Its middle, about which it turns.
    pub fn middle(&self) -> DVec3 {
        self.foot + DVec3::Y * (self.height / 2.0)
    }

    /// How it stands, turned to a place or direction. From above 60 degrees, where an upright picture would be
    /// thin, it leans over by as much as that is exceeded; from straight above it faces +z below.
    pub fn turned(&self, toward: Toward) -> Turned {
        let middle = self.middle();
        let way = toward.from(middle).0.try_normalize().unwrap_or(DVec3::Z);
        let (rise, run) = (way.y.abs(), DVec3::new(way.x, 0.0, way.z).length());
        // From straight above no side is the front one; what looks up from below sees the same card.
        let level = DVec3::Z * way.y.signum();
        let flat = if run > 1e-6 { DVec3::new(way.x, 0.0, way.z) / run } else { level };
        let right = DVec3::Y.cross(flat);
        let up = if rise <= STEEP {
            DVec3::Y
        } else {
            // Sine and cosine of what the height has beyond 60 degrees.
            let (sine, cosine) = (rise * 0.5 - run * STEEP, run * 0.5 + rise * STEEP);
            DVec3::Y * cosine - flat * (sine * way.y.signum())
        };
        Turned { middle, right, up }
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
}
