//! Three scenes under light, as files of Radiance, and the irradiance that Spandrel gives to twenty points
//! of each: what `tests/peers/light.py` compares.
//!
//! `cargo run --release -p spandrel-tests --example irradiance -- FOLDER SUN_X SUN_Y SUN_Z`

use glam::DVec3;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::fragment::{Anywhere, Around, Fragments, Member, Shader, Surfaces, World};
use spandrel_engine::light::list::{AreaLight, LampFile, MakeLamp, PointLight, SkyLight, SkySun};
use spandrel_engine::light::sky::SkyModel;
use spandrel_engine::raster::Raster;
use spandrel_engine::scene::{Material, Mesh, Scene, SceneSurfaces, Shape, Step, Transform};
use spandrel_engine::shade::{Bounces, Illuminate, Shadows};
use spandrel_engine::trace::Reductions;
use spandrel_tests::random::Random;
use spandrel_tests::scenes::polygons;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A point as Radiance has it: z up.
fn turned(p: DVec3) -> String {
    format!("{} {} {}", p.x, -p.z, p.y)
}

fn add_box(mesh: &mut Mesh, size: [f64; 3], turn: f64, at: DVec3) {
    let mut part = Shape::Box { size }.mesh().unwrap();
    let place = Transform(vec![Step::TurnY(turn), Step::Move(at.x, at.y, at.z)]).to_matrix();
    part.points.iter_mut().for_each(|p| *p = place.transform_point3(*p));
    mesh.append(&part).unwrap();
}

/// The faces as black polygons of Radiance: only direct light counts.
fn radiance(mesh: &Mesh) -> String {
    let mut out = String::from("void plastic black\n0\n0\n5 0 0 0 0 0\n");
    for face in 0..mesh.face_count() {
        let corners: Vec<String> =
            mesh.outline(face).iter().map(|i| turned(mesh.points[*i as usize])).collect();
        let count = 3 * corners.len();
        let _ = writeln!(out, "black polygon f{face}\n0\n0\n{count} {}", corners.join(" "));
    }
    out
}

struct Case<'a> {
    name: &'a str,
    mesh: Mesh,
    lights: Vec<&'a dyn MakeLamp>,
    /// Points and normals.
    points: Vec<(DVec3, DVec3)>,
    /// What of the scene Radiance needs beside its faces.
    rest: String,
}

