//! Known answers: areas against closed forms, for every rule.

use glam::DVec3;
use spandrel_engine::image::Channel;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::scene::{Face, Mesh, Scene, Seal};
use spandrel_engine::span::SpanImage;
use spandrel_tests::known::{self, Known};
use spandrel_tests::scenes;
use std::collections::BTreeSet;
use std::sync::Arc;

fn image(scene: &Arc<Scene>, rule: Rule, width: u32, height: u32) -> SpanImage {
    let view = scenes::pixel_view(width, height);
    let scenes = &[scene.clone().into()];
    scanline::render(scenes, &view, rule.plan().unwrap(), 0..height).unwrap()
}

/// The area of every face in pixels, by ordinal; the background's last.
fn areas(scene: &Arc<Scene>, rule: Rule, width: u32, height: u32) -> Vec<f64> {
    let image = image(scene, rule, width, height);
    let mut areas = vec![0.0; scene.part_count() as usize + 1];
    for cover in
        known::covers(&image, rule, &Framing::whole(image.view().raster())).iter().flatten()
    {
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

const SLOPES: [f64; 10] = [0.0, 0.1, 0.37, 1.0, 2.0, 5.0, 13.0, 50.0, -0.6, f64::INFINITY];

fn rules(n: u32) -> [Rule; 3] {
    [Rule::Sampled(n, Weighting::Trapezoid), Rule::Sampled(n, Weighting::Box), Rule::Sloped(n)]
}

/// Whether no pixel is off by more than half a strip for each of its edges; and slopes never lose.
fn is_within_half_a_strip(shape: impl Fn((f64, f64)) -> Known, edges: f64) {
    let shapes: Vec<Known> = known::offsets().into_iter().map(shape).collect();
    for n in [1, 3, 4, 8] {
        let [_, sampled, sloped] = rules(n).map(|rule| {
            let errors = known::errors(&shapes, rule);
            let bound = edges * 0.5 / f64::from(n) + 1e-5;
            assert!(errors.most <= bound, "{} {rule:?}: {errors:?}", shapes[0].name);
            errors
        });
        let name = &shapes[0].name;
        assert!(sloped.rmse <= sampled.rmse + 1e-6, "{name} {n}: {sloped:?} {sampled:?}");
    }
}

#[test]
fn a_half_plane_is_covered_as_its_line_says() {
    for slope in SLOPES {
        is_within_half_a_strip(|offset| known::half_plane(slope, offset), 1.0);
    }
}

#[test]
fn slopes_make_steep_edges_and_seams_exact() {
    let exact = |shape: fn((f64, f64)) -> Known| {
        let shapes: Vec<Known> = known::offsets().into_iter().map(shape).collect();
        let errors = known::errors(&shapes, Rule::Sloped(3));
        assert!(errors.most < 1e-4, "{}: {errors:?}", shapes[0].name);
    };
    exact(|offset| known::half_plane(0.37, offset));
    exact(|offset| known::half_plane(-0.6, offset));
    exact(known::crossing_planes);
}

#[test]
fn holes_seals_seams_and_circles_are_where_they_are() {
    is_within_half_a_strip(known::rotated_square, 2.0);
    is_within_half_a_strip(known::hole, 2.0);
    is_within_half_a_strip(known::seal, 2.0);
    is_within_half_a_strip(known::crossing_planes, 1.0);
    // No painter can sort it.
    is_within_half_a_strip(known::three_bars, 2.0);
}

#[test]
fn coverage_sums_to_one_in_every_pixel() {
    for seed in 0..20 {
        let scene = scenes::scene("faces", scenes::random_faces(seed, 40));
        let view = scenes::front_view(31, 19);
        for rule in [Rule::Sampled(3, Weighting::Trapezoid), Rule::Sloped(2), Rule::Sloped(5)] {
            let plan = rule.plan().unwrap();
            let image = scanline::render(&[scene.clone().into()], &view, plan, 0..19).unwrap();
            for row in known::covers(&image, rule, &Framing::whole(image.view().raster())) {
                let mut sums = vec![0.0f64; 31];
                for cover in row {
                    assert!(cover.area > 0.0 && cover.area <= 1.0 + 1e-6);
                    for pixel in cover.start..cover.end {
                        sums[pixel as usize] += f64::from(cover.area);
                    }
                }
                assert!(
                    sums.iter().all(|sum| (sum - 1.0).abs() < 1e-5),
                    "{seed} {rule:?} {sums:?}"
                );
            }
        }
    }
}

/// Areas of the parts of one face, 20 x 20 pixels, by the rule that is nearly exact.
fn parts(face: impl FnOnce(&mut Mesh) -> Face) -> Vec<f64> {
    let mut mesh = Mesh::default();
    let face = face(&mut mesh);
    mesh.add_face(face).unwrap();
    areas(&scenes::scene("face", mesh), Rule::Sloped(64), 20, 20)
}

fn close(found: &[f64], expected: &[f64]) {
    let near = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.2);
    assert!(near, "{found:?} instead of {expected:?}");
}

fn rectangle(x: f64, y: f64, w: f64, h: f64) -> [(f64, f64); 4] {
    [(x, y), (x + w, y), (x + w, y + h), (x, y + h)]
}

fn seal(mesh: &mut Mesh, points: &[(f64, f64)]) -> Seal {
    Seal { outline: add(mesh, points, 0.0), ..Seal::default() }
}

#[test]
fn of_overlapping_seals_the_later_is_seen() {
    let found = parts(|mesh| Face {
        outline: add(mesh, &rectangle(1.0, 1.0, 18.0, 18.0), 0.0),
        seals: vec![
            seal(mesh, &rectangle(2.0, 2.0, 8.0, 8.0)),
            seal(mesh, &rectangle(6.0, 6.0, 8.0, 8.0)),
        ],
        ..Face::default()
    });
    close(&found, &[324.0 - 112.0, 48.0, 64.0]);
}

#[test]
fn a_hole_is_transparent_even_under_a_seal() {
    let found = parts(|mesh| Face {
        outline: add(mesh, &rectangle(1.0, 1.0, 18.0, 18.0), 0.0),
        holes: vec![add(mesh, &rectangle(4.0, 4.0, 4.0, 4.0), 0.0)],
        seals: vec![seal(mesh, &rectangle(2.0, 2.0, 8.0, 8.0))],
        ..Face::default()
    });
    close(&found, &[324.0 - 64.0, 64.0 - 16.0]);
}

#[test]
fn seals_and_holes_are_cut_at_the_outline() {
    let found = parts(|mesh| Face {
        outline: add(mesh, &rectangle(4.0, 4.0, 10.0, 10.0), 0.0),
        holes: vec![add(mesh, &rectangle(12.0, 6.0, 6.0, 2.0), 0.0)],
        seals: vec![seal(mesh, &rectangle(2.0, 10.0, 5.0, 2.0))],
        ..Face::default()
    });
    close(&found, &[100.0 - 4.0 - 6.0, 6.0]);
}

#[test]
fn overlapping_holes_are_one_hole() {
    let found = parts(|mesh| Face {
        outline: add(mesh, &rectangle(1.0, 1.0, 18.0, 18.0), 0.0),
        holes: vec![
            add(mesh, &rectangle(2.0, 2.0, 8.0, 8.0), 0.0),
            add(mesh, &rectangle(6.0, 6.0, 8.0, 8.0), 0.0),
        ],
        ..Face::default()
    });
    close(&found, &[324.0 - 112.0]);
}

#[test]
fn outlines_that_cross_themselves_follow_the_even_odd_rule() {
    let parts = |outline: &[(f64, f64)]| {
        parts(|mesh| Face { outline: add(mesh, outline, 0.0), ..Face::default() })
    };
    // A bow tie whose signed area is zero: two faces, and the background.
    let bow = [(2.0, 2.0), (18.0, 18.0), (18.0, 2.0), (2.0, 18.0)];
    close(&parts(&bow), &[64.0, 64.0, 400.0 - 128.0]);
    // A square run round twice encloses nothing; run round at its corner, a smaller one is cut out.
    let square = rectangle(3.0, 3.0, 9.0, 9.0);
    close(&parts(&[square, square].concat()), &[400.0]);
    close(&parts(&[square, rectangle(3.0, 3.0, 4.0, 4.0)].concat()), &[81.0 - 16.0, 335.0]);
}

#[test]
fn a_seal_has_its_faces_plane_bit_for_bit() {
    let mut mesh = Mesh::default();
    let tilted = |x: f64, y: f64| DVec3::new(x / 3.0, y / 7.0, x * 0.1 + y * 0.3);
    let mut ring = |points: &[(f64, f64)], off: f64| -> Vec<u32> {
        points.iter().map(|(x, y)| mesh.add_point(tilted(*x, *y) + DVec3::Z * off)).collect()
    };
    let outline = ring(&rectangle(-3.0, -4.0, 6.0, 8.0), 0.0);
    // Its own points are off by a little; the plane is the face's all the same.
    let own = ring(&rectangle(-1.0, -1.0, 2.0, 2.0), 1e-9);
    let seals = vec![Seal { outline: own, ..Seal::default() }];
    mesh.add_face(Face { outline, seals, ..Face::default() }).unwrap();
    let scene = scenes::scene("seal", mesh);
    let plan = Rule::Sloped(4).plan().unwrap();
    let view = scenes::front_view(40, 30);
    let table = scanline::setup::face_table(&scene.into(), &view, plan).unwrap();
    let [face, seal] = table.faces() else { panic!("{} entries", table.faces().len()) };
    assert_eq!(face.plane, seal.plane);
    assert!(seal.rank > face.rank);
}

#[test]
fn drawn_edges_have_their_width_at_any_depth() {
    let mut mesh = Mesh::default();
    let outline = add(&mut mesh, &rectangle(4.0, 4.0, 12.0, 12.0), -5.0);
    let edge = Some(spandrel_engine::scene::EdgeStyle { width: 1.0, ..Default::default() });
    mesh.add_face(Face { outline, edge, ..Face::default() }).unwrap();
    let scene = scenes::scene("edges", mesh);
    let found = areas(&scene, Rule::Sloped(64), 20, 20);
    // Half a pixel inside and outside: from 11 x 11 to 13 x 13.
    close(&found, &[121.0, 169.0 - 121.0]);
}

#[test]
fn edges_are_drawn_of_faces_that_no_line_meets() {
    // A sliver between two lines, and a square beside the picture: what is drawn around them reaches into it.
    let drawn = |corners: &[(f64, f64)]| {
        let mut mesh = Mesh::default();
        let outline = add(&mut mesh, corners, -5.0);
        let edge = Some(spandrel_engine::scene::EdgeStyle { width: 4.0, ..Default::default() });
        mesh.add_face(Face { outline, edge, ..Face::default() }).unwrap();
        areas(&scenes::scene("edges", mesh), Rule::Sloped(64), 20, 20)
    };
    close(&drawn(&rectangle(4.0, 8.0, 10.0, 1e-3)), &[0.0, 14.0 * 4.0, 400.0 - 56.0]);
    close(&drawn(&rectangle(21.0, 5.0, 6.0, 6.0)), &[0.0, 10.0, 390.0]);
}

/// All shapes at an offset.
fn shapes(offset: (f64, f64)) -> Vec<Known> {
    let halves = SLOPES.into_iter().map(|slope| known::half_plane(slope, offset));
    let others = [
        known::rotated_square(offset),
        known::hole(offset),
        known::seal(offset),
        known::crossing_planes(offset),
        known::three_bars(offset),
    ];
    halves.chain(others).collect()
}

#[test]
fn exact_is_exact() {
    for offset in known::offsets() {
        for shape in shapes(offset) {
            let errors = known::errors(std::slice::from_ref(&shape), Rule::Exact);
            assert!(errors.most < 1e-5, "{} {errors:?}", shape.name);
        }
    }
}

#[test]
fn adaptive_pixels_are_as_good_as_tolerated() {
    for (n, tolerance) in [(1, 0.05), (4, 0.02), (8, 0.005)] {
        let shapes: Vec<Known> = known::offsets().into_iter().take(5).flat_map(shapes).collect();
        for shape in shapes {
            let errors = known::errors(std::slice::from_ref(&shape), Rule::Adaptive(n, tolerance));
            let sloped = known::errors(std::slice::from_ref(&shape), Rule::Sloped(n));
            let name = format!("{} {n} {tolerance}: {errors:?}, sloped {sloped:?}", shape.name);
            // What is tolerated is an estimate: single pixels may be off by a few times of it.
            assert!(errors.rmse <= tolerance && errors.most <= 4.0 * tolerance, "{name}");
            assert!(errors.rmse <= sloped.rmse + 1e-6, "{name}");
        }
    }
}

#[test]
fn estimates_tell_where_errors_are() {
    let channels = BTreeSet::from([Channel::Error]);
    let (mut squares, mut estimates, mut missed, mut wrong) = (0.0, 0.0, 0u32, 0u32);
    for shape in known::offsets().into_iter().take(8).flat_map(shapes) {
        for n in [1, 4] {
            let rule = Rule::Sloped(n);
            let image = image(&shape.scene, rule, known::SIZE, known::SIZE);
            let framing = Framing::whole(image.view().raster());
            let picture = resolve(&image, rule, &framing, &channels).unwrap();
            let estimate = picture.float("aa_error").unwrap();
            for (error, estimate) in known::worst(&shape, rule).into_iter().zip(estimate) {
                squares += error * error;
                estimates += f64::from(estimate * estimate);
                wrong += u32::from(error > 0.02);
                missed += u32::from(error > 0.02 && f64::from(*estimate) < error / 2.0);
            }
        }
    }
    let ratio = (estimates / squares).sqrt();
    assert!((0.5..2.0).contains(&ratio), "estimates are {ratio} times the errors");
    assert!(missed * 20 < wrong, "{missed} of {wrong} pixels are worse than estimated");
}
