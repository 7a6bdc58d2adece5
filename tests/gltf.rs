//! glTF: what a file says is what is there, or is told. Every file here is small and made by its test.

#![allow(
    clippy::disallowed_methods,
    reason = "what is expected may be computed by anybody's tangent"
)]

use glam::{DVec3, dvec3 as v};
use serde_json::{Value, json};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Gloss, Optics};
use spandrel_engine::light::list::{Entry, MakeLamp};
use spandrel_engine::light::{Lamp, Receiver};
use spandrel_engine::scene::read::{self, ReadOptions, Reading};
use spandrel_engine::scene::{AlphaMode, Material, Scene};
use spandrel_engine::texture::{Filter, Wrap};
use spandrel_tests::data;
use spandrel_tests::lights::close;
use spandrel_tests::program::Scratch;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::textures::{above, colors, spans};

/// A file in the making: its document, and the bytes of its only buffer.
struct Made {
    json: Value,
    bytes: Vec<u8>,
}

impl Made {
    /// A triangle of (0, 0, 0), (1, 0, 0), (0, 1, 0): accessors 0 (positions) and 1 (indices).
    fn triangle() -> Made {
        let mut made = Made {
            json: json!({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [], "bufferViews": [], "buffers": [],
            }),
            bytes: Vec::new(),
        };
        made.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        made.add("SCALAR", 5123, 3, &[0, 0, 1, 0, 2, 0]);
        made
    }

