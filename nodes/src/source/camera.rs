//! The node `Camera`: the engine's camera as a node (\[D], "Rendering condition data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::camera::{self, View};
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::raster::Raster;

/// A camera, perspective or parallel. Distances are in metres, angles in degrees; y is up.
///
/// Example: `Camera(position: (7, 1.8, 13), look_at: (0, 2, 0), field_of_view: 40)`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(transparent)]
pub struct Camera(camera::Camera);

impl Node for Camera {
    type Output = camera::Camera;
    const KIND: &'static str = "Camera";
    const GROUP: &'static str = "source";

    fn check(&self) -> std::result::Result<(), FieldError> {
        // The projection is the same for every raster, so any will do to try it.
        let one = Raster { width: 1, height: 1 };
        View::new(&self.0, one).map_err(|e| FieldError::new("position", e.to_string()))?;
        Ok(())
    }

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), _: &Inputs<'_>) -> Result<camera::Camera> {
        Ok(self.0.clone())
    }
}
