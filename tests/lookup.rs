//! Display by a look-up table: numbers of colours, and colours that change without a look at anything else.

use glam::DVec3;
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::image::{Codes, Image, Layout};
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::lookup::{Brightness, Display};
use spandrel_engine::scene::document::{Document, Object, Plan, Transform};
use spandrel_engine::scene::{EdgeStyle, Face, Material, Mesh, Scene, Seal, Shape, Sides, Step};
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights;
use spandrel_tests::program::{Scratch, run};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// Balls, a box with a seal and drawn edges, in three materials.
fn scene(colors: [Color; 3]) -> Arc<Scene> {
    let names = ["clay", "leaf", "label"];
    let material = |color| Material { color, ..Material::default() };
    let materials: BTreeMap<String, Material> = names
        .iter()
        .zip(colors)
        .map(|(name, color)| ((*name).to_owned(), material(color)))
        .collect();
    let object = |name: &str, material: &str, shape: &str, at: DVec3| Object {
        material: Some(material.to_owned()),
        transform: Transform(vec![Step::Move(at.x, at.y, at.z)]),
        ..Object::new(name, ron::from_str::<Shape>(shape).unwrap())
    };
    let mut plate = Mesh::default();
    let square = |half: f64| [(-half, -half), (half, -half), (half, half), (-half, half)];
    for (x, y) in square(1.5).into_iter().chain(square(0.5)) {
        plate.add_point([x, y, 0.0]);
    }
    plate.materials = vec!["clay".to_owned(), "label".to_owned()];
    let seal = Seal {
        outline: vec![4, 5, 6, 7],
        sides: Sides { front: Some(1), ..Sides::default() },
        edge: None,
    };
    let edge = Some(EdgeStyle { width: 2.0, color: Color { r: 0.0, g: 0.0, b: 0.4 } });
    let sides = Sides { front: Some(0), ..Sides::default() };
    plate
        .add_face(Face { outline: vec![0, 1, 2, 3], holes: vec![], seals: vec![seal], sides, edge })
        .unwrap();
    let mut plate = Object::new("plate", Shape::Faces(plate));
    plate.transform = Transform(vec![Step::TurnY(30.0), Step::Move(3.0, 0.0, 0.0)]);
    let root = Object {
        children: vec![
            object(
                "ball",
                "clay",
                "Sphere(radius: 1.6, segments: 32)",
                DVec3::new(-2.5, -1.6, 0.0),
            ),
            object(
                "small",
                "leaf",
                "Sphere(radius: 0.9, segments: 24)",
                DVec3::new(0.0, -2.0, 1.0),
            ),
            plate,
        ],
        ..Object::default()
    };
    let plan = Plan { name: "p".to_owned(), root, ..Plan::default() };
    let document = Document { materials, ..Document::with_plan(plan) };
    let key = spandrel_engine::key::Key::of(&colors);
    Arc::new(Scene::new(&document, None, "s", key, Path::new("")).unwrap())
}

const CLAY: Color = Color { r: 0.7, g: 0.3, b: 0.15 };
const LEAF: Color = Color { r: 0.1, g: 0.5, b: 0.2 };
const LABEL: Color = Color { r: 0.9, g: 0.9, b: 0.5 };

fn image(scene: &Arc<Scene>, (width, height): (u32, u32)) -> SpanImage {
    let camera =
        Camera { position: DVec3::new(0.5, 1.0, 12.0), look_at: DVec3::ZERO, ..Camera::default() };
    let view = View::new(&camera, Raster::new(width, height).unwrap()).unwrap();
    let plan = LinePlan::new(1, Phase::Centre).unwrap();
    scanline::render(&[scene.clone().into()], &view, plan, 0..height).unwrap()
}

fn display(colors: [Color; 3], entries: Option<u32>) -> Display {
    Display::new(&image(&scene(colors), (160, 90)), Brightness::Head, entries).unwrap()
}

#[test]
fn a_change_of_the_table_is_the_picture_made_anew() {
    let mut shown = display([CLAY, LEAF, LABEL], None);
    let names: Vec<(&str, bool)> =
        shown.parts().iter().map(|p| (p.name.as_str(), p.is_edge)).collect();
    assert!(names.contains(&("clay", false)) && names.contains(&("clay", true)), "{names:?}");
    assert_eq!(names.len(), 4);
    let other = Color { r: 0.05, g: 0.2, b: 0.8 };
    let numbers = shown.numbers().to_vec();
    let before = shown.table().to_vec();
    shown.set_color("clay", other).unwrap();
    assert_eq!(shown.numbers(), numbers);
    assert!(shown == display([other, LEAF, LABEL], None));
    // Only the entries of that part are others.
    let part = shown.parts().iter().find(|p| p.name == "clay" && !p.is_edge).unwrap();
    for (at, (old, new)) in before.iter().zip(shown.table()).enumerate() {
        assert!(old == new || (part.first..part.first + part.entries).contains(&at), "{at}");
    }
    assert_ne!(before, shown.table());
    // Seals change apart from their faces.
    shown.set_color("label", LEAF).unwrap();
    assert!(shown == display([other, LEAF, LEAF], None));
    let error = shown.set_color("clai", other).unwrap_err().to_string();
    assert!(error.contains("\"clay\""), "{error}");
}

