//! Probes: an image that is made again elsewhere is the image that it was.

use glam::DVec3;
use spandrel_engine::raster::LinePlan;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::Rule;
use spandrel_engine::span::{DepthRange, Keep, Probe, SpanImage, line};
use spandrel_tests::random::Random;
use spandrel_tests::scenes;
use std::sync::Arc;

fn plan() -> LinePlan {
    Rule::Adaptive(3, 0.0).plan().unwrap()
}

fn render(seed: u64, panes: bool) -> SpanImage {
    let view = scenes::front_view(40, 30);
    let mesh = if panes { scenes::random_panes(seed, 12) } else { scenes::random_faces(seed, 25) };
    let scene = scenes::scene(&format!("scene {seed}"), mesh);
    scanline::render(&[scene.into()], &view, plan(), 0..30).unwrap()
}

/// Probes of every line, over random windows.
fn probes(image: &SpanImage, seed: u64) -> Arc<[Probe]> {
    let mut random = Random::new(seed);
    let cells = image.view().raster().cells();
    let window = |k| {
        let (a, b) = (random.below(cells), random.below(cells));
        Probe { y: image.y(k), cells: a.min(b)..a.max(b) + 1 }
    };
    image.lines().range().map(window).collect()
}

fn assert_same(image: &SpanImage, name: &str) {
    let probes = probes(image, 7);
    let made = image.probed(&probes).unwrap().expect("it can be probed");
    let cells = image.view().raster().cells();
    for (k, probe) in image.lines().range().zip(probes.iter()) {
        let cut = |image: &SpanImage, k| {
            let all = line::segments(image.lines().line(k), cells);
            let cut = |range: std::ops::Range<u32>| {
                range.start.max(probe.cells.start)..range.end.min(probe.cells.end)
            };
            let all = all.map(|(range, face)| (cut(range), face));
            let opaque: Vec<_> = all.filter(|(range, _)| !range.is_empty()).collect();
            let layers = image.layers().line(k).iter();
            let layers = layers.map(|segment| (cut(segment.start..segment.end), segment.face));
            let layers: Vec<_> = layers.filter(|(range, _)| !range.is_empty()).collect();
            (opaque, layers)
        };
        let number = k - image.lines().range().start;
        let (mut here, mut there) = (cut(image, k), cut(&made, number));
        // A set: windows cut its members, so that their order may differ.
        here.1.sort_by_key(|(range, face)| (*face, range.start));
        there.1.sort_by_key(|(range, face)| (*face, range.start));
        assert_eq!(here, there, "{name}, line {k}");
    }
}

#[test]
fn probes_show_what_lines_show() {
    let plain = render(1, false);
    let panes = render(2, true);
    assert_same(&plain, "renderer");
    assert_same(&panes, "translucent faces");
    let merged = SpanImage::merge(&[plain.clone(), panes.clone(), render(3, false)]).unwrap();
    assert_same(&merged, "merge");
    for keep in [Keep::Outside, Keep::Inside] {
        assert_same(&plain.held(&panes, keep).unwrap(), "soft holdout");
        assert_same(&merged.held(&render(3, false), keep).unwrap(), "holdout");
    }
    let range = DepthRange { front: Some(0.11), back: Some(0.09) };
    assert_same(&merged.sliced(range), "slice");
    assert_same(&merged.cropped(5.25..30.5, 3.0..20.0), "crop");
    assert_same(&merged.with_depths(1.25, 0.01).unwrap(), "depths");
    assert_same(&merged.moved(3.3, -4, 0..30).unwrap(), "move");
    let deep = merged.sliced(range).moved(-2.7, 5, 2..28).unwrap();
    assert_same(&deep.held(&deep.cropped(0.0..20.0, 0.0..20.0), Keep::Outside).unwrap(), "all");
    assert_same(&SpanImage::empty(plain.view().clone(), plan(), 0..30), "nothing");
}

#[test]
fn an_image_without_a_maker_cannot_be_probed() {
    let view = scenes::front_view(40, 30);
    let square = vec![DVec3::ZERO, DVec3::X, DVec3::ONE];
    let scene = scenes::scene("one", scenes::polygons(&[square]));
    let plan = Rule::Sloped(3).plan().unwrap();
    let image = scanline::render(&[scene.into()], &view, plan, 0..30).unwrap();
    assert!(image.probed(&probes(&image, 1)).unwrap().is_none());
}
