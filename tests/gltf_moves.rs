//! glTF that moves: animations, skins and morph targets at a moment stand where closed forms have them. Files are JSON
//! with their data in it; those of other people are played too.

#![allow(clippy::disallowed_methods, reason = "what is expected may be computed by anybody's sine")]

use glam::{DQuat, DVec3, dvec3 as v};
use serde_json::{Value, json};
use spandrel_engine::Result;
use spandrel_engine::camera::Camera;
use spandrel_engine::light::list::LightEntry;
use spandrel_engine::moment::Moment;
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::read::{self, ReadOptions, Reading};
use spandrel_tests::data;
use spandrel_tests::program::{Scratch, run};
use std::path::{Path, PathBuf};

use crate::converted::base64;
use crate::gltf::{Made, TRIANGLE, folder, same};
use crate::gltf_bends::{limb, morphed, morphing};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A file on disk, with its data in it.
pub(crate) struct Film {
    folder: Scratch,
}

impl Film {
    pub(crate) fn of(made: &Made) -> Film {
        let mut json = made.json.clone();
        let uri = format!("data:application/octet-stream;base64,{}", base64(&made.bytes));
        json["buffers"] = json!([{"byteLength": made.bytes.len(), "uri": uri}]);
        let film = Film { folder: folder() };
        std::fs::write(film.path(), serde_json::to_vec(&json).unwrap()).unwrap();
        film
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.folder.path().join("film.gltf")
    }

    pub(crate) fn read(&self, options: &ReadOptions) -> Result<Reading> {
        read::document(&self.path(), options)
    }

    pub(crate) fn scene(&self, options: &ReadOptions) -> Scene {
        read::scene(&self.path(), None, "film", options).unwrap_or_else(|e| panic!("{e}"))
    }

    pub(crate) fn at(&self, seconds: f64) -> Scene {
        self.scene(&at(seconds))
    }

    /// The points of each instance in the world.
    pub(crate) fn points(&self, seconds: f64) -> Vec<Vec<DVec3>> {
        points(&self.at(seconds))
    }

    pub(crate) fn camera(&self, seconds: f64) -> Camera {
        let document = self.read(&at(seconds)).unwrap().document;
        document.plans[0].cameras["eye"].clone()
    }

    pub(crate) fn error(&self, options: &ReadOptions) -> String {
        let error = self.read(options).expect_err("it is read").to_string();
        assert!(error.contains("film.gltf"), "no file: {error}");
        error
    }
}

pub(crate) fn at(seconds: f64) -> ReadOptions {
    ReadOptions { moment: Some(Moment { frame: seconds, rate: 1.0 }), ..ReadOptions::default() }
}

pub(crate) fn named(seconds: f64, animation: &str) -> ReadOptions {
    ReadOptions { animation: Some(animation.to_owned()), ..at(seconds) }
}

pub(crate) fn points(scene: &Scene) -> Vec<Vec<DVec3>> {
    let one = |i: &spandrel_engine::scene::Instance| {
        let points = i.geometry.mesh().points.iter();
        points.map(|p| i.world_from_object.transform_point3(*p)).collect()
    };
    scene.instances.iter().map(one).collect()
}

/// Adds a channel to the last animation of a file, or to its first; returns the number of its sampler.
pub(crate) fn add(
    made: &mut Made,
    (node, path): (usize, &str),
    interpolation: &str,
    times: &[f32],
    values: &[f32],
) -> usize {
    let kind = match path {
        "rotation" => "VEC4",
        "weights" => "SCALAR",
        _ => "VEC3",
    };
    let output = made.floats(kind, values);
    channel(made, (node, path), interpolation, times, output)
}

pub(crate) fn channel(
    made: &mut Made,
    (node, path): (usize, &str),
    interpolation: &str,
    times: &[f32],
    output: usize,
) -> usize {
    let input = made.floats("SCALAR", times);
    if made.json.get("animations").is_none() {
        animation(made, "first");
    }
    let last = made.json["animations"].as_array_mut().unwrap().last_mut().unwrap();
    let samplers = last["samplers"].as_array_mut().unwrap();
    samplers.push(json!({"input": input, "output": output, "interpolation": interpolation}));
    let sampler = samplers.len() - 1;
    let channel = json!({"sampler": sampler, "target": {"node": node, "path": path}});
    last["channels"].as_array_mut().unwrap().push(channel);
    sampler
}

