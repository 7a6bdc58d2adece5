//! Pictures as compositors have them: layers, parts, windows, kinds of colour, what is kept, and what is told.

use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, SmallVec, Vec2, WritableImage,
};
use glam::DVec3;
use spandrel_engine::image::{Image, Samples, Window, file};
use spandrel_tests::graphs::Nodes;
use spandrel_tests::png;
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

type Flat = Layer<AnyChannels<FlatSamples>>;

/// A layer of 4 by 2 pixels, whose channels have one value each.
fn part(name: &str, channels: &[(&str, f32)]) -> Flat {
    let channel =
        |(name, value): &(&str, f32)| AnyChannel::new(*name, FlatSamples::F32(vec![*value; 8]));
    let attributes = LayerAttributes::named(name);
    let channels = AnyChannels::sort(channels.iter().map(channel).collect());
    Layer::new((4, 2), attributes, Encoding::FAST_LOSSLESS, channels)
}

fn write(path: &Path, layers: Vec<Flat>, change: impl FnOnce(&mut ImageAttributes)) {
    let mut attributes = ImageAttributes::new(IntegerBounds::new((0, 0), (4, 2)));
    change(&mut attributes);
    let layer_data: SmallVec<[Flat; 2]> = layers.into_iter().collect();
    exr::image::Image { attributes, layer_data }.write().to_file(path).unwrap();
}

