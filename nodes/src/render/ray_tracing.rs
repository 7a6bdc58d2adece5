//! The node `RayTracing`: rays for the whole picture (\[D], "High-quality image display").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::camera::Camera;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::render::rays::{self, Missed, RayOptions};
use spandrel_engine::scene::Scene;
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_engine::values::SpanDemand;

/// More of the picture than this may be missed without a word.
const SAID: f64 = 1e-3;

/// Renders a scene to spans by rays from the eye. Rays only nominate the faces that they meet, and
/// visibility is solved among these: edges are as sharp as those of `Scanline`, and what no ray met
/// is missing. How much that is, is estimated by more rays, and told where it is more than a
/// thousandth of the picture.
///
/// It is slower than `Scanline` and never more exact. Take it to compare with other ray tracers, or
/// with `refine: false` for plain samples. For reflections and refractions take `Trace`, which
/// traces rays from the surfaces that need them, on the spans of any renderer; with it, `Illuminate`
/// and `Fog` behind this node everything is by rays that the paper's ray tracer does.
///
/// Example: `RayTracing(scene: "assets/solids.ron", camera: "eye", rays: 2)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RayTracing {
    /// The scene.
    pub scene: Link<Scene>,
    /// The camera.
    pub camera: Link<Camera>,
    /// Rays through each pixel on every line. The number of lines comes from the node that resolves.
    #[schemars(range(min = 1, max = 64), extend("x-draft" = "1"))]
    pub rays: u32,
    /// Whether visibility is solved among the faces that rays meet. If not, each ray's answer stands
    /// for its share of a line.
    pub refine: bool,
    /// How rays find what they meet; the picture is the same. `Tree`, or voxels that are stepped
    /// through: `Grid(cells: (32, 32, 32))`, or `Grid(size: 2.0)` with voxels of this many metres.
    /// A grid spans the whole scene, or a `window: ((-1, 0, -1), (1, 2, 1))` from corner to corner.
    pub accelerator: Accelerator,
    /// Where this scene coincides with others, the greater priority is seen, as in `Scanline`.
    #[schemars(range(min = -1000, max = 1000))]
    pub priority: i32,
}

impl Default for RayTracing {
    fn default() -> RayTracing {
        let RayOptions { rays, accelerator, refine } = RayOptions::default();
        let (scene, camera) = (Link::default(), Link::default());
        RayTracing { scene, camera, rays, refine, accelerator, priority: 0 }
    }
}

impl Node for RayTracing {
    type Output = SpanImage;
    const KIND: &'static str = "RayTracing";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] = &["RayTracer", "RayCast", "RayTrace", "Raycaster"];

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        upstream.ask(&self.camera, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let (scene, camera) = (inputs.get(&self.scene), inputs.get(&self.camera));
        let RayTracing { rays, refine, accelerator, .. } = *self;
        let options = RayOptions { rays, accelerator, refine };
        wanted.seen(&scene, &camera, self.priority, inputs, |frame| {
            let (image, missed) = rays::solve(frame, &options)?;
            let share = missed.share();
            if missed.missed > 0 && share.end > SAID {
                let Missed { tested, missed } = missed;
                inputs.warn(&format!(
                    "faces that no ray met are seen in {:.2} % of the picture, {:.2} to {:.2} ({missed} of {tested} \
                     other rays met one): give more `rays`, or take `Scanline`",
                    100.0 * missed as f64 / tested as f64,
                    100.0 * share.start,
                    100.0 * share.end
                ));
            }
            Ok(image)
        })
    }
}
