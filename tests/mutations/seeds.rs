//! Small sound files of every format that is read.

use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use serde_json::json;
use spandrel_engine::image::{Image, Samples, Window, file};
use spandrel_engine::scene::read::{binary, text};
use spandrel_engine::span_file::{self, Options};
use spandrel_tests::png;
use spandrel_tests::scenes::front_view;
use spandrel_tests::spans;
use std::io::{Cursor, Write};
use std::path::Path;

use super::damage::{Form, made_glb};

/// A sound file.
pub(crate) struct Seed {
    /// What it is called.
    pub(crate) name: &'static str,
    pub(crate) form: Form,
    pub(crate) bytes: Vec<u8>,
    /// The file that names it, which is opened in its place.
    pub(crate) opened_by: Option<(&'static str, &'static [u8])>,
}

fn seed(name: &'static str, form: Form, bytes: impl Into<Vec<u8>>) -> Seed {
    Seed { name, form, bytes: bytes.into(), opened_by: None }
}

/// All of them. Files that they name are put into the folder.
pub(crate) fn all(folder: &Path) -> Vec<Seed> {
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).expect("a file can be written");
    };
    write("other.mtl", MTL.as_bytes());
    write("it.obj", MTL_USER);
    let mut seeds = pictures(folder);
    write("picture.png", &seeds[0].bytes);
    let png = seeds[0].bytes.clone();
    seeds.extend([
        seed("it.obj", Form::Text, OBJ),
        Seed { opened_by: Some(("it.obj", MTL_USER)), ..seed("it.mtl", Form::Text, MTL) },
        seed("it.stl", Form::Text, STL),
        seed("it.stl", Form::Binary, binary_stl()),
        seed("it.ply", Form::Text, [PLY_HEAD.replace("FORMAT", "ascii"), PLY.to_owned()].concat()),
        seed("it.ply", Form::Binary, binary_ply()),
        seed("it.gltf", Form::Json, gltf()),
        seed("it.glb", Form::Glb, glb(&png)),
        seed("it.json", Form::Json, CITY_JSON),
        seed("it.gml", Form::Text, CITY_GML),
        seed("it.ies", Form::Text, IES),
        seed("it.ldt", Form::Text, LDT.replace(' ', "\n")),
        seed("it.ron", Form::Text, SCENE),
        seed("it.scene", Form::Scene, binary_scene()),
        seed("it.graph", Form::Text, GRAPH),
        seed("it.span", Form::Spans, span(folder)),
        seed("it.nrrd", Form::Text, format!("{NRRD}encoding: text\n\n{}", numbers(27))),
        seed("it.nrrd", Form::Binary, nrrd()),
        seed("it.cube", Form::Text, format!("{CUBE}{}", numbers(54))),
    ]);
    seeds
}

const NRRD: &str = "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 3 3\nendian: little\n\
                    space directions: (1,0,0) (0,1,0) (0,0,1.5)\nspace units: \"mm\" \"mm\" \"mm\"\n";

/// Two orbitals at each of 27 points.
const CUBE: &str =
    "a title\nanother\n -1 0 0 0\n 3 0.5 0 0\n 3 0 0.5 0\n 3 0 0 0.5\n 1 1.0 0 0 0\n 2 4 5\n";

fn numbers(count: usize) -> String {
    let line = |from: usize| (from..count.min(from + 6)).map(|at| format!("{} ", at * 7 % 11));
    (0..count).step_by(6).map(|from| line(from).collect::<String>() + "\n").collect()
}

fn nrrd() -> Vec<u8> {
    let mut bytes = format!("{NRRD}encoding: gzip\n\n").into_bytes();
    let samples: Vec<u8> = (0..27i16).flat_map(|at| (at * 7 % 11).to_le_bytes()).collect();
    let mut encoder = flate2::write::GzEncoder::new(&mut bytes, flate2::Compression::fast());
    encoder.write_all(&samples).and_then(|()| encoder.finish().map(drop)).expect("memory takes it");
    bytes
}

