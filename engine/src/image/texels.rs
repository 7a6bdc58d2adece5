//! Pictures as they are mapped on surfaces: their samples as the file has them, whatever they mean.

use std::sync::Arc;

use super::{Coded, Image};

/// A picture's size and samples, row by row from the top.
#[derive(Clone, Debug)]
pub struct Texels {
    /// Columns and rows, at least 1 each.
    pub size: (u32, u32),
    /// Red, green, blue and alpha.
    pub samples: Samples,
}

/// The samples of a picture.
#[derive(Clone, Debug)]
pub enum Samples {
    /// As they are coded.
    Coded(Arc<Coded>),
    /// Scene-linear, alpha associated.
    Linear(Vec<[f32; 4]>),
}

impl Texels {
    /// Coded pixels.
    pub fn coded(coded: impl Into<Arc<Coded>>) -> Texels {
        let coded = coded.into();
        Texels { size: coded.size, samples: Samples::Coded(coded) }
    }

    /// A whole picture in memory.
    pub fn of(image: &Image) -> Texels {
        match image.coded() {
            Some(coded) => Texels::coded(coded.clone()),
            None => Texels { size: image.size, samples: Samples::Linear(image.pixels().collect()) },
        }
    }

    /// All pixels, scene-linear.
    pub fn pixels(&self) -> impl Iterator<Item = [f32; 4]> + '_ {
        let area = self.size.0 as usize * self.size.1 as usize;
        (0..area).map(|at| match &self.samples {
            Samples::Coded(coded) => coded.linear(at),
            Samples::Linear(texels) => texels[at],
        })
    }

    /// The same size with the first samples, shrunk by alpha, for alpha, and white for the colour.
    #[must_use]
    pub fn into_alpha(self) -> Texels {
        let samples = match self.samples {
            Samples::Coded(coded) => Samples::Coded(Arc::new(coded.into_alpha())),
            // Associated: the first is shrunk already.
            Samples::Linear(texels) => {
                Samples::Linear(texels.into_iter().map(|[v, ..]| [v; 4]).collect())
            }
        };
        Texels { size: self.size, samples }
    }
}