/// Adds an animation without channels.
pub(crate) fn animation(made: &mut Made, name: &str) {
    made.push("animations", json!({"name": name, "channels": [], "samplers": []}));
}

/// A triangle whose node has a channel.
pub(crate) fn moving(path: &str, interpolation: &str, times: &[f32], values: &[f32]) -> Made {
    let mut made = Made::triangle();
    add(&mut made, (0, path), interpolation, times, values);
    made
}

pub(crate) fn film(path: &str, interpolation: &str, times: &[f32], values: &[f32]) -> Film {
    Film::of(&moving(path, interpolation, times, values))
}

/// Where a triangle is that was turned about z.
pub(crate) fn turned(radians: f64) -> [DVec3; 3] {
    TRIANGLE.map(|p| DQuat::from_rotation_z(radians) * p)
}

/// A turn about z as numbers.
pub(crate) fn about_z(radians: f64) -> [f32; 4] {
    [0.0, 0.0, (radians / 2.0).sin() as f32, (radians / 2.0).cos() as f32]
}

const KEYS: [f32; 3] = [1.0, 2.0, 4.0];
const PLACES: [f32; 9] = [0.0, 0.0, 0.0, 2.0, 4.0, 0.0, 2.0, 0.0, 8.0];

#[test]
fn straight_ways_between_keys_are_even_and_ends_are_held() {
    let film = film("translation", "LINEAR", &KEYS, &PLACES);
    for (seconds, place) in [
        (-3.0, v(0.0, 0.0, 0.0)),
        (0.0, v(0.0, 0.0, 0.0)),
        (1.0, v(0.0, 0.0, 0.0)),
        (1.25, v(0.5, 1.0, 0.0)),
        (2.0, v(2.0, 4.0, 0.0)),
        (2.5, v(2.0, 3.0, 2.0)),
        (4.0, v(2.0, 0.0, 8.0)),
        (99.0, v(2.0, 0.0, 8.0)),
    ] {
        same(&film.points(seconds)[0], &TRIANGLE.map(|p| p + place));
    }
    // A frame at a rate: frame 0 is at 0 s.
    let moment = Some(Moment { frame: 30.0, rate: 24.0 });
    let scene = film.scene(&ReadOptions { moment, ..ReadOptions::default() });
    same(&points(&scene)[0], &TRIANGLE.map(|p| p + v(0.5, 1.0, 0.0)));
    // Without an interpolation it is this one.
    let mut made = moving("scale", "LINEAR", &KEYS, &PLACES);
    made.json["animations"][0]["samplers"][0].as_object_mut().unwrap().remove("interpolation");
    same(&Film::of(&made).points(2.5)[0], &TRIANGLE.map(|p| p * v(2.0, 3.0, 2.0)));
}

#[test]
fn steps_are_taken_at_their_keys() {
    let film = film("translation", "STEP", &KEYS, &PLACES);
    for (seconds, key) in [(0.0, 0), (1.0, 0), (1.999, 0), (2.0, 1), (3.99, 1), (4.0, 2), (7.0, 2)]
    {
        let [x, y, z] = [0, 1, 2].map(|i| f64::from(PLACES[3 * key + i]));
        same(&film.points(seconds)[0], &TRIANGLE.map(|p| p + v(x, y, z)));
    }
}

#[test]
fn a_step_at_the_time_of_a_frame_is_taken_in_this_frame() {
    // As programs write them: the time of each frame in single precision, rounded up or down.
    let rate = 24.0;
    let times: Vec<f32> = (0..50).map(|frame| (f64::from(frame) / rate) as f32).collect();
    assert!((0..50).any(|frame| f64::from(times[frame]) > frame as f64 / rate), "none is late");
    let places: Vec<f32> = (0..50).flat_map(|frame| [frame as f32, 0.0, 0.0]).collect();
    let film = film("translation", "STEP", &times, &places);
    for frame in 0..50 {
        let moment = Some(Moment { frame: f64::from(frame), rate });
        let scene = film.scene(&ReadOptions { moment, ..ReadOptions::default() });
        same(&points(&scene)[0], &TRIANGLE.map(|p| p + v(f64::from(frame), 0.0, 0.0)));
    }
}

