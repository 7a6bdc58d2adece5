//! Laws: sentences of the design that hold for every input.

use glam::DVec2;
use proptest::prelude::*;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::image::Channel;
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Cover, Framing, Rule, Vertical, Weighting, resolve};
use spandrel_engine::span::{DepthRange, FaceId, Keep, SpanImage, line};
use spandrel_tests::known::covers;
use spandrel_tests::random::Random;
use spandrel_tests::scenes;
use std::collections::{BTreeMap, BTreeSet};

fn plan(per_row: u32) -> LinePlan {
    LinePlan::new(per_row, Phase::Centre).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Tiles and plain merging line by line find the same spans and layers, bit for bit.
    #[test]
    fn both_ways_to_solve_visibility_agree(
        seed in 0u64..1 << 40, count in 1usize..60, left in 0.0..0.4, below in 0.0..0.4, right in 0.6..1.0, top in 0.6..1.0
    ) {
        let camera = Camera { viewport: [left, below, right, top], ..Camera::default() };
        let view = View::new(&camera, Raster::new(61, 23).unwrap()).unwrap();
        let scene = scenes::scene("a", scenes::random_panes(seed, count));
        let fast = scanline::render(&[scene.clone().into()], &view, plan(3), 0..23).unwrap();
        let slow = scanline::render_by_merging(&[scene.into()], &view, plan(3), 0..23).unwrap();
        prop_assert_eq!(fast.lines(), slow.lines());
        prop_assert_eq!(fast.layers(), slow.layers());
    }

    /// Rendering clusters apart and merging them is rendering them together, bit for bit.
    #[test]
    fn clusters_merge_to_what_they_are_together(seed in 0u64..1 << 40, count in 1usize..30) {
        let view = scenes::front_view(53, 17);
        let clusters: Vec<_> = (0..4)
            .map(|i| scenes::scene(&format!("cluster {i}"), scenes::random_panes(seed + i, count)))
            .collect();
        let together: Vec<scanline::Cluster> = clusters.iter().cloned().map(Into::into).collect();
        let together = scanline::render(&together, &view, plan(2), 0..17).unwrap();
        let apart: Vec<SpanImage> = clusters
            .iter()
            .rev()
            .map(|scene| scanline::render(&[scene.clone().into()], &view, plan(2), 0..17).unwrap())
            .collect();
        let merged = SpanImage::merge(&apart).unwrap();
        prop_assert!(merged == together);
    }
}

const RULES: [Rule; 6] = [
    Rule::Sampled(3, Weighting::Trapezoid),
    Rule::Sampled(4, Weighting::Box),
    Rule::Sloped(3),
    Rule::Sloped(1),
    Rule::Adaptive(2, 0.02),
    Rule::Exact,
];

fn render(seed: u64, rule: Rule) -> SpanImage {
    let view = scenes::front_view(40, 30);
    let scene = scenes::scene("faces", scenes::random_faces(seed, 25));
    scanline::render(&[scene.into()], &view, rule.plan().unwrap(), 0..30).unwrap()
}

/// The area that each face covers in a picture, in pixels.
fn areas(covers: &[Vec<Cover>]) -> BTreeMap<FaceId, f64> {
    let mut areas = BTreeMap::new();
    for cover in covers.iter().flatten() {
        let pixels = f64::from(cover.end - cover.start);
        *areas.entry(cover.face).or_insert(0.0) += f64::from(cover.area) * pixels;
    }
    areas
}

fn assert_close(a: &BTreeMap<FaceId, f64>, b: &BTreeMap<FaceId, f64>, bound: f64) {
    for face in a.keys().chain(b.keys()) {
        let at = |areas: &BTreeMap<FaceId, f64>| areas.get(face).copied().unwrap_or(0.0);
        assert!((at(a) - at(b)).abs() < bound, "{face:?}: {} {}", at(a), at(b));
    }
}

