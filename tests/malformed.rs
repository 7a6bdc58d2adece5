//! Damaged and invalid files: an error that names the file and the fault, or a scene where the file's
//! own report says that it is valid. No panic, no hang, no huge allocation.

use spandrel_tests::data;
use spandrel_tests::program::{Ran, run, scratch};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

fn info(path: &Path) -> Ran {
    run(PROGRAM, &["info", &path.to_string_lossy()], Path::new("/"))
}

/// An end that any file may have: done, or an error that names the file.
fn assert_civil(path: &Path, ran: &Ran) {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    match ran.code {
        Some(0) => {}
        Some(4) => {
            assert!(ran.err.starts_with("error: "), "{name}: {}", ran.err);
            let named = ran.err.contains(&name) || ran.err.contains("No such file");
            assert!(named, "{name} is not named: {}", ran.err);
        }
        code => panic!("{name} ended with {code:?}: {}", ran.err),
    }
}

/// Codes of the Khronos validator that blame what this reader does not use, or what does it no harm:
/// animations, skins, morph targets, bounds, names of types, lists that are empty.
const HARMLESS: [&str; 40] = [
    "ACCESSOR_ANIMATION_INPUT_NEGATIVE",
    "ACCESSOR_ANIMATION_INPUT_NON_INCREASING",
    "ACCESSOR_ELEMENT_OUT_OF_MAX_BOUND",
    "ACCESSOR_ELEMENT_OUT_OF_MIN_BOUND",
    "ACCESSOR_INVALID_FLOAT",
    "ACCESSOR_INVALID_IBM",
    "ACCESSOR_INVALID_SIGN",
    "ACCESSOR_JOINTS_INDEX_DUPLICATE",
    "ACCESSOR_JOINTS_INDEX_OOB",
    "ACCESSOR_MATRIX_ALIGNMENT",
    "ACCESSOR_MAX_MISMATCH",
    "ACCESSOR_MIN_MISMATCH",
    "ACCESSOR_TOO_LONG",
    "ACCESSOR_VECTOR3_NON_UNIT",
    "ACCESSOR_WEIGHTS_NEGATIVE",
    "ACCESSOR_WEIGHTS_NON_NORMALIZED",
    "ANIMATION_SAMPLER_ACCESSOR_WITH_BYTESTRIDE",
    "ANIMATION_SAMPLER_OUTPUT_ACCESSOR_INVALID_COUNT",
    "BUFFER_BYTE_LENGTH_MISMATCH",
    "BUFFER_DATA_URI_MIME_TYPE_INVALID",
    "BUFFER_VIEW_INVALID_BYTE_STRIDE",
    "EMPTY_ENTITY",
    "IMAGE_BUFFER_VIEW_WITH_BYTESTRIDE",
    "IMAGE_MIME_TYPE_INVALID",
    "INVALID_IBM_ACCESSOR_COUNT",
    "INVALID_URI",
    "MESH_INVALID_WEIGHTS_COUNT",
    "MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT",
    "MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT",
    "MESH_PRIMITIVE_JOINTS_WEIGHTS_MISMATCH",
    "MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR",
    "MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS",
    "MESH_PRIMITIVE_TOO_FEW_TEXCOORDS",
    "NODE_SKIN_NO_SCENE",
    "NODE_SKIN_WITH_NON_SKINNED_MESH",
    "NODE_WEIGHTS_INVALID",
    "SKIN_IBM_ACCESSOR_WITH_BYTESTRIDE",
    "SKIN_NO_COMMON_ROOT",
    "SKIN_SKELETON_INVALID",
    "UNDECLARED_EXTENSION",
];

/// Faults of parts that are not read, by file: the code alone does not tell.
const UNUSED_PARTS: [&str; 11] = [
    "animation/unresolved_channel_sampler.gltf",
    "buffer/zero_bytelength.gltf",
    "buffer_view/invalid_stride_too_big.gltf",
    "node/skin_with_no_mesh.gltf",
    "node/unresolved_skin.gltf",
    "node/weights_with_no_mesh.gltf",
    "root/extensions_non_objects.gltf",
    "root/invalid_collection_type.gltf",
    "skin/empty_object.gltf",
    "skin/no_joints_in_scene.gltf",
    "skin/skeleton_invalid.gltf",
];

/// Files whose text begins with a byte order mark, which is read over in any text.
const MARKED: [&str; 2] = ["glb/bom.glb", "json/bom.gltf"];

/// A valid document whose data the application must bring.
const WITHOUT_DATA: &str = "root/named_objects.gltf";

