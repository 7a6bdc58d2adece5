//! Span files: what was written comes back, merging files is merging images, and what is lit after reading is
//! lit as in memory.

use spandrel_engine::color::Color;
use spandrel_engine::image::Channel;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::scanline::render;
use spandrel_engine::resolve::{Framing, Rule, resolve};
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::shade::{Fog, Illuminate, Shadows, Trace};
use spandrel_engine::span::{Keep, SpanImage, Stage};
use spandrel_engine::span_file::{self, Options, Scenes, SpanFile};
use spandrel_engine::trace::Accelerator;
use spandrel_tests::lights::no_fog;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::front_view;
use spandrel_tests::spans::{image, picture, plans};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

fn round_trip(image: &SpanImage, path: &Path) -> SpanImage {
    span_file::write(image, path, Options::default()).unwrap();
    let file = SpanFile::open(path, None).unwrap();
    file.read(file.rows()).unwrap()
}

#[test]
fn what_was_written_comes_back() {
    let folder = Scratch::new("what_was_written_comes_back");
    let view = front_view(70, 50);
    for seed in 0..40 {
        let plan = plans()[seed as usize % 3];
        let rows = if seed % 4 == 0 { 10..37 } else { 0..50 };
        let mut image = image(seed, seed % 2 == 0, &view, plan, rows.clone());
        if seed % 5 == 0 {
            let matte = spandrel_tests::spans::image(seed + 1, true, &view, plan, rows);
            image = image.held(&matte, Keep::Outside).unwrap();
        }
        if seed % 3 == 0 {
            let fog = Fog {
                density: 0.1,
                color: Color::new(0.3, 1.0 / 3.0, 0.1),
                start: 0.7,
                ..no_fog()
            };
            image = image.shaded(Arc::new(fog)).unwrap();
        }
        let path = folder.path().join("a.span");
        let back = round_trip(&image, &path);
        assert_eq!(back, image.pruned().unwrap(), "seed {seed}");
        assert_eq!(back, round_trip(&back, &path), "seed {seed}");
        if image.rows() == (0..50) {
            let channels = [Channel::Color, Channel::Z];
            let (a, b) = (picture(&back, &channels), picture(&image, &channels));
            assert!(a.channels().eq(b.channels()), "seed {seed}");
        }
    }
}

#[test]
fn any_rows_can_be_read() {
    let folder = Scratch::new("any_rows_can_be_read");
    let path = folder.path().join("a.span");
    let view = front_view(60, 300);
    for plan in plans() {
        let whole = image(5, true, &view, plan, 0..300);
        span_file::write(&whole, &path, Options::default()).unwrap();
        let file = SpanFile::open(&path, None).unwrap();
        for rows in [0..1, 0..300, 84..87, 255..257, 299..300, 7..7] {
            let part = file.read(rows.clone()).unwrap();
            let all = image(5, true, &view, plan, rows.clone());
            for k in part.lines().range() {
                let pruned = whole.pruned().unwrap();
                assert_eq!(part.lines().line(k), pruned.lines().line(k), "{rows:?} {k}");
            }
            assert_eq!(part.lines().range(), all.lines().range());
        }
        assert!(file.read(200..301).is_err());
    }
}

#[test]
fn merging_files_is_merging_images() {
    let folder = Scratch::new("merging_files_is_merging_images");
    let view = front_view(64, 48);
    let mut random = Random::new(3);
    for round in 0..25u64 {
        let plan = plans()[round as usize % 3];
        // Some are the same source, seen in part: their tables must be united.
        let images: Vec<SpanImage> =
            (0..4).map(|i| image(round * 3 + i % 3, round % 2 == 0, &view, plan, 0..48)).collect();
        let paths: Vec<_> = (0..4).map(|i| folder.path().join(format!("{i}.span"))).collect();
        for (image, path) in images.iter().zip(&paths) {
            span_file::write(image, path, Options::default()).unwrap();
        }
        let expected = SpanImage::merge(&images).unwrap().pruned().unwrap();
        let merged = folder.path().join("merged.span");
        let mut order = [0, 1, 2, 3];
        for i in 0..3 {
            order.swap(i, i + random.below(4 - i as u32) as usize);
        }
        let inputs: Vec<&Path> = order.iter().map(|i| paths[*i].as_path()).collect();
        // At once, and two by two.
        span_file::merge(&inputs, &merged, &|_, _| {}).unwrap();
        let read = |path: &Path| {
            let file = SpanFile::open(path, None).unwrap();
            file.read(file.rows()).unwrap()
        };
        assert_eq!(read(&merged), expected, "round {round}");
        let halves = ["left.span", "right.span"].map(|name| folder.path().join(name));
        span_file::merge(&inputs[..2], &halves[0], &|_, _| {}).unwrap();
        span_file::merge(&inputs[2..], &halves[1], &|_, _| {}).unwrap();
        let halves = halves.each_ref().map(std::path::PathBuf::as_path);
        span_file::merge(&halves, &merged, &|_, _| {}).unwrap();
        assert_eq!(read(&merged), expected, "round {round}");
        // A file merges with an image in memory, and with itself.
        let both = SpanImage::merge(&[read(&merged), images[0].clone()]).unwrap();
        assert_eq!(both.pruned().unwrap(), expected, "round {round}");
        let colors = picture(&read(&merged), &[Channel::Color, Channel::Id]);
        let known = picture(&expected, &[Channel::Color, Channel::Id]);
        assert!(colors.channels().eq(known.channels()), "round {round}");
    }
}