#[test]
fn splines_are_the_cubics_that_their_tangents_say() {
    // x is t^3 - 2 t and z is t^2; a cubic is its own Hermite spline. Tangents are per second: keys are 2 s apart.
    let at_key = |t: f32| {
        let tangent = [3.0 * t * t - 2.0, 0.0, 2.0 * t];
        [tangent, [t * t * t - 2.0 * t, 0.0, t * t], tangent].concat()
    };
    let values = [at_key(1.0), at_key(3.0), at_key(4.0)].concat();
    let film = film("translation", "CUBICSPLINE", &[1.0, 3.0, 4.0], &values);
    for seconds in [1.0, 1.3, 2.0, 2.9, 3.0, 3.75, 4.0] {
        let place = v(seconds * seconds * seconds - 2.0 * seconds, 0.0, seconds * seconds);
        same(&film.points(seconds)[0], &TRIANGLE.map(|p| p + place));
    }
    same(&film.points(0.0)[0], &TRIANGLE.map(|p| p + v(-1.0, 0.0, 1.0)));
    same(&film.points(9.0)[0], &TRIANGLE.map(|p| p + v(56.0, 0.0, 16.0)));
}

#[test]
fn rotations_go_the_short_way_at_an_even_pace() {
    let third = std::f64::consts::TAU / 3.0;
    let keys = |second: [f32; 4]| {
        film("rotation", "LINEAR", &[0.0, 1.0], &[about_z(0.0), second].concat())
    };
    let plain = keys(about_z(third));
    // The same rotation by the quaternion's negative, and one that is not of length 1.
    let (negative, long) =
        (keys(about_z(third).map(|v| -v)), keys(about_z(third).map(|v| 3.0 * v)));
    for share in [0.0, 0.125, 0.5, 0.9, 1.0] {
        for film in [&plain, &negative, &long] {
            same(&film.points(share)[0], &turned(share * third));
        }
    }
    // 350 degrees forwards are 10 degrees backwards.
    let back = keys(about_z(350f64.to_radians()));
    same(&back.points(0.25)[0], &turned(-2.5f64.to_radians()));
    // Keys that are the same, or nearly so.
    same(&keys(about_z(0.0)).points(0.5)[0], &TRIANGLE);
    same(&keys(about_z(1e-6)).points(0.5)[0], &turned(5e-7));
    // What turns nothing.
    same(&keys([0.0; 4]).points(0.5)[0], &TRIANGLE);
}

#[test]
fn rotations_step_and_follow_splines() {
    let steps = [[0.0, 0.0, 3.0, 4.0], about_z(1.0)].concat();
    let stepped = film("rotation", "STEP", &[0.0, 1.0], &steps);
    same(&stepped.points(0.7)[0], &turned(2.0 * 3f64.atan2(4.0)));
    // From no turn to half a turn, without tangents and with one.
    for pull in [0.0, 0.5] {
        let none = [0.0; 4];
        let (from, to) = ([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]);
        let values = [none, from, [0.0, 0.0, pull, 0.0], none, to, none].concat();
        let spline = film("rotation", "CUBICSPLINE", &[0.0, 2.0], &values);
        for t in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let to = t * t * (3.0 - 2.0 * t);
            let z = to + 2.0 * f64::from(pull) * t * (1.0 - t) * (1.0 - t);
            same(&spline.points(2.0 * t)[0], &turned(2.0 * z.atan2(1.0 - to)));
        }
    }
}

