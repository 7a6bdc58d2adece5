//! Laws: sentences of the design that hold for every input.

use glam::DVec2;
use proptest::prelude::*;
use spandrel_engine::raster::{LinePlan, Phase};
use spandrel_engine::resolve::{Channel, Cover, Framing, Rule, Vertical, Weighting, resolve};
use spandrel_engine::span::{FaceId, SpanImage, line};
use spandrel_engine::visible;
use spandrel_tests::known::covers;
use spandrel_tests::scenes;
use std::collections::{BTreeMap, BTreeSet};

fn plan(per_row: u32) -> LinePlan {
    LinePlan::new(per_row, Phase::Centre).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Tiles and plain merging line by line find the same spans and layers, bit for bit.
    #[test]
    fn both_ways_to_solve_visibility_agree(seed in 0u64..1 << 40, count in 1usize..60) {
        let view = scenes::front_view(61, 23);
        let scene = scenes::scene("a", scenes::random_panes(seed, count));
        let fast = visible::render(&[scene.clone().into()], &view, plan(3), 0..23).unwrap();
        let slow = visible::render_by_merging(&[scene.into()], &view, plan(3), 0..23).unwrap();
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
        let together: Vec<visible::Cluster> = clusters.iter().cloned().map(Into::into).collect();
        let together = visible::render(&together, &view, plan(2), 0..17).unwrap();
        let apart: Vec<SpanImage> = clusters
            .iter()
            .rev()
            .map(|scene| visible::render(&[scene.clone().into()], &view, plan(2), 0..17).unwrap())
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
    visible::render(&[scene.into()], &view, rule.plan().unwrap(), 0..30).unwrap()
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
        let image = visible::render(&[scene.clone().into()], &view, plan, 0..30).unwrap();
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
            visible::render(&[scene.clone().into()], &view, rule.plan().unwrap(), 0..30).unwrap();
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
        let image = visible::render(&[cluster], &view, rule.plan().unwrap(), 0..120).unwrap();
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
            visible::render(&[scene.into()], &view, plan, 0..11).unwrap()
        };
        let [a, b, c] = [cluster(0), cluster(1), cluster(2)];
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