    /// Adds an accessor of its own buffer view.
    fn add(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let (at, view) = (self.bytes.len(), self.len("bufferViews"));
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": at, "byteLength": bytes.len()}));
        self.bytes.extend(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let size = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.add(kind, 5126, values.len() / size, &bytes)
    }

    fn len(&self, list: &str) -> usize {
        self.json[list].as_array().map_or(0, Vec::len)
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let at = self.len(list);
        if at == 0 {
            self.json[list] = json!([]);
        }
        self.json[list].as_array_mut().unwrap().push(value);
        at
    }

    /// Puts a value at a place of the document, such as `/nodes/0/mesh`.
    fn set(&mut self, place: &str, value: Value) -> &mut Made {
        match self.json.pointer_mut(place) {
            Some(old) => *old = value,
            None => {
                let (above, name) = place.rsplit_once('/').unwrap();
                self.json.pointer_mut(above).unwrap_or_else(|| panic!("{above}"))[name] = value;
            }
        }
        self
    }

    /// A triangle with something at a place.
    fn with(place: &str, value: Value) -> Made {
        let mut made = Made::triangle();
        made.set(place, value);
        made
    }

    /// A triangle of a material.
    fn of(material: Value) -> Made {
        let mut made = Made::with("/materials", json!([material]));
        made.set("/meshes/0/primitives/0/material", json!(0));
        made
    }

    /// As a GLB, which needs no other file.
    fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if self.len("buffers") == 0 {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        glb(&serde_json::to_vec(&json).unwrap(), &self.bytes)
    }

    fn document(&self) -> Result<Reading> {
        let folder = folder();
        let path = folder.path().join("made.glb");
        std::fs::write(&path, self.glb()).unwrap();
        read::document(&path, &ReadOptions::default())
    }

    fn scene(&self) -> Scene {
        let folder = folder();
        let path = folder.path().join("made.glb");
        std::fs::write(&path, self.glb()).unwrap();
        read::scene(&path, None, "made", &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn notes(&self) -> String {
        let notes = self.document().unwrap_or_else(|e| panic!("{e}")).notes;
        let of_file = |note: &String| note.split_once("made.glb: ").expect("a file").1.to_owned();
        notes.iter().map(of_file).collect::<Vec<_>>().join("\n")
    }

    fn error(&self) -> String {
        let error = self.document().err().unwrap_or_else(|| panic!("it is read: {}", self.json));
        let error = error.to_string();
        assert!(error.contains("made.glb"), "no file: {error}");
        error
    }

    /// The material of its only triangle.
    fn material(&self) -> Material {
        let scene = self.scene();
        let instance = &scene.instances[0];
        let front = instance.geometry.mesh().sides(0).front.expect("a material");
        scene.materials[instance.palette[front as usize] as usize].clone()
    }

    /// Its points in the world, instance by instance.
    fn points(&self) -> Vec<Vec<DVec3>> {
        let scene = self.scene();
        let one = |i: &spandrel_engine::scene::Instance| {
            let points = i.geometry.mesh().points.iter();
            points.map(|p| i.world_from_object.transform_point3(*p)).collect()
        };
        scene.instances.iter().map(one).collect()
    }
}

/// A folder of its own for a file.
fn folder() -> Scratch {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    Scratch::new(&format!("gltf-{}", COUNT.fetch_add(1, Ordering::Relaxed)))
}

fn glb(json: &[u8], bytes: &[u8]) -> Vec<u8> {
    let mut all = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, fill, chunk) in [(b"JSON", b' ', json), (b"BIN\0", 0, bytes)] {
        let length = chunk.len().next_multiple_of(4);
        all.extend((length as u32).to_le_bytes());
        all.extend(kind);
        all.extend(chunk);
        all.resize(all.len() + length - chunk.len(), fill);
    }
    let length = all.len() as u32;
    all[8..12].copy_from_slice(&length.to_le_bytes());
    all
}

fn same(points: &[DVec3], expected: &[DVec3]) {
    assert_eq!(points.len(), expected.len(), "{points:?}");
    for (a, b) in points.iter().zip(expected) {
        assert!((*a - *b).length() < 1e-6, "{points:?} for {expected:?}");
    }
}

const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

#[test]
fn numbers_that_name_what_is_not_there_are_errors_with_their_place() {
    let cases: [(&str, Value, &str); 17] = [
        ("/meshes/0/primitives/0/attributes/POSITION", json!(99), "POSITION is 99"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(-1), "POSITION is -1"),
        ("/meshes/0/primitives/0/indices", json!(7), "meshes[0].primitives[0].indices is 7"),
        ("/meshes/0/primitives/0/material", json!(0), "0 materials"),
        ("/meshes/0/primitives/0/targets", json!([{"POSITION": 4}]), "targets[0].POSITION is 4"),
        ("/accessors/0/bufferView", json!(12), "accessors[0].bufferView is 12"),
        ("/bufferViews/1/buffer", json!(3), "bufferViews[1].buffer is 3"),
        ("/nodes/0/mesh", json!(4_000_000_000u32), "nodes[0].mesh is 4000000000"),
        ("/nodes/0/skin", json!(0), "nodes[0].skin is 0, and the file has 0 skins"),
        ("/nodes/0/camera", json!(2), "nodes[0].camera is 2"),
        ("/nodes/0/children", json!([5]), "nodes[0].children[0] is 5"),
        ("/scenes/0/nodes", json!([0, 1]), "scenes[0].nodes[1] is 1"),
        ("/scene", json!(1), "scene is 1"),
        ("/textures", json!([{"source": 0}]), "textures[0].source is 0"),
        (
            "/images",
            json!([{"bufferView": 9, "mimeType": "image/png"}]),
            "images[0].bufferView is 9",
        ),
        ("/skins", json!([{"joints": [0, 8]}]), "skins[0].joints[1] is 8"),
        ("/materials", json!([{"emissiveTexture": {"index": 1}}]), "emissiveTexture.index is 1"),
    ];
    for (place, value, word) in cases {
        let error = Made::with(place, value).error();
        assert!(error.contains(word), "{place}: {error}");
    }
}

#[test]
fn accessors_that_lie_are_errors_that_name_them() {
    let huge = json!(u64::MAX);
    let sparse = |count: u64, index: u8| {
        let mut made = Made::triangle();
        let indices = made.add("SCALAR", 5121, 1, &[index]);
        let values = made.floats("VEC3", &[5.0, 6.0, 7.0]);
        made.set(
            "/accessors/0/sparse",
            json!({"count": count, "values": {"bufferView": values},
                "indices": {"bufferView": indices, "componentType": 5121}}),
        );
        made
    };
    // One that is sound: what it replaces is replaced.
    same(&sparse(1, 2).points()[0], &[DVec3::ZERO, DVec3::X, v(5.0, 6.0, 7.0)]);
    let mut cases = vec![
        (Made::with("/accessors/0/count", json!(4)), "accessor 0"),
        (Made::with("/accessors/0/count", json!(1u64 << 62)), "accessor 0"),
        (Made::with("/accessors/0/count", huge.clone()), "accessor 0"),
        (Made::with("/accessors/0/count", json!(0)), "accessor 0 is empty"),
        (Made::with("/accessors/1/byteOffset", json!(u64::MAX - 1)), "accessor 1"),
        (Made::with("/accessors/0/type", json!("VEC2")), "accessor 0 is Vec2"),
        (Made::with("/accessors/0/componentType", json!(5123)), "accessor 0 is Vec3 of U16"),
        (Made::with("/accessors/1/componentType", json!(5126)), "accessor 1 is Scalar of F32"),
        (Made::with("/accessors/0/componentType", json!(1)), "accessors[0]"),
        (Made::with("/bufferViews/0/byteLength", huge.clone()), "bufferViews[0]"),
        (Made::with("/bufferViews/0/byteOffset", huge), "bufferViews[0]"),
        (Made::with("/bufferViews/0/byteStride", json!(4)), "accessors[0]"),
        (Made::with("/bufferViews/0/byteStride", json!(252)), "accessor 0"),
        (Made::with("/buffers", json!([{"byteLength": 400}])), "400 are announced"),
        (sparse(1, 3), "accessor 0 has a sparse value"),
        (sparse(2, 0), "accessor 0 uses buffer view"),
        (sparse(9, 0), "accessors[0]"),
    ];
    let mut beyond = Made::triangle();
    beyond.bytes[36..38].copy_from_slice(&[9, 0]);
    cases.push((beyond, "mesh 0 primitive 0: its indices name vertex 9"));
    for (made, word) in cases {
        let error = made.error();
        assert!(error.contains(word), "{word}: {error}");
    }
}

#[test]
fn a_few_bytes_do_not_become_gigabytes() {
    // Zeros cost a file nothing.
    let mut zeros = Made::triangle();
    let few = zeros.add("SCALAR", 5121, 1, &[1]);
    let value = zeros.floats("VEC3", &[1.0, 2.0, 3.0]);
    let of_zeros = json!({"componentType": 5126, "type": "VEC3", "count": 4_000_000_000u32,
        "sparse": {"count": 1, "values": {"bufferView": value},
            "indices": {"bufferView": few, "componentType": 5121}}});
    zeros.set("/accessors/0", of_zeros);
    zeros.json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    assert!(zeros.error().contains("64 times over"), "{}", zeros.error());
    // One list of corners, and a hundred thousand primitives of it.
    let mut many = Made::triangle();
    let corners = vec![0u8; 3000];
    let corners = many.add("SCALAR", 5121, 3000, &corners);
    let primitive = json!({"attributes": {"POSITION": 0}, "indices": corners});
    many.set("/meshes/0/primitives", json!(vec![primitive; 2000]));
    assert!(many.error().contains("64 times over"), "{}", many.error());
    // Nodes that are in each other again and again.
    let nodes: Vec<Value> = (1..30).map(|i| json!({"children": [i, i]})).collect();
    let mut laughs = Made::with("/nodes", json!(nodes));
    laughs.push("nodes", json!({"mesh": 0}));
    assert!(laughs.error().contains("stands under two nodes"), "{}", laughs.error());
    let circle = Made::with("/nodes", json!([{"children": [1]}, {"children": [0], "mesh": 0}]));
    assert!(circle.error().contains("contains itself"), "{}", circle.error());
}

#[test]
fn many_primitives_on_one_list_of_vertices_keep_what_each_uses() {
    let mut made = Made::triangle();
    let numbers: Vec<f32> = (0..300).map(|i| (i * i % 97) as f32).collect();
    let shared = made.floats("VEC3", &numbers);
    let corners = made.add("SCALAR", 5121, 3, &[90, 7, 33]);
    made.set(
        "/meshes/0/primitives/0",
        json!({"attributes": {"POSITION": shared}, "indices": corners}),
    );
    let scene = made.scene();
    let mesh = scene.instances[0].geometry.mesh();
    let of = |i: usize| {
        v(f64::from(numbers[3 * i]), f64::from(numbers[3 * i + 1]), f64::from(numbers[3 * i + 2]))
    };
    let seen: Vec<DVec3> = mesh.outline(0).iter().map(|c| mesh.points[*c as usize]).collect();
    assert_eq!((mesh.points.len(), seen), (3, vec![of(90), of(7), of(33)]));
}

#[test]
fn files_that_are_valid_are_read() {
    let plain = Made::triangle();
    assert_eq!(plain.notes(), "");
    let mut own = Made::triangle();
    let batch = own.floats("SCALAR", &[1.0, 2.0, 3.0]);
    own.set("/meshes/0/primitives/0/attributes/_BATCH_ID", json!(batch));
    let mut unused = Made::triangle();
    let length = unused.bytes.len();
    unused.set("/buffers", json!([{"byteLength": length}, {"byteLength": 7}]));
    let mut whole = Made::triangle();
    whole.set("/accessors/0/count", json!(3.0)).set("/nodes/0/mesh", json!(0.0));
    whole.set("/accessors/0/componentType", json!(5126.0)).set("/scene", json!(0.0));
    let cases = [
        own,
        unused,
        whole,
        Made::with("/extras", json!([1, "two"])),
        Made::with("/nodes/0/extras", json!("a word")),
        Made::with("/meshes/0/primitives/0/extras", json!(7)),
        Made::with("/accessors/0/extras", json!(null)),
        Made::with("/meshes/0/extras", json!(true)),
    ];
    for made in &cases {
        same(&made.points()[0], &TRIANGLE);
        assert_eq!(made.notes(), "", "{}", made.json);
    }
    // Without a scene, all nodes are shown; without a node, nothing is; both are told or said by the file itself.
    let mut none = Made::triangle();
    none.json.as_object_mut().unwrap().retain(|name, _| name != "scene" && name != "scenes");
    same(&none.points()[0], &TRIANGLE);
    assert!(none.notes().contains("has no scene: all its nodes are shown"), "{}", none.notes());
    none.json.as_object_mut().unwrap().remove("nodes");
    assert!(none.notes().contains("nothing is shown"), "{}", none.notes());
    for scene in [json!({}), json!({"name": "empty"})] {
        let empty = Made::with("/scenes", json!([scene]));
        assert_eq!((empty.scene().instances.len(), empty.notes().as_str()), (0, ""));
    }
}

#[test]
fn a_byte_order_mark_and_zeros_behind_the_json_are_no_part_of_it() {
    let made = Made::triangle();
    let folder = Scratch::new("gltf-mark");
    let mut json = made.json.clone();
    json["buffers"] = json!([{"byteLength": made.bytes.len(), "uri": "a%20b.bin"}]);
    std::fs::write(folder.path().join("a b.bin"), &made.bytes).unwrap();
    let text = serde_json::to_vec(&json).unwrap();
    let path = folder.path().join("a.gltf");
    let sound = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let scene = read::scene(&path, None, "a", &ReadOptions::default());
        assert_eq!(scene.unwrap_or_else(|e| panic!("{e}")).face_count(), 1);
    };
    sound(&text);
    sound(&[b"\xef\xbb\xbf", &text[..]].concat());
    json["buffers"] = json!([{"byteLength": made.bytes.len()}]);
    let text = serde_json::to_vec(&json).unwrap();
    sound(&glb(&[&text[..], b"\0\0\0\0\0"].concat(), &made.bytes));
    // What is wrong in the text is told with its place.
    std::fs::write(&path, "{\"asset\": {\"version\": \"2.0\"},\n \"nodes\": [{\"mesh\": \"x\"}]}")
        .unwrap();
    let error = read::document(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("nodes[0].mesh is \"x\""), "{error}");
    std::fs::write(&path, "{\"asset\": {\"version\": \"2.0\"},\n \"nodes\": [}").unwrap();
    let error = read::document(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("a.gltf:2:"), "{error}");
}

#[test]
fn extensions_that_are_not_read_are_told_or_refused_with_a_cure() {
    let used = |name: &str| {
        let mut made = Made::of(json!({"extensions": {name: {"anything": 1}}}));
        made.set("/extensionsUsed", json!([name]));
        made
    };
    for (name, word) in [
        ("KHR_materials_clearcoat", "clear coat"),
        ("KHR_materials_sheen", "cloth"),
        ("VENDOR_of_mine", "left out"),
    ] {
        let made = used(name);
        let notes = made.notes();
        assert!(notes.contains(name) && notes.contains(word), "{notes}");
        // An extension need not be declared to be told.
        let mut silent = used(name);
        silent.json.as_object_mut().unwrap().remove("extensionsUsed");
        assert_eq!(silent.notes(), notes);
    }
    for (name, word) in [
        ("KHR_draco_mesh_compression", "Blender"),
        ("EXT_meshopt_compression", "gltfpack"),
        ("KHR_texture_basisu", "PNG"),
        ("VENDOR_of_mine", "export it without"),
    ] {
        let error = Made::with("/extensionsRequired", json!([name])).error();
        assert!(error.contains(name) && error.contains(word), "{error}");
    }
    let known = json!(["KHR_materials_unlit", "KHR_lights_punctual", "KHR_mesh_quantization"]);
    let mut known = Made::with("/extensionsRequired", known);
    known.set("/extensionsUsed", json!(["KHR_texture_transform", "EXT_mesh_gpu_instancing"]));
    assert_eq!(known.notes(), "");
    // Compressed data without its plain form, though the file says it is not needed.
    let mut draco = Made::with("/extensionsUsed", json!(["KHR_draco_mesh_compression"]));
    draco.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert!(draco.error().contains("Blender"), "{}", draco.error());
    let animation = json!([{"channels": [], "samplers": []}]);
    assert!(Made::with("/animations", animation).notes().contains("not played"));
}

#[test]
fn what_a_file_leaves_open_is_as_the_format_says() {
    let microfacets =
        |roughness: f32, metal: f32| Gloss::Microfacets { reflectance: 0.04, roughness, metal };
    // No material, and an empty one: white metal, wholly rough, seen from its front.
    for made in [Made::triangle(), Made::of(json!({}))] {
        let material = made.material();
        assert_eq!((material.color, material.alpha), (Color::WHITE, 1.0));
        assert_eq!(material.finish.gloss, microfacets(1.0, 1.0));
        assert_eq!((material.alpha_mode, material.one_sided), (AlphaMode::Opaque, true));
        assert_eq!((material.finish.glow, material.unlit), (Color::BLACK, false));
        assert_eq!((material.finish.ambient, material.finish.diffuse), (1.0, 1.0));
        assert!(material.finish.optics.is_none() && material.maps.is_empty() && material.casts);
    }
    let material = Made::of(json!({"alphaMode": "MASK", "doubleSided": true, "emissiveFactor": [0.5, 0, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 1, 0.75], "metallicFactor": 0, "roughnessFactor": 0.5}}))
    .material();
    assert_eq!((material.color, material.alpha), (Color::new(0.25, 0.5, 1.0), 0.75));
    assert_eq!((material.alpha_mode, material.one_sided), (AlphaMode::Mask(0.5), false));
    assert_eq!(material.finish.gloss, microfacets(0.5, 0.0));
    assert_eq!(material.finish.glow, Color::new(0.5, 0.0, 1.0));
    // Colours of vertices are those of the file, with and without alpha, in shares and in numbers.
    let mut three = Made::triangle();
    let colors = three.floats("VEC3", &[1.0, 0.5, 0.25].repeat(3));
    three.set("/meshes/0/primitives/0/attributes/COLOR_0", json!(colors));
    let mut four = Made::triangle();
    let colors = four.add("VEC4", 5121, 3, &[255, 51, 0, 102].repeat(3));
    four.set("/meshes/0/primitives/0/attributes/COLOR_0", json!(colors));
    four.set(&format!("/accessors/{colors}/normalized"), json!(true));
    for (made, expected) in [(three, [1.0, 0.5, 0.25, 1.0]), (four, [1.0, 0.2, 0.0, 0.4])] {
        assert_eq!(made.scene().instances[0].geometry.mesh().colors, [expected; 3]);
        assert_eq!(made.material().color, Color::WHITE, "the file's colours are not tinted");
    }
    // Pictures: the first coordinates, repeated, their top at the top; normals and occlusion whole.
    let mut made =
        Made::of(json!({"normalTexture": {"index": 0}, "occlusionTexture": {"index": 0},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    made.set("/textures", json!([{"source": 0}])).set("/images", json!([{"uri": "a.png"}]));
    let uvs = made.floats("VEC2", &[0.0, 0.0, 1.0, 0.25, 0.5, 1.0]);
    made.set("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(uvs));
    let material = made.material();
    for name in ["color", "normal", "occlusion"] {
        let map = &material.maps[name];
        assert_eq!((map.strength, map.mapping.wrap), (1.0, [Wrap::Repeat; 2]), "{name}");
    }
    let v_up: Vec<[f32; 2]> =
        made.scene().instances[0].geometry.mesh().uvs.iter().map(|uv| uv.to_array()).collect();
    assert_eq!(v_up, [[0.0, 1.0], [1.0, 0.75], [0.5, 0.0]]);
    made.set("/samplers", json!([{}, {"wrapS": 33071, "wrapT": 33648}]));
    for (sampler, wrap) in [(0, [Wrap::Repeat; 2]), (1, [Wrap::Clamp, Wrap::Mirror])] {
        made.set("/textures/0/sampler", json!(sampler));
        assert_eq!(made.material().maps["color"].mapping.wrap, wrap);
    }
    // Metres, y up: nothing is turned or scaled.
    let moved = Made::with("/nodes/0/translation", json!([1, 20, 300]));
    same(&moved.points()[0], &TRIANGLE.map(|p| p + v(1.0, 20.0, 300.0)));
}

#[test]
fn older_materials_of_diffuse_and_specular_colour_are_shown() {
    let of = |gloss: Value| {
        Made::of(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": gloss}}))
    };
    let gloss = |material: &Material| material.finish.gloss;
    let garden =
        of(json!({"diffuseFactor": [0.2, 0.6, 0.1, 0.5], "specularFactor": [0.1, 0.1, 0.1],
        "glossinessFactor": 0.25}));
    let material = garden.material();
    assert_eq!((material.color, material.alpha), (Color::new(0.2, 0.6, 0.1), 0.5));
    assert_eq!(
        gloss(&material),
        Gloss::Microfacets { reflectance: 0.1, roughness: 0.75, metal: 0.0 }
    );
    assert_eq!(garden.notes(), "");
    // Nothing of its own colour: a metal, whose colour is that of what it mirrors.
    let gold =
        of(json!({"diffuseFactor": [0, 0, 0, 1], "specularFactor": [1, 0.75, 0.25]})).material();
    assert_eq!(gold.color, Color::new(1.0, 0.75, 0.25));
    assert!(matches!(gold.finish.gloss, Gloss::Microfacets { metal: 1.0, roughness: 0.0, .. }));
    // What is absent is 1.
    let absent = of(json!({})).material();
    assert_eq!(absent.color, Color::WHITE);
    assert_eq!(gloss(&absent), Gloss::Microfacets { reflectance: 1.0, roughness: 0.0, metal: 0.0 });
    let mut picture =
        of(json!({"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 0}}));
    picture.set("/textures", json!([{"source": 0}])).set("/images", json!([{"uri": "a.png"}]));
    assert_eq!(picture.material().maps.keys().collect::<Vec<_>>(), ["color"]);
    assert!(picture.notes().contains("specularGlossinessTexture"), "{}", picture.notes());
}

#[test]
fn glow_glass_and_bodies_are_as_their_extensions_say() {
    let glow = Made::of(json!({"emissiveFactor": [1, 0.5, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 300}}}));
    assert_eq!(glow.material().finish.glow, Color::new(300.0, 150.0, 0.0));
    let ior = Made::of(json!({"pbrMetallicRoughness": {"metallicFactor": 0},
        "extensions": {"KHR_materials_ior": {"ior": 2}}}));
    let Gloss::Microfacets { reflectance, .. } = ior.material().finish.gloss else { panic!() };
    close(f64::from(reflectance), 1.0 / 9.0, 1e-6);
    let glass = |extensions: Value| {
        Made::of(json!({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0,
            "baseColorFactor": [0.5, 1, 1, 1]}, "extensions": extensions}))
    };
    // A pane mirrors 4 %, and lets three quarters of the rest through without moving what is behind it.
    let pane = glass(json!({"KHR_materials_transmission": {"transmissionFactor": 0.75}}));
    let material = pane.material();
    let optics = material.finish.optics.expect("optics");
    assert_eq!((optics.index, optics.fresnel), (1.0, false));
    close(f64::from(optics.reflect.r), 0.04, 1e-6);
    close(f64::from(optics.refract.r), 0.5 * 0.75 * 0.96, 1e-6);
    close(f64::from(optics.refract.g), 0.75 * 0.96, 1e-6);
    close(f64::from(material.color.g), 0.25, 1e-6);
    assert_eq!(pane.notes(), "");
    // A body: half is left of blue after 2 m, and a quarter of red.
    let body = glass(json!({"KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_ior": {"ior": 1.33}, "KHR_materials_volume": {"thicknessFactor": 0.1,
            "attenuationDistance": 2, "attenuationColor": [0.25, 1, 0.5]}}));
    let material = body.material();
    let Optics { reflect, refract, index, fresnel, absorb } =
        material.finish.optics.expect("optics");
    assert_eq!((reflect, refract), (Color::WHITE, Color::new(0.5, 1.0, 1.0)));
    assert_eq!((index, fresnel, material.one_sided), (1.33, true, false));
    close(f64::from(absorb.r), 4f64.ln() / 2.0, 1e-6);
    close(f64::from(absorb.b), 2f64.ln() / 2.0, 1e-6);
    assert_eq!((absorb.g, material.color), (0.0, Color::BLACK));
    // Metal lets nothing through.
    let metal =
        Made::of(json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}));
    assert!(metal.material().finish.optics.is_none());
}

#[test]
fn lights_are_in_the_list_of_their_scene_in_candela_and_lux() {
    let lights = json!([
        {"type": "point", "name": "bulb", "intensity": 100, "color": [1, 0.5, 0]},
        {"type": "directional", "intensity": 5000},
        {"type": "spot", "intensity": 40, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.6}},
        {"type": "spot"},
        {"type": "area"},
    ]);
    let mut made = Made::with("/extensions", json!({"KHR_lights_punctual": {"lights": lights}}));
    let half = 0.5f64.sqrt();
    // All look down: -z is turned to -y.
    let of = |light: u32, name: &str, y: f64| {
        json!({"name": name, "rotation": [-half, 0, 0, half], "translation": [0, y, 0],
            "extensions": {"KHR_lights_punctual": {"light": light}}})
    };
    made.set(
        "/nodes",
        json!([{"mesh": 0, "translation": [0, 1, 0], "children": [1, 2, 3, 4, 5]}, of(0, "", 1.0),
            of(1, "sun", 0.0), of(2, "spot", 3.0), of(3, "plain", 3.0), of(4, "panel", 3.0)]),
    );
    let scene = made.scene();
    assert_eq!(scene.lights.keys().collect::<Vec<_>>(), ["bulb", "plain", "spot", "sun"]);
    assert!(made.notes().contains("\"panel\" is left out"), "{}", made.notes());
    let lit = |name: &str, x: f64| -> Color {
        let lamp: Lamp = scene.lights[name].lamp(name, Path::new("")).unwrap();
        let at = Receiver { position: v(x, 0.0, 0.0), normal: DVec3::Y };
        lamp.light.irradiance(&at) * lamp.strength
    };
    // 100 cd two metres above.
    let bulb = lit("bulb", 0.0);
    close(f64::from(bulb.r), 25.0, 1e-5);
    close(f64::from(bulb.g), 12.5, 1e-5);
    close(f64::from(lit("sun", 7.0).g), 5000.0, 1e-2);
    // Four metres above, on the axis and beyond the cone.
    close(f64::from(lit("spot", 0.0).g), 40.0 / 16.0, 1e-5);
    assert_eq!(lit("spot", 4.0 * 0.61f64.tan()), Color::BLACK);
    let Entry::SpotLight(plain) = &scene.lights["plain"] else { panic!("{:?}", scene.lights) };
    assert_eq!((plain.intensity, plain.inner_angle), (1.0, Some(0.0)));
    close(plain.angle, 45.0, 1e-9);
    assert!((plain.direction - DVec3::NEG_Y).length() < 1e-6);
}

#[test]
fn quantized_meshes_are_where_their_numbers_say() {
    let mut made = Made::triangle();
    let bytes: Vec<u8> = [0i16, 0, 0, 0, i16::MAX, 0, -16384, 0, 0, i16::MIN, 0, 0]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let positions = made.add("VEC3", 5122, 3, &bytes);
    made.set(&format!("/bufferViews/{positions}/byteStride"), json!(8));
    made.set(&format!("/accessors/{positions}/normalized"), json!(true));
    let normals = made.add("VEC3", 5120, 3, &[0, 0, 127, 0].repeat(3));
    made.set(&format!("/bufferViews/{normals}/byteStride"), json!(4));
    made.set(&format!("/accessors/{normals}/normalized"), json!(true));
    let uvs = made.add("VEC2", 5123, 3, &[1, 0, 2, 0].repeat(3));
    made.set(
        "/meshes/0/primitives/0/attributes",
        json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs}),
    );
    // Without the extension it is no valid file.
    assert!(made.error().contains("which does not fit its use"), "{}", made.error());
    made.set("/extensionsRequired", json!(["KHR_mesh_quantization"]));
    same(&made.points()[0], &[DVec3::ZERO, v(1.0, 0.0, -16384.0 / 32767.0), v(0.0, -1.0, 0.0)]);
    let scene = made.scene();
    let mesh = scene.instances[0].geometry.mesh();
    assert_eq!(mesh.normals, [glam::Vec3::Z; 3]);
    assert_eq!(mesh.uvs, [glam::Vec2::new(1.0, 1.0 - 2.0); 3]);
}

#[test]
fn instances_stand_where_their_attributes_say() {
    let mut made = Made::with("/nodes/0/translation", json!([10, 0, 0]));
    let moves = made.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 5.0, 0.0]);
    let half = 0.5f32.sqrt();
    let turns = made.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half]);
    let scales = made.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 3.0, 1.0]);
    let attributes =
        json!({"TRANSLATION": moves, "ROTATION": turns, "SCALE": scales, "_ID": moves});
    made.set("/nodes/0/extensions", json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}}));
    let points = made.points();
    assert_eq!(points.len(), 2);
    same(&points[0], &TRIANGLE.map(|p| p + v(10.0, 0.0, 0.0)));
    // Scaled, then turned by a quarter from x to y, then moved.
    same(&points[1], &[v(10.0, 5.0, 0.0), v(10.0, 7.0, 0.0), v(7.0, 5.0, 0.0)]);
    made.set("/accessors/2/count", json!(1));
    assert!(made.error().contains("node 0, EXT_mesh_gpu_instancing"), "{}", made.error());
}