impl Case<'_> {
    fn write(self, folder: &Path) {
        let at = |ending: &str| folder.join(format!("{}.{ending}", self.name));
        std::fs::write(at("rad"), radiance(&self.mesh) + &self.rest).unwrap();
        let lines: Vec<String> =
            self.points.iter().map(|(p, n)| format!("{} {}", turned(*p), turned(*n))).collect();
        std::fs::write(at("pts"), lines.join("\n") + "\n").unwrap();
        let mut scene = Scene::clone(&spandrel_tests::scenes::scene(self.name, self.mesh));
        scene.materials =
            vec![Material { color: Color::WHITE, ..Material::default() }; scene.materials.len()];
        let (label, key) = (scene.label.clone(), scene.key);
        let surfaces: Arc<dyn Surfaces> = Arc::new(SceneSurfaces::new(Arc::new(scene)));
        let (label, stack) = (label.clone(), Vec::new());
        let member = Member { label, scene: key, surfaces, stack, is_beside: false };
        let world = World::new(vec![member]);
        let lamps = self.lights.iter().map(|light| light.lamp("light", folder).unwrap()).collect();
        let shadows = Shadows::Rays(16384);
        let less = Reductions::default();
        let shader = Illuminate {
            lamps,
            white: 1.0,
            shadows,
            samples: 4096,
            less,
            bounces: Bounces::default(),
        };
        let view = View::new(&Camera::default(), Raster::new(8, 8).unwrap()).unwrap();
        let mut fragments = Fragments::new(&view);
        for (i, (point, normal)) in self.points.iter().enumerate() {
            fragments.push(0, true, i as f64, 0.5, 1.0);
            fragments.position.push(*point);
            fragments.normal.push(normal.as_vec3());
            fragments.facing.push(*normal);
            fragments.color.push(Color::WHITE);
            fragments.alpha.push(1.0);
            fragments.unlit.push(false);
            fragments.finish.push(Default::default());
        }
        let around = Around { world: Some(&world), stack: &[], at: 0, batch: &Anywhere };
        shader.shade(&mut fragments, &around);
        // The peer's skies are grey.
        let luminance = |color: &Color| color.luminance().to_string();
        let ours: Vec<String> = fragments.color.iter().map(luminance).collect();
        std::fs::write(at("ours"), ours.join("\n") + "\n").unwrap();
    }
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().expect("a folder");
    let sun: Vec<f64> = arguments.map(|a| a.parse().expect("a number")).collect();
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).unwrap();
    let mut random = Random::new(11);
    let mut spread = |low: f64, high: f64| random.between(low, high);

    // A room of 6 x 3 x 4 m with a panel under its ceiling, a table and a cupboard; points on the floor and
    // on a wall.
    let mut room = polygons(&[vec![
        v(-3.0, 0.0, 2.0),
        v(3.0, 0.0, 2.0),
        v(3.0, 0.0, -2.0),
        v(-3.0, 0.0, -2.0),
    ]]);
    add_box(&mut room, [1.6, 0.05, 0.8], 20.0, v(-0.4, 0.7, 0.1));
    add_box(&mut room, [0.8, 1.9, 0.5], 0.0, v(2.3, 0.0, -1.6));
    let panel = vec![v(-0.9, 2.9, -0.6), v(0.6, 2.9, -0.6), v(0.6, 2.9, 0.5), v(-0.9, 2.9, 0.5)];
    let area = AreaLight { outline: panel.clone(), luminance: 1.0, ..AreaLight::default() };
    let corners: Vec<String> = panel.iter().map(|p| turned(*p)).collect();
    let rest = format!(
        "void light lamp\n0\n0\n3 1 1 1\nlamp polygon panel\n0\n0\n12 {}\n",
        corners.join(" ")
    );
    let mut points: Vec<(DVec3, DVec3)> =
        (0..14).map(|_| (v(spread(-2.8, 2.8), 0.0, spread(-1.8, 1.8)), DVec3::Y)).collect();
    points.extend((0..6).map(|_| (v(-3.0, spread(0.2, 2.7), spread(-1.8, 1.8)), DVec3::X)));
    Case { name: "room", mesh: room, lights: vec![&area], points, rest }.write(folder);

    // A courtyard of four wings of different heights, with a canopy: under three skies.
    let court = || {
        let mut court = polygons(&[vec![
            v(-40.0, 0.0, 40.0),
            v(40.0, 0.0, 40.0),
            v(40.0, 0.0, -40.0),
            v(-40.0, 0.0, -40.0),
        ]]);
        add_box(&mut court, [30.0, 9.0, 4.0], 0.0, v(0.0, 0.0, -12.0));
        add_box(&mut court, [30.0, 6.0, 4.0], 0.0, v(0.0, 0.0, 12.0));
        add_box(&mut court, [4.0, 12.0, 20.0], 0.0, v(-13.0, 0.0, 0.0));
        add_box(&mut court, [4.0, 4.0, 20.0], 0.0, v(13.0, 0.0, 0.0));
        add_box(&mut court, [6.0, 0.2, 3.0], 0.0, v(-7.0, 2.6, 6.0));
        court
    };
    let mut points: Vec<(DVec3, DVec3)> =
        (0..13).map(|_| (v(spread(-10.0, 10.0), 0.0, spread(-9.0, 9.0)), DVec3::Y)).collect();
    points.extend((0..6).map(|_| (v(spread(-10.0, 10.0), spread(0.5, 8.0), -10.0), DVec3::Z)));
    // What stands in the open, to compare with.
    points.push((v(0.0, 50.0, 0.0), DVec3::Y));
    let toward = DVec3::new(sun[0], sun[2], -sun[1]);
    let skies = [
        ("overcast", SkyModel::Overcast),
        ("intermediate", SkyModel::Intermediate),
        ("clear", SkyModel::Clear),
    ];
    for (name, model) in skies {
        let sun = SkySun::Toward(toward);
        let sky = SkyLight { model: Some(model), sun, ..SkyLight::default() };
        let (points, rest) = (points.clone(), String::new());
        Case { name, mesh: court(), lights: vec![&sky], points, rest }.write(folder);
    }

    // A lamp of which every quarter differs, 3 m over a floor, beside a pillar.
    let planes = [0, 45, 90, 135, 180, 225, 270, 315, 360];
    let mut file = String::from(
        "IESNA:LM-63-2002\n[TEST] ours\nTILT=NONE\n1 -1 1 19 9 1 2 0.02 0.02 0\n1 1 10\n",
    );
    let angles: Vec<String> = (0..=18).map(|i| (i * 5).to_string()).collect();
    let _ = writeln!(file, "{}", angles.join(" "));
    let _ = writeln!(file, "{}", planes.map(|p| p.to_string()).join(" "));
    for plane in planes {
        let side = f64::from(plane % 360) / 90.0;
        let candela: Vec<String> = (0..=18)
            .map(|i| {
                let t = f64::from(i) / 18.0;
                format!("{:.1}", 1000.0 * (1.0 - t) * (1.0 + side * t))
            })
            .collect();
        let _ = writeln!(file, "{}", candela.join(" "));
    }
    std::fs::write(folder.join("lamp.ies"), file).unwrap();
    let mut floor = polygons(&[vec![
        v(-6.0, 0.0, 6.0),
        v(6.0, 0.0, 6.0),
        v(6.0, 0.0, -6.0),
        v(-6.0, 0.0, -6.0),
    ]]);
    add_box(&mut floor, [0.5, 3.5, 0.5], 30.0, v(1.2, 0.0, 0.9));
    let lamp = PointLight {
        position: v(0.2, 3.0, -0.3),
        lamp: Some(LampFile("lamp.ies".into())),
        ..PointLight::default()
    };
    let points =
        (0..20).map(|_| (v(spread(-4.0, 4.0), 0.0, spread(-4.0, 4.0)), DVec3::Y)).collect();
    Case { name: "lamp", mesh: floor, lights: vec![&lamp], points, rest: String::new() }
        .write(folder);
}