#[test]
fn a_pictures_mean_is_its_spans_mean() {
    for seed in 0..12 {
        let rule = Rule::Sampled(4, Weighting::Box);
        let image = render(seed, rule);
        let raster = image.view().raster();
        let mut lengths: BTreeMap<FaceId, f64> = BTreeMap::new();
        for k in image.lines().range() {
            for (range, face) in line::segments(image.lines().line(k), raster.cells()) {
                *lengths.entry(face).or_insert(0.0) +=
                    (raster.pixels(range.end) - raster.pixels(range.start)) / 4.0;
            }
        }
        assert_close(&areas(&covers(&image, rule, &Framing::whole(raster))), &lengths, 1e-3);
    }
}

#[test]
fn scaling_keeps_every_faces_share() {
    // Adaptive pixels are others at other scales.
    let rules = RULES.into_iter().filter(|rule| rule.tolerance().is_none_or(|t| t == 0.0));
    for seed in 0..6 {
        for rule in rules.clone() {
            let image = render(seed, rule);
            let raster = image.view().raster();
            let once = areas(&covers(&image, rule, &Framing::whole(raster)));
            for (x, y) in [(0.5, 0.5), (2.0, 3.0), (0.1, 4.0), (7.0, 1.0)] {
                let framing = Framing::scaled(raster, DVec2::new(x, y)).unwrap();
                let mut scaled = areas(&covers(&image, rule, &framing));
                scaled.values_mut().for_each(|area| *area /= x * y);
                assert_close(&once, &scaled, 1e-3);
            }
        }
    }
}

