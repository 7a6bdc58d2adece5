//! Materials, pictures and lights, by value.

use super::*;

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
    // What is done to the file's space is not done to them, and told.
    let folder = folder();
    let path = folder.path().join("made.glb");
    std::fs::write(&path, made.glb()).unwrap();
    let told = |options: ReadOptions| {
        let notes = read::document(&path, &options).unwrap().notes;
        notes.iter().any(|note| note.contains("cameras and lights"))
    };
    assert!(!told(ReadOptions::default()));
    assert!(told(ReadOptions { unit: Some(0.01), ..ReadOptions::default() }));
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
    let LightEntry::SpotLight(plain) = &scene.lights["plain"] else { panic!("{:?}", scene.lights) };
    assert_eq!((plain.intensity, plain.inner_angle), (1.0, Some(0.0)));
    close(plain.angle, 45.0, 1e-9);
    assert!((plain.direction - DVec3::NEG_Y).length() < 1e-6);
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
    let [r, g, b] = colors(&spans(Arc::new(scene), &above(2.0, 4)), TextureFilter::default());
    assert!(g.iter().all(|v| (v - 1.0).abs() < 1e-3), "{g:?}");
    assert!(r.iter().chain(&b).all(|v| v.abs() < 1e-3));
}

#[test]
fn cameras_of_one_name_are_all_there() {
    let mut made = Made::triangle();
    made.push(
        "cameras",
        json!({"type": "perspective", "name": "eye", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    for x in 0..2 {
        let node = made.push("nodes", json!({"camera": 0, "translation": [x, 0, 5]}));
        made.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
    }
    let cameras = made.scene().cameras;
    let places: Vec<(&str, f64)> =
        cameras.iter().map(|(name, c)| (name.as_str(), c.position.x)).collect();
    assert_eq!(places, [("eye", 0.0), ("eye#2", 1.0)]);
}
