//! A renderer: spheres, solved analytically into spans. \[N] composites images that come from different
//! programs; this is one.
//!
//! On every line a sphere covers one segment, whose ends are the roots of a quadratic. Its depth is not
//! affine, so the segment is divided into pieces, each with a face whose depth joins the ends of the
//! piece. Normals are those of the sphere.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::sync::Arc;

/// Pieces of a segment.
const PIECES: u32 = 32;

/// A ball.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Where its middle is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub centre: DVec3,
    /// Its radius in metres.
    #[schemars(range(min = 0.0))]
    pub radius: f64,
    /// Its colour.
    pub color: Color,
}

/// Renders spheres that are round at any distance.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Spheres {
    /// The camera.
    pub camera: Link<Camera>,
    /// The spheres.
    pub balls: Vec<Ball>,
}

impl Node for Spheres {
    type Output = SpanImage;
    const KIND: &'static str = "Spheres";
    const GROUP: &'static str = "studio";

    fn check(&self) -> std::result::Result<(), FieldError> {
        match self.balls.iter().find(|ball| ball.radius <= 0.0) {
            Some(ball) => Err(FieldError::new("balls", format!("a radius of {}", ball.radius))),
            None => Ok(()),
        }
    }

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.camera, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let view = View::new(&inputs.get(&self.camera), wanted.raster)?;
        let mut writer = SpanWriter::new(view.clone(), wanted.plan, wanted.rows.clone());
        // Faces are numbered alike whatever rows are asked for.
        let per_ball = (wanted.raster.height * wanted.plan.per_row + 1) * PIECES;
        for (b, ball) in self.balls.iter().enumerate() {
            for line in writer.lines() {
                let y = wanted.plan.y(line);
                let Some((left, right)) = extent(&view, ball, y) else { continue };
                for piece in 0..PIECES {
                    // Shorter towards the ends, where the ball turns away.
                    let at = |i: u32| {
                        let turn =
                            math::cos(f64::from(i) / f64::from(PIECES) * std::f64::consts::PI);
                        left + (right - left) * (1.0 - turn) / 2.0
                    };
                    let (x0, x1) = (at(piece), at(piece + 1));
                    let (d0, d1) = (depth(&view, ball, x0, y), depth(&view, ball, x1, y));
                    let a = (d1 - d0) / (x1 - x0);
                    let head = FaceHead {
                        ordinal: b as u32 * per_ball + line * PIECES + piece,
                        plane: Plane { a, b: 0.0, c: d0 - a * x0 },
                        rank: 0,
                        role: Role::Face,
                        sees_front: true,
                        is_translucent: false,
                    };
                    let face = writer.face(head, &[])?;
                    writer.segment(line, x0..x1, face)?;
                }
            }
        }
        let surfaces = BallSurfaces { balls: self.balls.clone(), per_ball };
        writer.finish("spheres", Key::of(&self.balls), Arc::new(surfaces))
    }
}

/// The ray through a point of the screen: a point on it, and its direction.
fn ray(view: &View, x: f64, y: f64) -> (DVec3, DVec3) {
    let (near, far) =
        (view.world_point(x, y, view.depth(1.0)), view.world_point(x, y, view.depth(2.0)));
    (near, far - near)
}

/// The quadratic whose roots are where a ray meets a ball: t^2 + 2 b t + c, t in the ray's own length.
fn quadratic(view: &View, ball: &Ball, x: f64, y: f64) -> (f64, f64, f64) {
    let (origin, along) = ray(view, x, y);
    let length = along.length();
    let from = origin - ball.centre;
    let b = from.dot(along / length);
    (b, from.length_squared() - ball.radius * ball.radius, length)
}

fn meets(view: &View, ball: &Ball, x: f64, y: f64) -> bool {
    let (b, c, length) = quadratic(view, ball, x, y);
    // The far root must lie before the eye, which is one unit before the ray's origin.
    b * b >= c && -b + (b * b - c).sqrt() > -length
}

/// The segment that a ball covers on a line, in pixels, by bisection from inside.
fn extent(view: &View, ball: &Ball, y: f64) -> Option<(f64, f64)> {
    let width = f64::from(view.raster().width);
    let steps = 256;
    let at = |i: i32| width * (f64::from(i) / f64::from(steps) * 1.5 - 0.25);
    let inside = (0..=steps).map(at).find(|x| meets(view, ball, *x, y)).or_else(|| {
        // Small ones fall between the steps: look where the middle is.
        let eye = view.eye_from_object(&glam::DAffine3::IDENTITY).transform_point3(ball.centre);
        let p = view.project(eye);
        Some(p.x / p.w).filter(|x| p.w > 0.0 && meets(view, ball, *x, y))
    })?;
    let edge = |mut outside: f64| {
        let mut inside = inside;
        for _ in 0..60 {
            let middle = (inside + outside) / 2.0;
            if meets(view, ball, middle, y) { inside = middle } else { outside = middle }
        }
        inside
    };
    Some((edge(-width), edge(2.0 * width)))
}

/// The depth of a ball's near side at a point of the screen.
fn depth(view: &View, ball: &Ball, x: f64, y: f64) -> f64 {
    let (b, c, length) = quadratic(view, ball, x, y);
    let t = -b - (b * b - c).max(0.0).sqrt();
    view.depth(1.0 + t / length)
}

#[derive(Debug)]
struct BallSurfaces {
    balls: Vec<Ball>,
    per_ball: u32,
}

impl Surfaces for BallSurfaces {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        for i in 0..fragments.len() {
            let ball = &self.balls[(fragments.ordinal[i] / self.per_ball) as usize];
            if wanted.contains(Columns::COLOR) {
                fragments.color.push(ball.color);
                fragments.unlit.push(false);
            }
            if wanted.contains(Columns::NORMAL) {
                let (x, y) = (fragments.x[i], fragments.y[i]);
                let rho = depth(fragments.view, ball, x, y);
                let point = fragments.view.world_point(x, y, rho);
                fragments.normal.push((point - ball.centre).normalize_or_zero().as_vec3());
            }
        }
    }

    fn varying(&self, _: u32) -> Columns {
        Columns::NORMAL
    }

    fn object(&self, ordinal: u32) -> String {
        format!("ball {}", ordinal / self.per_ball)
    }
}