/// What `Read` makes of `a.exr` in a folder, with more fields.
fn read(folder: &Path, fields: &str) -> Result<(Image, Vec<String>), String> {
    let nodes = Nodes::new(folder, &format!(r#""p": Read(file: "a.exr" {fields})"#));
    nodes.picture("p", None).map(|made| (Image::clone(&made.image), made.notes))
}

fn render(folder: &Path, nodes: &str) -> Ran {
    std::fs::write(folder.join("g.ron"), format!("Graph(nodes: {{{nodes}}})")).unwrap();
    run(PROGRAM, &["render", "g.ron"], folder)
}

#[test]
fn any_layer_is_the_colour_that_is_asked_for() {
    let folder = Scratch::new("any_layer");
    let (folder, path) = (folder.path(), folder.path().join("a.exr"));
    let rgb = |layer: &str, v: f32| {
        let dot = if layer.is_empty() { "" } else { "." };
        ["R", "G", "B"].map(|axis| format!("{layer}{dot}{axis}")).map(|name| (name, v)).to_vec()
    };
    let mixed = [
        rgb("", 0.1),
        rgb("diffuse", 0.2),
        rgb("left.spec", 0.3),
        vec![("Z".into(), 7.0), ("mask.A".into(), 0.5)],
    ]
    .concat();
    let mixed: Vec<(&str, f32)> = mixed.iter().map(|(name, v)| (name.as_str(), *v)).collect();
    write(&path, vec![part("", &mixed)], |_| {});
    let seen = |fields: &str| read(folder, fields).unwrap().0.rgba(1, 1);
    assert_eq!(seen(""), [0.1, 0.1, 0.1, 1.0]);
    assert_eq!(seen(r#", layer: "diffuse""#), [0.2, 0.2, 0.2, 1.0]);
    assert_eq!(seen(r#", layer: "left.spec""#)[0], 0.3);
    let error = read(folder, r#", layer: "difuse""#).unwrap_err();
    assert!(error.contains("a.exr") && error.contains("diffuse"), "{error}");
    // Part by part, as Gaffer and Nuke write them; an empty name; a part called rgba.
    let three = || {
        [("rgba", 0.4), ("diffuse", 0.5), ("depth", 9.0)].map(|(name, v)| match name {
            "depth" => part(name, &[("Z", v)]),
            _ => part(name, &[("B", v), ("G", v), ("R", v)]),
        })
    };
    write(&path, three().to_vec(), |_| {});
    assert_eq!(seen("")[0], 0.4, "of the part called rgba");
    assert_eq!(seen(r#", layer: "diffuse""#)[0], 0.5);
    assert_eq!(seen(r#", part: "diffuse""#)[0], 0.5);
    assert_eq!(seen(r#", part: "1""#)[0], 0.5);
    let error = read(folder, r#", part: "difuse""#).unwrap_err();
    assert!(error.contains("diffuse"), "{error}");
    // Several that have colour, none of them the main one: all are listed.
    write(
        &path,
        vec![
            part("key", &[("R", 1.0), ("G", 1.0), ("B", 1.0)]),
            part("fill", &[("R", 1.0), ("G", 1.0), ("B", 1.0)]),
        ],
        |_| {},
    );
    let error = read(folder, "").unwrap_err();
    assert!(error.contains("key") && error.contains("fill") && error.contains("layer"), "{error}");
    // The only one that has colour.
    write(
        &path,
        vec![part("key", &[("R", 0.6), ("G", 0.6), ("B", 0.6)]), part("z", &[("Z", 1.0)])],
        |_| {},
    );
    assert_eq!(seen("")[0], 0.6);
    // Luminance alone.
    write(&path, vec![part("", &[("Y", 0.7)])], |_| {});
    assert_eq!(seen("")[..3], [0.7; 3]);
}

#[test]
fn a_plate_with_less_than_its_display_is_a_plate() {
    let folder = Scratch::new("smaller_plate");
    let path = folder.path().join("a.exr");
    let mut small = part("", &[("R", 0.5), ("G", 0.5), ("B", 0.5)]);
    small.attributes.layer_position = Vec2(3, 1);
    write(&path, vec![small], |attributes| {
        attributes.display_window = IntegerBounds::new((0, 0), (10, 6))
    });
    let ran = render(
        folder.path(),
        r#""r": Read(file: "a.exr"), "g": Grade(image: "r", multiply: 2), "w": Write(image: "g", path: "b.exr", bits: 32)"#,
    );
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let made = file::read(&folder.path().join("b.exr")).unwrap().whole();
    assert_eq!(made.size, (10, 6));
    for y in 0..6 {
        for x in 0..10 {
            let is_in = (3..7).contains(&x) && (1..3).contains(&y);
            assert_eq!(made.rgba(x, y)[0], if is_in { 1.0 } else { 0.0 }, "{x} {y}");
        }
    }
}

#[test]
fn what_is_read_is_written_again() {
    let folder = Scratch::new("read_and_written");
    let (a, b) = (folder.path().join("a.exr"), folder.path().join("b.exr"));
    let id = |i: usize| 70_000 + i as u32 * 3;
    let mut layer = part(
        "",
        &[
            ("R", 0.25),
            ("G", 0.5),
            ("B", 0.75),
            ("light_key.R", 0.1),
            ("light_key.G", 0.2),
            ("light_key.B", 0.3),
            ("Z", 1234.567),
        ],
    );
    let ids = AnyChannel::new("object", FlatSamples::U32((0..8).map(id).collect()));
    let mut list = layer.channel_data.list.to_vec();
    list.push(ids);
    layer.channel_data = AnyChannels::sort(list.into_iter().collect());
    layer.attributes.comments = Some("of a show".into());
    write(&a, vec![layer], |_| {});
    let ran = render(
        folder.path(),
        r#""r": Read(file: "a.exr"), "w": Write(image: "r", path: "b.exr", bits: 16)"#,
    );
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let back = exr::prelude::read_all_flat_layers_from_file(&b).unwrap();
    let back = &back.layer_data[0];
    let of = |name: &str| back.channel_data.list.iter().find(|c| c.name.to_string() == name);
    let FlatSamples::U32(ids) = &of("object").unwrap().sample_data else {
        panic!("ids are whole numbers")
    };
    assert!(ids.iter().enumerate().all(|(i, v)| *v == id(i)));
    let FlatSamples::F32(z) = &of("Z").unwrap().sample_data else { panic!("depth keeps its bits") };
    assert!(z.iter().all(|z| *z == 1234.567));
    assert!(matches!(of("R").unwrap().sample_data, FlatSamples::F16(_)), "bits: 16 is of colours");
    assert_eq!(
        back.attributes.comments.as_ref().map(ToString::to_string),
        Some("of a show".to_owned())
    );
    // Just what is asked for.
    let ran = render(
        folder.path(),
        r#""r": Read(file: "a.exr"), "w": Write(image: "r", path: "b.exr", channels: [Z])"#,
    );
    assert_eq!(ran.code, Some(0), "{ran:?}");
    let made = file::read(&b).unwrap();
    assert_eq!(made.channels().map(|(name, _)| name).collect::<Vec<_>>(), ["Z"]);
    // And what is not there is told, not left out.
    let ran = render(
        folder.path(),
        r#""r": Read(file: "a.exr"), "w": Write(image: "r", path: "c.exr", channels: [Color, N])"#,
    );
    assert!(
        ran.code != Some(0) && ran.err.contains('N') && !folder.path().join("c.exr").exists(),
        "{ran:?}"
    );
}

#[test]
fn layers_of_light_sum_to_the_colour_whatever_is_done_to_it() {
    let folder = Scratch::new("layers_sum");
    let path = folder.path().join("a.exr");
    let three = |layer: &str, v: [f32; 3]| -> Vec<(String, f32)> {
        ["R", "G", "B"].iter().zip(v).map(|(axis, v)| (format!("{layer}{axis}"), v)).collect()
    };
    let all = [
        three("", [0.6, 0.5, 0.4]),
        three("light_key.", [0.4, 0.3, 0.1]),
        three("rest.", [0.2, 0.2, 0.3]),
    ]
    .concat();
    let all: Vec<(&str, f32)> = all.iter().map(|(name, v)| (name.as_str(), *v)).collect();
    write(&path, vec![part("", &all)], |_| {});
    for node in [
        r#"Grade(image: "r", multiply: 1.7)"#,
        r#"Grade(image: "r", gamma: 2.2, add: 0.03)"#,
        r#"Blur(image: "r", radius: 0.1)"#,
        r#"Reformat(image: "r", size: (7, 5))"#,
    ] {
        let graph = format!(
            r#""r": Read(file: "a.exr"), "g": {node}, "w": Write(image: "g", path: "b.exr", bits: 32)"#
        );
        let ran = render(folder.path(), &graph);
        assert_eq!(ran.code, Some(0), "{ran:?}");
        let made = file::read(&folder.path().join("b.exr")).unwrap();
        for axis in ["R", "G", "B"] {
            let of = |name: &str| made.float(&format!("{name}{axis}")).unwrap().to_vec();
            for ((color, key), rest) in of("").iter().zip(of("light_key.")).zip(of("rest.")) {
                assert!(
                    (color - key - rest).abs() < 1e-5 * (1.0 + color.abs()),
                    "{node}: {color} {key} {rest}"
                );
            }
        }
    }
}

#[test]
fn samples_that_are_not_finite_are_refused_or_become_what_is_asked() {
    let folder = Scratch::new("not_finite");
    let folder = folder.path();
    let mut image = Image::new((4, 2), Window::whole(4, 2));
    for name in ["R", "G", "B"] {
        let mut values: Vec<f32> = (0..8).map(|i| i as f32).collect();
        if name == "G" {
            values[5] = f32::INFINITY;
            values[1] = f32::NAN;
        }
        image.insert(name, Samples::Float(values)).unwrap();
    }
    file::write(&image, &folder.join("a.exr"), Some(32)).unwrap();
    let error = read(folder, "").unwrap_err();
    assert!(
        error.contains("channel G of pixel 1, 0 is NaN") && error.contains("not_finite"),
        "{error}"
    );
    let (zero, notes) = read(folder, ", not_finite: Zero").unwrap();
    assert_eq!((zero.rgba(1, 0)[1], zero.rgba(1, 1)[1], zero.rgba(2, 1)[1]), (0.0, 0.0, 6.0));
    assert!(notes.iter().any(|note| note.starts_with("2 samples")), "{notes:?}");
    let (near, _) = read(folder, ", not_finite: Nearest").unwrap();
    let [a, b] = [near.rgba(1, 0)[1], near.rgba(1, 1)[1]];
    assert!([0.0, 2.0].contains(&a) && [4.0, 6.0].contains(&b), "{a} {b}");
    assert_eq!(near.rgba(1, 0)[0], 1.0);
}

#[test]
fn colours_of_other_primaries_are_those_of_rec_709() {
    let folder = Scratch::new("primaries");
    let (folder, path) = (folder.path(), folder.path().join("a.exr"));
    let acescg = Chromaticities {
        red: Vec2(0.713, 0.293),
        green: Vec2(0.165, 0.83),
        blue: Vec2(0.128, 0.044),
        white: Vec2(0.32168, 0.33767),
    };
    let of = |color: [f32; 3], chromaticities| {
        let [r, g, b] = color;
        write(&path, vec![part("", &[("R", r), ("G", g), ("B", b)])], |a| {
            a.chromaticities = chromaticities
        });
        read(folder, "").unwrap()
    };
    // White is white; red is what is published for the matrix from AP1 to Rec. 709 (D60 to D65, Bradford).
    let (white, notes) = of([1.0; 3], Some(acescg));
    assert!(white.rgba(0, 0).iter().all(|v| (v - 1.0).abs() < 1e-5), "{:?}", white.rgba(0, 0));
    assert!(!notes.is_empty());
    let (red, _) = of([1.0, 0.0, 0.0], Some(acescg));
    for (seen, known) in red.rgba(0, 0).into_iter().zip([1.70505, -0.13026, -0.02400]) {
        assert!((seen - known).abs() < 2e-4, "{seen} {known}");
    }
    let (own, notes) = of([0.3, 0.2, 0.1], None);
    assert_eq!((own.rgba(0, 0), notes.len()), ([0.3, 0.2, 0.1, 1.0], 0));
}

/// The bytes of a PNG of one grey row, with chunks before its pixels.
fn png(width: u32, height: u32, grey: &[u8], before: &[(&[u8], Vec<u8>)]) -> Vec<u8> {
    let mut head = [width.to_be_bytes(), height.to_be_bytes()].concat();
    head.extend([8, 0, 0, 0, 0]);
    let pixels = png::packed(&[&[0], grey].concat());
    let before = before.iter().map(|(kind, data)| (*kind, &data[..]));
    let end: [(&[u8], &[u8]); 2] = [(b"IDAT", &pixels), (b"IEND", &[])];
    png::file([(&b"IHDR"[..], &head[..])].into_iter().chain(before).chain(end))
}

#[test]
fn a_png_says_how_its_colours_are_coded() {
    let folder = Scratch::new("coded_png");
    let seen = |before: &[(&[u8], Vec<u8>)]| {
        std::fs::write(folder.path().join("a.png"), png(3, 1, &[0, 128, 255], before)).unwrap();
        file::read(&folder.path().join("a.png")).unwrap().rgba(1, 0)[0]
    };
    let v: f32 = 128.0 / 255.0;
    let srgb = spandrel_engine::math::powf((v + 0.055) / 1.055, 2.4);
    assert!((seen(&[]) - srgb).abs() < 1e-5);
    assert!((seen(&[(b"sRGB", vec![0])]) - srgb).abs() < 1e-5);
    // gAMA: the power with which it was coded, times 100000. sRGB beside it counts for more.
    let gamma = |power: u32| (&b"gAMA"[..], power.to_be_bytes().to_vec());
    assert!((seen(&[gamma(100_000)]) - v).abs() < 1e-5, "linear");
    assert!((seen(&[gamma(50_000)]) - v * v).abs() < 1e-4);
    assert!((seen(&[(b"sRGB", vec![0]), gamma(100_000)]) - srgb).abs() < 1e-5);
    // cICP: Rec. 709's primaries, linear.
    assert!((seen(&[(b"cICP", vec![1, 8, 0, 1])]) - v).abs() < 1e-4);
}

#[test]
fn headers_that_promise_too_much_are_errors_before_anything_is_taken() {
    let folder = Scratch::new("bombs");
    let folder = folder.path();
    // A picture of 60000 by 60000 pixels in less than a hundred bytes, as picture, texture and sky.
    std::fs::write(folder.join("bomb.png"), png(60_000, 60_000, &[0; 8], &[])).unwrap();
    let sky = r#""l": SkyLight(picture: "bomb.png"), "eye": Camera(), "s": Scanline(scene: "s.ron", camera: "eye"), "i": Illuminate(image: "s", lights: ["l"]), "p": Resolve(image: "i", size: (4, 4))"#;
    let texture = r#""eye": Camera(), "s": Scanline(scene: "s.ron", camera: "eye"), "p": Resolve(image: "s", size: (4, 4))"#;
    let scene = r#"Scene(materials: {"m": (unlit: true, maps: {"color": (picture: File("bomb.png"))})}, plans: [(name: "p", root: (material: "m", shape: Box(size: (1, 1, 1))))])"#;
    std::fs::write(folder.join("s.ron"), scene).unwrap();
    for nodes in [r#""p": Read(file: "bomb.png")"#, sky, texture] {
        let ran = render(folder, &format!(r#"{nodes}, "w": Write(image: "p", path: "a.png")"#));
        assert!(ran.code.is_some_and(|code| code != 0 && code != 101), "{nodes}: {ran:?}");
        assert!(ran.err.contains("bomb.png"), "{nodes}: {ran:?}");
    }
    // A sound picture that is larger than is allowed says how large it is, how large it may be, and the cure.
    let sound = folder.join("sound.png");
    image::GrayImage::from_pixel(3000, 3000, image::Luma([9])).save(&sound).unwrap();
    std::fs::write(
        folder.join("g.ron"),
        r#"Graph(nodes: {"p": Read(file: "sound.png"), "w": Write(image: "p", path: "a.png")})"#,
    )
    .unwrap();
    let ran = run(PROGRAM, &["render", "g.ron", "--largest-picture", "1M"], folder);
    for word in ["sound.png", "3000 by 3000", "--largest-picture"] {
        assert!(ran.err.contains(word), "{word}: {ran:?}");
    }
    assert_eq!(
        run(PROGRAM, &["render", "g.ron", "--largest-picture", "500M"], folder).code,
        Some(0)
    );
}

#[test]
fn pictures_of_all_kinds_show_what_they_show_as_png() {
    let folder = Scratch::new("all_kinds");
    let at = |x: u32, y: u32| image::Rgba([(x * 20) as u8, (y * 30) as u8, 77, 255]);
    let picture = image::RgbaImage::from_fn(9, 7, at);
    let plain = image::DynamicImage::ImageRgba8(picture).into_rgb8();
    let path = |ending: &str| folder.path().join(format!("a.{ending}"));
    plain.save(path("png")).unwrap();
    let known = file::read(&path("png")).unwrap();
    for ending in ["tiff", "bmp", "tga", "webp"] {
        plain.save(path(ending)).unwrap();
        let seen = file::read(&path(ending)).unwrap_or_else(|error| panic!("{ending}: {error}"));
        for y in 0..7 {
            for x in 0..9 {
                assert_eq!(seen.rgba(x, y), known.rgba(x, y), "{ending} {x} {y}");
            }
        }
        // Under another's name it is what it is, and told.
        if ending != "tga" {
            std::fs::copy(path(ending), folder.path().join("b.jpg")).unwrap();
            let nodes = Nodes::new(folder.path(), r#""p": Read(file: "b.jpg")"#);
            let made = nodes.picture("p", None).unwrap();
            assert_eq!(made.image.rgba(3, 3), known.rgba(3, 3), "{ending}");
            assert!(made.notes.iter().any(|note| note.contains("although its name")), "{ending}");
        }
    }
}

#[test]
fn radiance_pictures_lie_as_they_say_and_are_as_bright_as_they_say() {
    let folder = Scratch::new("radiance");
    let path = folder.path().join("a.hdr");
    // Three columns and two rows; a pixel's mantissa says which it is.
    let value = |x: usize, y: usize| (40 + 40 * x + 20 * y) as u8;
    let write = |lines: &str, size: &str, order: &[(usize, usize)]| {
        let mut bytes =
            format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
        order
            .iter()
            .for_each(|(x, y)| bytes.extend([value(*x, *y), value(*x, *y), value(*x, *y), 128]));
        std::fs::write(&path, bytes).unwrap();
        file::read(&path).unwrap()
    };
    let rows = |ys: [usize; 2], xs: [usize; 3]| {
        ys.into_iter().flat_map(|y| xs.map(|x| (x, y))).collect::<Vec<_>>()
    };
    let columns = |xs: [usize; 3], ys: [usize; 2]| {
        xs.into_iter().flat_map(|x| ys.map(|y| (x, y))).collect::<Vec<_>>()
    };
    let (right, left, down, up) = ([0, 1, 2], [2, 1, 0], [0, 1], [1, 0]);
    let cases = [
        ("-Y 2 +X 3", rows(down, right)),
        ("-Y 2 -X 3", rows(down, left)),
        ("+Y 2 +X 3", rows(up, right)),
        ("+Y 2 -X 3", rows(up, left)),
        ("+X 3 -Y 2", columns(right, down)),
        ("-X 3 -Y 2", columns(left, down)),
        ("+X 3 +Y 2", columns(right, up)),
        ("-X 3 +Y 2", columns(left, up)),
    ];
    let shown = |x: usize, y: usize| (f32::from(value(x, y)) + 0.5) / 256.0;
    for (size, order) in cases {
        let picture = write("", size, &order);
        assert_eq!(picture.size, (3, 2), "{size}");
        for y in 0..2 {
            for x in 0..3 {
                let seen = picture.rgba(x as u32, y as u32)[0];
                let known = shown(x, y);
                assert!((seen - known).abs() < 0.6 / 256.0, "{size}: {x} {y} {seen} {known}");
            }
        }
    }
    let order = rows(down, right);
    let plain = write("", "-Y 2 +X 3", &order).rgba(2, 1)[0];
    let bright = write("EXPOSURE=4\nEXPOSURE=2\n", "-Y 2 +X 3", &order).rgba(2, 1)[0];
    assert!((plain / bright - 8.0).abs() < 1e-5, "what was multiplied in is divided out");
}

#[test]
fn info_tells_what_a_picture_is() {
    let folder = Scratch::new("info_of_pictures");
    write(
        &folder.path().join("a.exr"),
        vec![part("", &[("R", 0.5), ("G", f32::NAN), ("B", 0.5), ("Z", 1.0)])],
        |_| {},
    );
    let ran = run(PROGRAM, &["info", "a.exr"], folder.path());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for word in ["OpenEXR", "4 x 2 pixels", "main layer", "channel G: 8 samples not finite"] {
        assert!(ran.out.contains(word), "{word}: {ran:?}");
    }
    std::fs::write(folder.path().join("empty.png"), "").unwrap();
    let ran = run(PROGRAM, &["info", "empty.png"], folder.path());
    assert!(ran.code != Some(0) && ran.err.contains("empty"), "{ran:?}");
}

#[test]
fn pictures_say_where_the_camera_was() {
    let folder = Scratch::new("where");
    let place = DVec3::new(0.7, 0.4, -0.3);
    let scene = format!(
        "Scene(plans: [(name: \"p\", root: (transform: [Move({}, {}, {})], shape: Sphere(radius: 0.02)))])",
        place.x, place.y, place.z
    );
    std::fs::write(folder.path().join("dot.ron"), scene).unwrap();
    for camera in [
        "position: (1, 2, 6), look_at: (0.2, 0.6, 0), field_of_view: 30, roll: 20",
        "position: (1, 2, 6), look_at: (0.2, 0.6, 0), parallel_height: 3, front: 1, back: 20",
    ] {
        for (resolve, node) in [
            ("", r#"Grade(image: "p", multiply: 1)"#),
            (", scale: (2, 3), pan: (11, -7)", r#"Quantize(image: "p", colors: 4)"#),
            (
                "",
                r#"Reformat(image: "p", size: (90, 70), shift: (0.1, 0.05), turn: 12, scale: (0.8, 0.8))"#,
            ),
        ] {
            let ran = render(
                folder.path(),
                &format!(
                    r#""eye": Camera({camera}), "s": Scanline(scene: "dot.ron", camera: "eye"),
                    "p": Resolve(image: "s", size: (64, 48){resolve}), "x": {node},
                    "w": Write(image: "x", path: "x.exr", channels: [Color], bits: 32)"#
                ),
            );
            assert_eq!(ran.code, Some(0), "{ran:?}");
            let read =
                exr::prelude::read_all_flat_layers_from_file(folder.path().join("x.exr")).unwrap();
            let layer = &read.layer_data[0];
            // As the standard has it: a point is a row, and multiplied from the left.
            let times = |matrix: [f32; 16], point: DVec3| -> [f64; 4] {
                let row = point.extend(1.0).to_array();
                std::array::from_fn(|column| {
                    (0..4).map(|i| row[i] * f64::from(matrix[4 * i + column])).sum()
                })
            };
            let [x, y, _, w] = times(layer.attributes.world_to_normalized_device.unwrap(), place);
            let (width, height) = (layer.size.0, layer.size.1);
            let told = [x / w * width as f64, y / w * height as f64];
            // Where the dot is: the middle of what differs from the corner.
            let channel =
                layer.channel_data.list.iter().find(|c| c.name.to_string() == "R").unwrap();
            let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
            let (mut sum, mut all) = ([0.0; 2], 0.0);
            for (at, value) in values.iter().enumerate() {
                let weight = f64::from((value - values[0]).abs());
                all += weight;
                sum[0] += weight * ((at % width) as f64 + 0.5);
                sum[1] += weight * ((at / width) as f64 + 0.5);
            }
            let off = [sum[0] / all - told[0], sum[1] / all - told[1]];
            assert!(
                off.iter().all(|off| off.abs() < 0.6),
                "{camera} {node}: {told:?} off by {off:?}"
            );
            let [x, y, z, _] = times(layer.attributes.world_to_camera.unwrap(), place);
            let ray = DVec3::new(0.2, 0.6, 0.0) - DVec3::new(1.0, 2.0, 6.0);
            let deep = (place - DVec3::new(1.0, 2.0, 6.0)).dot(ray.normalize());
            assert!((z - deep).abs() < 1e-5, "{z} {deep}");
            assert!(
                (DVec3::new(x, y, z).length() - (place - DVec3::new(1.0, 2.0, 6.0)).length()).abs()
                    < 1e-5
            );
            let clips = [layer.attributes.near_clip_plane, layer.attributes.far_clip_plane];
            assert_eq!(
                clips,
                if camera.contains("back") { [Some(1.0), Some(20.0)] } else { [None; 2] }
            );
            assert!(
                layer
                    .attributes
                    .software_name
                    .as_ref()
                    .unwrap()
                    .to_string()
                    .starts_with("Spandrel ")
            );
        }
    }
}
