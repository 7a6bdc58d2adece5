//! Programs of the stream editor against the same by hand in Rust, over a million fragments.

use criterion::{Criterion, criterion_group, criterion_main};
use glam::Vec3;
use spandrel_engine::math;
use spandrel_engine::stream::{Program, Variable, noise};
use std::collections::BTreeMap;
use std::hint::black_box;

const COUNT: usize = 1 << 20;

fn grade(bench: &mut Criterion) {
    let colors: Vec<Vec3> = (0..COUNT)
        .map(|i| Vec3::new((i % 101) as f32, (i % 103) as f32, (i % 107) as f32) / 107.0)
        .collect();
    let code = "grey = luminance(color);
        bright = mix([grey, grey, grey], color, 1.2) * [1.3, 0.7, 0.5] + 0.02;
        color = clamp(mix(bright, [0.7, 0.8, 0.9], smoothstep(grey, 0.2, 0.9)), 0, 4);";
    let program = Program::new(code, &BTreeMap::new(), &BTreeMap::new()).expect("a sound program");
    let mut group = bench.benchmark_group("grade a million fragments");
    group.sample_size(20);
    group.bench_function("program", |bench| {
        bench.iter(|| {
            let colors = black_box(&colors);
            program.run(COUNT, |variable, first, out| {
                let pairs = out.iter_mut().zip(&colors[first..]);
                match variable {
                    Variable::Color(0) => pairs.for_each(|(out, color)| *out = color.x),
                    Variable::Color(1) => pairs.for_each(|(out, color)| *out = color.y),
                    _ => pairs.for_each(|(out, color)| *out = color.z),
                }
            })
        });
    });
    group.bench_function("by hand", |bench| {
        bench.iter(|| {
            let one = |color: &Vec3| {
                let grey = color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
                let bright = Vec3::splat(grey).lerp(*color, 1.2) * Vec3::new(1.3, 0.7, 0.5) + 0.02;
                let t = ((grey - 0.2) / 0.7).clamp(0.0, 1.0);
                let far = Vec3::new(0.7, 0.8, 0.9);
                bright.lerp(far, t * t * (3.0 - 2.0 * t)).clamp(Vec3::ZERO, Vec3::splat(4.0))
            };
            black_box(&colors).iter().map(one).collect::<Vec<Vec3>>()
        });
    });
    group.finish();
}

fn marble(bench: &mut Criterion) {
    let count = COUNT >> 4;
    let places: Vec<Vec3> = (0..count)
        .map(|i| Vec3::new((i % 401) as f32, (i % 211) as f32, (i % 107) as f32) / 40.0)
        .collect();
    let code = "t = turbulence(P * 2);
        veins = 0.5 + 0.5 * sin(P.x * 6 + 5 * t);
        color = mix([0.9, 0.88, 0.85], [0.3, 0.2, 0.2], veins ^ 3);";
    let program = Program::new(code, &BTreeMap::new(), &BTreeMap::new()).expect("a sound program");
    let width = 0.01;
    let mut group = bench.benchmark_group("marble on 65536 fragments");
    group.sample_size(20);
    group.bench_function("program", |bench| {
        bench.iter(|| {
            let places = black_box(&places);
            program.run(count, |variable, first, out| {
                let pairs = out.iter_mut().zip(&places[first..]);
                match variable {
                    Variable::World(k) => pairs.for_each(|(out, p)| *out = p[k as usize]),
                    _ => out.fill(width),
                }
            })
        });
    });
    group.bench_function("by hand", |bench| {
        bench.iter(|| {
            let one = |p: &Vec3| {
                let at = (*p * 2.0).to_array();
                let t = noise::octaves(at, width * 2.0, [6.0, 2.0, 0.5], true);
                let angle = p.x * 6.0 + 5.0 * t;
                let veins = 0.5 + 0.5 * math::sin(f64::from(angle)) as f32;
                let light = Vec3::new(0.9, 0.88, 0.85);
                light.lerp(Vec3::new(0.3, 0.2, 0.2), veins * veins * veins)
            };
            black_box(&places).iter().map(one).collect::<Vec<Vec3>>()
        });
    });
    group.finish();
}

criterion_group!(benches, grade, marble);
criterion_main!(benches);
