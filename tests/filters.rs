//! Pixel filters against brute force: small squares weighed by formulas of the filters' authors.

use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, PixelFilter, Rule, Weighting};
use spandrel_tests::known::{self, Known, SIZE};
use spandrel_tests::scenes;

/// Small squares to a pixel's side.
const FINE: i32 = 24;

const FILTERS: [PixelFilter; 5] = [
    PixelFilter::Box,
    PixelFilter::Tent,
    PixelFilter::Gaussian,
    PixelFilter::Mitchell,
    PixelFilter::Lanczos,
];

/// A filter's value at `t` pixels from the centre, up to a factor.
fn value(filter: PixelFilter, t: f64) -> f64 {
    use spandrel_engine::math;
    use std::f64::consts::PI;
    let t = t.abs();
    match filter {
        PixelFilter::Box => f64::from(t < 0.5),
        PixelFilter::Tent => (1.0 - t).max(0.0),
        PixelFilter::Gaussian => (math::exp(-t * t / 0.5) - math::exp(-2.25 / 0.5)).max(0.0),
        // Mitchell and Netravali 1988, eq. 8.
        PixelFilter::Mitchell => {
            let (b, c) = (1.0 / 3.0, 1.0 / 3.0);
            if t < 1.0 {
                (12.0 - 9.0 * b - 6.0 * c) * t.powi(3)
                    + (-18.0 + 12.0 * b + 6.0 * c) * t.powi(2)
                    + (6.0 - 2.0 * b)
            } else if t < 2.0 {
                (-b - 6.0 * c) * t.powi(3)
                    + (6.0 * b + 30.0 * c) * t.powi(2)
                    + (-12.0 * b - 48.0 * c) * t
                    + (8.0 * b + 24.0 * c)
            } else {
                0.0
            }
        }
        PixelFilter::Lanczos => {
            let sinc = |x: f64| if x == 0.0 { 1.0 } else { math::sin(PI * x) / (PI * x) };
            if t < 3.0 { sinc(t) * sinc(t / 3.0) } else { 0.0 }
        }
    }
}

/// The share of a shape in a pixel, square by square.
fn truth(shape: &Known, filter: PixelFilter, (x, y): (f64, f64)) -> f64 {
    let side = 1.0 / f64::from(FINE);
    let reach = 3 * FINE;
    let at = |i: i32| (f64::from(i) + 0.5) * side;
    let (mut sum, mut total) = (0.0, 0.0);
    for j in -reach..reach {
        for i in -reach..reach {
            let weight = value(filter, at(i)) * value(filter, at(j));
            if weight != 0.0 {
                let corner = (x + 0.5 + f64::from(i) * side, y + 0.5 + f64::from(j) * side);
                let inside = known::inside(&shape.seen[0][0].1, corner, side) / (side * side);
                sum += weight * inside;
                total += weight;
            }
        }
    }
    sum / total
}

#[test]
fn filters_weigh_edges_as_their_authors_say() {
    let rules = [
        (Rule::Sloped(8), 2e-3),
        (Rule::Sampled(32, Weighting::Box), 4e-3),
        (Rule::Sampled(32, Weighting::Trapezoid), 4e-3),
    ];
    for slope in [0.0, 0.37, -1.0, 5.0] {
        let shape = known::half_plane(slope, (0.31, 0.17));
        for filter in FILTERS {
            for (rule, bound) in rules {
                let found = &known::coverage(&shape.scene, rule, filter)[0];
                // Pixels across the edge, in the row above the middle.
                for x in 14..27 {
                    let row = SIZE / 2 - 1;
                    let truth = truth(&shape, filter, (f64::from(x), f64::from(SIZE - 1 - row)));
                    let found = found[(row * SIZE + x) as usize];
                    assert!(
                        (found - truth).abs() < bound,
                        "{filter:?} {rule:?} {slope} at {x}: {found}, not {truth}"
                    );
                }
            }
        }
    }
}

#[test]
fn only_sharpening_filters_overshoot() {
    for filter in FILTERS {
        let shape = known::half_plane(0.0, (0.0, 0.0));
        let found = &known::coverage(&shape.scene, Rule::Sloped(4), filter)[0];
        let row = &found[(SIZE * SIZE / 2) as usize..][8..SIZE as usize - 8];
        let most = row.iter().fold(0.0f64, |most, share| most.max(*share));
        let overshoots = matches!(filter, PixelFilter::Mitchell | PixelFilter::Lanczos);
        assert_eq!(most > 1.005, overshoots, "{filter:?}: {most}");
        assert!(overshoots || row.is_sorted_by(|a, b| a >= b), "{filter:?}");
    }
}

#[test]
fn weights_of_every_filter_sum_to_one() {
    let view = scenes::front_view(40, 30);
    let scene = scenes::scene("faces", scenes::random_faces(5, 25));
    for rule in [Rule::Sloped(3), Rule::Sampled(3, Weighting::Trapezoid)] {
        let plan = rule.plan().unwrap();
        let image = scanline::render(&[scene.clone().into()], &view, plan, 0..30).unwrap();
        for filter in FILTERS {
            for scale in [0.3, 1.0, 2.7] {
                let framing = Framing::scaled(view.raster(), glam::DVec2::splat(scale)).unwrap();
                let framing = Framing { filter, ..framing };
                for covers in known::covers(&image, rule, &framing) {
                    let mut sums = vec![0.0; framing.columns.len()];
                    for cover in covers {
                        for pixel in cover.start..cover.end {
                            sums[pixel as usize] += f64::from(cover.area);
                        }
                    }
                    assert!(
                        sums.iter().all(|sum| (sum - 1.0).abs() < 1e-5),
                        "{filter:?} {rule:?} {scale}: {sums:?}"
                    );
                }
            }
        }
    }
}
