//! Probes: pieces of lines at any height, asked for after an image was made.
//!
//! An image knows how it came to be: a renderer how it solves lines, a merge what it merged, a holdout
//! what holds what. So it can be asked for more lines where those that it has do not suffice, without
//! solving any other place again. What refines pixels asks in this way; images that were written or
//! read line by line hold what they hold and answer nothing.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::SpanImage;
use crate::error::Result;

/// A piece of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Probe {
    /// Its height in pixels from the top of the raster.
    pub y: f64,
    /// Its cells. What an image says of others is not meant.
    pub cells: Range<u32>,
}

/// Makes an image again, on other lines.
#[derive(Clone)]
pub(crate) struct Again(Arc<Make>);

type Make = dyn Fn(&Arc<[Probe]>) -> Result<SpanImage> + Send + Sync;

impl Again {
    pub(crate) fn new(
        make: impl Fn(&Arc<[Probe]>) -> Result<SpanImage> + Send + Sync + 'static,
    ) -> Again {
        Again(Arc::new(make))
    }

    pub(crate) fn make(&self, probes: &Arc<[Probe]>) -> Result<SpanImage> {
        (self.0)(probes)
    }
}

impl fmt::Debug for Again {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Again")
    }
}

impl SpanImage {
    /// The same picture where it is asked for: line k of the result is probe k, ids mean what they mean
    /// here. `None` if the image holds nothing but its own lines.
    ///
    /// # Errors
    /// As what made the image.
    pub fn probed(&self, probes: &Arc<[Probe]>) -> Result<Option<SpanImage>> {
        self.again().map(|again| again.make(probes)).transpose()
    }

    /// `result`, which is `make` of this image, made so again where this one can be.
    pub(super) fn then(
        &self,
        result: SpanImage,
        make: impl Fn(SpanImage) -> Result<SpanImage> + Send + Sync + 'static,
    ) -> SpanImage {
        let again = self.again().cloned();
        result.with_again(again.map(|again| Again::new(move |probes| make(again.make(probes)?))))
    }
}
