//! Times the stages.
use spandrel_engine::raster::{LinePlan, Phase};
use spandrel_engine::visible;
use spandrel_tests::town;
use std::time::Instant;
fn main() {
    for (t, w, h) in [(34_000, 640, 480), (10_000, 1920, 1080), (100_000, 1920, 1080), (364_000, 1920, 1080), (1_000_000, 1920, 1080), (3_100_000, 640, 480)] {
        let t0 = Instant::now();
        let c = town::clusters(t, 1);
        let faces = c[0].face_count();
        let load = t0.elapsed();
        let view = town::view(w, h);
        for n in [1, 4, 8] {
            let plan = LinePlan::new(n, Phase::Centre).unwrap();
            let (mut s, mut v) = (1e9f64, 1e9f64);
            let mut spans = 0; let mut bytes = 0; let mut kept = 0;
            for _ in 0..3 {
                let t1 = Instant::now();
                let table = visible::setup::face_table(&c[0].clone().into(), &view, plan).unwrap();
                kept = table.faces().len();
                let d1 = t1.elapsed().as_secs_f64() * 1e3;
                drop(table);
                let t2 = Instant::now();
                let image = visible::render(&[c[0].clone().into()], &view, plan, 0..h).unwrap();
                let d2 = t2.elapsed().as_secs_f64() * 1e3;
                s = s.min(d1); v = v.min(d2);
                spans = image.lines().spans().len(); bytes = image.bytes();
            }
            let rule = spandrel_engine::resolve::Rule::Sloped(n);
            let image = visible::render(&[c[0].clone().into()], &view, plan, 0..h).unwrap();
            let framing = spandrel_engine::resolve::Framing::whole(view.raster());
            let mut r = 1e9f64; let mut r2 = 1e9f64;
            for _ in 0..3 {
                let image2 = spandrel_engine::span::SpanImage::merge(&[image.clone(), spandrel_engine::span::SpanImage::empty(view.clone(), plan, 0..h)]).unwrap();
                let t3 = Instant::now();
                let p = spandrel_engine::resolve::resolve(&image2, rule, &framing, &[spandrel_engine::resolve::Channel::Color].into()).unwrap();
                r = r.min(t3.elapsed().as_secs_f64() * 1e3);
                drop(p);
                let t3 = Instant::now();
                let rule = spandrel_engine::resolve::Rule::Sampled(n, spandrel_engine::resolve::Weighting::Box);
                let p = spandrel_engine::resolve::resolve(&image2, rule, &framing, &[spandrel_engine::resolve::Channel::Color].into()).unwrap();
                r2 = r2.min(t3.elapsed().as_secs_f64() * 1e3);
                drop(p);
            }
            println!("resolve sloped {r:.1} box {r2:.1}");
            println!("{t} {w}x{h} n={n}: faces {faces} kept {kept} load {load:?} setup {s:.1} visible {:.1} ms, spans {spans}, {:.1} MB", v - s, bytes as f64 / 1e6);
        }
    }
}