#[test]
fn whole_pixels_of_pan_move_the_picture() {
    let channels = BTreeSet::from([Channel::Color]);
    for rule in RULES {
        for vertical in [Vertical::Whole, Vertical::Fractions] {
            let image = render(3, rule);
            let raster = image.view().raster();
            for scale in [1.0, 1.5] {
                let still =
                    Framing { vertical, ..Framing::scaled(raster, DVec2::splat(scale)).unwrap() };
                let moved = Framing { pan: DVec2::new(3.0, -2.0), ..still.clone() };
                let (a, b) = (
                    resolve(&image, rule, &still, &channels).unwrap(),
                    resolve(&image, rule, &moved, &channels).unwrap(),
                );
                for y in 2..a.window.height {
                    for x in 0..a.window.width - 3 {
                        let (p, q) = (a.rgba(x, y), b.rgba(x + 3, y - 2));
                        assert!(
                            p.iter().zip(q).all(|(p, q)| (p - q).abs() < 1e-5),
                            "{rule:?} {x} {y}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn a_flat_face_stays_flat_at_every_scale() {
    let far = 1000.0;
    let corners = [(-far, -far), (far, -far), (far, far), (-far, far)];
    let square = corners.iter().map(|(x, y)| glam::DVec3::new(*x, *y, 0.0)).collect();
    let scene = scenes::scene("flat", scenes::polygons(&[square]));
    let view = scenes::front_view(40, 30);
    for rule in RULES {
        let plan = rule.plan().unwrap();
        let image = scanline::render(&[scene.clone().into()], &view, plan, 0..30).unwrap();
        for vertical in [Vertical::Whole, Vertical::Fractions] {
            for scale in [0.1, 0.8, 1.2, 2.5, 7.0] {
                let framing = Framing {
                    vertical,
                    ..Framing::scaled(view.raster(), DVec2::new(scale, scale)).unwrap()
                };
                let channels = BTreeSet::from([Channel::Color]);
                let picture = resolve(&image, rule, &framing, &channels).unwrap();
                let first = picture.rgba(0, 0);
                assert!(first[3] == 1.0, "{rule:?} {scale}: alpha {}", first[3]);
                for name in ["R", "A"] {
                    let same = picture
                        .float(name)
                        .unwrap()
                        .iter()
                        .all(|v| *v == first[if name == "R" { 0 } else { 3 }]);
                    assert!(same, "{rule:?} {vertical:?} {scale}: {name} is not flat");
                }
            }
        }
    }
}

#[test]
fn rules_converge_at_their_order() {
    // A disc of 96 sides: straight edges of every slope.
    let disc: Vec<glam::DVec3> = (0..96)
        .map(|i| {
            let a = f64::from(i) / 96.0 * std::f64::consts::TAU;
            glam::DVec3::new(
                20.1 + 12.3 * spandrel_engine::math::cos(a),
                15.2 + 12.3 * spandrel_engine::math::sin(a),
                0.0,
            )
        })
        .collect();
    let scene = scenes::scene("disc", scenes::polygons(&[disc]));
    let view = scenes::pixel_view(40, 30);
    let alpha = |rule: Rule| {
        let image =
            scanline::render(&[scene.clone().into()], &view, rule.plan().unwrap(), 0..30).unwrap();
        let framing = Framing::whole(view.raster());
        let picture = resolve(&image, rule, &framing, &BTreeSet::from([Channel::Color])).unwrap();
        picture.float("A").unwrap().to_vec()
    };
    let truth = alpha(Rule::Sloped(512));
    let error = |rule: Rule| {
        let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
        (alpha(rule).iter().zip(&truth).map(square).sum::<f64>() / truth.len() as f64).sqrt()
    };
    let falls = |rule: fn(u32) -> Rule| {
        let (coarse, fine) = (error(rule(4)), error(rule(32)));
        // Eight times the lines: an order of 1.2 or better.
        assert!(coarse > fine * 12.1, "{:?}: {coarse} to {fine}", rule(4));
    };
    falls(|n| Rule::Sampled(n, Weighting::Trapezoid));
    falls(|n| Rule::Sampled(n, Weighting::Box));
    falls(Rule::Sloped);
    // Its edges are shorter than a row: slopes gain little, and must lose nothing.
    assert!(error(Rule::Sloped(4)) < error(Rule::Sampled(4, Weighting::Box)));
}

#[test]
fn slopes_pay_where_edges_are_long() {
    let view = spandrel_tests::town::view(160, 120);
    let town = spandrel_tests::town::clusters(600, 1);
    let picture = |rule: Rule| {
        let cluster = town[0].clone().into();
        let image = scanline::render(&[cluster], &view, rule.plan().unwrap(), 0..120).unwrap();
        let channels = BTreeSet::from([Channel::Color]);
        resolve(&image, rule, &Framing::whole(view.raster()), &channels).unwrap()
    };
    let truth = picture(Rule::Sampled(256, Weighting::Box));
    let error = |rule: Rule| {
        let (a, b) = (picture(rule), &truth);
        let square = |name| {
            let pairs = a.float(name).unwrap().iter().zip(b.float(name).unwrap());
            pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>()
        };
        (["R", "G", "B"].map(square).iter().sum::<f64>() / (3.0 * 160.0 * 120.0)).sqrt()
    };
    for n in [1, 2, 4, 8] {
        let (sloped, boxed) = (error(Rule::Sloped(n)), error(Rule::Sampled(n, Weighting::Box)));
        assert!(sloped < 0.8 * boxed, "n = {n}: {sloped}, {boxed}");
    }
}

#[test]
fn slopes_leave_every_face_the_area_that_lines_give_it() {
    // Where an edge leans to is gained above as much as lost below: whatever crosses, fades or is flattened,
    // each face has the area that the same lines without slopes give it.
    for seed in 0..12 {
        for n in [1, 3, 8] {
            let rule = Rule::Sloped(n);
            let image = render(seed, rule);
            let whole = Framing::whole(image.view().raster());
            let inside = |rule: Rule| {
                // What leans out of the picture at its sides is lost.
                let mut rows = covers(&image, rule, &whole);
                rows.iter_mut().for_each(|row| row.retain(|c| c.face.is_some()));
                areas(&rows)
            };
            let (sloped, sampled) = (inside(rule), inside(Rule::Sampled(n, Weighting::Box)));
            let touches_sides = |face: &FaceId| {
                let lines = image.lines();
                let cells = image.view().raster().cells();
                lines.range().any(|k| {
                    let segments = line::segments(lines.line(k), cells);
                    segments.filter(|(_, f)| f == face).any(|(range, _)| {
                        let near = cells / 20;
                        range.start < near || range.end > cells - near
                    })
                })
            };
            for (face, area) in &sampled {
                let found = sloped.get(face).copied().unwrap_or(0.0);
                if !touches_sides(face) {
                    assert!((found - area).abs() < 1e-4, "{seed} {n} {face:?}: {found} {area}");
                }
            }
        }
    }
}

#[test]
fn slivers_are_nearer_to_the_truth_with_slopes() {
    // Pictures full of slivers that lean, cross and end in each other's way.
    let mut random = Random::new(5);
    for count in [40, 400, 1000] {
        let sliver = |i| {
            let (x, y) = (random.between(0.0, 32.0), random.between(0.0, 24.0));
            let angle = random.between(0.0, std::f64::consts::TAU);
            let (s, c) = (spandrel_engine::math::sin(angle), spandrel_engine::math::cos(angle));
            let (length, width) = (random.between(0.5, 12.0), random.between(0.001, 0.3));
            let at = |u: f64, v: f64| {
                glam::DVec3::new(x + u * c - v * s, y + u * s + v * c, f64::from(i) * 0.01)
            };
            vec![at(0.0, 0.0), at(length, 0.0), at(length * 0.9, width)]
        };
        let polygons: Vec<Vec<glam::DVec3>> = (0..count).map(sliver).collect();
        let scene = scenes::scene("slivers", scenes::polygons(&polygons));
        let view = scenes::pixel_view(32, 24);
        let alpha = |rule: Rule| {
            let plan = rule.plan().unwrap();
            let image = scanline::render(&[scene.clone().into()], &view, plan, 0..24).unwrap();
            let framing = Framing::whole(view.raster());
            let channels = BTreeSet::from([Channel::Color]);
            resolve(&image, rule, &framing, &channels).unwrap().float("A").unwrap().to_vec()
        };
        let truth = alpha(Rule::Exact);
        let error = |rule: Rule| {
            let square = |(a, b): (&f32, &f32)| f64::from(a - b).powi(2);
            alpha(rule).iter().zip(&truth).map(square).sum::<f64>()
        };
        for n in [1, 2, 4, 8] {
            let (sloped, sampled) =
                (error(Rule::Sloped(n)), error(Rule::Sampled(n, Weighting::Box)));
            assert!(sloped < sampled, "{count} slivers, {n} lines: {sloped} and {sampled}");
        }
    }
}

#[test]
fn a_declared_priority_decides_what_is_meant_to_coincide() {
    // Two walls that should be one, the second farther by less than the step of a priority, 2^-24 of the
    // distance; and one that is farther by more.
    let wall = |z: f64| {
        let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
        let ring = corners.map(|(x, y)| glam::DVec3::new(x, y, z + 0.01 * x)).to_vec();
        scenes::scene(&format!("wall {z}"), scenes::polygons(&[ring]))
    };
    let parallel = scenes::pixel_view(20, 15);
    for view in [scenes::front_view(20, 15), parallel] {
        let distance = if view.is_parallel() { 1000.0 } else { 10.0 };
        let step = distance / f64::from(1 << 24);
        let render = |scene: &std::sync::Arc<spandrel_engine::scene::Scene>, priority| {
            let cluster = scanline::Cluster { priority, ..scene.clone().into() };
            scanline::render(&[cluster], &view, plan(2), 0..15).unwrap()
        };
        // By label, the share of the picture that each of two images shows of their merge.
        let seen = |a: &SpanImage, b: &SpanImage| {
            let both = SpanImage::merge(&[a.clone(), b.clone()]).unwrap();
            let other = SpanImage::merge(&[b.clone(), a.clone()]).unwrap();
            assert!(both == other, "in any order");
            let mut labels = BTreeSet::new();
            for span in both.lines().items().iter().filter(|span| span.face.is_some()) {
                labels.insert(both.face(span.face).0.label.clone());
            }
            labels.into_iter().collect::<Vec<_>>().join(" and ")
        };
        let (front, back) = (wall(0.0), wall(-0.3 * step));
        let far = wall(-40.0 * step);
        assert_eq!(seen(&render(&front, 0), &render(&back, 0)), front.label);
        assert_eq!(seen(&render(&front, 0), &render(&back, 1)), back.label);
        assert_eq!(seen(&render(&front, 2), &render(&back, 1)), front.label);
        assert_eq!(seen(&render(&front, -1), &render(&back, 0)), back.label);
        assert_eq!(seen(&render(&front, 0), &render(&far, 20)), front.label);
        assert_eq!(seen(&render(&front, 0), &render(&far, 60)), far.label);
        // Outlines stay where they are.
        assert_eq!(render(&front, 0).lines(), render(&front, 60).lines());
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let clusters: Vec<SpanImage> =
                (0..3).map(|seed| render(seed, Rule::Sloped(3))).collect();
            // Equal labels and different contents: three sources.
            let merged = SpanImage::merge(&clusters).unwrap();
            let framing = Framing::whole(merged.view().raster());
            let all =
                BTreeSet::from([Channel::Color, Channel::Z, Channel::N, Channel::P, Channel::Id]);
            (resolve(&merged, Rule::Sloped(3), &framing, &all).unwrap(), merged)
        })
    };
    let (one, spans) = with(1);
    for threads in [2, 3, 8] {
        let (other, others) = with(threads);
        assert!(spans == others, "{threads} threads");
        for (name, samples) in one.channels() {
            // Normals and ids of background are 0, its distance infinite: no NaN, so equality holds.
            assert!(other.channel(name) == Some(samples), "{name} with {threads} threads");
        }
    }
}

#[test]
fn merging_is_associative_commutative_and_idempotent() {
    for seed in 0..40 {
        let view = scenes::front_view(37, 11);
        let plan = plan(2);
        let cluster = |i: u64| {
            // Shared faces among the clusters: many coincide.
            let scene =
                scenes::scene(&format!("cluster {i}"), scenes::random_panes(seed * 3 + i / 2, 12));
            scanline::render(&[scene.into()], &view, plan, 0..11).unwrap()
        };
        let [a, b, c] = [cluster(0), cluster(1), cluster(2)];
        // What was cut, held or moved before it is merged is merged as all else.
        let depth = Some(view.depth(9.0));
        let [a, b, c] = match seed % 4 {
            0 => [
                a.held(&c, Keep::Outside).unwrap(),
                b.sliced(DepthRange { front: depth, back: None }),
                c.moved(1.25, 2, 0..11).unwrap(),
            ],
            1 => [
                a.held(&b, Keep::Inside).unwrap(),
                b.with_depths(1.5, 0.01).unwrap(),
                c.sliced(DepthRange { front: None, back: depth }).held(&a, Keep::Outside).unwrap(),
            ],
            _ => [a, b, c],
        };
        let merge = |images: &[&SpanImage]| {
            SpanImage::merge(&images.iter().map(|image| (*image).clone()).collect::<Vec<_>>())
                .unwrap()
        };
        let all = merge(&[&a, &b, &c]);
        for other in [
            merge(&[&c, &b, &a]),
            merge(&[&b, &a, &c]),
            merge(&[&merge(&[&a, &b]), &c]),
            merge(&[&a, &merge(&[&b, &c])]),
            merge(&[&all, &all]),
            merge(&[&all, &a]),
            merge(&[&SpanImage::empty(view.clone(), plan, 0..11), &all]),
        ] {
            assert!(all == other, "seed {seed}");
        }
    }
}
