//! Files of pictures and the files that name them: every kind is read or refused by name, lies where it says, and
//! those of other people show what is in them.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::camera::Camera;
use spandrel_engine::image::{Channel, Image, Samples, Window, file};
use spandrel_engine::scene::{Map, Picture, read};
use spandrel_engine::texture::{Mapping, TextureFilter};
use spandrel_tests::data;
use spandrel_tests::png;
use spandrel_tests::program::Scratch;
use spandrel_tests::scenes::painted_faces;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use crate::textures::{
    above, colors, floor, made, map, mapped, painted, scratch, shown, spans, unlit, view,
};

#[test]
fn pictures_of_every_kind_are_read_or_refused_by_name() {
    let show = |path: &str| {
        let material = mapped("color", map(path, Mapping::default()), unlit());
        let image = spans(made(&[(floor(1.0), material)]), &above(2.0, 4));
        shown(&image, TextureFilter::default(), &[Channel::Color])
    };
    let error = |path: &str| {
        let error = show(path).unwrap_err();
        assert!(error.contains(path), "{error}");
        error
    };
    error(&scratch("missing.png").to_string_lossy());
    let write = |name: &str, bytes: &[u8]| {
        let path = scratch(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_string_lossy().into_owned()
    };
    assert!(error(&write("text.png", b"no picture")).contains("does not begin as a PNG does"));
    assert!(error(&write("empty.jpg", b"")).contains("empty"));
    let sound = std::fs::read(painted("sound.png", 9, 9, |x, _| [x as f32 / 9.0; 4])).unwrap();
    assert!(error(&write("cut.png", &sound[..sound.len() / 2])).contains("not a sound PNG"));
    assert!(error(&write("cut.jpg", b"\xff\xd8\xff\xe0\0\x10JFIF")).contains("not a sound JPEG"));
    // A photograph that breaks off in its middle, as a picture on a surface and as one of a graph.
    let photo =
        std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../graphs/assets/photos/oak.jpg"))
            .unwrap();
    let broken = write("broken.jpg", &photo[..photo.len() * 3 / 5]);
    assert!(error(&broken).contains("breaks off"));
    assert!(file::read(broken.as_ref()).unwrap_err().to_string().contains("breaks off"));
    // What stands behind its end, whatever it is, does not count.
    let more = [&photo[..], b"\xff\xda\x00\x08 of another \xff"].concat();
    assert!(file::read(write("more.jpg", &more).as_ref()).is_ok());
    // A header that announces four thousand million pixels.
    let mut huge = sound.clone();
    huge[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let checksum = crc32fast::hash(&huge[12..29]);
    huge[29..33].copy_from_slice(&checksum.to_be_bytes());
    let said = error(&write("huge.png", &huge));
    assert!(said.contains("pixels"), "{said}");
    // One texel.
    let one = painted("one.png", 1, 1, |_, _| [0.25, 0.5, 0.75, 1.0]);
    let picture = show(&one).unwrap();
    for (name, wanted) in [("R", 0.25), ("G", 0.5), ("B", 0.75)] {
        let seen = picture.float(name).unwrap()[5];
        assert!((seen - wanted).abs() < 1e-4, "{name}: {seen}");
    }
    // A palette, greys of 1 and 16 bits, and colours of 16 bits are the colours that they stand for.
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType as Kind, ImageEncoder};
    let png = |name: &str, bytes: &[u8], kind: Kind| {
        let mut out = Vec::new();
        PngEncoder::new(&mut out).write_image(bytes, 2, 2, kind).unwrap();
        write(name, &out)
    };
    let linear = |v: f64| ((v + 0.055) / 1.055).powf(2.4) as f32;
    let half = linear(128.0 / 255.0);
    let wide = 32_896u16.to_ne_bytes();
    let colours: Vec<u8> = [wide, [0, 0], wide].concat().repeat(4);
    let cases = [
        (png("grey.png", &[128; 4], Kind::L8), [half; 3]),
        (png("grey16.png", &wide.repeat(4), Kind::L16), [half; 3]),
        (png("colours16.png", &colours, Kind::Rgb16), [half, 0.0, half]),
        (write("palette.png", &palette(&[[128, 0, 128]], &[0; 4])), [half, 0.0, half]),
    ];
    for (path, wanted) in cases {
        let picture = show(&path).unwrap();
        for (name, wanted) in ["R", "G", "B"].into_iter().zip(wanted) {
            let seen = picture.float(name).unwrap()[5];
            assert!((seen - wanted).abs() < 1e-3, "{path} {name}: {seen} {wanted}");
        }
    }
    // Names and numbers that no map has.
    let wrong = [
        ("colour", map(&one, Mapping::default()), "no such map"),
        ("color", Map { strength: 2.0, ..map(&one, Mapping::default()) }, "0 to 1"),
        ("bump", Map { strength: f32::NAN, ..map(&one, Mapping::default()) }, "finite"),
        ("color", map(&one, Mapping { length: DVec2::ZERO, ..Mapping::default() }), "length"),
        ("bump", Map::of(Picture::Wave(f64::NAN, 1.0)), "Wave"),
        ("color", map("", Mapping::default()), "no file"),
    ];
    for (name, map, cure) in wrong {
        let material = mapped(name, map, unlit());
        let error = painted_faces(&[(floor(1.0), material)]).err().unwrap();
        assert!(error.contains(cure) && error.contains(name), "{error}");
    }
}

/// The bytes of a PNG of 2 by 2 pixels with a palette.
fn palette(colors: &[[u8; 3]], indices: &[u8; 4]) -> Vec<u8> {
    let rows = [0, indices[0], indices[1], 0, indices[2], indices[3]];
    let (colors, pixels) = (colors.concat(), png::packed(&rows));
    let chunks: [(&[u8], &[u8]); 4] = [
        (b"IHDR", &[0, 0, 0, 2, 0, 0, 0, 2, 8, 3, 0, 0, 0]),
        (b"PLTE", &colors),
        (b"IDAT", &pixels),
        (b"IEND", &[]),
    ];
    png::file(chunks)
}

/// A glTF file of one square on the ground from -1 to 1, unlit, whose texture coordinates 1 run over it from its upper
/// left corner, seen from above; those of set 0 are all alike.
fn gltf_square(name: &str, picture: &str, info: &str) -> PathBuf {
    let mut bytes: Vec<u8> = Vec::new();
    let corners = [(-1f32, -1f32), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    for (x, z) in corners {
        [x, 0.0, z].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    bytes.extend([0u8; 32]);
    for (x, z) in corners {
        [(x + 1.0) / 2.0, (z + 1.0) / 2.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    [0u16, 1, 2, 0, 2, 3].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    std::fs::write(scratch(&format!("{name}.bin")), &bytes).unwrap();
    let accessor = |view: u32, kind: &str, component: u32, count: u32| {
        format!(
            r#"{{"bufferView":{view},"componentType":{component},"count":{count},"type":"{kind}"{}}}"#,
            if view == 0 { r#","min":[-1,0,-1],"max":[1,0,1]"# } else { "" }
        )
    };
    let views = [(0, 48), (48, 32), (80, 32), (112, 12)];
    let views = views
        .map(|(at, length)| format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{length}}}"#));
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_materials_unlit","KHR_texture_transform"],
        "extensionsRequired":["KHR_texture_transform"],"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":2}},"indices":3,"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{info}}},"extensions":{{"KHR_materials_unlit":{{}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"{picture}"}}],
        "accessors":[{},{},{},{}],"bufferViews":[{}],"buffers":[{{"uri":"{name}.bin","byteLength":124}}]}}"#,
        accessor(0, "VEC3", 5126, 4),
        accessor(1, "VEC2", 5126, 4),
        accessor(2, "VEC2", 5126, 4),
        accessor(3, "SCALAR", 5123, 6),
        views.join(",")
    );
    let path = scratch(&format!("{name}.gltf"));
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn textures_of_gltf_lie_by_their_set_and_their_transform() {
    // Red to the right, green downwards, as glTF measures.
    let size = 64u32;
    let of = |i: u32| (i as f32 + 0.5) / size as f32;
    painted("ramp.png", size, size, |x, y| [of(x), of(y), 0.0, 1.0]);
    let view = above(2.0, 16);
    let cases: [(&str, [f64; 2], f64, [f64; 2]); 7] = [
        ("mirrored", [0.8, 0.1], 0.6, [-0.4, 0.4]),
        ("upside down", [0.2, 0.7], -0.35, [0.5, -0.5]),
        ("even right", [0.3, 0.8], std::f64::consts::FRAC_PI_2, [0.5, 0.5]),
        ("plain", [0.0, 0.0], 0.0, [1.0, 1.0]),
        ("moved", [0.25, 0.125], 0.0, [0.5, 0.75]),
        ("turned", [0.3, 0.45], 0.6, [0.4, 0.4]),
        ("right", [0.1, 0.9], std::f64::consts::FRAC_PI_2, [0.5, 0.7]),
    ];
    for (name, offset, rotation, scale) in cases {
        let info = format!(
            r#"{{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":{offset:?},"rotation":{rotation:?},"scale":{scale:?},"texCoord":1}}}}}}"#
        );
        let path = gltf_square(name, "ramp.png", &info);
        let loaded = read::scene(&path, None, name, &read::ReadOptions::default()).unwrap();
        let [r, g, _] = colors(&spans(Arc::new(loaded), &view), TextureFilter::default());
        for (x, y) in [(2usize, 3usize), (8, 8), (13, 5), (4, 12)] {
            let (u, w) = ((x as f64 + 0.5) / 16.0, (y as f64 + 0.5) / 16.0);
            let (sin, cos) = rotation.sin_cos();
            let (a, b) = (scale[0] * u, scale[1] * w);
            let expected = [cos * a + sin * b + offset[0], cos * b - sin * a + offset[1]];
            let seen = [r[y * 16 + x], g[y * 16 + x]].map(f64::from);
            for k in 0..2 {
                let expected = expected[k].rem_euclid(1.0);
                assert!((seen[k] - expected).abs() < 0.01, "{name} {x} {y}: {seen:?} {expected}");
            }
        }
    }
    // What skews is told, and shown without.
    let info = r#"{"index":0,"extensions":{"KHR_texture_transform":{"rotation":0.5,"scale":[1,3],"texCoord":1}}}"#;
    let path = gltf_square("skew", "ramp.png", info);
    let notes = read::scene(&path, None, "skew", &read::ReadOptions::default()).unwrap().notes;
    assert!(notes.iter().any(|note| note.contains("skews")), "{notes:?}");
    // Whatever is wrong with a transform, the texture lies by the set that it names.
    let looks = |name: &str, info: &str| {
        let path = gltf_square(name, "ramp.png", info);
        let scene = read::scene(&path, None, name, &read::ReadOptions::default()).unwrap();
        colors(&spans(Arc::new(scene), &view), TextureFilter::default())
    };
    let plain = looks("second", r#"{"index":0,"texCoord":1}"#);
    assert_ne!(plain, looks("first", r#"{"index":0}"#));
    for wrong in [r#""rotation":0.5,"scale":[1,3]"#, r#""scale":"wide""#, r#""scale":[0,1e300]"#] {
        let info = format!(
            r#"{{"index":0,"extensions":{{"KHR_texture_transform":{{{wrong},"texCoord":1}}}}}}"#
        );
        assert_eq!(looks("wrong", &info), plain, "{wrong}");
    }
    // Coordinates that the mesh does not have are told.
    let path = gltf_square("third", "ramp.png", r#"{"index":0,"texCoord":3}"#);
    let notes = read::scene(&path, None, "third", &read::ReadOptions::default()).unwrap().notes;
    assert!(notes.iter().any(|note| note.contains("coordinates 3")), "{notes:?}");
}

#[test]
fn real_models_show_their_pictures() {
    let Some(folder) = data::find("models/kaykit_city") else { return };
    let mut seen = 0;
    for name in ["building_A", "building_D", "car_taxi", "bush"] {
        let both = ["gltf", "obj"].map(|format| {
            let path = folder.join(format).join(format!("{name}.{format}"));
            let scene = read::scene(&path, None, name, &read::ReadOptions::default()).unwrap();
            let camera = Camera {
                position: v(3.0, 2.5, 4.0),
                look_at: v(0.0, 0.5, 0.0),
                field_of_view: 35.0,
                ..Camera::default()
            };
            let image = spans(Arc::new(scene), &view(&camera, 90, 90));
            colors(&image, TextureFilter::default())
        });
        // One model in two formats has one picture.
        let [gltf, obj] = &both;
        let off =
            gltf.iter().flatten().zip(obj.iter().flatten()).filter(|(a, b)| (*a - *b).abs() > 0.02);
        let (off, all) = (off.count(), 3 * 90 * 90);
        assert!(off * 200 < all, "{name}: {off} of {all}");
        let kinds: BTreeMap<[u32; 3], ()> = (0..90 * 90)
            .map(|at| ([0, 1, 2].map(|axis| (gltf[axis][at] * 20.0) as u32), ()))
            .collect();
        assert!(kinds.len() > 6, "{name} has {} colours", kinds.len());
        seen += 1;
    }
    assert_eq!(seen, 4);
}

#[test]
fn real_buildings_show_photographs_of_their_facades() {
    // Buildings of Rotterdam, with their own.
    if let Some(path) = data::find("city/twobuildings/twobuildings_t.json") {
        let shown = |pictures: bool| {
            let options =
                read::ReadOptions { pictures: Some(pictures), ..read::ReadOptions::default() };
            let scene = read::scene(&path, None, "rotterdam", &options);
            let mut scene = scene.unwrap_or_else(|error| panic!("{error}"));
            scene.materials.iter_mut().for_each(|material| material.unlit = true);
            let points = scene.instances.iter().flat_map(|one| {
                let points = one.geometry.mesh().points.iter();
                points.map(|p| one.world_from_object.transform_point3(*p))
            });
            let ends = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let (low, high) = points.fold(ends, |(low, high), p| (low.min(p), high.max(p)));
            let middle = (low + high) / 2.0;
            let camera = Camera {
                position: middle + v(0.5, 0.6, 0.9) * (high - low).length(),
                look_at: middle,
                ..Camera::default()
            };
            let maps = scene.materials.iter().flat_map(|material| material.maps.values());
            let maps: BTreeSet<String> = maps.map(|map| format!("{:?}", map.picture)).collect();
            let image = spans(Arc::new(scene), &view(&camera, 120, 120));
            (maps.len(), colors(&image, TextureFilter::default()))
        };
        let (maps, with) = shown(true);
        let (none, without) = shown(false);
        assert_eq!((maps, none), (14, 0));
        let kinds = |c: &[Vec<f32>; 3]| {
            let all = (0..c[0].len()).map(|at| [0, 1, 2].map(|k| (c[k][at] * 40.0) as u32));
            all.collect::<BTreeSet<_>>().len()
        };
        assert!(kinds(&with) > 3 * kinds(&without), "{} and {}", kinds(&with), kinds(&without));
    }
    // Of Yokosuka only the photographs are in a format that is read: each on a wall keeps its mean.
    let Some(folder) = data::find("city/52397519_bldg_6697_appearance") else { return };
    let photographs = data::files(&folder, &[".jpg"]);
    assert_eq!(photographs.len(), 3);
    for path in photographs {
        let material = mapped("color", map(&path.to_string_lossy(), Mapping::default()), unlit());
        let image = spans(made(&[(floor(1.0), material)]), &above(2.0, 32));
        let seen = colors(&image, TextureFilter::Exact);
        let picture = file::read(&path).unwrap();
        for (k, name) in ["R", "G", "B"].into_iter().enumerate() {
            let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
            let (shown, held) = (mean(&seen[k]), mean(picture.float(name).unwrap()));
            assert!((shown / held - 1.0).abs() < 0.01, "{}: {shown} {held}", path.display());
        }
    }
}

#[test]
fn pixels_beside_the_display_are_left_out_and_layers_lie_where_they_say() {
    use exr::prelude::{
        AnyChannel, AnyChannels, FlatSamples, Layer, LayerAttributes, Vec2, WritableImage,
    };
    let folder = std::env::temp_dir().join(format!("spandrel-overscan-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("overscan.exr");
    // A pixel says where it is: x + 100 y, of the display.
    let layer =
        |name: &str, channel: &str, (left, top): (i32, i32), (width, height): (usize, usize)| {
            let at = |i: usize| {
                (left + (i % width) as i32) as f32 + 100.0 * (top + (i / width) as i32) as f32
            };
            let samples = FlatSamples::F32((0..width * height).map(at).collect());
            let channels =
                AnyChannels::sort([AnyChannel::new(channel, samples)].into_iter().collect());
            let attributes = LayerAttributes::named(name).with_position(Vec2(left, top));
            Layer::new((width, height), attributes, exr::prelude::Encoding::FAST_LOSSLESS, channels)
        };
    let write_on = |display: (usize, usize), layers: Vec<Layer<AnyChannels<FlatSamples>>>| {
        let display = exr::prelude::IntegerBounds::new((0, 0), display);
        let layers = layers.into_iter().collect();
        let image = exr::image::Image {
            attributes: exr::prelude::ImageAttributes::new(display),
            layer_data: layers,
        };
        let image: exr::image::Image<exr::prelude::SmallVec<[Layer<AnyChannels<FlatSamples>>; 2]>> =
            image;
        image.write().to_file(&path).unwrap();
        file::read(&path)
    };
    let write = |layers| write_on((6, 4), layers);
    let picture =
        write(vec![layer("wide", "R", (-3, -2), (12, 8)), layer("small", "G", (4, 1), (5, 2))])
            .unwrap();
    assert_eq!((picture.size, picture.window), ((6, 4), Window::whole(6, 4)));
    let (wide, small) = (picture.float("wide.R").unwrap(), picture.float("small.G").unwrap());
    for y in 0..4usize {
        for x in 0..6usize {
            let says = x as f32 + 100.0 * y as f32;
            assert_eq!(wide[y * 6 + x], says, "{x} {y}");
            let is_in = (4..9).contains(&x) && (1..3).contains(&y);
            assert_eq!(small[y * 6 + x], if is_in { says } else { 0.0 }, "{x} {y}");
        }
    }
    // Twenty layers of a pixel each in two corners of a display of 60000 by 60000 would be 288 gigabytes.
    let far =
        |i: i32| layer(&format!("far {i}"), "R", (59_999 * (i % 2), 59_999 * (i % 2)), (1, 1));
    let error = write_on((60_000, 60_000), (0..20).map(far).collect()).unwrap_err();
    assert!(error.to_string().contains("--largest-picture"), "{error}");
    let error = write(vec![layer("far", "R", (-9, -9), (3, 3))]).unwrap_err();
    assert!(error.to_string().contains("outside of its display window"), "{error}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn real_plates_of_many_layers_keep_them() {
    for (name, channels) in [
        ("exr/psyop_cornellBox.0001.exr", 50),
        ("exr/gaffer_channelTestPartPerLayer.exr", 1),
        ("exr/gaffer_imitateProductionLayers2.exr", 1),
    ] {
        let Some(path) = data::find(name) else { return };
        let picture = file::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let expected = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
        let count: usize =
            expected.layer_data.iter().map(|layer| layer.channel_data.list.len()).sum();
        assert!(count >= channels, "{name}: {count}");
        assert_eq!(picture.channels().count(), count, "{name}");
    }
    // A plate of luminance and chroma, of which chroma has a quarter of the samples, beside a JPEG of the same view.
    let Some(path) = data::find("photos/CrissyField.exr") else { return };
    let picture = file::read(&path).unwrap_or_else(|error| panic!("{error}"));
    let colored = picture.channels().map(|(name, _)| name.to_owned()).collect::<Vec<_>>();
    assert_eq!(colored, ["B", "G", "R"], "{path:?}");
    // OpenEXR's own library shows it as the JPEG does, apart from the curve of brightness: what is green there is here.
    let jpeg = file::read(&data::find("photos/CrissyField.jpg").unwrap()).unwrap();
    assert_eq!(picture.size, jpeg.size);
    let (mut alike, mut all) = (0, 0);
    for y in (0..picture.size.1).step_by(16) {
        for x in (0..picture.size.0).step_by(16) {
            let [a, b] = [&picture, &jpeg].map(|image| image.rgba(x, y));
            if b[..3].iter().all(|v| (0.05..0.8).contains(v)) {
                let hue = |p: [f32; 4]| (p[0] > p[1], p[1] > p[2]);
                all += 1;
                alike += usize::from(hue(a) == hue(b));
            }
        }
    }
    assert!(all > 200 && alike * 10 > all * 8, "{alike} of {all}");
}

#[test]
fn plates_of_one_colour_are_small_and_sound() {
    let mut plate = Image::new((4096, 1024), Window::whole(4096, 1024));
    for (name, value) in [("R", 0.25), ("G", 0.5), ("B", 0.0), ("A", 1.0)] {
        plate.insert(name, Samples::Float(vec![value; 4096 * 1024])).unwrap();
    }
    for bits in [16, 32] {
        let path = scratch(&format!("plate{bits}.exr"));
        file::write(&plate, &path, Some(bits)).unwrap();
        assert_eq!(file::read(&path).unwrap().rgba(4000, 1000), [0.25, 0.5, 0.0, 1.0]);
    }
}

#[test]
fn faces_of_a_ply_without_a_picture_have_none() {
    let folder = Scratch::new("ply-texnumber");
    let path = folder.path().join("a.ply");
    let text = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
                property int texnumber\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 6 0 0 1 0 0 1 0\n3 0 2 1 6 0 0 0 0 0 0 -1\n";
    std::fs::write(&path, text).unwrap();
    let scene = spandrel_engine::scene::read::scene(&path, None, "", &read::ReadOptions::default())
        .unwrap();
    let mesh = scene.instances[0].geometry.mesh();
    assert_eq!([mesh.sides(0).front, mesh.sides(1).front], [Some(0), None]);
}
