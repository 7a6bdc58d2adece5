//! The node `Isosurface`: surfaces of equal value in a volume (\[D], "Applications").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::text::AnyValue;
use spandrel_engine::volume::surface::{Level, Surface};
use spandrel_engine::volume::{Inside, Volume};
use spandrel_engine::{Error, Result};

/// Makes a scene of the surfaces on which a volume has given values, by tetrahedral cells: densities
/// and orbitals of molecules, bone and skin from scanners, any simulation.
///
/// The surfaces are closed, but for where they leave the grid or are cut, with normals by the
/// field's gradient. Coordinates and lengths here are those of the file. Give each level a material
/// of its own, as scenes have them. `spandrel info FILE --level 0.1` tells area and volume.
///
/// Volumes are overlaid by `DepthMerge` of their images.
///
/// Example: `Isosurface(volume: "ethanol.cube", levels: [(value: 0.1), (value: 0.125)])`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Isosurface {
    /// The volume.
    pub volume: Link<Volume>,
    /// The surfaces, each an object called as its value, such as `0.1`.
    pub levels: Vec<IsoLevel>,
    /// Samples from one vertex of the grid of cells to the next. More than 1 makes fewer triangles.
    /// Less than 1 divides cells, and the field between samples is a cubic spline.
    #[schemars(range(min = 0.0625, max = 64.0), extend("x-draft" = "4"))]
    pub step: f64,
    /// Leaves out triangles, so that no vertex of the whole surface lies further than this from it.
    /// If absent, none.
    pub error: Option<f64>,
    /// Keeps what is in a box: its least and its greatest corner.
    pub within: Option<IsoBox>,
    /// Cuts by planes, such as `[(point: (0, 0, 0), direction: (1, 0, 0))]`. What lies on the side to which the
    /// direction points is gone.
    pub cuts: Vec<IsoCut>,
    /// Whether faces are shaded as one curved surface. If not, each triangle is flat.
    pub smooth: bool,
    /// The scene's name in messages and object names.
    pub name: String,
}

/// A surface of equal value.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IsoLevel {
    /// The value.
    pub value: f64,
    /// Where the inside is: `Above` the value, or `Below` it, as in the negative lobe of an orbital.
    #[serde(default)]
    pub inside: Inside,
    /// How it looks: a material as in scenes, such as `(color: "#d8c9a8", alpha: 0.3, alpha_mode: Blend)`.
    #[serde(default)]
    pub material: Option<AnyValue>,
}

/// A box that is kept.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IsoBox {
    /// Its least corner.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub least: (f64, f64, f64),
    /// Its greatest corner.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub greatest: (f64, f64, f64),
}

/// A plane that cuts.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IsoCut {
    /// A point of it.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub point: (f64, f64, f64),
    /// To what is taken away.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub direction: (f64, f64, f64),
}

impl Default for Isosurface {
    fn default() -> Isosurface {
        Isosurface {
            volume: Link::default(),
            levels: Vec::new(),
            step: 1.0,
            error: None,
            within: None,
            cuts: Vec::new(),
            smooth: true,
            name: "isosurface".to_owned(),
        }
    }
}

impl Isosurface {
    fn surface(&self) -> std::result::Result<Surface, FieldError> {
        let fault = |message: String| FieldError::new("levels", message);
        let levels = self.levels.iter().map(|IsoLevel { value, inside, material }| {
            let text = material.as_ref().map_or("()", AnyValue::text);
            Level::new(*value, *inside, text).map_err(fault)
        });
        Ok(Surface {
            levels: levels.collect::<std::result::Result<_, _>>()?,
            step: self.step,
            error: self.error,
            within: self.within.as_ref().map(|of| [of.least, of.greatest].map(Into::into)),
            cuts: self.cuts.iter().map(|cut| [cut.point, cut.direction].map(Into::into)).collect(),
            smooth: self.smooth,
        })
    }
}

impl Node for Isosurface {
    type Output = Scene;
    const KIND: &'static str = "Isosurface";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] =
        &["MarchingCubes", "MarchingTetrahedra", "Contour", "VolumeToMesh", "Isocontour"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.levels.is_empty() {
            return Err(FieldError::new("levels", "needs at least one, such as [(value: 0.1)]"));
        }
        self.surface()?.check().map_err(|(field, message)| FieldError::new(field, message))
    }

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.volume, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Scene> {
        let surface = self.surface().map_err(|fault| Error::invalid(fault.message))?;
        let scene = surface.scene(&inputs.get(&self.volume), &self.name)?;
        scene.notes.iter().for_each(|note| inputs.warn(note));
        Ok(scene)
    }
}