#[test]
fn rotations_and_weights_may_be_normalized_whole_numbers() {
    let half = 0.5f64.sqrt();
    for (component, size, most) in
        [(5120u32, 1, 127.0), (5121, 1, 255.0), (5122, 2, 32767.0), (5123, 2, 65535.0f64)]
    {
        let whole = |value: f64| {
            let value = (value * most).round() as i32;
            value.to_le_bytes()[..size].to_vec()
        };
        let turn: Vec<u8> = [0.0, 0.0, half, half].into_iter().flat_map(whole).collect();
        let mut made = Made::triangle();
        let output = made.add("VEC4", component, 1, &turn);
        made.set(&format!("/accessors/{output}/normalized"), json!(true));
        channel(&mut made, (0, "rotation"), "LINEAR", &[0.0], output);
        same(&Film::of(&made).points(0.0)[0], &turned(std::f64::consts::FRAC_PI_2));
        made.set(&format!("/accessors/{output}/normalized"), json!(false));
        let error = Film::of(&made).error(&at(0.0));
        assert!(error.contains(&format!("accessor {output} is not normalized")), "{error}");

        let mut made = morphing();
        let weights: Vec<u8> = [1.0, 0.0, 0.0, 1.0].into_iter().flat_map(whole).collect();
        let output = made.add("SCALAR", component, 4, &weights);
        made.set(&format!("/accessors/{output}/normalized"), json!(true));
        channel(&mut made, (0, "weights"), "LINEAR", &[0.0, 1.0], output);
        same(&Film::of(&made).points(0.25)[0], &morphed(0.75, 0.25));
    }
}

#[test]
fn what_is_scaled_to_nothing_is_seen_when_it_grows() {
    let film = film("scale", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    assert_eq!(film.points(0.0)[0], [DVec3::ZERO; 3]);
    same(&film.points(1.0)[0], &TRIANGLE.map(|p| p / 2.0));
}

#[test]
fn cameras_and_lights_move_with_their_nodes() {
    let mut made = Made::triangle();
    made.set(
        "/cameras",
        json!([{"name": "eye", "type": "perspective",
        "perspective": {"yfov": 1, "znear": 0.1}}]),
    );
    let light = json!({"name": "lamp", "type": "spot", "spot": {}});
    made.set("/extensions", json!({"KHR_lights_punctual": {"lights": [light]}}));
    made.set("/extensionsUsed", json!(["KHR_lights_punctual"]));
    made.set(
        "/nodes",
        json!([{"mesh": 0}, {"children": [2, 3]}, {"camera": 0, "translation": [0, 0, 5]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}}]),
    );
    made.set("/scenes/0/nodes", json!([0, 1]));
    // A quarter about y: what looks along -z comes to look along -x, what stands at z comes to x.
    let half = 0.5f32.sqrt();
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half];
    add(&mut made, (1, "rotation"), "LINEAR", &[0.0, 2.0], &turns);
    add(&mut made, (3, "translation"), "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 0.0, 0.0, 3.0, 0.0]);
    let film = Film::of(&made);
    for t in [0.0, 1.0, 2.0f64] {
        let angle = t * std::f64::consts::FRAC_PI_4;
        let back = v(angle.sin(), 0.0, angle.cos());
        let camera = film.camera(t);
        same(&[camera.position, camera.look_at], &[5.0 * back, 4.0 * back]);
        let document = film.read(&at(t)).unwrap().document;
        let LightEntry::SpotLight(lamp) = &document.plans[0].lights["lamp"] else { panic!() };
        same(&[lamp.position, lamp.direction], &[v(0.0, 1.5 * t, 0.0), -back]);
    }
    assert!(read::moves(&film.path()).unwrap());
}

