//! Programs over fragments, and what they may know beside them.

use std::any::Any;
use std::fmt::Debug;

use super::{Batch, Columns, Fragments, Stage, World};
use crate::color::ValueKind;
use crate::trace::Toward;

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
    fn makes_channels(&self) -> Vec<(String, ValueKind)> {
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

    /// The lights toward which it looks, if all that it sees of its surroundings is what casts shadows of them. `None`,
    /// if what is anywhere may matter.
    fn looks_toward(&self) -> Option<Vec<Toward>> {
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
