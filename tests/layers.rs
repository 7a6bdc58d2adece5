//! Translucent faces: known colours, and the order of what lies over each other.

use glam::DVec3;
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::scene::{Face, Mesh, Seal, Sides};
use spandrel_engine::span::SpanImage;
use spandrel_tests::scenes;
use std::collections::BTreeSet;

const RULES: [Rule; 3] =
    [Rule::Sampled(4, Weighting::Trapezoid), Rule::Sampled(4, Weighting::Box), Rule::Sloped(4)];
const PANE: Option<u32> = Some(0);
const TINT: Option<u32> = Some(1);

fn panes() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.materials = vec!["pane".into(), "tint".into()];
    mesh
}

fn add(mesh: &mut Mesh, corners: &[(f64, f64, f64)], front: Option<u32>) -> Vec<u32> {
    let outline: Vec<u32> =
        corners.iter().map(|(x, y, z)| mesh.add_point(DVec3::new(*x, *y, *z))).collect();
    let sides = Sides { front, ..Sides::default() };
    mesh.add_face(Face { outline: outline.clone(), sides, ..Face::default() }).unwrap();
    outline
}

/// A rectangle that faces the viewer.
fn rectangle(mesh: &mut Mesh, x: (f64, f64), y: (f64, f64), z: f64, front: Option<u32>) {
    add(mesh, &[(x.0, y.0, z), (x.1, y.0, z), (x.1, y.1, z), (x.0, y.1, z)], front);
}

fn image(mesh: Mesh, rule: Rule) -> SpanImage {
    let clusters = &[scenes::scene("panes", mesh).into()];
    scanline::render(clusters, &scenes::pixel_view(20, 20), rule.plan().unwrap(), 0..20).unwrap()
}

fn picture(image: &SpanImage, rule: Rule) -> Image {
    let framing = Framing::whole(image.view().raster());
    resolve(image, rule, &framing, &BTreeSet::from([Channel::Color, Channel::Z])).unwrap()
}

fn close(found: [f32; 4], expected: [f32; 4], what: &str) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5);
    assert!(near, "{what}: {found:?} instead of {expected:?}");
}

#[test]
fn panes_over_a_wall_blend_from_front_to_back() {
    for rule in RULES {
        let mut mesh = panes();
        rectangle(&mut mesh, (0.0, 20.0), (0.0, 20.0), 0.0, None);
        rectangle(&mut mesh, (0.0, 10.0), (0.0, 20.0), 1.0, PANE);
        rectangle(&mut mesh, (5.0, 15.0), (0.0, 20.0), 2.0, TINT);
        // Behind the wall: not seen at all.
        rectangle(&mut mesh, (0.0, 20.0), (0.0, 20.0), -1.0, PANE);
        let image = image(mesh, rule);
        let picture = picture(&image, rule);
        let pane = [0.4 + 0.4, 0.1 + 0.4, 0.05 + 0.4, 1.0];
        let tint = [0.025 + 0.6, 0.075 + 0.6, 0.225 + 0.6, 1.0];
        let both = [0.025 + 0.75 * pane[0], 0.075 + 0.75 * pane[1], 0.225 + 0.75 * pane[2], 1.0];
        close(picture.rgba(2, 9), pane, "the pane");
        close(picture.rgba(7, 9), both, "both");
        close(picture.rgba(12, 9), tint, "the tint");
        close(picture.rgba(17, 9), [0.8, 0.8, 0.8, 1.0], "the wall");
        assert!(image.layers().items().len() <= 2 * image.layers().range().len());
    }
}

#[test]
fn a_pane_before_nothing_is_half_there() {
    for rule in RULES {
        let mut mesh = panes();
        rectangle(&mut mesh, (4.5, 15.0), (0.0, 20.0), 0.0, PANE);
        let picture = picture(&image(mesh, rule), rule);
        close(picture.rgba(10, 10), [0.4, 0.1, 0.05, 0.5], "the middle");
        close(picture.rgba(4, 10), [0.2, 0.05, 0.025, 0.25], "the edge");
        close(picture.rgba(2, 10), [0.0; 4], "beside");
        // Half of it shines through: it has no depth to speak of.
        assert!(picture.float("Z").unwrap()[10 * 20 + 2].is_infinite());
    }
}

