//! Span files: what was written comes back, merging files is merging images, and nothing that is in a file
//! can do more than fail.

use spandrel_engine::camera::View;
use spandrel_engine::color::Color;
use spandrel_engine::raster::{LinePlan, Phase, Raster, Rows};
use spandrel_engine::resolve::{Channel, Framing, Rule, resolve};
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_engine::shade::{Fog, Illuminate, ParallelLight};
use spandrel_engine::span::{Keep, SpanImage, Stage};
use spandrel_engine::span_file::{self, Options, Scenes, SpanFile};
use spandrel_engine::visible::render;
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::{front_view, random_faces, random_panes, scene};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

fn image(seed: u64, panes: bool, view: &View, plan: LinePlan, rows: Rows) -> SpanImage {
    let mesh = if panes { random_panes(seed, 25) } else { random_faces(seed, 25) };
    let scene = scene(&format!("cluster {}", seed % 7), mesh);
    render(&[scene.into()], view, plan, rows).unwrap()
}

fn plans() -> [LinePlan; 3] {
    [(4, Phase::Centre), (3, Phase::Border), (1, Phase::Centre)]
        .map(|(n, phase)| LinePlan::new(n, phase).unwrap())
}

fn round_trip(image: &SpanImage, path: &Path) -> SpanImage {
    span_file::write(image, path, Options::default()).unwrap();
    let file = SpanFile::open(path, None).unwrap();
    file.read(file.rows()).unwrap()
}

fn picture(image: &SpanImage, channels: &[Channel]) -> spandrel_engine::image::Image {
    let rule = match image.plan() {
        LinePlan { per_row, phase: Phase::Centre, .. } => Rule::Sloped(per_row),
        LinePlan { per_row, .. } => {
            Rule::Sampled(per_row, spandrel_engine::resolve::Weighting::Trapezoid)
        }
    };
    let framing = whole(image.view().raster());
    let channels: BTreeSet<Channel> = channels.iter().copied().collect();
    resolve(image, rule, &framing, &channels).unwrap()
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
            let matte = self::image(seed + 1, true, &view, plan, rows);
            image = image.held(&matte, Keep::Outside).unwrap();
        }
        if seed % 3 == 0 {
            let fog = Fog { density: 0.1, color: Color::new(0.3, 1.0 / 3.0, 0.1), start: 0.7 };
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
        r##"Scene(version: 1, materials: {"red": (color: "#c02010")}, plans: [(name: "part", root: (name: "ball",
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
    let sun = ParallelLight::new((-1.0, -2.0, -1.5).into(), Color::grey(0.9)).unwrap();
    let lights =
        Illuminate { lights: vec![Arc::new(sun)], sky: Color::grey(0.2), ground: Color::BLACK };
    image.shaded(Arc::new(lights)).unwrap()
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
    let fog = Fog { density: 0.2, color: Color::WHITE, start: 0.0 };
    let (a, b) = (back.shaded(Arc::new(fog)).unwrap(), lit.shaded(Arc::new(fog)).unwrap());
    let (a, b) = (picture(&a, &[Channel::Color]), picture(&b, &[Channel::Color]));
    assert!(a.channels().eq(b.channels()));
}

/// A small file with everything in it.
fn sample(path: &Path) -> Vec<u8> {
    let view = front_view(24, 20);
    let image = image(4, true, &view, plans()[0], 0..20);
    span_file::write(&image, path, Options::default()).unwrap();
    std::fs::read(path).unwrap()
}

fn try_read(path: &Path, bytes: &[u8]) -> spandrel_engine::Result<SpanImage> {
    std::fs::write(path, bytes).unwrap();
    let file = SpanFile::open(path, None)?;
    let image = file.read(file.rows())?;
    Ok(image)
}

#[test]
fn a_truncated_file_is_an_error_that_names_the_place() {
    let folder = Scratch::new("a_truncated_file_is_an_error_that_names_the_place");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    for length in 0..bytes.len() {
        let error = try_read(&path, &bytes[..length]).unwrap_err().to_string();
        assert!(error.contains("a.span: byte "), "{length}: {error}");
        let named = error.contains("block") || length < 16;
        assert!(named && (length < 16 || error.contains("truncated")), "{length}: {error}");
    }
    let longer = [&bytes[..], b"more"].concat();
    assert!(try_read(&path, &longer).unwrap_err().to_string().contains("bytes follow the end"));
}

#[test]
fn every_changed_byte_is_found() {
    let folder = Scratch::new("every_changed_byte_is_found");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    let mut random = Random::new(8);
    for at in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[at] ^= 1 << random.below(8);
        let error = try_read(&path, &changed).unwrap_err().to_string();
        assert!(error.contains("a.span: byte "), "{at}: {error}");
        assert!(at < 16 || error.contains("block"), "{at}: {error}");
    }
}

