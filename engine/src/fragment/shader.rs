//! Programs over fragments, and what they may know beside them.

use std::any::Any;
use std::fmt::Debug;
use std::sync::Arc;
use std::time::Instant;

use super::{Columns, Fragments, Painted, Stage, World};
use crate::color::Kind;
use crate::key::Key;
use crate::trace::{Reductions, Toward};

/// A program over fragments: one entry of a source's shading stack.
///
/// A shader is what it is saved as: two that are saved alike shade alike, and a span file holds it in this
/// form, under the name of its type. One that holds large data is saved as where to find it.
#[typetag::serde]
pub trait Shader: Any + Send + Sync + Debug {
    /// The columns that it reads.
    fn reads(&self) -> Columns;

    /// The columns that it changes, if it knows: what others [keep](Batch::keep) of fragments stays true while
    /// only columns change that they do not read.
    fn changes(&self) -> Columns {
        Columns::ALL
    }

    /// What it does to how much surfaces hide. If nothing lets more be seen, what is hidden behind many layers is not
    /// shaded at all.
    fn hiding(&self) -> Hiding {
        Hiding::Changes
    }

    /// The names of the [layers](Fragments::layers) that it makes.
    fn layers(&self) -> Vec<String> {
        Vec::new()
    }

    /// The [channels](Fragments::channels) that it makes, by name.
    fn makes_channels(&self) -> Vec<(String, Kind)> {
        Vec::new()
    }

    /// The names of the channels that a shader before it must have made.
    fn reads_channels(&self) -> Vec<String> {
        Vec::new()
    }

    /// The illuminance in lux under which a white surface shows 1, if it is the one that lights them.
    fn white(&self) -> Option<f32> {
        None
    }

    /// Changes the fragments' columns. Every column in [`reads`](Shader::reads), and the colour, is
    /// filled.
    fn shade(&self, fragments: &mut Fragments<'_>, around: &Around<'_>);
}

impl dyn Shader {
    /// Whether it is a shader of a type.
    pub fn is<T: Shader>(&self) -> bool {
        (self as &dyn Any).is::<T>()
    }
}

/// What a shader does to how much surfaces hide of what lies behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Hiding {
    /// They hide as much as before.
    Keeps,
    /// They hide as much or more: what let all through may be seen.
    Raises,
    /// They may hide more or less.
    Changes,
}

/// What a shader may know beside its fragments.
#[derive(Clone, Copy)]
pub struct Around<'a> {
    /// Everything that was in the image when the shader was applied; there if it reads
    /// [`Columns::WORLD`] or [`Columns::TRACED`].
    pub world: Option<&'a World>,
    /// The stack of the fragments' source.
    pub stack: &'a [Stage],
    /// The shader's place in it.
    pub at: usize,
    /// Where the fragments are.
    pub batch: &'a dyn Batch,
}

impl Around<'_> {
    /// What was done to the fragments' source before, if it changed more than colours.
    pub fn changes_before(&self) -> impl Iterator<Item = &Stage> {
        self.stack[..self.at].iter().filter(|stage| match stage {
            Stage::Shade(shading) => shading.shader().changes() != Columns::COLOR,
            Stage::Place(_) | Stage::Kept(_) => true,
        })
    }
}

/// Something kept from one picture to the next.
pub type Kept = Arc<dyn Any + Send + Sync>;

/// A place in the stream where fragments stand: what is kept of them, and what only the lines around them
/// tell.
pub trait Batch {
    /// What was kept under a key, of these very fragments.
    fn kept(&self, _key: Key) -> Option<Kept> {
        None
    }

    /// Keeps something of these fragments that took some seconds to make, as long as there is room.
    fn keep(&self, _key: Key, _value: Kept, _bytes: usize, _seconds: f64) {}

    /// Whether nobody waits for the fragments any more: what is made of them then is thrown away.
    fn is_stopped(&self) -> bool {
        false
    }

    /// What is known already of what pictures show of these fragments: of all on which pictures lie, or nothing.
    fn painted(&self) -> &[Painted] {
        &[]
    }

    /// By fragment, how much of the area that it covers is lit by a source at one place: exact along lines.
    /// `None` if there are no lines around the fragments.
    fn lit(&self, _casting: &Casting<'_>) -> Option<Vec<f32>> {
        None
    }

    /// Counts what was done, by a name that people read.
    fn count(&self, _what: &'static str, _number: u64) {}

    /// The share of its pixel that a fragment covers, 0 to 1.
    fn coverage(&self, _fragment: usize) -> f32 {
        1.0
    }

    /// What a fragment covers of the screen: pieces of lines, in pixels of the raster. Empty if it is but
    /// its point.
    fn pieces(&self, _fragment: usize) -> Vec<Piece> {
        Vec::new()
    }
}

impl dyn Batch + '_ {
    /// What was kept under a key, of these very fragments, or else is made now and kept: the value and its bytes.
    pub fn or_made<T: Any + Send + Sync>(
        &self,
        key: Key,
        make: impl FnOnce() -> (T, usize),
    ) -> Arc<T> {
        if let Some(known) = self.kept(key).and_then(|kept| kept.downcast().ok()) {
            return known;
        }
        let clock = Instant::now();
        let (made, bytes) = make();
        let made = Arc::new(made);
        self.keep(key, made.clone() as Kept, bytes, clock.elapsed().as_secs_f64());
        made
    }
}

/// Light from one place, and what stands in its way.
#[derive(Clone, Copy, Debug)]
pub struct Casting<'a> {
    /// Where it comes from.
    pub from: Toward,
    /// What casts shadows.
    pub world: &'a World,
    /// What is left out of the search.
    pub less: Reductions,
}

/// A piece of a line that shows a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Its ends, from the left.
    pub x: [f64; 2],
    /// The strip that it stands for, from the top.
    pub y: [f64; 2],
}

/// Fragments that stand nowhere in particular.
pub struct Anywhere;

impl Batch for Anywhere {}