#[test]
fn gltf_files_end_as_the_khronos_validator_says() {
    let Some(folder) = data::find("malformed/gltf_validator") else { return };
    let mut counts = [0; 2];
    for path in data::files(&folder, &[".gltf", ".glb"]) {
        let ran = info(&path);
        assert_civil(&path, &ran);
        let report = std::fs::read_to_string(format!("{}.report.json", path.display()));
        let Ok(report) = report else { continue };
        let report: serde_json::Value = serde_json::from_str(&report).unwrap();
        let name = path.strip_prefix(&folder).unwrap().to_string_lossy().into_owned();
        let errors: Vec<&str> = report["issues"]["messages"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|message| message["severity"] == 0)
            .filter_map(|message| message["code"].as_str())
            .collect();
        if errors.is_empty() {
            assert!(ran.code == Some(0) || name == WITHOUT_DATA, "{name} is valid: {}", ran.err);
            counts[0] += 1;
        } else if ran.code == Some(0) {
            let harmless = errors.iter().all(|code| HARMLESS.contains(code));
            assert!(
                harmless || UNUSED_PARTS.contains(&&*name) || MARKED.contains(&&*name),
                "{name} loads with {errors:?}"
            );
        } else {
            counts[1] += 1;
        }
    }
    assert!(counts[0] > 20 && counts[1] > 40, "{counts:?}");
}

#[test]
fn odd_obj_files_load_or_name_their_line() {
    let Some(folder) = data::find("malformed/obj_odd") else { return };
    // What is wrong with them, if it is fatal.
    let faults = [
        ("invalid-face-definition.obj", "corner"),
        ("invalid-relative-vertex-index.obj", "does not exist"),
        ("test-nan.obj", "finite"),
    ];
    for path in data::files(&folder, &[".obj"]) {
        let ran = info(&path);
        assert_civil(&path, &ran);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let fault = faults.iter().find(|(file, _)| *file == name);
        match fault {
            Some((_, word)) => {
                assert_eq!(ran.code, Some(4), "{name} loads");
                assert!(ran.err.contains(word), "{name}: {}", ran.err);
                let place = format!("{name}:");
                let after = ran.err.split(&place).nth(1).unwrap_or("");
                assert!(after.starts_with(|c: char| c.is_ascii_digit()), "{name}: {}", ran.err);
            }
            None => assert_eq!(ran.code, Some(0), "{name}: {}", ran.err),
        }
    }
}

#[test]
fn invalid_city_models_are_civil() {
    let Some(folder) = data::find("malformed/val3dity_invalid") else { return };
    for path in data::files(&folder, &[".json", ".obj"]) {
        let ran = info(&path);
        assert_civil(&path, &ran);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let must_fail = ["invalid_json_cityjson.json", "index901.obj"];
        if must_fail.contains(&name.as_str()) {
            assert_eq!(ran.code, Some(4), "{name} loads");
        }
    }
}

/// The `.poly` text of the val3dity tests: vertices, then polygons of one outer and inner rings.
fn poly_as_cityjson(text: &str) -> Option<String> {
    let mut numbers = text.lines().map(|line| line.split('#').next().unwrap_or(""));
    let head: Vec<usize> =
        numbers.next()?.split_whitespace().map(|n| n.parse().unwrap_or(0)).collect();
    let mut names = std::collections::BTreeMap::new();
    let mut vertices = Vec::new();
    while vertices.len() < *head.first()? {
        let line: Vec<f64> =
            numbers.next()?.split_whitespace().filter_map(|n| n.parse().ok()).collect();
        let [name, x, y, z] = line[..] else { return None };
        names.insert(name as u64, vertices.len());
        vertices.push(format!("[{x},{y},{z}]"));
    }
    let count: usize = numbers.next()?.split_whitespace().next()?.parse().ok()?;
    let mut surfaces = Vec::new();
    for _ in 0..count {
        let head: Vec<usize> =
            numbers.next()?.split_whitespace().filter_map(|n| n.parse().ok()).collect();
        let (rings, holes) = (*head.first()?, head.get(1).copied().unwrap_or(0));
        let mut surface = Vec::new();
        for _ in 0..rings {
            let ring: Vec<u64> =
                numbers.next()?.split_whitespace().filter_map(|n| n.parse().ok()).collect();
            let corners: Option<Vec<String>> =
                ring.get(1..)?.iter().map(|name| names.get(name).map(usize::to_string)).collect();
            surface.push(format!("[{}]", corners?.join(",")));
        }
        // Points inside the holes, for tetgen.
        for _ in 0..holes {
            numbers.next()?;
        }
        surfaces.push(format!("[{}]", surface.join(",")));
    }
    Some(format!(
        r#"{{"type":"CityJSON","version":"2.0","vertices":[{}],"CityObjects":{{"b":{{"type":"Building",
        "geometry":[{{"type":"MultiSurface","lod":"1","boundaries":[{}]}}]}}}}}}"#,
        vertices.join(","),
        surfaces.join(",")
    ))
}

/// Not faults of a face: points closer than a millimetre, which val3dity takes as one (104_4); a face that
/// fills the hole of another and has one itself, both sound (207_2).
const SOUND: [&str; 2] = ["104_4", "207_2"];

