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
        assert!(
            (areas[0] - wall).abs() < half_strip * 2.0 * (15.4 + 4.0 + 5.0),
            "{rule:?}: {areas:?}"
        );
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
            let image = visible::render(&[scene.clone().into()], &view, plan, 0..19).unwrap();
            for row in covers(&image, rule) {
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
    // A bow tie whose signed area is zero.
    let bow = [(2.0, 2.0), (18.0, 18.0), (18.0, 2.0), (2.0, 18.0)];
    close(&parts(|mesh| Face { outline: add(mesh, &bow, 0.0), ..Face::default() }), &[128.0]);
    // A square run round twice encloses nothing; a pentagram not its middle.
    let square = rectangle(3.0, 3.0, 9.0, 9.0);
    let twice = [square, square].concat();
    close(&parts(|mesh| Face { outline: add(mesh, &twice, 0.0), ..Face::default() }), &[0.0]);
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
    let table = visible::setup::face_table(&scene.into(), &view, plan).unwrap();
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
fn three_bars_in_a_circle_are_solved_where_no_painter_can() {
    // Each lies over the next at one end and under it at the other.
    let mut polygons = Vec::new();
    for i in 0..3 {
        let turn = |p: (f64, f64), z: f64| {
            let a = f64::from(i) * std::f64::consts::TAU / 3.0;
            let (s, c) = (spandrel_engine::math::sin(a), spandrel_engine::math::cos(a));
            DVec3::new(10.0 + p.0 * c - p.1 * s, 10.0 + p.0 * s + p.1 * c, z)
        };
        polygons.push(vec![
            turn((-8.0, -4.5), 1.0),
            turn((8.0, -4.5), -1.0),
            turn((8.0, -2.5), -1.0),
            turn((-8.0, -2.5), 1.0),
        ]);
    }
    let scene = scenes::scene("circle", scenes::polygons(&polygons));
    let found = areas(&scene, Rule::Sloped(64), 20, 20);
    // By symmetry all three show the same, and each hides as much as it is hidden.
    assert!((found[0] - found[1]).abs() < 0.02 && (found[1] - found[2]).abs() < 0.02, "{found:?}");
    // Two bars 2 wide meet at 60 degrees three times: rhombi of 4 / sin 60.
    let rhombus = 4.0 / 0.866_025_403_784;
    let seen = 3.0 * 32.0 - 3.0 * rhombus;
    assert!((found[..3].iter().sum::<f64>() - seen).abs() < 0.05, "{found:?} {seen}");
}

#[test]
fn a_half_plane_is_covered_as_its_line_says() {
    for slope in [0.0, 0.1, 0.37, 1.0, 2.0, 5.0, 13.0, 50.0, -0.6, -7.0] {
        // x < 10 + slope (y - 10), far beyond the picture.
        let edge = |y: f64| (10.0 + slope * (y - 10.0), y);
        let (top, bottom) = (edge(40.0), edge(-20.0));
        let corners = [(-900.0, -20.0), bottom, top, (-900.0, 40.0)];
        let scene = scenes::scene("half", scenes::polygons(&[ring(&corners, 0.0)]));
        let image = image(&scene, Rule::Sloped(4), 20, 20);
        for (row, covers) in covers(&image, Rule::Sloped(4)).iter().enumerate() {
            // The mean over the row of the line's x, cut at the picture's sides.
            let y = 20.0 - row as f64;
            let samples = 4000;
            let x = |i: u32| {
                (10.0 + slope * (y - (f64::from(i) + 0.5) / f64::from(samples) - 10.0))
                    .clamp(0.0, 20.0)
            };
            let expected = (0..samples).map(x).sum::<f64>() / f64::from(samples);
            let found: f64 = covers
                .iter()
                .filter(|c| c.face.is_some())
                .map(|c| f64::from(c.area) * f64::from(c.end - c.start))
                .sum();
            // Exact where the line stays in the picture; where it leaves within a strip, the strip
            // knows of it only if its middle line does.
            let within = (0.0..=20.0).contains(&(10.0 + slope * (y - 10.0)))
                && (0.0..=20.0).contains(&(10.0 + slope * (y - 1.0 - 10.0)));
            let bound = if within { 1e-4 } else { slope.abs() / 4.0 };
            assert!(
                (found - expected).abs() <= bound,
                "slope {slope} row {row}: {found} {expected}"
            );
        }
    }
}