#[test]
fn unequal_files_do_not_merge_and_nothing_is_written() {
    let folder = Scratch::new("unequal_files_do_not_merge_and_nothing_is_written");
    let view = front_view(40, 30);
    let [a, b, _] = plans();
    let paths = ["a.span", "b.span", "c.span"].map(|name| folder.path().join(name));
    span_file::write(&image(1, false, &view, a, 0..30), &paths[0], Options::default()).unwrap();
    span_file::write(&image(2, false, &view, b, 0..30), &paths[1], Options::default()).unwrap();
    let error = span_file::merge(&[&paths[0], &paths[1]], &paths[2], &|_, _| {}).unwrap_err();
    assert!(error.to_string().contains("4 lines per row, centred"), "{error}");
    span_file::write(&image(2, false, &view, a, 3..30), &paths[1], Options::default()).unwrap();
    let error = span_file::merge(&[&paths[0], &paths[1]], &paths[2], &|_, _| {}).unwrap_err();
    assert!(error.to_string().contains("rows 3 to 30"), "{error}");
    assert!(!paths[2].exists());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

/// A scene file that names another, with curved surfaces, and the folder that it is in.
fn scene_files(folder: &Path) -> std::path::PathBuf {
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write(
        "part.ron",
        r##"Scene(version: 1, materials: {"red": (color: "#c02010", finish: (optics: (reflect: 0.4, fresnel: false)))}, plans: [(name: "part", root: (name: "ball",
            material: "red", shape: Sphere(radius: 1.5, segments: 24)))])"##,
    );
    write(
        "whole.ron",
        r##"Scene(version: 1, materials: {"blue": (color: "#2040c0")}, plans: [(name: "whole", root: (name: "all",
            children: [
                (name: "box", material: "blue", shape: Box(size: (3, 1, 2))),
                (name: "from", shape: File(path: "part.ron"), transform: [Move(1, 1, 0)]),
            ]))])"##,
    );
    folder.join("whole.ron")
}

fn whole(raster: Raster) -> Framing {
    Framing::scaled(raster, glam::DVec2::ONE).unwrap()
}

fn lit(image: &SpanImage) -> SpanImage {
    let sun = sun((-1.0, -2.0, -1.5), Color::grey(0.9));
    let lights = illuminate(vec![sun], Color::grey(0.2), Color::BLACK);
    image.shaded(Arc::new(lights)).unwrap()
}

fn lit_with_shadows(image: &SpanImage) -> SpanImage {
    let sun = sun((-0.3, -0.4, -1.5), Color::grey(0.9));
    let lights = illuminate(vec![sun], Color::grey(0.2), Color::BLACK);
    let lights = Illuminate { shadows: Shadows::Volumes, ..lights };
    // Twice, so that the world of the second holds that of the first. Only the ball mirrors, and sees what was
    // not merged.
    let twice = image.shaded(Arc::new(lights.clone())).unwrap().shaded(Arc::new(lights)).unwrap();
    let background = Color::grey(0.5);
    let accelerator = Accelerator::default();
    let trace = Trace { rays: 2, depth: 3, least: 1e-3, background, sky: None, accelerator };
    twice.shaded_beside(Arc::new(trace), &[image]).unwrap()
}

