//! Wire frames: edges as spans with a width, and what is behind faces.

use glam::DVec3;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::Channel;
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::priority::{self, BspTree, Roots};
use spandrel_engine::render::rays::{self, RayOptions};
use spandrel_engine::render::scanline;
use spandrel_engine::scene::face::EdgeStyle;
use spandrel_engine::scene::wire::{HiddenLines, Wire};
use spandrel_engine::scene::{Face, Mesh, Scene, Seal};
use spandrel_engine::span::SpanImage;
use spandrel_tests::{scenes, spans};
use std::sync::Arc;

const PLAN: u32 = 4;

fn view() -> View {
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 10.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(40.0),
        ..Camera::default()
    };
    View::new(&camera, Raster::new(40, 40).unwrap()).unwrap()
}

/// A square of 20 before one of 30, and a seal of 6 on the first; a unit is a pixel.
fn squares() -> Scene {
    let mut mesh = Mesh::default();
    let mut square = |half: f64, z: f64| -> Vec<u32> {
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        corners.map(|(x, y)| mesh.add_point([x, y, z])).to_vec()
    };
    let (front, seal, back) = (square(10.0, 1.0), square(3.0, 1.0), square(15.0, 0.0));
    let inner = square(5.0, -1.0);
    let seal = Seal { outline: seal, ..Seal::default() };
    mesh.add_face(Face { outline: front, seals: vec![seal], ..Face::default() }).unwrap();
    mesh.add_polygon(&back, None).unwrap();
    mesh.add_polygon(&inner, None).unwrap();
    Arc::unwrap_or_clone(scenes::scene("squares", mesh))
}

const EDGE: Color = Color { r: 1.0, g: 0.0, b: 0.0 };
const FILL: Color = Color { r: 0.0, g: 0.0, b: 1.0 };

fn framed(hidden: HiddenLines) -> Arc<Scene> {
    let edge = EdgeStyle { width: 2.0, color: EDGE };
    Arc::new(squares().wire_frame(&Wire { edge, fill: FILL, hidden }).unwrap())
}

fn rendered(scene: &Arc<Scene>) -> SpanImage {
    let plan = LinePlan::new(PLAN, Phase::Centre).unwrap();
    scanline::render(&[scene.clone().into()], &view(), plan, 0..40).unwrap()
}

/// The colour of a pixel on the middle row of a picture, so far right of the middle.
fn at(image: &SpanImage, right: usize) -> [f32; 3] {
    let picture = spans::picture(image, &[Channel::Color]);
    ["R", "G", "B"].map(|name| picture.float(name).unwrap()[20 * 40 + 20 + right])
}

fn close(found: [f32; 3], right: [f32; 3]) {
    let off = found.iter().zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(off < 1e-3, "{found:?}, not {right:?}");
}

#[test]
fn lines_have_their_width_and_hidden_ones_are_left_out_dimmed_or_shown() {
    let (edge, fill) = ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let out = rendered(&framed(HiddenLines::LeftOut));
    // Two pixels wide, half within and half without: the front's edges, the seal's, and those of the square behind where
    // nothing is before them.
    for right in [2, 3, 9, 10, 14, 15] {
        close(at(&out, right), edge);
    }
    // Between lines, and where the inner square's edge is behind.
    for right in [0, 1, 4, 5, 6, 8, 11, 12, 13] {
        close(at(&out, right), fill);
    }
    close(at(&out, 17), [0.0; 3]);
    // Shown: nothing but lines.
    let shown = rendered(&framed(HiddenLines::Shown));
    for right in [2, 3, 4, 5, 9, 10, 14, 15] {
        close(at(&shown, right), edge);
    }
    for right in [0, 7, 12, 17] {
        close(at(&shown, right), [0.0; 3]);
    }
    // Dimmed: two faces are before the inner square's edge. Each takes away 0.6 of what is behind it.
    let dimmed = rendered(&framed(HiddenLines::Dimmed(0.6)));
    let left = 0.4f32 * 0.4;
    for right in [4, 5] {
        close(at(&dimmed, right), [left, 0.0, 1.0 - left]);
    }
    close(at(&dimmed, 9), edge);
    assert!(
        squares()
            .wire_frame(&Wire {
                edge: EdgeStyle::default(),
                fill: FILL,
                hidden: HiddenLines::Dimmed(1.0)
            })
            .is_err()
    );
    let wide = EdgeStyle { width: f32::NAN, color: EDGE };
    assert!(
        squares().wire_frame(&Wire { edge: wide, fill: FILL, hidden: HiddenLines::Shown }).is_err()
    );
}

#[test]
fn all_three_renderers_draw_the_same_lines() {
    for hidden in [HiddenLines::LeftOut, HiddenLines::Dimmed(0.3), HiddenLines::Shown] {
        let scene = framed(hidden);
        let exact = rendered(&scene);
        let plan = LinePlan::new(PLAN, Phase::Centre).unwrap();
        let tree = BspTree::generate(scene.clone(), Roots::Best).unwrap();
        assert!(priority::render(&tree, 0, &view(), plan, 0..40).unwrap() == exact);
        let frame = scanline::frame(&[scene.into()], &view(), plan, 0..40).unwrap();
        assert!(rays::solve(&frame, &RayOptions::default()).unwrap().0 == exact);
    }
}
