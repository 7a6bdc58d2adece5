//! glTF that bends: morph targets and skins at a moment stand where closed forms have them.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DQuat, DVec3, Vec2, Vec3, dvec3 as v};
use serde_json::json;
use spandrel_engine::scene::read::{self, ReadOptions};

use crate::gltf::{Made, same};
use crate::gltf_moves::{Film, about_z, add, points};

/// A triangle with two morph targets: one moves it up along z by 1, one its first corner to the right by 4.
pub(crate) fn morphing() -> Made {
    let mut made = Made::triangle();
    let up = made.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let right = made.floats("VEC3", &[4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    made.set("/meshes/0/primitives/0/targets", json!([{"POSITION": up}, {"POSITION": right}]));
    made.set("/meshes/0/weights", json!([0.5, 0.25]));
    made
}

pub(crate) fn morphed(up: f64, right: f64) -> [DVec3; 3] {
    [v(4.0 * right, 0.0, up), v(1.0, 0.0, up), v(0.0, 1.0, up)]
}

#[test]
fn morph_targets_have_the_weights_of_the_animation_then_the_node_then_the_mesh() {
    let mut made = morphing();
    made.set("/nodes", json!([{"mesh": 0}, {"mesh": 0, "weights": [2, 0]}, {"mesh": 0}]));
    made.set("/scenes/0/nodes", json!([0, 1, 2]));
    add(&mut made, (0, "weights"), "LINEAR", &[0.0, 1.0], &[0.0, 1.0, 1.0, 0.0]);
    let film = Film::of(&made);
    let points = film.points(0.25);
    same(&points[0], &morphed(0.25, 0.75));
    same(&points[1], &morphed(2.0, 0.0));
    same(&points[2], &morphed(0.5, 0.25));
    // Names stay while shapes change.
    let paths = |seconds| film.at(seconds).instances.iter().map(|i| i.path.clone()).collect();
    let [a, b]: [Vec<String>; 2] = [0.0, 0.25].map(paths);
    assert_eq!(a, b);
}

#[test]
fn splines_of_weights_have_all_tangents_towards_a_key_before_its_values() {
    // The first weight is t^2, the second t^3 - t; keys are at 0 and 2.
    let at_key = |t: f32| {
        let tangents = [2.0 * t, 3.0 * t * t - 1.0];
        [tangents, [t * t, t * t * t - t], tangents].concat()
    };
    let mut made = morphing();
    let values = [at_key(0.0), at_key(2.0)].concat();
    add(&mut made, (0, "weights"), "CUBICSPLINE", &[0.0, 2.0], &values);
    let film = Film::of(&made);
    for t in [0.0, 0.5, 1.0, 1.75, 2.0] {
        same(&film.points(t)[0], &morphed(t * t, t * t * t - t));
    }
}

#[test]
fn morph_targets_move_normals_texture_coordinates_and_colours() {
    let mut made = Made::triangle();
    let normals = made.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let uvs = made.floats("VEC2", &[0.25, 0.25].repeat(3));
    let colors = made.floats("VEC4", &[0.25, 0.5, 0.75, 0.5].repeat(3));
    made.set(
        "/meshes/0/primitives/0/attributes",
        json!({"POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors}),
    );
    let lean = made.floats("VEC3", &[1.0, 0.0, 0.0].repeat(3));
    let slide = made.floats("VEC2", &[1.0, 0.5].repeat(3));
    let blush = made.floats("VEC4", &[0.5, -1.0, 0.0, 0.25].repeat(3));
    let target = json!({"NORMAL": lean, "TEXCOORD_0": slide, "COLOR_0": blush});
    made.set("/meshes/0/primitives/0/targets", json!([target]));
    add(&mut made, (0, "weights"), "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    let film = Film::of(&made);
    let mesh = |seconds| film.at(seconds).instances[0].geometry.mesh().clone();
    let still = mesh(0.0);
    assert_eq!(still.normals, [Vec3::Z; 3]);
    assert_eq!(still.uvs, [Vec2::new(0.25, 0.75); 3]);
    assert_eq!(still.colors, [[0.25, 0.5, 0.75, 0.5]; 3]);
    let moved = mesh(1.0);
    let slanted = Vec3::new(1.0, 0.0, 1.0).normalize();
    assert!(moved.normals.iter().all(|n| (*n - slanted).length() < 1e-6), "{:?}", moved.normals);
    assert_eq!(moved.uvs, [Vec2::new(1.25, 0.25); 3]);
    // Colours stay within 0 and 1.
    assert_eq!(moved.colors, [[0.75, 0.0, 0.75, 0.75]; 3]);
}

/// A strip along x, bent by two joints: one at the origin and, 1 m along x, one under it. The first three corners hang
/// on the first, on the second, on both.
pub(crate) fn limb() -> Made {
    let mut made = Made::triangle();
    let places = made.floats("VEC3", &[0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 2.0, 1.0, 0.0]);
    let normals = made.floats("VEC3", &[1.0, 1.0, 0.0].repeat(3));
    // The second set of joints finishes what the first begins; weights need not sum to 1.
    let joints = made.add("VEC4", 5121, 3, &[0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let weights =
        made.floats("VEC4", &[2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.25, 0.0, 0.0]);
    let more = made.add("VEC4", 5121, 3, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0]);
    let shares =
        made.floats("VEC4", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0]);
    made.set(
        "/meshes/0/primitives/0/attributes",
        json!({"POSITION": places, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights,
            "JOINTS_1": more, "WEIGHTS_1": shares}),
    );
    let mut bound = [[0.0f32; 16]; 2];
    bound.iter_mut().for_each(|matrix| (0..4).for_each(|i| matrix[5 * i] = 1.0));
    bound[1][12] = -1.0;
    let bound = made.floats("MAT4", bound.as_flattened());
    made.set(
        "/nodes",
        json!([{"name": "limb", "mesh": 0, "skin": 0}, {"name": "hip", "children": [2]},
            {"name": "knee", "translation": [1, 0, 0]}, {"children": [0, 1]}]),
    );
    made.set("/scenes/0/nodes", json!([3]));
    made.set("/skins", json!([{"joints": [1, 2], "inverseBindMatrices": bound}]));
    made
}

#[test]
fn skins_bend_with_their_joints() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut made = limb();
    let turns = [about_z(0.0), about_z(quarter)].concat();
    add(&mut made, (2, "rotation"), "LINEAR", &[0.0, 1.0], &turns);
    add(&mut made, (1, "translation"), "LINEAR", &[0.0, 1.0], &[0.0, 0.0, 0.0, 0.0, 0.0, 6.0]);
    let film = Film::of(&made);
    for t in [0.0, 0.3, 0.5, 1.0] {
        let knee = DQuat::from_rotation_z(t * quarter);
        let up = v(0.0, 0.0, 6.0 * t);
        let bent = |p: DVec3| v(1.0, 0.0, 0.0) + knee * (p - v(1.0, 0.0, 0.0)) + up;
        let corner = v(2.0, 1.0, 0.0);
        let expected =
            [v(0.0, 1.0, 0.0) + up, bent(v(2.0, 0.0, 0.0)), (corner + up + bent(corner)) / 2.0];
        same(&film.points(t)[0], &expected);
        let scene = film.at(t);
        let normals = &scene.instances[0].geometry.mesh().normals;
        let expected = (knee * v(1.0, 1.0, 0.0)).normalize().as_vec3();
        assert!((normals[1] - expected).length() < 1e-6, "{normals:?}");
        assert!((normals[0] - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6);
    }
}

#[test]
fn normals_of_skins_turn_by_the_inverse_transposed() {
    let mut made = limb();
    add(&mut made, (1, "scale"), "LINEAR", &[0.0], &[2.0, 1.0, 1.0]);
    let scene = Film::of(&made).at(0.0);
    let normals = &scene.instances[0].geometry.mesh().normals;
    let expected = Vec3::new(0.5, 1.0, 0.0).normalize();
    assert!((normals[0] - expected).length() < 1e-6, "{normals:?}");
}

#[test]
fn a_skinned_mesh_takes_no_notice_of_its_own_node() {
    let mut made = limb();
    add(&mut made, (0, "translation"), "LINEAR", &[0.0], &[7.0, 8.0, 9.0]);
    let still = points(&Film::of(&limb()).scene(&ReadOptions::default()));
    let film = Film::of(&made);
    assert_eq!(film.points(0.0), still);
    assert!(!read::moves(&film.path()).unwrap());
    // What stands above its joints moves it.
    add(&mut made, (3, "translation"), "LINEAR", &[0.0], &[7.0, 8.0, 9.0]);
    let film = Film::of(&made);
    assert!(read::moves(&film.path()).unwrap());
    let moved: Vec<DVec3> = still[0].iter().map(|p| *p + v(7.0, 8.0, 9.0)).collect();
    same(&film.points(0.0)[0], &moved);
}

#[test]
fn a_skin_moves_what_is_morphed() {
    let mut made = limb();
    let up = made.floats("VEC3", &[0.0, 1.0, 0.0].repeat(3));
    made.set("/meshes/0/primitives/0/targets", json!([{"POSITION": up}]));
    let quarter = std::f64::consts::FRAC_PI_2;
    add(&mut made, (2, "rotation"), "LINEAR", &[0.0], &about_z(quarter));
    add(&mut made, (0, "weights"), "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    // The second corner, moved by the target and then by a quarter turn about (1, 0, 0).
    same(&Film::of(&made).points(0.5)[0][1..2], &[v(0.5, 1.0, 0.0)]);
}