#[test]
fn shadows_come_back_with_what_casts_them() {
    let folder = Scratch::new("shadows_come_back_with_what_casts_them");
    let path = scene_files(folder.path());
    let scene = read::scene(&path, None, "whole", &ReadOptions::default()).unwrap();
    let view = front_view(80, 60);
    let image = render(&[Arc::new(scene).into()], &view, plans()[0], 0..60).unwrap();
    let color = [Channel::Color];
    let expected = picture(&lit_with_shadows(&image), &color);
    assert!(!expected.channels().eq(picture(&lit(&lit(&image)), &color).channels()));
    let (by_path, embedded, merged) =
        (folder.path().join("a.span"), folder.path().join("b.span"), folder.path().join("c.span"));
    span_file::write(&lit_with_shadows(&image), &by_path, Options::default()).unwrap();
    let options = Options { scenes: Scenes::Embedded, ..Options::default() };
    span_file::write(&lit_with_shadows(&image), &embedded, options).unwrap();
    span_file::merge(&[&by_path, &embedded], &merged, &|_, _| {}).unwrap();
    let open = |path: &Path| {
        let file = SpanFile::open(path, None).unwrap();
        file.read(file.rows()).unwrap()
    };
    for path in [&by_path, &embedded, &merged] {
        assert!(picture(&open(path), &color).channels().eq(expected.channels()), "{path:?}");
    }
    std::fs::remove_file(&path).unwrap();
    assert!(picture(&open(&embedded), &color).channels().eq(expected.channels()));
    let framing = whole(view.raster());
    let error = resolve(&open(&by_path), Rule::Sloped(4), &framing, &BTreeSet::from(color));
    let error = error.unwrap_err().to_string();
    assert!(error.contains("whole.ron"), "{error}");
}

#[test]
fn a_picture_lit_after_reading_equals_the_one_lit_in_memory() {
    let folder = Scratch::new("a_picture_lit_after_reading_equals_the_one_lit_in_memory");
    let path = scene_files(folder.path());
    let scene = read::scene(&path, None, "whole", &ReadOptions::default()).unwrap();
    let view = front_view(80, 60);
    let image = render(&[Arc::new(scene).into()], &view, plans()[0], 0..60).unwrap();
    let everything = [Channel::Color, Channel::Z, Channel::N, Channel::P, Channel::Id];
    let expected = picture(&lit(&image), &everything);
    let by_path = folder.path().join("by_path.span");
    span_file::write(&image, &by_path, Options::default()).unwrap();
    let embedded = folder.path().join("embedded.span");
    let options = Options { scenes: Scenes::Embedded, ..Options::default() };
    span_file::write(&image, &embedded, options).unwrap();
    // What was lit before it was written is lit alike.
    let lit_before = folder.path().join("lit.span");
    span_file::write(&lit(&image), &lit_before, Options::default()).unwrap();
    let open = |path: &Path| {
        let file = SpanFile::open(path, None).unwrap();
        (file.read(file.rows()).unwrap(), file.scenes().to_vec())
    };
    for path in [&by_path, &embedded] {
        assert!(picture(&lit(&open(path).0), &everything).channels().eq(expected.channels()));
    }
    assert!(picture(&open(&lit_before).0, &everything).channels().eq(expected.channels()));

    // The scene goes away: what is within the file is enough, what is not is missed.
    let moved = folder.path().join("gone.ron");
    std::fs::rename(&path, &moved).unwrap();
    let (within, scenes) = open(&embedded);
    assert!(scenes[0].embedded && scenes[0].missing.is_none());
    assert!(picture(&lit(&within), &everything).channels().eq(expected.channels()));
    // It stays within when files are merged.
    let again = folder.path().join("again.span");
    span_file::merge(&[&embedded], &again, &|_, _| {}).unwrap();
    assert!(picture(&lit(&open(&again).0), &everything).channels().eq(expected.channels()));

    let (alone, scenes) = open(&by_path);
    assert!(
        scenes[0].missing.as_deref().is_some_and(|why| why.contains("whole.ron")),
        "{scenes:?}"
    );
    let plain = [Channel::Color, Channel::Z, Channel::P, Channel::Id];
    let known = picture(&image, &plain);
    assert!(picture(&alone, &plain).channels().eq(known.channels()));
    let framing = whole(view.raster());
    for (image, channel) in [(lit(&alone), Channel::Color), (alone, Channel::N)] {
        let error = resolve(&image, Rule::Sloped(4), &framing, &BTreeSet::from([channel]));
        let error = error.unwrap_err().to_string();
        assert!(error.contains("normals") && error.contains("whole.ron"), "{error}");
    }
    // A scene that changed is not the scene.
    std::fs::write(
        &path,
        std::fs::read_to_string(&moved).unwrap().replace("(3, 1, 2)", "(3, 1, 4)"),
    )
    .unwrap();
    let missing = open(&by_path).1[0].missing.clone().unwrap();
    assert!(missing.contains("not what it was"), "{missing}");
}

