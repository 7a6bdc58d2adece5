//! The node `ReadVolume`: numbers on a grid, from a file (\[D], "Applications").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{InFile, Inputs, Node, Upstream};
use spandrel_engine::scene::document::Axis;
use spandrel_engine::volume::Volume;

/// Reads a volume: NRRD (`.nrrd`, `.nhdr`) or a Gaussian cube (`.cube`). `Isosurface` makes surfaces of
/// it.
///
/// A link to a volume may name the file directly. This node is for files that need options.
/// `spandrel info FILE` tells what is in a volume.
///
/// Example: `ReadVolume(file: "orbitals.cube", component: 2, unit: 0.1)`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ReadVolume {
    /// The file.
    pub file: InFile,
    /// Where each point has several values, which is taken, from 0 on: orbitals, or components of vectors. If
    /// absent, the first.
    pub component: Option<u32>,
    /// Metres per unit of the file. If absent, what the file says of its unit, or 0.001 where it says nothing
    /// (NRRD); a bohr is shown as a metre (cube).
    pub unit: Option<f64>,
    /// The axis that points up. If absent, z for NRRD and y for cubes.
    pub up: Option<Axis>,
}

impl Node for ReadVolume {
    type Output = Volume;
    const KIND: &'static str = "ReadVolume";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] = &["Volume", "VolumeReader", "Nrrd", "Cube"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.unit.is_some_and(|unit| !(unit > 0.0 && unit.is_finite())) {
            let what = "is metres per unit of the file: a number above 0";
            return Err(FieldError::new("unit", what));
        }
        Ok(())
    }

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Volume> {
        let mut volume = Volume::read(&self.file.under(inputs.directory()), self.component)?;
        volume.unit = self.unit.unwrap_or(volume.unit);
        volume.up = self.up.unwrap_or(volume.up);
        volume.notes.iter().for_each(|note| inputs.warn(note));
        Ok(volume)
    }
}
