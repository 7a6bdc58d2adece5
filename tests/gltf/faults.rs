//! Files that lie are refused with the place; valid ones are read; what is not shown is told.

use super::*;

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
    // A file that is not there is told with the one that names it.
    json["buffers"] = json!([{"byteLength": made.bytes.len(), "uri": "nowhere.bin"}]);
    std::fs::write(&path, json.to_string()).unwrap();
    let error = read::document(&path, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("nowhere.bin") && error.contains("a.gltf"), "{error}");
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
    // What animates something else than nodes.
    let channel = json!({"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer":
        {"pointer": "/materials/0/emissiveFactor"}}}});
    let sampler = json!({"input": 0, "output": 0});
    let animation = json!([{"channels": [channel], "samplers": [sampler]}]);
    let notes = Made::with("/animations", animation).notes();
    assert!(notes.starts_with("the extension KHR_animation_pointer is not read"), "{notes}");
    assert_eq!(notes.lines().count(), 1, "{notes}");
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
