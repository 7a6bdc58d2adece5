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
    /// The cells that are wanted; elsewhere the answer is undefined.
    pub cells: Range<u32>,
}

/// Makes an image again on other lines: what is asked where those that it has do not suffice.
///
/// Closures are such makers. A renderer need not be one: [`SpanImage::rendered`] makes one of it.
pub trait Probing: Send + Sync {
    /// The same picture where it is asked for: line k of the result is probe k, ids mean what they mean in the image.
    ///
    /// # Errors
    /// As what made the image.
    fn probed(&self, probes: &Arc<[Probe]>) -> Result<SpanImage>;
}

impl<F: Fn(&Arc<[Probe]>) -> Result<SpanImage> + Send + Sync> Probing for F {
    fn probed(&self, probes: &Arc<[Probe]>) -> Result<SpanImage> {
        self(probes)
    }
}

/// A closure as a maker.
pub(crate) fn probing(
    make: impl Fn(&Arc<[Probe]>) -> Result<SpanImage> + Send + Sync + 'static,
) -> Arc<dyn Probing> {
    Arc::new(make)
}

impl fmt::Debug for dyn Probing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Probing")
    }
}

impl SpanImage {
    /// The same picture where it is asked for: line k of the result is probe k, ids mean what they mean
    /// here. `None` if the image holds nothing but its own lines.
    ///
    /// # Errors
    /// As what made the image.
    pub fn probed(&self, probes: &Arc<[Probe]>) -> Result<Option<SpanImage>> {
        self.probing().map(|maker| maker.probed(probes)).transpose()
    }

    /// `result`, which is `make` of this image, made so again where this one can be.
    pub(super) fn then(
        &self,
        result: SpanImage,
        make: impl Fn(SpanImage) -> Result<SpanImage> + Send + Sync + 'static,
    ) -> SpanImage {
        result.with_probing(
            self.probing().cloned().map(|own| probing(move |probes| make(own.probed(probes)?))),
        )
    }
}