#[test]
fn faults_of_faces_and_holes_are_named() {
    let Some(folder) = data::find("malformed/val3dity_invalid") else { return };
    let scratch = spandrel_tests::program::scratch("poly");
    // val3dity's code, the first three digits of the name, and what `info` says of it.
    let words = [
        ("104", &["crosses or touches itself"][..]),
        ("201", &["crosses", "overlap"]),
        ("202", &["overlap"]),
        ("203", &["do not lie in a plane"]),
        ("206", &["a hole lies outside", "a hole crosses"]),
        ("207", &["overlap"]),
    ];
    let mut seen = 0;
    for path in data::files(&folder, &[".poly"]) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let Some(json) = poly_as_cityjson(&std::fs::read_to_string(&path).unwrap()) else {
            continue;
        };
        let file = scratch.join(format!("{name}.json"));
        std::fs::write(&file, json).unwrap();
        let ran = info(&file);
        assert_civil(&file, &ran);
        if SOUND.contains(&name.as_str()) {
            continue;
        }
        if let Some((_, words)) = words.iter().find(|(code, _)| name.starts_with(code)) {
            let told = words.iter().any(|word| ran.out.contains(word) || ran.err.contains(word));
            assert!(told, "{name}: expected {words:?} in {}{}", ran.out, ran.err);
            seen += 1;
        }
    }
    assert!(seen >= 7, "only {seen} files were judged");
    std::fs::remove_dir_all(scratch).unwrap();
}

#[test]
fn absurd_parameters_of_shapes_are_refused() {
    let shapes = [
        "Box(size: (0, 1, 1))",
        "Box(size: (1e400, 1, 1))",
        "Box(size: (NaN, 1, 1))",
        "Sphere(radius: -1)",
        "Sphere(radius: 1, segments: 2)",
        "Sphere(radius: 1, segments: 4000000000)",
        "Torus(radius: 1, tube: 2)",
        "Cone(radius: 0, height: 1)",
        "Prism(outline: [(0, 0), (1, 0)], height: 1)",
        "Revolve(profile: [(1, 0)])",
        "Revolve(profile: [(1, 0), (1, 0)])",
        "Revolve(profile: [(-1, 0), (1, 1)])",
        "Revolve(profile: [(1, 0), (1, 1)], angle: 0)",
        "Sweep(profile: [(0, 0), (1, 0), (0, 1)], path: [(0, 0, 0), (0, 0, 0)])",
        "HeightField(heights: [[1, 2], [3]], size: (1, 1))",
        "HeightField(heights: [], size: (1, 1))",
        "Terrain(size: (1, 1), height: 1, levels: 30)",
        "Terrain(size: (1, 1), height: 1, roughness: 1)",
        "Instance(\"nobody\")",
        "File(path: \"nowhere.obj\")",
        "Array(of: (shape: Box(size: (1, 1, 1))), count: (100000, 100000, 1), step: (1, 1, 1))",
        "Faces(points: [(0, 0, 0)], faces: [(outline: [0, 1, 2])])",
        "Faces(points: [(0, 0, 0), (1, 0, 0), (1, 1, 0)], normals: [(0, 0, 1)], faces: [])",
    ];
    let scratch = spandrel_tests::program::scratch("shapes");
    let path = scratch.join("shape.ron");
    for shape in shapes {
        let text = format!("Scene(plans: [(name: \"p\", root: (name: \"it\", shape: {shape}))])");
        std::fs::write(&path, text).unwrap();
        let ran = info(&path);
        assert_ne!(ran.code, Some(0), "{shape} is taken");
        assert!(ran.code == Some(4), "{shape}: {ran:?}");
        assert!(ran.err.starts_with("error: "), "{shape}: {}", ran.err);
    }
    // A scene that contains itself.
    std::fs::write(
        &path,
        "Scene(plans: [(name: \"p\", root: (shape: File(path: \"shape.ron\")))])",
    )
    .unwrap();
    let ran = info(&path);
    assert!(ran.err.contains("contains itself"), "{}", ran.err);
    let laughs = "Scene(plans: [(name: \"p\", definitions: {
        \"a\": (children: [(shape: Instance(\"b\")), (shape: Instance(\"b\")), (shape: Instance(\"b\"))]),
        \"b\": (children: [(shape: Instance(\"a\"))]),
    }, root: (shape: Instance(\"a\")))])";
    std::fs::write(&path, laughs).unwrap();
    let ran = info(&path);
    assert!(ran.err.contains("contains itself"), "{}", ran.err);
    std::fs::remove_dir_all(scratch).unwrap();
}

#[test]
fn damaged_pictures_are_civil() {
    let folder = scratch("pictures");
    let mut seen = 0;
    for (name, ending) in [
        ("malformed/openexr_damaged", "exr"),
        ("malformed/tinyexr_regress", "exr"),
        ("malformed/pngsuite_broken", "png"),
        ("exr", "exr"),
    ] {
        let Some(damaged) = data::find(name) else { continue };
        for (i, path) in data::files(&damaged, &[""]).iter().enumerate() {
            let own = path.extension().is_some_and(|e| e == "md" || e == "txt" || e == "csv");
            if own {
                continue;
            }
            // Many have no ending of their own.
            let copy = folder.join(format!("{i}.{ending}"));
            std::fs::copy(path, &copy).unwrap();
            let file = copy.to_string_lossy();
            let ran = run(PROGRAM, &["diff", &file, &file], Path::new("/"));
            assert_civil(&copy, &ran);
            seen += 1;
        }
    }
    assert!(seen > 80 || data::folder().is_none(), "{seen} pictures");
    let _ = std::fs::remove_dir_all(folder);
}
