//! Sets of columns.

use std::ops::{BitAnd, BitOr};

/// A set of a fragment's columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize)]
pub struct Columns(u32);

impl Columns {
    /// No column.
    pub const NONE: Columns = Columns(0);
    /// Every column.
    pub const ALL: Columns = Columns(u32::MAX);
    /// Colour, alpha, and whether lights act on it.
    pub const COLOR: Columns = Columns(1);
    /// The normal.
    pub const NORMAL: Columns = Columns(2);
    /// The position in the world.
    pub const POSITION: Columns = Columns(4);
    /// The depth. Every fragment has one; named by shaders whose result depends on it.
    pub const DEPTH: Columns = Columns(8);

    /// The normal of the face itself.
    pub const FACING: Columns = Columns(16);
    /// How the surface answers light.
    pub const FINISH: Columns = Columns(32);
    /// Everything else in the image: what casts shadows, and is mirrored.
    pub const WORLD: Columns = Columns(64);

    /// What rays show on the surface, if its finish wants any. Places differ then, and everything else in
    /// the image is looked at.
    pub const TRACED: Columns = Columns(128);

    /// The place in the object's own space.
    pub const LOCAL: Columns = Columns(256);
    /// Texture coordinates.
    pub const UV: Columns = Columns(512);
    /// The names of objects.
    pub const NAMES: Columns = Columns(1024);
    /// The names of materials.
    pub const MATERIALS: Columns = Columns(2048);
    /// The share of its pixel that a fragment covers. No column of fragments: what is
    /// [around](super::Batch::coverage) them tells it.
    pub const COVERAGE: Columns = Columns(4096);

    /// What differs from place to place on every face.
    pub const PLACE: Columns = Columns(4 | 8 | 64 | 256 | 512 | 4096);

    /// Whether every column of `other` is in this set.
    pub fn contains(self, other: Columns) -> bool {
        self & other == other
    }

    /// Whether the two sets share a column.
    pub fn meets(self, other: Columns) -> bool {
        self & other != Columns::NONE
    }
}

impl BitOr for Columns {
    type Output = Columns;
    fn bitor(self, other: Columns) -> Columns {
        Columns(self.0 | other.0)
    }
}

impl BitAnd for Columns {
    type Output = Columns;
    fn bitand(self, other: Columns) -> Columns {
        Columns(self.0 & other.0)
    }
}