#[test]
fn one_animation_is_played_and_the_others_are_told() {
    let mut made = Made::triangle();
    animation(&mut made, "walk");
    add(&mut made, (0, "translation"), "LINEAR", &[0.0, 2.5], &[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    made.push("animations", json!({"channels": [], "samplers": []}));
    animation(&mut made, "walk");
    add(&mut made, (0, "scale"), "LINEAR", &[0.5, 1.0], &[5.0; 6]);
    let film = Film::of(&made);
    let place = |options: &ReadOptions| points(&film.scene(options))[0][1];
    assert_eq!(place(&at(0.0)), v(2.0, 0.0, 0.0));
    assert_eq!(place(&named(0.0, "walk")), v(2.0, 0.0, 0.0));
    assert_eq!(place(&named(0.0, "walk#2")), v(5.0, 0.0, 0.0));
    assert_eq!(place(&named(0.0, "animation 1")), v(1.0, 0.0, 0.0));
    let notes = film.read(&at(0.0)).unwrap().notes.join("\n");
    assert!(
        notes.ends_with(
            "animation \"walk\" is played, the file's first; `animation` chooses another: \"animation 1\", \"walk#2\""
        ),
        "{notes}"
    );
    assert!(film.read(&named(0.0, "walk#2")).unwrap().notes.is_empty());
    let unknown =
        "there is no animation \"run\": the file has \"walk\", \"animation 1\", \"walk#2\"";
    for options in [named(0.0, "run"), ReadOptions { moment: None, ..named(0.0, "run") }] {
        let error = film.error(&options);
        assert!(error.ends_with(unknown), "{error}");
    }
    let none = Film::of(&Made::triangle()).error(&named(0.0, "run"));
    assert!(none.ends_with("the file has none"), "{none}");
    // Without a moment it is a still, and says so; with one nothing of a file without animation changes.
    assert_eq!(place(&ReadOptions::default()), DVec3::X);
    let notes = film.read(&ReadOptions::default()).unwrap().notes.join("\n");
    assert!(notes.contains("animations are not played"), "{notes}");
    // Keys tell moments and animations apart.
    let key = |options: &ReadOptions| film.read(options).unwrap().key;
    let (walk, other) = (named(0.0, "walk"), named(0.0, "walk#2"));
    let keys =
        [key(&ReadOptions::default()), key(&at(0.0)), key(&at(1.0)), key(&walk), key(&other)];
    assert!((0..5).all(|i| (0..i).all(|j| keys[i] != keys[j])), "{keys:?}");
    assert_eq!(keys[1], key(&at(0.0)));
    // Other formats have none.
    let path = film.folder.path().join("tri.obj");
    std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let notes = read::document(&path, &named(0.0, "run")).unwrap().notes.join("\n");
    assert!(notes.contains("`animation` names one of a glTF file"), "{notes}");
}

#[test]
fn info_tells_what_animations_move() {
    let mut made = limb();
    let up = made.floats("VEC3", &[0.0, 1.0, 0.0].repeat(3));
    made.set("/meshes/0/primitives/0/targets", json!([{"POSITION": up}]));
    animation(&mut made, "walk");
    add(&mut made, (1, "translation"), "LINEAR", &[0.0, 2.5], &[0.0; 6]);
    add(&mut made, (2, "scale"), "LINEAR", &[0.0, 1.0], &[1.0; 6]);
    animation(&mut made, "talk");
    add(&mut made, (0, "weights"), "STEP", &[0.5, 1.25], &[0.0, 1.0]);
    animation(&mut made, "idle");
    add(&mut made, (0, "scale"), "STEP", &[0.0, 1.0], &[1.0; 6]);
    animation(&mut made, "broken");
    add(&mut made, (1, "scale"), "STEP", &[1.0, 1.0], &[1.0; 6]);
    let film = Film::of(&made);
    let ran = run(PROGRAM, &["info", "film.gltf"], film.folder.path());
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for line in [
        "animation \"walk\": 2.5 s, moves \"hip\", \"knee\"; played unless `animation` names another\n",
        "animation \"talk\": 0.5 to 1.25 s, morphs \"limb\"\n",
        "animation \"idle\": 1 s, moves nothing that is read\n",
        "animation \"broken\" cannot be played: sampler 0, scale of node 1: accessor",
    ] {
        assert!(ran.out.contains(line), "{line}: {}", ran.out);
    }
    assert!(!ran.out.contains("not played"), "{}", ran.out);
}

#[test]
fn a_file_moves_if_something_that_is_read_does() {
    let moves = |made: &Made| read::moves(&Film::of(made).path()).unwrap();
    let path = |path: &str, values: &[f32]| moving(path, "LINEAR", &[0.0], values);
    assert!(!moves(&Made::triangle()));
    assert!(moves(&path("translation", &[0.0; 3])));
    // Its mesh has no morph targets.
    let weights = path("weights", &[0.0]);
    assert!(!moves(&weights));
    let notes = Film::of(&weights).read(&at(0.0)).unwrap().notes.join("\n");
    assert!(
        notes.contains(
            "1 nodes without morph targets are morphed by an animation; the first: node 0"
        ),
        "{notes}"
    );
    let mut made = morphing();
    add(&mut made, (0, "weights"), "LINEAR", &[0.0], &[0.0; 2]);
    assert!(moves(&made));
    // Nothing stands on the node; then something does; then no scene shows it.
    let mut made = path("translation", &[0.0; 3]);
    made.set("/animations/0/channels/0/target/node", json!(1));
    made.set("/nodes", json!([{"mesh": 0}, {}]));
    made.set("/scenes/0/nodes", json!([0, 1]));
    assert!(!moves(&made));
    made.set("/nodes", json!([{"mesh": 0}, {"children": [2]}, {"mesh": 0}]));
    assert!(moves(&made));
    made.set("/scenes/0/nodes", json!([0]));
    assert!(!moves(&made));
    // The property of something that is no node.
    let mut made = path("translation", &[0.0; 3]);
    let pointer = json!({"KHR_animation_pointer": {"pointer": "/materials/0/emissiveFactor"}});
    made.set("/animations/0/channels/0/target", json!({"path": "pointer", "extensions": pointer}));
    assert!(!moves(&made));
    let notes = Film::of(&made).read(&at(0.0)).unwrap().notes.join("\n");
    assert!(notes.contains("KHR_animation_pointer is not read"), "{notes}");
    assert!(!notes.contains("channels"), "{notes}");
    made.set("/animations/0/channels/0/target", json!({"node": 0, "path": "color"}));
    assert!(!moves(&made));
    let notes = Film::of(&made).read(&at(0.0)).unwrap().notes.join("\n");
    assert!(notes.contains("\"first\": 1 of its channels"), "{notes}");
}

#[test]
fn faulty_animations_are_errors_that_name_their_samplers() {
    let still = ReadOptions::default();
    let plain = || moving("translation", "LINEAR", &[0.0, 1.0], &[0.0; 6]);
    // Accessor 2 has the values, accessor 3 the times.
    let with = |place: &str, value: Value| {
        let mut made = plain();
        made.set(place, value);
        made
    };
    let times = |times: &[f32]| moving("translation", "STEP", times, &vec![0.0; 3 * times.len()]);
    let nan = f32::NAN;
    let spline = moving("translation", "CUBICSPLINE", &[0.0, 1.0], &[0.0; 6]);
    let quantized = moving("translation", "LINEAR", &[0.0], &[0.0; 3]);
    let mut short = morphing();
    add(&mut short, (0, "weights"), "LINEAR", &[0.0, 1.0], &[0.0; 2]);
    let mut twice = plain();
    add(&mut twice, (0, "translation"), "LINEAR", &[0.0], &[0.0; 3]);
    // Neither has data, so that no buffer bounds their counts.
    let mut endless = plain();
    for accessor in [2, 3] {
        endless.json["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        endless.set(&format!("/accessors/{accessor}/count"), json!(1u64 << 60));
    }
    let mut wide = quantized;
    wide.set("/accessors/2/componentType", json!(5122));
    let cases = [
        (with("/accessors/2/count", json!(1)), "accessor 2 has 1 values, and 2 keys need 1 each"),
        (spline, "accessor 2 has 2 values, and 2 keys need 3 each"),
        (short, "2 keys need 2 each"),
        (times(&[1.0, 1.0]), "key 1 is at 1 s, and the one before it at 1 s: times must increase"),
        (times(&[2.0, 1.0]), "key 1 is at 1 s, and the one before it at 2 s"),
        (times(&[0.0, nan]), "accessor 3: the time of key 1 is not finite"),
        (times(&[f32::INFINITY]), "accessor 3: the time of key 0 is not finite"),
        (
            moving("translation", "LINEAR", &[0.0], &[0.0, nan, 0.0]),
            "accessor 2: value 0 is not finite",
        ),
        (with("/accessors/2/type", json!("SCALAR")), "accessor 2 is Scalar of F32"),
        (with("/accessors/3/type", json!("VEC2")), "accessor 3 is Vec2 of F32"),
        (wide, "accessor 2 is Vec3 of I16"),
        (with("/accessors/3/count", json!(1u64 << 60)), "accessor 3 uses buffer view 3"),
        (with("/accessors/3/count", json!(0)), "accessor 3 is empty"),
        (endless, "64 times over"),
        (twice, "another sampler moves the same"),
        (
            with("/nodes/0/matrix", json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])),
            "the node has a matrix",
        ),
    ];
    for (made, word) in cases {
        let film = Film::of(&made);
        let error = film.error(&at(0.5));
        assert!(error.contains("animation \"first\": sampler "), "{error}");
        assert!(error.contains(word), "{word}: {error}");
        // As a still it is read; nothing of a faulty animation is used.
        film.read(&still).unwrap_or_else(|e| panic!("{e}"));
    }
    let lost = [
        ("/animations/0/channels/0/target/node", "animations[0].channels[0].target.node is 9"),
        ("/animations/0/samplers/0/input", "animations[0].samplers[0].input is 9"),
        ("/animations/0/samplers/0/output", "animations[0].samplers[0].output is 9"),
    ];
    for (place, word) in lost {
        let error = Film::of(&with(place, json!(9))).error(&still);
        assert!(error.contains(word), "{error}");
    }
    for (place, value, word) in [
        ("/animations/0/samplers/0/interpolation", json!("CUBIC"), "interpolation"),
        ("/animations/0/channels/0/sampler", json!(9), "sampler"),
    ] {
        let error = Film::of(&with(place, value)).error(&at(0.0));
        assert!(error.contains(word), "{error}");
    }
    // No valid JSON of animations: a still can be shown, and no more.
    let film = Film::of(&with("/animations/0/samplers/0", json!({"input": 0})));
    let notes = film.read(&still).unwrap().notes.join("\n");
    assert!(notes.contains("its animations cannot be played"), "{notes}");
    assert!(film.error(&at(0.0)).contains("its animations cannot be played"));
    assert!(!read::moves(&film.path()).unwrap());
    // No time.
    let moment = Some(Moment { frame: 1.0, rate: 0.0 });
    let error = Film::of(&plain()).read(&ReadOptions { moment, ..ReadOptions::default() });
    assert!(error.is_err());
}

#[test]
fn the_wheels_of_a_real_truck_turn() {
    let Some(path) = data::find("models/CesiumMilkTruck.glb") else { return };
    assert!(read::moves(&path).unwrap());
    let wheels = |seconds: f64| {
        let scene = read::scene(&path, None, "truck", &at(seconds)).unwrap();
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
        let is_wheel = |path: &str| path.contains("node 2") || path.contains("node 4");
        let wheels = scene.instances.iter().filter(|i| is_wheel(&i.path));
        wheels.map(|i| i.world_from_object).collect::<Vec<_>>()
    };
    let (end, after) = (wheels(1.25), wheels(7.0));
    assert_eq!(end.len(), 2);
    assert_eq!(end, after);
    // Nearly a whole turn in 1.25 s, about axles that stay where they are.
    let whole = 2.0 * 0.088_485_89f64.atan2(-0.996_077_4);
    for seconds in [0.0, 0.3, 0.625, 1.0, 1.25] {
        let cosine = (whole * (1.0 - seconds / 1.25)).cos();
        for (wheel, end) in wheels(seconds).iter().zip(&end) {
            assert_eq!(wheel.translation, end.translation);
            let turned = [wheel, end].map(|wheel| wheel.transform_vector3(DVec3::X));
            assert!((turned[0].dot(turned[1]) - cosine).abs() < 1e-4, "{seconds} s: {turned:?}");
        }
    }
}

#[test]
fn animated_files_of_the_khronos_validator_are_played_or_refused() {
    let Some(folder) = data::find("malformed/gltf_validator") else { return };
    let mut animated = 0;
    for path in data::files(&folder, &[".gltf", ".glb"]) {
        let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
        animated += usize::from(text.contains("\"animations\""));
        for seconds in [-1.0, 0.0, 0.3, 5.0] {
            civil(&path, read::document(&path, &at(seconds)).map(drop));
        }
        civil(&path, read::moves(&path).map(drop));
    }
    assert!(animated > 8, "{animated}");
}

/// What fails names the file.
fn civil(path: &Path, read: Result<()>) {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    if let Err(error) = read {
        let error = error.to_string();
        assert!(error.contains(&name) || error.contains("No such file"), "{name}: {error}");
    }
}
