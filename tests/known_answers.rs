//! Known answers: areas against closed forms, for every rule.

use glam::DVec3;
use spandrel_engine::resolve::{Cover, Coverage, Framing, Rule, Weighting};
use spandrel_engine::scene::{Face, Mesh, Scene, Seal};
use spandrel_engine::span::{FaceId, SpanImage};
use spandrel_engine::visible;
use spandrel_tests::scenes;
use std::sync::Arc;

const RULES: [Rule; 3] =
    [Rule::Sampled(8, Weighting::Trapezoid), Rule::Sampled(8, Weighting::Box), Rule::Sloped(8)];

fn image(scene: &Arc<Scene>, rule: Rule, width: u32, height: u32) -> SpanImage {
    let view = scenes::pixel_view(width, height);
    let scenes = &[scene.clone().into()];
    visible::render(scenes, &view, rule.plan().unwrap(), 0..height).unwrap()
}

fn covers(image: &SpanImage, rule: Rule) -> Vec<Vec<Cover>> {
    let framing = Framing::whole(image.view().raster());
    let mut coverage = Coverage::new(image, rule, &framing);
    let rows = framing.rows.clone();
    rows.map(|row| {
        let mut out = Vec::new();
        coverage.row(row, &mut out);
        out
    })
    .collect()
}

/// The area of every face in pixels, by ordinal; the background's last.
fn areas(scene: &Arc<Scene>, rule: Rule, width: u32, height: u32) -> Vec<f64> {
    let image = image(scene, rule, width, height);
    let mut areas = vec![0.0; scene.part_count() as usize + 1];
    for cover in covers(&image, rule).iter().flatten() {
        let at = if cover.face.is_some() {
            image.face(cover.face).1.ordinal as usize
        } else {
            areas.len() - 1
        };
        areas[at] += f64::from(cover.area) * f64::from(cover.end - cover.start);
    }
    areas
}

fn ring(points: &[(f64, f64)], z: f64) -> Vec<DVec3> {
    points.iter().map(|(x, y)| DVec3::new(*x, *y, z)).collect()
}

fn add(mesh: &mut Mesh, points: &[(f64, f64)], z: f64) -> Vec<u32> {
    ring(points, z).iter().map(|p| mesh.add_point(*p)).collect()
}

const SQUARE: [(f64, f64); 4] = [(2.2, 2.3), (17.6, 2.3), (17.6, 17.9), (2.2, 17.9)];

#[test]
fn a_rotated_square_has_its_area() {
    let corners = [(10.0, 1.5), (18.5, 10.0), (10.0, 18.5), (1.5, 10.0)];
    let scene = scenes::scene("square", scenes::polygons(&[ring(&corners, 0.0)]));
    for rule in RULES {
        let areas = areas(&scene, rule, 20, 20);
        assert!((areas[0] - 144.5).abs() < 0.01, "{rule:?}: {}", areas[0]);
        assert!((areas[0] + areas[1] - 400.0).abs() < 1e-3);
    }
}

#[test]
fn a_hole_is_transparent_and_a_seal_is_seen() {
    let mut mesh = Mesh::default();
    let outline = add(&mut mesh, &SQUARE, 0.0);
    let hole = add(&mut mesh, &[(4.0, 4.0), (8.0, 4.0), (8.0, 9.0), (4.0, 9.0)], 0.0);
    let seal = add(&mut mesh, &[(10.0, 5.0), (15.0, 5.0), (12.5, 15.0)], 0.0);
    let seals = vec![Seal { outline: seal, ..Seal::default() }];
    mesh.add_face(Face { outline, holes: vec![hole], seals, ..Face::default() }).unwrap();
    let scene = scenes::scene("wall", mesh);
    for rule in RULES {
        let areas = areas(&scene, rule, 20, 20);
        // Horizontal edges cross no line: each is off by at most half a strip.
        let half_strip = 0.5 / 8.0;
        let wall = 15.4 * 15.6 - 20.0 - 25.0;
        assert!((areas[0] - wall).abs() < half_strip * 2.0 * (15.4 + 4.0 + 5.0), "{rule:?}: {areas:?}");
        assert!((areas[1] - 25.0).abs() < half_strip * 2.0 * 5.0, "{rule:?}: {areas:?}");
    }
}

#[test]
fn two_planes_cross_where_they_meet() {
    // One face flat at z = 0, one rising to the right through it at x = 10 + 0.3 (y - 10).
    let slanted = |x: f64, y: f64| DVec3::new(x, y, x - 10.0 - 0.3 * (y - 10.0));
    let corners = [(-9.0, -9.0), (29.0, -9.0), (29.0, 29.0), (-9.0, 29.0)];
    let rising: Vec<DVec3> = corners.iter().map(|(x, y)| slanted(*x, *y)).collect();
    let scene = scenes::scene("planes", scenes::polygons(&[ring(&corners, 0.0), rising]));
    for rule in RULES {
        let areas = areas(&scene, rule, 20, 20);
        assert!((areas[0] - 200.0).abs() < 1e-3, "{rule:?}: {areas:?}");
        let image = image(&scene, rule, 20, 20);
        // The seam is a straight line: in each pixel its area is exact for the rule that knows slopes.
        if let Rule::Sloped(_) = rule {
            for (row, covers) in covers(&image, rule).iter().enumerate() {
                let middle = 10.0 + 0.3 * (20.0 - (row as f64 + 0.5) - 10.0);
                let left: f64 = covers
                    .iter()
                    .filter(|c| c.face == FaceId(0))
                    .map(|c| f64::from(c.area) * f64::from(c.end - c.start))
                    .sum();
                assert!((left - middle).abs() < 1e-5, "row {row}: {left} {middle}");
            }
        }
    }
}

#[test]
fn coverage_sums_to_one_in_every_pixel() {
    for seed in 0..20 {
        let scene = scenes::scene("faces", scenes::random_faces(seed, 40));
        let view = scenes::front_view(31, 19);
        for rule in [Rule::Sampled(3, Weighting::Trapezoid), Rule::Sloped(2), Rule::Sloped(5)] {
            let plan = rule.plan().unwrap();
            let image =
                visible::render(&[scene.clone().into()], &view, plan, 0..19).unwrap();
            for row in covers(&image, rule) {
                let mut sums = vec![0.0f64; 31];
                for cover in row {
                    assert!(cover.area > 0.0 && cover.area <= 1.0 + 1e-6);
                    for pixel in cover.start..cover.end {
                        sums[pixel as usize] += f64::from(cover.area);
                    }
                }
                assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 1e-5), "{seed} {rule:?} {sums:?}");
            }
        }
    }
}
