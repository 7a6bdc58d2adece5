//! Programs of the stream editor against the same shader by hand in Rust, over a million fragments in batches as Resolve
//! makes them.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DVec3, Vec3};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Anywhere, Around, Fragments, Shader};
use spandrel_engine::math;
use spandrel_engine::raster::Raster;
use spandrel_engine::shade::Stream;
use spandrel_engine::stream::noise;
use std::collections::BTreeMap;

/// Fragments of a batch, and batches.
const BATCH: u32 = 4096;
const BATCHES: u32 = 256;

const GRADE: &str = "grey = luminance(color);
    bright = mix([grey, grey, grey], color, 1.2) * [1.3, 0.7, 0.5] + 0.02;
    color = clamp(mix(bright, [0.7, 0.8, 0.9], smoothstep(grey, 0.2, 0.9)), 0, 4);";

fn grade_by_hand(fragments: &mut Fragments<'_>) {
    for color in &mut fragments.color {
        let old = Vec3::from(color.to_array());
        let grey = old.dot(Vec3::new(0.2126, 0.7152, 0.0722));
        let bright = Vec3::splat(grey).lerp(old, 1.2) * Vec3::new(1.3, 0.7, 0.5) + 0.02;
        let t = ((grey - 0.2) / 0.7).clamp(0.0, 1.0);
        let far = Vec3::new(0.7, 0.8, 0.9);
        let new = bright.lerp(far, t * t * (3.0 - 2.0 * t));
        let [r, g, b] = new.clamp(Vec3::ZERO, Vec3::splat(4.0)).to_array();
        *color = Color::new(r, g, b);
    }
}

const STRIPES: &str = "height = P.y * 3;
    t = height - floor(height);
    edge = smoothstep(t, 0.45, 0.5) * (1 - smoothstep(t, 0.95, 1));
    up = max(N.y, 0);
    color = mix(color, [0.9, 0.88, 0.8] * (0.4 + 0.6 * up), edge * (alpha > 0.5 ? 1 : 0.3));";

fn stripes_by_hand(fragments: &mut Fragments<'_>) {
    let smooth = |x: f32, low: f32, high: f32| {
        let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    for i in 0..fragments.len() {
        let height = fragments.position[i].y as f32 * 3.0;
        let t = height - height.floor();
        let edge = smooth(t, 0.45, 0.5) * (1.0 - smooth(t, 0.95, 1.0));
        let up = fragments.normal[i].y.max(0.0);
        let light = Color::new(0.9, 0.88, 0.8) * (0.4 + 0.6 * up);
        let share = edge * if fragments.alpha[i] > 0.5 { 1.0 } else { 0.3 };
        fragments.color[i] = fragments.color[i].mix(light, share);
    }
}

const MARBLE: &str = "t = turbulence(P * 2);
    veins = 0.5 + 0.5 * sin(P.x * 6 + 5 * t);
    color = mix([0.9, 0.88, 0.85], [0.3, 0.2, 0.2], veins ^ 3);";

fn marble_by_hand(fragments: &mut Fragments<'_>) {
    for i in 0..fragments.len() {
        let p = fragments.position[i].as_vec3();
        let sides = fragments.footprint(i, fragments.position[i], fragments.facing[i]);
        let width = (sides[0].length() + sides[1].length()) as f32 / 2.0;
        let t = noise::octaves((p * 2.0).to_array(), width * 2.0, [6.0, 2.0, 0.5], true);
        let veins = 0.5 + 0.5 * math::sin(f64::from(p.x * 6.0 + 5.0 * t)) as f32;
        let (light, dark) = (Vec3::new(0.9, 0.88, 0.85), Vec3::new(0.3, 0.2, 0.2));
        let [r, g, b] = light.lerp(dark, veins * veins * veins).to_array();
        fragments.color[i] = Color::new(r, g, b);
    }
}

fn batch(view: &View) -> Fragments<'_> {
    let mut batch = Fragments::new(view);
    for i in 0..BATCH {
        let unit = |n: u32| f64::from(i % n) / f64::from(n);
        batch.push(i / 64, true, unit(101) * 100.0, unit(97) * 100.0, 0.1);
        batch.color.push(Color::new(unit(101) as f32, unit(103) as f32, unit(107) as f32));
        batch.alpha.push(1.0);
        batch.position.push(DVec3::new(unit(401), unit(211), unit(107)) * 10.0);
        let normal = DVec3::new(unit(11) - 0.5, 1.0, unit(13) - 0.5).normalize();
        batch.normal.push(normal.as_vec3());
        batch.facing.push(normal);
    }
    batch
}

fn compare(
    bench: &mut Criterion,
    name: &str,
    code: &str,
    by_hand: fn(&mut Fragments<'_>),
    batches: u32,
) {
    let raster = Raster::new(100, 100).expect("a size");
    let view = View::new(&Camera::default(), raster).expect("a camera");
    let program = Stream::new(code, BTreeMap::new(), BTreeMap::new()).expect("a sound program");
    let mut group = bench.benchmark_group(name);
    group.sample_size(20);
    let around = Around { world: None, stack: &[], at: 0, batch: &Anywhere };
    let mut fragments = batch(&view);
    group.bench_function("program", |bench| {
        bench.iter(|| (0..batches).for_each(|_| program.shade(&mut fragments, &around)));
    });
    let mut fragments = batch(&view);
    group.bench_function("by hand", |bench| {
        bench.iter(|| (0..batches).for_each(|_| by_hand(&mut fragments)));
    });
    group.finish();
}

fn grade(bench: &mut Criterion) {
    compare(bench, "grade a million fragments", GRADE, grade_by_hand, BATCHES);
}

fn stripes(bench: &mut Criterion) {
    compare(bench, "stripes on a million fragments", STRIPES, stripes_by_hand, BATCHES);
}

fn marble(bench: &mut Criterion) {
    compare(bench, "marble on 65536 fragments", MARBLE, marble_by_hand, BATCHES / 16);
}

criterion_group!(benches, grade, stripes, marble);
criterion_main!(benches);
