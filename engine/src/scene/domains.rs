//! Attribute mapping (\[D], "Attribute mapping"). A surface has *attribute domains*, each with an
//! *attribute index*. A table gives a *bundle*, which is a material, for each index. Indices are
//! never mixed: what a pixel covers of a surface is divided among its domains.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::error::{Error, Result};
use crate::texture::Mapping;

/// Attribute domains of a surface, and the material of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Domains {
    /// Which index is where.
    pub define: Define,
    /// How the canvas of the domains is placed on the surface.
    #[serde(default)]
    pub mapping: Mapping,
    /// The bundle table: materials of the scene by attribute index.
    pub table: BTreeMap<u8, String>,
    /// Their numbers in the scene.
    #[serde(skip)]
    pub(super) numbers: BTreeMap<u8, u32>,
}

/// An attribute-domain definition function, over a canvas from 0 to 1 that repeats as its mapping
/// says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Define {
    /// Tiles, 1, with joints between them, 0, as wide as this share of the canvas.
    Tiled(f64),
    /// Bricks, 1, with joints, 0. The canvas has two courses of one brick; the upper is moved by
    /// half.
    Bricked(f64),
    /// Squares, 0 and 1 by turns, two to a side of the canvas.
    Checker,
    /// A trigger pattern. The indices are the bytes of a grey picture, or the numbers of its
    /// colours if it has a palette.
    Picture(String),
}

impl Domains {
    /// The numbers of the materials in its table.
    pub(super) fn bundles(&self) -> impl Iterator<Item = u32> + '_ {
        self.numbers.values().copied()
    }

    /// Checks numbers and the table.
    ///
    /// # Errors
    /// If a number is out of range, or an index has no bundle.
    pub(super) fn check(&self) -> Result<()> {
        let indices: &[u8] = match &self.define {
            Define::Tiled(joint) | Define::Bricked(joint) => {
                if !(0.0..1.0).contains(joint) {
                    return Err(Error::invalid(format!(
                        "a joint of {joint}: must be 0 to below 1"
                    )));
                }
                &[0, 1]
            }
            Define::Checker => &[0, 1],
            Define::Picture(path) if path.is_empty() => {
                return Err(Error::invalid("the trigger pattern names no file"));
            }
            Define::Picture(_) => &[],
        };
        if let Some(index) = indices.iter().find(|index| !self.table.contains_key(index)) {
            return Err(Error::invalid(format!("the table has no attribute index {index}")));
        }
        if self.table.is_empty() {
            return Err(Error::invalid("the table has 1 to 256 attribute indices"));
        }
        self.mapping.check()
    }
}
