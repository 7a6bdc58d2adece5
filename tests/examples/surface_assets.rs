//! Paints the pictures of the surfaces in `graphs/surfaces.ron` and `graphs/papers/zashiki.ron` into
//! `graphs/assets/surfaces`: bricks, tiles, planks, a globe, leaves, a label; a carved transom, sliding doors, a scroll. `cargo run --release -p spandrel-tests --example surface_assets`.

#![allow(
    clippy::disallowed_methods,
    reason = "nothing depends on the last bits of a painted picture"
)]

use spandrel_engine::image::{Image, Samples, Window, file};
use std::path::Path;

/// A number in [0, 1) that belongs to two whole numbers and a seed.
fn chance(x: i64, y: i64, seed: u64) -> f32 {
    let mut z = (x as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ (y as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ seed.wrapping_mul(0x1656_67B1_9E37_79F9);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// Smooth noise that repeats after `period`.
fn noise(x: f32, y: f32, period: i64, seed: u64) -> f32 {
    let (i, j) = (x.floor() as i64, y.floor() as i64);
    let soft = |t: f32| t * t * (3.0 - 2.0 * t);
    let (u, v) = (soft(x - x.floor()), soft(y - y.floor()));
    let at =
        |di: i64, dj: i64| chance((i + di).rem_euclid(period), (j + dj).rem_euclid(period), seed);
    let row = |dj: i64| at(0, dj) * (1.0 - u) + at(1, dj) * u;
    row(0) * (1.0 - v) + row(1) * v
}

fn layers(x: f32, y: f32, period: i64, seed: u64) -> f32 {
    let octave = |k: u32| {
        noise(x * (1 << k) as f32, y * (1 << k) as f32, period << k, seed) / (1 << k) as f32
    };
    (0..4).map(octave).sum::<f32>() / 1.875
}

fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    [0, 1, 2].map(|k| a[k] * (1.0 - t) + b[k] * t)
}

fn step(from: f32, to: f32, t: f32) -> f32 {
    let t = ((t - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Colours are as they are coded, between 0 and 1; alpha is straight.
fn paint(name: &str, width: u32, height: u32, texel: impl Fn(f32, f32) -> [f32; 4]) {
    let linear = |v: f32| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    let mut picture = Image::new((width, height), Window::whole(width, height));
    let texels: Vec<[f32; 4]> = (0..width * height)
        .map(|at| {
            let (x, y) = (at % width, at / width);
            // u to the right, v upwards.
            let u = (x as f32 + 0.5) / width as f32;
            let [r, g, b, a] = texel(u, 1.0 - (y as f32 + 0.5) / height as f32);
            let [r, g, b] = [r, g, b].map(|v| linear(v.clamp(0.0, 1.0)) * a);
            [r, g, b, a]
        })
        .collect();
    for (axis, channel) in ["R", "G", "B", "A"].into_iter().enumerate() {
        let values = texels.iter().map(|texel| texel[axis]).collect();
        picture.insert(channel, Samples::Float(values)).expect("as many samples as pixels");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/assets/surfaces").join(name);
    file::write(&picture, &path, Some(8)).expect("the folder is there");
}

/// Bricks: 4 by 8 with mortar; how deep in a brick, and which.
fn brick(u: f32, v: f32) -> (f32, i64, i64) {
    let row = (v * 8.0).floor();
    let x = u * 4.0 + if row as i64 % 2 == 0 { 0.0 } else { 0.5 };
    let (i, j) = ((x.floor() as i64).rem_euclid(4), row as i64);
    let (s, t) = (x - x.floor(), v * 8.0 - row);
    let edge = (s.min(1.0 - s) * 2.0).min(t.min(1.0 - t));
    (edge + 0.03 * (layers(u * 24.0, v * 24.0, 24, 3) - 0.5), i, j)
}

/// Granite as if photographed: grains of quartz, feldspar and mica, repeating after 1, with dust on it.
fn granite(u: f32, v: f32) -> [f32; 3] {
    let (x, y) = (
        u * 18.0 + 0.6 * layers(u * 9.0, v * 9.0, 9, 31),
        v * 18.0 + 0.6 * layers(u * 9.0, v * 9.0, 9, 32),
    );
    let mut nearest = (f32::INFINITY, 0.0);
    for j in -1..=1 {
        for i in -1..=1 {
            let (cx, cy) = (x.floor() as i64 + i, y.floor() as i64 + j);
            let (kx, ky) = (cx.rem_euclid(18), cy.rem_euclid(18));
            let at = (cx as f32 + chance(kx, ky, 33), cy as f32 + chance(kx, ky, 34));
            let off = (x - at.0).hypot(y - at.1);
            if off < nearest.0 {
                nearest = (off, chance(kx, ky, 35));
            }
        }
    }
    let dust = 0.05 * (layers(u * 60.0, v * 60.0, 60, 36) - 0.5);
    let of = match nearest.1 {
        kind if kind < 0.2 => [0.13, 0.12, 0.13],
        kind if kind < 0.62 => [0.66, 0.47, 0.41],
        _ => [0.86, 0.85, 0.83],
    };
    of.map(|v| v + dust)
}

fn main() {
    paint("granite_photo.png", 256, 256, |u, v| {
        let [r, g, b] = granite(u, v);
        [r, g, b, 1.0]
    });
    paint("bricks.png", 256, 256, |u, v| {
        let (edge, i, j) = brick(u, v);
        let own = mix([0.56, 0.27, 0.2], [0.72, 0.42, 0.3], chance(i, j, 1));
        let own = mix(own, [0.4, 0.22, 0.18], 0.5 * layers(u * 16.0, v * 16.0, 16, 2));
        let mortar = [0.68, 0.65, 0.6];
        let [r, g, b] = mix(mortar, own, step(0.05, 0.09, edge));
        [r, g, b, 1.0]
    });
    paint("bricks_height.png", 256, 256, |u, v| {
        let (edge, i, j) = brick(u, v);
        let own = 0.75 + 0.2 * chance(i, j, 4) - 0.2 * layers(u * 20.0, v * 20.0, 20, 5);
        [step(0.02, 0.14, edge) * own; 3].iter().fold([0.0; 4], |_, h| [*h, *h, *h, 1.0])
    });
    paint("tiles.png", 256, 256, |u, v| {
        let (i, j) = ((u * 2.0) as i64, (v * 2.0) as i64);
        let (s, t) = (u * 2.0 - i as f32, v * 2.0 - j as f32);
        let edge = s.min(1.0 - s).min(t.min(1.0 - t));
        let veins = (layers(u * 5.0, v * 5.0, 5, 6 + ((i + j) % 2) as u64) - 0.5).abs();
        let light = mix([0.9, 0.88, 0.83], [0.7, 0.67, 0.62], step(0.05, 0.0, veins));
        let dark = mix([0.24, 0.3, 0.3], [0.45, 0.52, 0.5], step(0.04, 0.0, veins));
        let own = if (i + j) % 2 == 0 { light } else { dark };
        let [r, g, b] = mix([0.5, 0.49, 0.47], own, step(0.006, 0.014, edge));
        [r, g, b, 1.0]
    });
    paint("planks.png", 256, 256, |u, v| {
        let board = (v * 4.0).floor();
        let t = v * 4.0 - board;
        let own = chance(board as i64, 0, 8);
        let grain = layers(u * 3.0 + own * 7.0, v * 40.0, 120, 9);
        let rings =
            (0.5 + 0.5 * ((v * 60.0 + 6.0 * layers(u * 4.0, v * 8.0, 32, 10)).sin())) * 0.35;
        let wood = mix([0.72, 0.52, 0.32], [0.45, 0.29, 0.16], 0.5 * grain + rings + 0.2 * own);
        let [r, g, b] = mix([0.2, 0.13, 0.08], wood, step(0.01, 0.05, t.min(1.0 - t)));
        [r, g, b, 1.0]
    });
    paint("globe.png", 512, 256, |u, v| {
        let (angle, up) = (u * std::f32::consts::TAU, (v - 0.5) * std::f32::consts::PI);
        let (x, y, z) = (angle.sin() * up.cos(), up.sin(), angle.cos() * up.cos());
        let land = layers(x * 1.8 + 40.0, y * 1.8 + 7.3 + z * 1.3, 1 << 20, 11)
            + 0.6 * layers(z * 2.2 + 9.0, x * 1.7 + y * 2.0 + 60.0, 1 << 20, 12);
        let (degrees, across) = (u * 24.0, v * 12.0);
        let line = |t: f32| (t - t.round()).abs();
        let grid = step(0.035, 0.015, line(degrees).min(line(across)));
        let sea = mix([0.16, 0.34, 0.5], [0.3, 0.52, 0.64], step(0.5, 0.78, land));
        let ground = mix([0.72, 0.66, 0.42], [0.42, 0.5, 0.28], step(0.84, 1.1, land));
        let own = mix(sea, ground, step(0.79, 0.81, land));
        let own = mix(own, [0.93, 0.94, 0.95], step(1.28, 1.36, up.abs() + 0.1 * land));
        let [r, g, b] = mix(own, [0.12, 0.14, 0.16], 0.5 * grid);
        [r, g, b, 1.0]
    });
    // A vine: leaves along winding stems.
    paint("leaves.png", 256, 256, |u, v| {
        let mut found = [0.0f32; 4];
        let cell = 9.0;
        let (ci, cj) = ((u * cell).floor() as i64, (v * cell).floor() as i64);
        for i in ci - 1..=ci + 1 {
            for j in cj - 1..=cj + 1 {
                let (wi, wj) = (i.rem_euclid(9), j.rem_euclid(9));
                if chance(wi, wj, 20) < 0.22 {
                    continue;
                }
                let place = |seed| 0.25 + 0.5 * chance(wi, wj, seed);
                let (x, y) = (u * cell - i as f32 - place(21), v * cell - j as f32 - place(22));
                let turn = chance(wi, wj, 23) * std::f32::consts::TAU;
                let (a, b) = (x * turn.cos() + y * turn.sin(), y * turn.cos() - x * turn.sin());
                let half = 0.26 * (1.0 - (a / 0.62).powi(2)).max(0.0) * (1.0 - 0.35 * a);
                let inside = step(0.02, -0.02, b.abs() - half);
                if inside > found[3] {
                    let own = mix([0.22, 0.36, 0.13], [0.5, 0.58, 0.22], chance(wi, wj, 24));
                    let [r, g, b] = mix([0.6, 0.66, 0.4], own, step(0.0, 0.035, b.abs()));
                    found = [r, g, b, inside];
                }
            }
        }
        let stem = (v - 0.5 - 0.13 * (u * std::f32::consts::TAU).sin()).abs();
        if found[3] < 0.5 && stem < 0.008 { [0.36, 0.26, 0.17, 1.0] } else { found }
    });
    paint("label.png", 256, 128, |u, v| {
        let (x, y) = ((u - 0.5) * 2.0, v - 0.5);
        let ring = (x * x + 4.0 * y * y).sqrt();
        let arch = (0.5 - ((x * 0.9).powi(2) + ((y + 0.22) * 2.4).powi(2)).sqrt()).abs();
        let on =
            step(0.055, 0.045, arch) * step(-0.24, -0.2, y) + step(0.03, 0.02, (ring - 0.86).abs());
        let [r, g, b] = mix([0.86, 0.68, 0.34], [0.3, 0.14, 0.1], on.min(1.0));
        [r, g, b, 1.0]
    });
    japanese();
}

/// What is in a Japanese room: mountains in ink on sliding doors, a hanging scroll, a transom carved of a board.
fn japanese() {
    // Hills in mist, one behind the other, on gold leaf. It repeats to the right.
    paint("fusuma.png", 512, 256, |u, v| {
        let leaf = (u * 8.0 - (u * 8.0).round()).abs().min((v * 4.0 - (v * 4.0).round()).abs());
        let gold = mix([0.82, 0.71, 0.45], [0.74, 0.62, 0.36], layers(u * 8.0, v * 4.0, 8, 50));
        let mut own = mix(gold, [0.66, 0.54, 0.3], step(0.02, 0.0, leaf) * 0.35);
        for hill in 0..4u64 {
            let period = 3 + hill as i64;
            let ridge = 0.62 - 0.13 * hill as f32
                + 0.34 * (layers(u * period as f32, 0.5, period, 51 + hill) - 0.5);
            let ink = mix([0.62, 0.6, 0.5], [0.17, 0.22, 0.2], hill as f32 / 3.0);
            // Ink is thick at the ridge, and runs out into mist.
            let below = step(0.0, 0.008, ridge - v) * step(0.26, 0.0, ridge - v);
            own = mix(own, ink, 0.85 * below);
        }
        let sun = (u - 0.7).hypot((v - 0.78) * 0.5);
        let own = mix(own, [0.72, 0.26, 0.18], step(0.052, 0.048, sun));
        [own[0], own[1], own[2], 1.0]
    });
    // Bamboo in ink.
    paint("scroll.png", 128, 384, |u, v| {
        let mut own = mix([0.9, 0.87, 0.78], [0.84, 0.8, 0.7], layers(u * 6.0, v * 18.0, 18, 60));
        for (at, lean, wide) in [(0.36, 0.05, 0.02), (0.58, -0.04, 0.028), (0.5, 0.12, 0.012)] {
            let joint = (v * 7.0 + at * 9.0).fract();
            let off = (u - at - lean * (v - 0.5)).abs();
            let stalk = step(wide, wide * 0.75, off) * step(0.0, 0.03, joint.min(1.0 - joint));
            own = mix(own, [0.22, 0.24, 0.22], stalk * step(0.06, 0.1, v) * 0.85);
        }
        for leaf in 0..26 {
            let c = |seed| chance(leaf, 0, seed);
            let (x, y) = (0.22 + 0.6 * c(61), 0.42 + 0.46 * c(62));
            let turn = -0.5 - 1.3 * c(63);
            let (dx, dy) = ((u - x) * 1.0, (v - y) * 3.0);
            let (a, b) = (dx * turn.cos() + dy * turn.sin(), dy * turn.cos() - dx * turn.sin());
            let half = 0.022 * (1.0 - (a / 0.15 - 0.2).powi(2)).max(0.0);
            if half > 0.0 {
                let inside = step(0.004, -0.004, b.abs() - half);
                own = mix(own, [0.16, 0.18, 0.16], inside * 0.8);
            }
        }
        let seal = (u - 0.78).abs().max((v - 0.12).abs() * 3.0);
        let own = mix(own, [0.7, 0.2, 0.14], step(0.05, 0.045, seal));
        [own[0], own[1], own[2], 1.0]
    });
    // Cranes over waves, cut out of a board.
    let transom = |u: f32, v: f32| {
        let (x, y) = (u * 4.0, v);
        let grain = layers(x * 2.0, y * 26.0, 64, 70);
        let mut wood = mix([0.62, 0.42, 0.25], [0.4, 0.25, 0.14], grain);
        let mut there = 0.0f32;
        // Waves: rows of scales, each of rings.
        if y < 0.5 {
            let mut nearest = f32::INFINITY;
            for row in 0..5 {
                let shift = if row % 2 == 0 { 0.0 } else { 0.125 };
                let cx = ((x - shift) / 0.25).round() * 0.25 + shift;
                let cy = 0.02 + 0.1 * row as f32;
                let d = (x - cx).hypot(y - cy);
                // The rows below lie over those above.
                if d < 0.14 && nearest.is_infinite() {
                    nearest = d;
                }
            }
            if nearest.is_finite() {
                let ring = (nearest / 0.14 * 3.0).fract();
                there = step(0.3, 0.4, ring);
                wood = mix(wood, [0.3, 0.18, 0.1], 0.5 * step(0.8, 0.98, ring));
            }
        }
        // Cranes: wings as two arcs, a neck, a tail.
        for (cx, cy, size) in
            [(0.62, 0.62, 0.3), (1.5, 0.7, 0.22), (2.35, 0.6, 0.33), (3.3, 0.68, 0.25)]
        {
            let (a, b) = ((x - cx) / size, (y - cy) / size);
            let wing = 0.34 * (1.0 - a.abs()).max(0.0) * (a.abs() * 2.6).sin().abs();
            let inside = (b - 0.55 * a.abs() + 0.18).abs() < wing.max(0.02) && a.abs() < 1.0;
            let body = (a * 1.0).hypot(b * 3.4 + 0.4) < 0.3;
            let neck = (b + 0.12 + 0.12 * (a - 0.4)).abs() < 0.035 && (0.0..0.85).contains(&a);
            if inside || body || neck {
                there = 1.0;
                let edge = (b * 26.0 + a.abs() * 9.0).sin();
                wood = mix(wood, [0.7, 0.5, 0.32], 0.35 + 0.25 * edge);
            }
        }
        // Battens that hold them, and the frame.
        let batten = (x - x.round()).abs() < 0.014 || (y - 0.5).abs() < 0.014;
        let frame = x.min(4.0 - x).min(y.min(1.0 - y)) < 0.05;
        if batten || frame {
            there = 1.0;
            wood = mix(wood, [0.34, 0.21, 0.12], 0.4);
        }
        [wood[0], wood[1], wood[2], there]
    };
    paint("transom.png", 512, 128, transom);
    // Its trigger pattern: the byte 1 where there is wood, 0 where it is cut away.
    paint("transom_index.png", 512, 128, |u, v| {
        let index = if transom(u, v)[3] >= 0.5 { 1.0 / 255.0 } else { 0.0 };
        [index, index, index, 1.0]
    });
}