#[test]
fn morph_targets_have_the_weights_of_their_node_or_mesh() {
    let mut made = Made::triangle();
    let up = made.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let right = made.floats("VEC3", &[4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    made.set("/meshes/0/primitives/0/targets", json!([{"POSITION": up}, {"POSITION": right}]));
    same(&made.points()[0], &TRIANGLE);
    made.set("/meshes/0/weights", json!([0.5, 0.25]));
    let morphed = |up: f64, right: f64| [v(right, 0.0, up), v(1.0, 0.0, up), v(0.0, 1.0, up)];
    same(&made.points()[0], &morphed(0.5, 1.0));
    // Two nodes with one mesh, one of them with weights of its own.
    made.set("/nodes", json!([{"mesh": 0}, {"mesh": 0, "weights": [2, 0]}]));
    made.set("/scenes/0/nodes", json!([0, 1]));
    let points = made.points();
    same(&points[0], &morphed(0.5, 1.0));
    same(&points[1], &morphed(2.0, 0.0));
    made.set(&format!("/accessors/{right}/count"), json!(2));
    made.set("/meshes/0/weights", json!([0, 1]));
    assert!(made.error().contains("morph target 1"), "{}", made.error());
}

#[test]
fn skins_stand_as_their_joints_do() {
    // Joint 2 stands 3 m above joint 1, a quarter turned, and was bound 1 m to the right.
    let mut made = Made::triangle();
    let joints = made.add("VEC4", 5121, 3, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let weights =
        made.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0]);
    let mut bound = [[0.0f32; 16]; 2];
    for matrix in &mut bound {
        (0..4).for_each(|i| matrix[5 * i] = 1.0);
    }
    bound[1][12] = -1.0;
    let bound = made.floats("MAT4", bound.as_flattened());
    let normals = made.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    made.set(
        "/meshes/0/primitives/0/attributes",
        json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights, "NORMAL": normals}),
    );
    let half = 0.5f64.sqrt();
    made.set(
        "/nodes",
        json!([{"name": "body", "mesh": 0, "skin": 0, "translation": [100, 0, 0]},
            {"children": [2], "translation": [0, 0, 1]},
            {"translation": [0, 3, 0], "rotation": [0, 0, half, half]}]),
    );
    made.set("/scenes/0/nodes", json!([0, 1]));
    made.set("/skins", json!([{"joints": [1, 2], "inverseBindMatrices": bound}]));
    // By the first, moved by 1 m; by the second, at its own place; the mean of both. The place of the mesh's own
    // node does not count.
    let by_second = v(0.0, 3.0, 1.0) + v(-1.0, -1.0, 0.0);
    let expected = [v(0.0, 0.0, 1.0), v(0.0, 3.0, 1.0), (v(0.0, 1.0, 1.0) + by_second) / 2.0];
    same(&made.points()[0], &expected);
    let scene = made.scene();
    assert_eq!(scene.instances[0].path, "body");
    let normals = &scene.instances[0].geometry.mesh().normals;
    assert!((normals[0] - glam::Vec3::X).length() < 1e-6, "{normals:?}");
    assert!((normals[1] - glam::Vec3::Y).length() < 1e-6, "{normals:?}");
    // What points nowhere is told.
    made.set(&format!("/accessors/{bound}/count"), json!(1));
    assert!(made.error().contains("skin 0: 1 inverse bind matrices"), "{}", made.error());
    made.set("/skins", json!([{"joints": [1]}]));
    assert!(made.error().contains("joint 1, and its skin has 1"), "{}", made.error());
}