fn pictures(folder: &Path) -> Vec<Seed> {
    let rgb = RgbImage::from_fn(9, 7, |x, y| Rgb([x as u8 * 28, y as u8 * 36, (x * y) as u8]));
    let picture = DynamicImage::from(rgb);
    let encoded = |picture: &DynamicImage, format: ImageFormat| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("a picture can be written");
        bytes.into_inner()
    };
    let deep = DynamicImage::from(picture.to_rgba16());
    let light = DynamicImage::from(picture.to_rgb32f());
    let samples: Vec<f32> = (0..63).map(|i| i as f32 / 9.0).collect();
    let mut image = Image::new((9, 7), Window::whole(9, 7));
    for name in ["R", "G", "B", "A", "Z"] {
        image.insert(name, Samples::Float(samples.clone())).expect("a channel fits");
    }
    let exr = folder.join("seed.exr");
    file::write(&image, &exr, Some(32)).expect("an EXR can be written");
    vec![
        seed("it.png", Form::Png, encoded(&picture, ImageFormat::Png)),
        seed("it.png", Form::Png, encoded(&deep, ImageFormat::Png)),
        seed("it.png", Form::Png, palette()),
        seed("it.jpg", Form::Jpeg, encoded(&picture, ImageFormat::Jpeg)),
        seed("it.tif", Form::Binary, encoded(&picture, ImageFormat::Tiff)),
        seed("it.tif", Form::Binary, encoded(&deep, ImageFormat::Tiff)),
        seed("it.webp", Form::Riff, encoded(&picture, ImageFormat::WebP)),
        seed("it.bmp", Form::Binary, encoded(&picture, ImageFormat::Bmp)),
        seed("it.tga", Form::Binary, encoded(&picture, ImageFormat::Tga)),
        seed("it.hdr", Form::Binary, encoded(&light, ImageFormat::Hdr)),
        seed("it.exr", Form::Binary, std::fs::read(&exr).expect("an EXR can be read")),
    ]
}

/// A PNG of 4 by 4 pixels of 2 bits, their colours in a palette.
fn palette() -> Vec<u8> {
    let pixels = png::packed(&[0, 0x1b, 0, 0xe4, 0, 0x1b, 0, 0xe4]);
    let chunks: [(&[u8], &[u8]); 6] = [
        (b"IHDR", &[0, 0, 0, 4, 0, 0, 0, 4, 2, 3, 0, 0, 0]),
        (b"gAMA", &[0, 0, 0xb1, 0x8f]),
        (b"PLTE", &[0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255]),
        (b"tRNS", &[0, 128, 255]),
        (b"IDAT", &pixels),
        (b"IEND", &[]),
    ];
    png::file(chunks)
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn gltf() -> Vec<u8> {
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA";
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": 42, "uri": format!("data:application/octet-stream;base64,{data}")}],
    });
    serde_json::to_vec(&document).expect("JSON can be written")
}

/// A GLB with all that is read: a skin, morph targets, an animation, sparse values, instances, pictures, lights, cameras,
/// materials.
fn glb(png: &[u8]) -> Vec<u8> {
    let mut data = Vec::new();
    let (mut accessors, mut views) = (Vec::new(), Vec::new());
    let mut add = |kind: &str, component: u32, count: usize, bytes: Vec<u8>| {
        data.resize(data.len().next_multiple_of(4), 0);
        views.push(json!({"buffer": 0, "byteOffset": data.len(), "byteLength": bytes.len()}));
        data.extend(bytes);
        accessors.push(
            json!({"bufferView": views.len() - 1, "componentType": component, "count": count, "type": kind}),
        );
    };
    add("VEC3", 5126, 3, floats(&CORNERS));
    add("SCALAR", 5123, 3, vec![0, 0, 1, 0, 2, 0]);
    add("VEC3", 5126, 3, floats(&[0.0, 0.0, 1.0].repeat(3)));
    add("VEC2", 5126, 3, floats(&[0.0, 0.0, 1.0, 0.0, 0.5, 1.0]));
    add("VEC4", 5121, 3, [0, 1, 0, 0].repeat(3));
    add("VEC4", 5126, 3, floats(&[0.5, 0.5, 0.0, 0.0].repeat(3)));
    let mut bound = [0.0; 16];
    (0..4).for_each(|i| bound[5 * i] = 1.0);
    add("MAT4", 5126, 2, floats(&bound.repeat(2)));
    add("VEC4", 5121, 3, [255, 128, 0, 255].repeat(3));
    add("SCALAR", 5121, 1, vec![1]);
    add("SCALAR", 5121, png.len(), png.to_vec());
    add("SCALAR", 5126, 2, floats(&[0.0, 1.0]));
    add("SCALAR", 5126, 6, floats(&[0.0, 0.5, 1.0, 0.0, 1.0, 0.0]));
    add("SCALAR", 5126, 3, floats(&[0.0, 1.0, 3.0]));
    accessors[7]["normalized"] = json!(true);
    accessors[2]["sparse"] = json!({"count": 1, "indices": {"bufferView": 8, "componentType": 5121},
        "values": {"bufferView": 0}});
    let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 2]}}});
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["KHR_lights_punctual", "EXT_mesh_gpu_instancing", "KHR_mesh_quantization"],
        "nodes": [
            {"mesh": 0, "skin": 0, "weights": [0.5]},
            {"children": [3], "translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"mesh": 0, "camera": 0,
                "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0, "ROTATION": 5}}}},
            {"rotation": [0, 0, 0.7, 0.7], "scale": [1, 2, 1]}],
        "skins": [{"joints": [1, 3], "inverseBindMatrices": 6}],
        "animations": [{"name": "walk",
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}},
                {"sampler": 1, "target": {"node": 1, "path": "translation"}},
                {"sampler": 2, "target": {"node": 3, "path": "rotation"}}],
            "samplers": [{"input": 10, "output": 11, "interpolation": "CUBICSPLINE"},
                {"input": 12, "output": 0}, {"input": 12, "output": 5}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 100}}],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "intensity": 40, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}}]}},
        "meshes": [{"weights": [1], "primitives": [{"indices": 1, "material": 0, "targets": [{"POSITION": 2}],
            "attributes": {"POSITION": 0, "NORMAL": 2, "TEXCOORD_0": 3, "JOINTS_0": 4, "WEIGHTS_0": 5,
                "COLOR_0": 7}}]}],
        "materials": [{"alphaMode": "MASK", "normalTexture": texture,
            "pbrMetallicRoughness": {"baseColorTexture": texture, "metallicFactor": 0.5},
            "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2}}}],
        "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071}],
        "images": [{"bufferView": 9, "mimeType": "image/png"}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": data.len()}],
    });
    made_glb(&serde_json::to_vec(&document).expect("JSON can be written"), &data)
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![0u8; 80];
    bytes.extend(2u32.to_le_bytes());
    for _ in 0..2 {
        bytes.extend(floats(&[0.0, 0.0, 1.0]));
        bytes.extend(floats(&CORNERS));
        bytes.extend([0, 0]);
    }
    bytes
}

