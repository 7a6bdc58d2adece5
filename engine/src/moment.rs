//! Moments of a film.

use serde::{Deserialize, Serialize};

/// A moment of a film: a frame, or between two.
///
/// ```
/// use spandrel_engine::moment::Moment;
///
/// let moment = Moment { frame: 36.0, rate: 24.0 };
/// assert_eq!(moment.seconds(), 1.5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// The frame; with a fraction where a shutter is open between two.
    pub frame: f64,
    /// Frames of a second.
    pub rate: f64,
}

impl Moment {
    /// Frames of a second, if nobody says how many.
    pub const RATE: f64 = 24.0;

    /// A frame at the usual rate.
    pub fn of_frame(frame: f64) -> Moment {
        Moment { frame, rate: Moment::RATE }
    }

    /// The time in seconds: frame 0 is at 0.
    pub fn seconds(self) -> f64 {
        self.frame / self.rate
    }

    /// The moment some frames later.
    #[must_use]
    pub fn later(self, frames: f64) -> Moment {
        Moment { frame: self.frame + frames, ..self }
    }
}

impl Default for Moment {
    /// The first frame at the usual rate.
    fn default() -> Moment {
        Moment::of_frame(1.0)
    }
}