#[test]
fn stored_intensities_are_the_shaded_colours() {
    let folder = Scratch::new("stored_intensities_are_the_shaded_colours");
    let path = folder.path().join("a.span");
    let view = front_view(60, 40);
    let lit = lit(&image(11, false, &view, plans()[0], 0..40));
    let options = Options { shaded: true, scenes: Scenes::Left };
    let written = span_file::write(&lit, &path, options).unwrap();
    assert_eq!(written.varying, 0, "flat faces under parallel light are alike all over");
    let file = SpanFile::open(&path, None).unwrap();
    let back = file.read(0..40).unwrap();
    let is_kept = |stage: &Stage| matches!(stage, Stage::Kept(_));
    assert!(back.sources().iter().all(|source| source.stack.iter().all(is_kept)));
    let (a, b) = (picture(&back, &[Channel::Color]), picture(&lit, &[Channel::Color]));
    assert!(a.channels().eq(b.channels()));
    // They are light already: no light acts on them again, fog does.
    let fog = Fog { density: 0.2, color: Color::WHITE, start: 0.0, ..no_fog() };
    let fog = Arc::new(fog);
    let (a, b) = (back.shaded(fog.clone()).unwrap(), lit.shaded(fog).unwrap());
    let (a, b) = (picture(&a, &[Channel::Color]), picture(&b, &[Channel::Color]));
    assert!(a.channels().eq(b.channels()));
}

#[test]
fn parts_of_one_scene_merge_with_the_colours_and_names_of_all() {
    let scratch = Scratch::new("parts_of_one_scene");
    let path = |name: &str| scratch.path().join(name);
    let view = front_view(64, 48);
    let whole = image(2, true, &view, plans()[0], 0..48);
    let halves = [whole.cropped(0.0..32.0, 0.0..48.0), whole.cropped(32.0..64.0, 0.0..48.0)];
    let everything = [Channel::Color, Channel::Z, Channel::Id];
    let expected = picture(&SpanImage::merge(&halves).unwrap(), &everything);
    let files = [path("left.span"), path("right.span")];
    for (image, file) in halves.iter().zip(&files) {
        // There is no scene file: what is stored is all there is.
        let written = span_file::write(image, file, Options::default()).unwrap();
        assert!(written.faces < whole.pruned().unwrap().face_count() as u64);
    }
    for order in [[0, 1], [1, 0]] {
        let merged = path("merged.span");
        let inputs = order.map(|i| files[i].as_path());
        span_file::merge(&inputs, &merged, &|_, _| {}).unwrap();
        let read = |path: &Path| {
            let file = SpanFile::open(path, None).unwrap();
            file.read(file.rows()).unwrap()
        };
        let from_file = picture(&read(&merged), &everything);
        assert!(from_file.channels().eq(expected.channels()));
        let in_memory = SpanImage::merge(&inputs.map(read)).unwrap();
        assert!(picture(&in_memory, &everything).channels().eq(expected.channels()));
        // What was just rendered knows all faces, whichever comes first.
        let pair = [read(&files[0]), halves[1].clone()];
        let mixed = SpanImage::merge(&order.map(|i| pair[i].clone())).unwrap();
        assert!(picture(&mixed, &[Channel::N]).channels().count() == 3);
        assert!(picture(&mixed, &everything).channels().eq(expected.channels()));
    }
}

#[test]
fn storing_intensities_keeps_the_order_of_what_coincides() {
    let scratch = Scratch::new("storing_intensities_keeps");
    let path = scratch.path().join("a.span");
    let view = front_view(40, 30);
    let fog = |density| Fog { density, ..no_fog() };
    for seed in 0..30 {
        // One scene, shaded in several ways: all faces coincide, and the order of sources decides.
        let base = image(seed, true, &view, plans()[0], 0..30);
        let shaded = |density: f32| base.shaded(Arc::new(fog(density))).unwrap();
        let twice = shaded(0.2).shaded(Arc::new(fog(0.1))).unwrap();
        let held = base.held(&shaded(0.3), Keep::Outside).unwrap();
        let image =
            SpanImage::merge(&[base.clone(), shaded(0.1), shaded(0.2), twice, held]).unwrap();
        let options = Options { shaded: true, scenes: Scenes::Left };
        span_file::write(&image, &path, options).unwrap();
        let file = SpanFile::open(&path, None).unwrap();
        let back = file.read(0..30).unwrap();
        assert_eq!(back.lines(), image.pruned().unwrap().lines(), "seed {seed}");
        assert_eq!(back.layers(), image.pruned().unwrap().layers(), "seed {seed}");
        // It is not the image that can be shaded anew.
        assert!(back.sources().iter().all(|s| image.sources().iter().all(|t| s.order(t).is_ne())));
    }
}
