//! A renderer that answers for any line: round marks that face the camera.
//!
//! A disc that is parallel to the picture is a circle there, so the segment that it covers on a line of any height is a
//! square root. As the renderer is asked again wherever `Adaptive` and `Exact` divide a pixel, the discs are round at
//! any scale.

use glam::{DAffine3, DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::sync::Arc;

/// A mark.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Where its middle is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub centre: DVec3,
    /// Its radius in metres.
    #[schemars(range(min = 0.0))]
    pub radius: f64,
    /// Its colour.
    pub color: Color,
}

/// Renders round marks that face the camera.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Discs {
    /// The camera.
    pub camera: Link<Camera>,
    /// The marks.
    pub discs: Vec<Disc>,
}

impl Node for Discs {
    type Output = SpanImage;
    const KIND: &'static str = "Discs";
    const GROUP: &'static str = "studio";

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.camera, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let view = View::new(&inputs.get(&self.camera), wanted.raster)?;
        let mut writer = SpanWriter::new(view.clone(), wanted.plan, wanted.rows.clone());
        let mut circles = Vec::new();
        for (ordinal, disc) in (0..).zip(&self.discs) {
            let eye = view.eye_from_object(&DAffine3::IDENTITY).transform_point3(disc.centre);
            let middle = view.project(eye);
            if middle.w <= 0.0 {
                continue; // It is behind the camera.
            }
            let depth = middle.r / middle.w;
            let head = FaceHead {
                ordinal,
                plane: Plane::constant(depth),
                rank: 0,
                role: Role::Face,
                sees_front: true,
                is_translucent: false,
            };
            let face = writer.face(head, &[])?;
            let middle = DVec2::new(middle.x, middle.y) / middle.w;
            let radius = disc.radius / view.pixel_width(view.distance(depth)).0;
            circles.push(Circle { face, middle, radius });
        }
        let surfaces = Arc::new(Marks(self.discs.clone()));
        writer.render("discs", Key::of(&self.discs), surfaces, Circles(circles))
    }
}

/// A disc in the picture, in pixels.
struct Circle {
    face: FaceId,
    middle: DVec2,
    radius: f64,
}

struct Circles(Vec<Circle>);

impl LineRenderer for Circles {
    fn line(&self, _: &SpanImage, y: f64, found: &mut Candidates<'_>) -> Result<()> {
        for Circle { face, middle, radius } in &self.0 {
            let half = (radius * radius - (y - middle.y).powi(2)).max(0.0).sqrt();
            found.add(*face, middle.x - half..middle.x + half)?;
        }
        Ok(())
    }
}

#[derive(Debug)]
struct Marks(Vec<Disc>);

impl Surfaces for Marks {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        if wanted.contains(Columns::COLOR) {
            let color = |ordinal: &u32| self.0[*ordinal as usize].color;
            fragments.color = fragments.ordinal.iter().map(color).collect();
            fragments.unlit = vec![true; fragments.len()];
        }
    }

    fn varying(&self, _: u32) -> Columns {
        Columns::NONE
    }

    fn object(&self, ordinal: u32) -> String {
        format!("disc {ordinal}")
    }
}