#[test]
fn panes_that_cross_change_order_where_they_meet() {
    // The tint rises to the right through the pane at x = 10.
    let mut mesh = panes();
    rectangle(&mut mesh, (0.0, 20.0), (0.0, 20.0), 0.0, PANE);
    let rising = [(0.0, 0.0, -5.0), (20.0, 0.0, 5.0), (20.0, 20.0, 5.0), (0.0, 20.0, -5.0)];
    add(&mut mesh, &rising, TINT);
    let over = |front: [f32; 3], a: f32, back: [f32; 3], b: f32| {
        let mix = |i: usize| front[i] * a + back[i] * b * (1.0 - a);
        [mix(0), mix(1), mix(2), a + b * (1.0 - a)]
    };
    let (red, blue) = ([0.8, 0.2, 0.1], [0.1, 0.3, 0.9]);
    for rule in RULES {
        let picture = picture(&image(mesh.clone(), rule), rule);
        close(picture.rgba(9, 10), over(red, 0.5, blue, 0.25), "left");
        close(picture.rgba(10, 10), over(blue, 0.25, red, 0.5), "right");
    }
}

#[test]
fn a_pane_that_goes_into_a_wall_ends_at_its_seam() {
    let mut mesh = panes();
    rectangle(&mut mesh, (0.0, 20.0), (0.0, 20.0), 0.0, None);
    // It enters the wall along x = 10.5 + 0.25 (y - 10).
    let depth = |x: f64, y: f64| (10.5 + 0.25 * (y - 10.0) - x) * 0.3;
    let corner = |x: f64, y: f64| (x, y, depth(x, y));
    let corners = [corner(0.0, 0.0), corner(20.0, 0.0), corner(20.0, 20.0), corner(0.0, 20.0)];
    add(&mut mesh, &corners, PANE);
    let rule = Rule::Sloped(4);
    let picture = picture(&image(mesh, rule), rule);
    for row in 0..20u32 {
        let middle = 10.5 + 0.25 * (20.0 - (f64::from(row) + 0.5) - 10.0);
        // The wall's blue is 0.8, the pane over it 0.45.
        let seen: f64 = (0..20).map(|x| f64::from((0.8 - picture.rgba(x, row)[2]) / 0.35)).sum();
        assert!((seen - middle).abs() < 1e-4, "row {row}: {seen} {middle}");
    }
}

#[test]
fn a_seal_of_glass_lets_its_wall_through_and_a_solid_one_stops_the_pane() {
    let wall_with = |wall: Option<u32>, seal: Option<u32>| {
        let mut mesh = panes();
        let at = |mesh: &mut Mesh, low: f64, high: f64| -> Vec<u32> {
            [(low, low), (high, low), (high, high), (low, high)]
                .map(|(x, y)| mesh.add_point(DVec3::new(x, y, 0.0)))
                .to_vec()
        };
        let outline = at(&mut mesh, 0.0, 20.0);
        let sides = |front| Sides { front, ..Sides::default() };
        let seal = Seal { outline: at(&mut mesh, 5.0, 15.0), sides: sides(seal), edge: None };
        mesh.add_face(Face { outline, seals: vec![seal], sides: sides(wall), ..Face::default() })
            .unwrap();
        mesh
    };
    for rule in RULES {
        let glass = picture(&image(wall_with(None, PANE), rule), rule);
        close(glass.rgba(10, 10), [0.8, 0.5, 0.45, 1.0], "glass on a wall");
        let solid = picture(&image(wall_with(PANE, None), rule), rule);
        close(solid.rgba(10, 10), [0.8, 0.8, 0.8, 1.0], "solid on glass");
        close(solid.rgba(2, 10), [0.4, 0.1, 0.05, 0.5], "the glass");
    }
}

#[test]
fn opaque_pictures_hold_no_layers() {
    let mesh = scenes::random_faces(5, 30);
    assert!(image(mesh, RULES[0]).layers().items().is_empty());
}