/// Heads of blocks: kind, a, b, and the contents unpacked.
fn blocks(bytes: &[u8]) -> Vec<([u8; 4], u32, u32, Vec<u8>)> {
    use std::io::Read;
    let mut at = 16;
    let mut found = Vec::new();
    while at < bytes.len() {
        let u32_at = |i: usize| u32::from_le_bytes(bytes[at + i..at + i + 4].try_into().unwrap());
        let (stored, raw) = (u32_at(12) as usize, u32_at(20) as usize);
        let body = &bytes[at + 36..at + 36 + stored];
        let mut unpacked = Vec::new();
        match stored == raw {
            true => unpacked.extend_from_slice(body),
            false => {
                flate2::read::ZlibDecoder::new(body).read_to_end(&mut unpacked).unwrap();
            }
        }
        found.push((bytes[at..at + 4].try_into().unwrap(), u32_at(4), u32_at(8), unpacked));
        at += 36 + stored;
    }
    found
}

/// A file of blocks that are not packed, by the documented layout alone.
fn file_of(blocks: &[([u8; 4], u32, u32, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = b"SPANDRELspan".to_vec();
    bytes.extend(1u32.to_le_bytes());
    for (kind, a, b, body) in blocks {
        let mut head = kind.to_vec();
        head.extend(a.to_le_bytes());
        head.extend(b.to_le_bytes());
        head.extend((body.len() as u64).to_le_bytes());
        head.extend((body.len() as u64).to_le_bytes());
        head.extend(crc32fast::hash(body).to_le_bytes());
        head.extend(crc32fast::hash(&head).to_le_bytes());
        bytes.extend(head);
        bytes.extend(body);
    }
    bytes
}

/// Mutations below the checksums: what is read is an image that resolves, or an error that names a block or
/// the file.
#[test]
fn contents_that_lie_end_in_an_image_or_an_error() {
    let folder = Scratch::new("contents_that_lie_end_in_an_image_or_an_error");
    let path = folder.path().join("a.span");
    let sound = blocks(&sample(&path));
    assert!(try_read(&path, &file_of(&sound)).is_ok());
    let mut random = Random::new(21);
    let (mut images, mut errors) = (0, 0);
    for round in 0..6000 {
        let mut changed = sound.clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(changed.len() as u32) as usize;
            let (kind, a, b, body) = &mut changed[at];
            match random.below(8) {
                0 => *a = random.below(1 << 31) >> random.below(32),
                1 => *b = random.below(1 << 31) >> random.below(32),
                2 => *kind = [*b"head", *b"scen", *b"line", *b"face"][random.below(4) as usize],
                3 => body.truncate(random.below(body.len() as u32 + 1) as usize),
                _ if body.is_empty() => {}
                _ => {
                    let place = random.below(body.len() as u32) as usize;
                    body[place] = match random.below(3) {
                        0 => 0xff,
                        1 => body[place] ^ (1 << random.below(8)),
                        _ => random.below(256) as u8,
                    };
                }
            }
        }
        match try_read(&path, &file_of(&changed)) {
            Ok(image) => {
                images += 1;
                // Whatever it is of, it is an image.
                let side = image.view().raster();
                if side.width <= 200 && side.height <= 200 && image.rows() == (0..side.height) {
                    picture(&image, &[Channel::Color, Channel::Z, Channel::P, Channel::Id]);
                    let again = SpanImage::merge(&[image.clone(), image.clone()]).unwrap();
                    assert_eq!(again.lines().range(), image.lines().range(), "round {round}");
                }
            }
            Err(error) => {
                errors += 1;
                assert!(error.to_string().contains("a.span"), "round {round}: {error}");
            }
        }
    }
    assert!(images > 100 && errors > 1000, "{images} images, {errors} errors");
}

#[test]
fn lengths_that_lie_allocate_nothing() {
    let folder = Scratch::new("lengths_that_lie_allocate_nothing");
    let path = folder.path().join("a.span");
    let bytes = sample(&path);
    for (at, value) in [(12, u64::MAX), (12, 1 << 40), (20, u64::MAX), (20, 1 << 29)] {
        let mut changed = bytes.clone();
        changed[16 + at..16 + at + 8].copy_from_slice(&value.to_le_bytes());
        let checksum = crc32fast::hash(&changed[16..48]);
        changed[48..52].copy_from_slice(&checksum.to_le_bytes());
        let error = try_read(&path, &changed).unwrap_err().to_string();
        assert!(error.contains("block \"head\""), "{error}");
    }
}

/// A file written by hand from its documentation: two triangles' worth of walls, one before the other.
#[test]
fn any_program_can_write_one() {
    let head = r#"{
        "writer": "by hand", "width": 8, "height": 2, "lines_per_row": 1, "phase": "Centre", "rows": [0, 2],
        "camera": {"position": [0, 0, 10], "look_at": [0, 0, 0], "parallel_height": 2},
        "sources": [{"label": "walls", "scene": "00000000000000000000000000000001"}]
    }"#;
    let run = |bytes: &[u8]| {
        assert!(bytes.len() < 128);
        [&[bytes.len() as u8][..], bytes].concat()
    };
    let number = |mut n: u64| {
        let mut out = Vec::new();
        while n >= 128 {
            out.push(n as u8 | 128);
            n >>= 7;
        }
        out.push(n as u8);
        out
    };
    let signed = |n: i64| number(if n < 0 { (-2 * n - 1) as u64 } else { 2 * n as u64 });
    // A cell is 2^-28 pixels: 8 has 28 leading zeros.
    let cell = |pixels: f64| (pixels * (1u64 << 28) as f64) as u64;
    // Line 0: nothing, face 5 from 2 to 6, nothing. Line 1: the same, with face 9 from 4 on before it: keep
    // two, one new, keep one.
    let operations =
        [number(3), number(4 * 2 + 2), number(4), number(4), number(2), number(0)].concat();
    let moves = [signed(0), signed(0), signed(0)].concat();
    let faces = [signed(-1), signed(6), signed(-6), signed(4)].concat();
    let places = [number(0), number(cell(2.0)), number(cell(4.0)), number(cell(2.0))].concat();
    let spans = [run(&operations), run(&moves), run(&faces), run(&places)].concat();
    let none = [run(&[0, 0]), run(&[]), run(&[]), run(&[])].concat();
    let doubles = |values: &[f64]| {
        let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
        let mixed: Vec<u64> =
            (0..bits.len()).map(|i| bits[i] ^ if i > 0 { bits[i - 1] } else { 0 }).collect();
        (0..8)
            .rev()
            .flat_map(|byte| mixed.iter().map(move |v| (v >> (8 * byte)) as u8))
            .collect::<Vec<u8>>()
    };
    let floats = |values: &[f32]| {
        let bits: Vec<u32> = values.iter().map(|v| v.to_bits()).collect();
        let mixed: Vec<u32> =
            (0..bits.len()).map(|i| bits[i] ^ if i > 0 { bits[i - 1] } else { 0 }).collect();
        (0..4)
            .rev()
            .flat_map(|byte| mixed.iter().map(move |v| (v >> (8 * byte)) as u8))
            .collect::<Vec<u8>>()
    };
    let table = [
        run(&[5, 4]),
        run(&[0, 1]),
        run(&[1, 1 + 32]),
        run(&[0, 0]),
        run(&[]),
        run(&[doubles(&[0.0, 0.0]), doubles(&[0.0, 0.0]), doubles(&[-10.0, -8.0])].concat()),
        run(&[1, 4, 0]),
        run(&[0, 0, 0, 0]),
        run(&[vec![4], doubles(&[2.0, 6.0, 6.0, 2.0]), doubles(&[0.0, 0.0, 2.0, 2.0])].concat()),
        run(&[0, 1]),
        run(&[
            vec![2],
            floats(&[1.0, 0.0]),
            floats(&[0.0, 0.5]),
            floats(&[0.0, 0.0]),
            floats(&[1.0, 1.0]),
        ]
        .concat()),
        run(&[0, 0]),
        run(&[vec![1], run(b"wall")].concat()),
    ]
    .concat();
    let bytes = file_of(&[
        (*b"head", 0, 0, head.as_bytes().to_vec()),
        (*b"line", 0, 2, [spans, none].concat()),
        (*b"note", 7, 7, b"skipped".to_vec()),
        (*b"face", 0, 2, table),
        (*b"end ", 4, 0, Vec::new()),
    ]);
    let folder = Scratch::new("any_program_can_write_one");
    let path = folder.path().join("a.span");
    let image = try_read(&path, &bytes).unwrap();
    let result = picture(&image, &[Channel::Color, Channel::Z]);
    let channel = |name: &str| match result.channel(name).unwrap() {
        spandrel_engine::image::Samples::Float(values) => values.clone(),
        spandrel_engine::image::Samples::Id(_) => unreachable!(),
    };
    let (red, green, z) = (channel("R"), channel("G"), channel("Z"));
    assert_eq!(red[..8], [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    assert_eq!(red[8..], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(green[8..], [0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    assert_eq!(z[8 + 3..8 + 6], [10.0, 8.0, 8.0]);
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
    let fog = |density| Fog { density, color: Color::WHITE, start: 0.0 };
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

#[test]
fn a_file_holds_what_its_documentation_allows() {
    let scratch = Scratch::new("a_file_holds_what");
    let path = scratch.path().join("a.span");
    let sound = blocks(&sample(&path));
    let error = |blocks: &[([u8; 4], u32, u32, Vec<u8>)]| {
        try_read(&path, &file_of(blocks)).unwrap_err().to_string()
    };
    let mut twice = sound.clone();
    twice.insert(1, sound[0].clone());
    twice.last_mut().unwrap().1 += 1;
    assert!(error(&twice).contains("it is there twice"));
    let mut missing = sound.clone();
    missing.retain(|(kind, ..)| kind != b"line");
    missing.last_mut().unwrap().1 -= 1;
    assert!(error(&missing).contains("its lines end with 0, not 80"));
    let mut many = sound.clone();
    many[1].2 = 5000;
    assert!(error(&many).contains("at most 4096 lines"), "{}", error(&many));
    let mut uncounted = sound;
    uncounted.last_mut().unwrap().1 += 1;
    assert!(error(&uncounted).contains("blocks stand before it"));
}