#[test]
fn pictures_as_webp_are_shown() {
    use image::{ExtendedColorType, codecs::webp::WebPEncoder};
    let mut webp = Vec::new();
    WebPEncoder::new_lossless(&mut webp)
        .encode(&[0, 255, 0].repeat(4), 2, 2, ExtendedColorType::Rgb8)
        .unwrap();
    let mut made = Made::of(json!({"extensions": {"KHR_materials_unlit": {}}, "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let corners = [-9.0, 0.0, -9.0, -9.0, 0.0, 9.0, 18.0, 0.0, 0.0];
    let positions = made.floats("VEC3", &corners);
    let uvs = made.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.5, 1.0]);
    made.set(
        "/meshes/0/primitives/0/attributes",
        json!({"POSITION": positions, "TEXCOORD_0": uvs}),
    );
    let accessor = made.add("SCALAR", 5121, webp.len(), &webp);
    let view = made.json["accessors"][accessor]["bufferView"].clone();
    made.json["accessors"].as_array_mut().unwrap().pop();
    made.set("/images", json!([{"bufferView": view, "mimeType": "image/webp"}]));
    made.set("/textures", json!([{"extensions": {"EXT_texture_webp": {"source": 0}}}]));
    made.set("/extensionsRequired", json!(["EXT_texture_webp"]));
    let folder = Scratch::new("gltf-webp");
    let path = folder.path().join("webp.glb");
    std::fs::write(&path, made.glb()).unwrap();
    let scene = read::scene(&path, None, "webp", &ReadOptions::default()).unwrap();
    assert_eq!(scene.notes, [""; 0]);
    let [r, g, b] = colors(&spans(Arc::new(scene), &above(2.0, 4)), Filter::default());
    assert!(g.iter().all(|v| (v - 1.0).abs() < 1e-3), "{g:?}");
    assert!(r.iter().chain(&b).all(|v| v.abs() < 1e-3));
}

#[test]
fn real_files_are_read_and_tell_what_is_missing() {
    for (name, notes) in [
        ("models/CesiumMilkTruck.glb", &["animations are not played"][..]),
        ("models/AlphaBlendModeTest.glb", &[]),
        ("models/kaykit_city/gltf/building_A.gltf", &[]),
    ] {
        let Some(path) = data::find(name) else { continue };
        let reading = read::document(&path, &ReadOptions::default()).unwrap();
        assert_eq!(reading.notes.len(), notes.len(), "{name}: {:?}", reading.notes);
        assert!(notes.iter().all(|note| reading.notes[0].contains(note)), "{:?}", reading.notes);
    }
}