fn binary_ply() -> Vec<u8> {
    let mut bytes = PLY_HEAD.replace("FORMAT", "binary_little_endian").into_bytes();
    bytes.extend(floats(&CORNERS));
    bytes.push(3);
    [0i32, 1, 2].iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
    bytes
}

fn binary_scene() -> Vec<u8> {
    let document =
        text::parse(Path::new("seed.ron"), SCENE.as_bytes()).expect("the scene is sound");
    binary::write(&document).expect("a scene can be written")
}

fn span(folder: &Path) -> Vec<u8> {
    let path = folder.join("seed.span");
    let image = spans::image(4, true, &front_view(24, 20), spans::plans()[0], 0..20);
    span_file::write(&image, &path, Options::default()).expect("spans can be written");
    std::fs::read(path).expect("spans can be read")
}

const OBJ: &str = "mtllib other.mtl\no a\nv 0 0 0\nv 1 0 0\nv 1 1 0 1 0.5 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\n\
    usemtl red\nf 1/1/1 2/2/1 3/2/1 4/1/1\ng b\ns 1\nf -4 -3 -2\nf 1//1 2//1 \\\n4//1\n";
const MTL: &str = "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 40\nd 0.5\nillum 2\nNi 1.5\nmap_Kd -s 2 2 picture.png\n\
    newmtl blue\nKd 0 0 1\nTr 0.25\n";
const MTL_USER: &[u8] = b"mtllib it.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
const STL: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0.5 0\nvertex 0 1 0.25\nendloop\n\
    endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0.5 0\nvertex 0 1 1\nendloop\nendfacet\nendsolid s\n";
const PLY_HEAD: &str = "ply\nformat FORMAT 1.0\ncomment a triangle\nelement vertex 3\nproperty float x\n\
    property float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const PLY: &str = "0 0 0\n1 0.5 0\n0 1 0.25\n3 0 1 2\n";