/// The colour of each pixel against that of the finest table: half a step of either, and the rounding of both.
#[test]
fn entries_cost_half_a_step_at_most() {
    let fine = display([CLAY, LEAF, LABEL], Some(62));
    let value = |display: &Display, at: usize| display.table()[display.numbers()[at] as usize];
    let mut last = f64::INFINITY;
    for entries in [4u32, 16, 31] {
        let shown = display([CLAY, LEAF, LABEL], Some(entries));
        let (mut worst, mut sum) = (0.0f64, 0.0);
        for at in 0..160 * 90 {
            let (a, b) = (value(&shown, at), value(&fine, at));
            assert_eq!(a[3], b[3]);
            let off = (0..3).map(|c| f64::from(a[c].abs_diff(b[c])) / 255.0).fold(0.0, f64::max);
            worst = worst.max(off);
            sum += off * off;
        }
        let rmse = (sum / f64::from(160 * 90)).sqrt();
        let most = 0.5 / f64::from(entries) + 0.5 / 62.0 + 1.0 / 255.0;
        assert!(worst <= most, "{entries}: {worst} {most}");
        assert!(rmse < last, "{entries}: {rmse} {last}");
        last = rmse;
    }
}

/// A head light's brightness is the cosine: a ball is a bright disc that falls off as its normals do.
#[test]
fn a_ball_under_a_head_light_is_bright_by_its_normals() {
    let object =
        Object::new("ball", ron::from_str::<Shape>("Sphere(radius: 2, segments: 180)").unwrap());
    let root = Object { children: vec![object], ..Object::default() };
    let document = Document::with_plan(Plan { name: "p".to_owned(), root, ..Plan::default() });
    let key = spandrel_engine::key::Key::of(&"ball");
    let scene = Arc::new(Scene::new(&document, None, "s", key, Path::new("")).unwrap());
    let camera = Camera {
        position: DVec3::new(0.0, 0.0, 50.0),
        look_at: DVec3::ZERO,
        parallel_height: Some(5.0),
        ..Camera::default()
    };
    let view = View::new(&camera, Raster::new(100, 100).unwrap()).unwrap();
    let plan = LinePlan::new(1, Phase::Centre).unwrap();
    let image = scanline::render(&[scene.into()], &view, plan, 0..100).unwrap();
    let shown = Display::new(&image, Brightness::Head, Some(200)).unwrap();
    let part = &shown.parts()[0];
    for at in 0..100 * 100usize {
        let (x, y) = ((at % 100) as f64 + 0.5 - 50.0, (at / 100) as f64 + 0.5 - 50.0);
        let r = (x * x + y * y).sqrt() / 40.0;
        let number = shown.numbers()[at] as usize;
        if r > 1.01 {
            assert_eq!(number, 0);
        } else if r < 0.95 {
            let right = spandrel_engine::color::encode_srgb((1.0 - r * r).sqrt() as f32) * 200.0;
            let step = (number - part.first) as f32 + 0.5;
            assert!((step - right).abs() < 2.0, "{at}: {step} {right}");
        }
    }
}

#[test]
fn a_png_keeps_the_numbers_and_the_table() {
    let scratch = Scratch::new("lookup_png");
    let solids = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs/assets/solids.ron");
    let solids = solids.to_string_lossy().replace('\\', "/");
    let graph = |more: &str| {
        format!(
            r##"Graph(nodes: {{
                "eye": SceneCamera(scene: "{solids}", name: "front"),
                "image": Scanline(scene: "{solids}", camera: "eye"),
                "shown": Lookup(image: "image", size: (120, 80){more}),
                "file": Write(image: "shown", path: "out.png"),
            }})"##
        )
    };
    let render = |more: &str| {
        std::fs::write(scratch.path().join("g.ron"), graph(more)).unwrap();
        run(PROGRAM, &["render", "g.ron", "-q"], scratch.path())
    };
    let read = || {
        let image: Image =
            spandrel_engine::image::file::read(&scratch.path().join("out.png")).unwrap();
        let coded = image.coded().expect("it is coded").clone();
        let (Layout::Palette(table), Codes::Bytes(numbers)) = (&coded.layout, &coded.codes) else {
            panic!("it has a palette");
        };
        (table.clone(), numbers.clone())
    };
    let ran = render("");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let (table, numbers) = read();
    let ran = render(", colors: {\"clay\": \"#2040ff\"}");
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let (other, same) = read();
    assert_eq!(numbers, same);
    assert_ne!(table, other);
    assert!(table.len() <= 256 && numbers.iter().any(|number| *number > 0));
    let ran = render(", colors: {\"clya\": \"#2040ff\"}");
    assert!(ran.code == Some(1) && ran.err.contains("\"clay\""), "{}", ran.err);
    let ran = render(", entries: 200");
    assert!(ran.code == Some(1) && ran.err.contains("fewer `entries`"), "{}", ran.err);
}

/// Lights and their shaders serve as well, and edges and what shines stay as they are.
#[test]
fn shaded_brightness_is_that_of_the_shaders() {
    let image = image(&scene([CLAY, LEAF, LABEL]), (160, 90));
    let lamp = lights::sun(DVec3::new(0.0, -1.0, -0.2), Color::grey(0.8));
    let light = lights::illuminate(vec![lamp], Color::grey(0.1), Color::grey(0.1));
    let lit = image.shaded(Arc::new(light)).unwrap();
    let [head, shaded] = [(&image, Brightness::Head), (&lit, Brightness::Shaded)]
        .map(|(image, by)| Display::new(image, by, Some(32)).unwrap());
    assert_eq!(head.parts().len(), shaded.parts().len());
    assert_ne!(head.numbers(), shaded.numbers());
    // From above: of the ball the upper half is bright.
    let ball = shaded.parts().iter().find(|part| part.name == "clay" && !part.is_edge).unwrap();
    let step =
        |x: usize, y: usize| (shaded.numbers()[y * 160 + x] as usize).checked_sub(ball.first);
    let column = 160 / 2 - 26;
    let steps: Vec<usize> =
        (0..90).filter_map(|y| step(column, y)).filter(|s| *s < ball.entries).collect();
    assert!(steps.len() > 10 && steps[2] > steps[steps.len() - 3], "{steps:?}");
}
