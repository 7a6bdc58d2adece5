//! Where the vertices of quantized, instanced, morphed and skinned meshes stand.

use super::*;

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