const CITY_JSON: &str = r#"{"type": "CityJSON", "version": "2.0",
    "transform": {"scale": [0.001, 0.001, 0.001], "translate": [1000, 2000, 0]},
    "vertices": [[0, 0, 0], [1000, 0, 0], [1000, 1000, 0], [0, 1000, 0], [250, 250, 0], [500, 250, 0], [250, 500, 0]],
    "appearance": {"materials": [{"name": "red", "diffuseColor": [1, 0, 0]}],
        "textures": [{"type": "PNG", "image": "picture.png"}], "vertices-texture": [[0, 0], [1, 0], [1, 1]]},
    "geometry-templates": {"vertices-templates": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        "templates": [{"type": "MultiSurface", "lod": "1", "boundaries": [[[0, 1, 2]]]}]},
    "CityObjects": {
        "house": {"type": "Building", "children": ["part"], "geometry": [{"type": "MultiSurface", "lod": "2",
            "boundaries": [[[0, 1, 2, 3], [4, 6, 5]]], "material": {"": {"values": [0]}},
            "semantics": {"surfaces": [{"type": "WallSurface"}], "values": [0]}}]},
        "part": {"type": "BuildingPart", "parents": ["house"], "geometry": [{"type": "Solid", "lod": 1,
            "boundaries": [[[[0, 1, 2]], [[0, 2, 3]]]]}]},
        "tree": {"type": "SolitaryVegetationObject", "geometry": [{"type": "GeometryInstance", "template": 0,
            "boundaries": [0], "transformationMatrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}]}}}"#;
const CITY_GML: &str = r##"<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:gml="http://www.opengis.net/gml"
  xmlns:bldg="http://www.opengis.net/citygml/building/2.0" xmlns:app="http://www.opengis.net/citygml/appearance/2.0"
  xmlns:xlink="http://www.w3.org/1999/xlink"><cityObjectMember><bldg:Building gml:id="house">
<gml:name>Home</gml:name><bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>
<gml:surfaceMember xlink:href="#roof"/></gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid>
<bldg:boundedBy><bldg:RoofSurface><bldg:lod2MultiSurface><gml:MultiSurface><gml:surfaceMember>
<gml:Polygon gml:id="roof"><gml:exterior><gml:LinearRing gml:id="ring">
<gml:posList srsDimension="3">0 0 3 4 0 3 4 5 3 0 5 3 0 0 3</gml:posList></gml:LinearRing></gml:exterior>
<gml:interior><gml:LinearRing><gml:pos>1 1 3</gml:pos><gml:pos>1 2 3</gml:pos><gml:pos>2 2 3</gml:pos>
<gml:pos>1 1 3</gml:pos></gml:LinearRing></gml:interior></gml:Polygon></gml:surfaceMember></gml:MultiSurface>
</bldg:lod2MultiSurface></bldg:RoofSurface></bldg:boundedBy></bldg:Building></cityObjectMember>
<app:appearanceMember><app:Appearance><app:surfaceDataMember><app:ParameterizedTexture>
<app:imageURI>picture.png</app:imageURI><app:target uri="#roof"><app:TexCoordList>
<app:textureCoordinates ring="#ring">0 0 1 0 1 0.5 0 0.5 0 0</app:textureCoordinates></app:TexCoordList></app:target>
</app:ParameterizedTexture></app:surfaceDataMember></app:Appearance></app:appearanceMember></CityModel>"##;
const IES: &str = "IESNA:LM-63-2002\n[TEST] ours\nTILT=INCLUDE\n1\n2\n0 90\n1 0.8\n\
    2 1000 2 3 2 1 2 0.1 0.2 0\n0.5 1 40\n0 90 180\n0 90\n50 40 30 20 10 0\n";
const LDT: &str = "Maker 1 0 4 90 3 45 report name number file date 100 100 50 80 80 0 0 0 0 100 80 1 0 1 1 LED 2000 \
    3000 80 25 0 0 0 0 0 0 0 0 0 0 0 90 180 270 0 45 90 9 9 1 9 9 2 9 9 3 9 9 4";
const SCENE: &str = r##"Scene(
    materials: {
        "red": (color: "#ff0000", finish: (gloss: Phong(share: 0.2, exponent: 20), optics: (index: 1.33))),
        "stone": (color: (0.5, 0.5, 0.5), maps: {"color": (picture: File("picture.png"), mapping: (scale: (2, 2)))}),
    },
    plans: [(name: "all", cameras: {"front": (position: (0, 1, 5), look_at: (0, 0, 0))},
        lights: {"sun": ParallelLight(direction: (-1, -2, -1), illuminance: 1000)},
        definitions: {"post": (shape: Box(size: (0.1, 1, 0.1)))},
        root: (children: [
            (name: "wall", material: "red", transform: [Move(0, 1, 0), TurnY(30)],
                shape: Polygon(outline: [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)],
                    holes: [[(0.5, 0.5, 0), (1, 0.5, 0), (1, 1, 0)]])),
            (name: "ball", material: "stone", shape: Sphere(radius: 1, segments: 12)),
            (name: "fence", shape: Array(of: (shape: Instance("post")), count: (5, 1, 1), step: (0.5, 0, 0))),
            (name: "mesh", shape: Faces(points: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], faces: [(outline: [0, 1, 2])])),
        ]))])"##;
const GRAPH: &str = r##"Graph(
    version: 1,
    nodes: {
        "it": ReadScene(file: "it.ron", up: Z, origin: (1, 2, 3)),
        "eye": Camera(position: (6, 5, 8), look_at: (0, 1, 0)),
        "spans": Scanline(scene: "it", camera: "eye"),
        "window": ParallelLight(direction: (-0.8, -1, -0.55), color: "#fff1dc", illuminance: 0.78),
        "lit": Illuminate(image: "spans", lights: ["window"], ambient: "#8d96a3"),
        "far": Fog(image: "lit", density: 0.012, color: "#c9c4b9", start: 18),
        "painted": Stream(image: "far", code: "if (P.y > 1) { color = color * 0.5; }"),
        "picture": Resolve(image: "painted", size: (120, 67), lines: Sloped(8)),
        "file": Write(image: "picture", path: "out.png"),
    },
)"##;
