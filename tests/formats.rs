//! Scenes in files: what is written is read back, formats agree with each other, primitives have the
//! areas and volumes of their formulas.

use glam::DVec3;
use spandrel_engine::color::Color;
use spandrel_engine::key::Key;
use spandrel_engine::light::list::{LightEntry, SunLight};
use spandrel_engine::scene::read::{self, ReadOptions, binary, text};
use spandrel_engine::scene::shape::Patch;
use spandrel_engine::scene::{
    Back, Display, Document, EdgeStyle, Environment, Face, Geometry, Material, Mesh, Object, Plan,
    Scene, Seal, Shape, Sides, Step,
};
use spandrel_tests::program::scratch;
use std::f64::consts::PI;
use std::path::Path;

/// A document that uses everything that the model has.
fn everything() -> Document {
    let mut mesh = Mesh::default();
    for (i, (x, y)) in
        [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0), (1.0, 1.0), (2.0, 1.0), (2.0, 2.0)]
            .iter()
            .enumerate()
    {
        mesh.points.push(DVec3::new(*x, *y, 1e-300 * i as f64));
        mesh.normals.push(glam::Vec3::Z);
        mesh.uvs.push(glam::Vec2::new(0.1, 1.0 / 3.0));
        mesh.colors.push([0.25, f32::MIN_POSITIVE, 0.1, 1.0]);
    }
    let glass = mesh.material("glass");
    mesh.add_face(Face {
        outline: vec![0, 1, 2, 3],
        holes: vec![vec![4, 5, 6]],
        seals: vec![Seal {
            outline: vec![4, 6, 5],
            sides: Sides { front: Some(glass), back: Back::Material(glass) },
            edge: Some(EdgeStyle { color: Color::new(0.1, 0.2, 0.3), width: 1.5 }),
        }],
        sides: Sides { front: None, back: Back::Material(glass) },
        edge: Some(EdgeStyle::default()),
    })
    .unwrap();
    mesh.add_polygon(&[0, 1, 2], Some(glass)).unwrap();
    mesh.add_polygon(&[2, 1, 0], None).unwrap();
    let mut document = Document::default();
    document
        .materials
        .insert("glass".into(), Material { alpha: 0.5, unlit: true, ..Material::default() });
    let mut plan = Plan { name: "all".into(), ..Plan::default() };
    plan.cameras.insert("front".into(), Default::default());
    plan.lights.insert("sun".into(), LightEntry::SunLight(SunLight::default()));
    plan.environment = Some(Environment::default());
    plan.definitions
        .insert("ball".into(), Object::new("", Shape::Sphere { radius: 0.1, segments: 8 }));
    let array = Shape::Array {
        of: Box::new(Object::new("", Shape::Instance("ball".into()))),
        count: [2, 3, 1],
        step: [0.1, 0.2, 0.3],
    };
    let patch =
        Patch { outline: vec![DVec3::ZERO, DVec3::X, DVec3::Y], material: Some("glass".into()) };
    let polygon = Shape::Polygon {
        outline: vec![DVec3::ZERO, DVec3::X, DVec3::ONE, DVec3::Y],
        holes: vec![vec![DVec3::ZERO, DVec3::X, DVec3::Y]],
        seals: vec![patch],
    };
    let mut faces =
        Object::new("faces", Shape::Faces(mesh)).of("glass").moved([1.0, 1.0 / 3.0, -2.0]);
    faces.user.insert("key".into(), "a \"value\"\n".into());
    faces.display = Display::FacesOnly;
    faces.transform.0.extend([Step::TurnX(1.0), Step::Stretch(-1.0, 1.0, 1.0), Step::Scale(0.1)]);
    let shapes = [
        polygon,
        array,
        Shape::Prism {
            outline: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            holes: vec![],
            height: 1.0,
        },
        Shape::Patch { points: [[DVec3::X; 4]; 4], divisions: [2, 3] },
        Shape::HeightField {
            heights: vec![vec![0.0, 1.0], vec![0.5, 0.25]],
            size: [1.0, 2.0],
            smooth: true,
        },
    ];
    faces.children =
        shapes.into_iter().enumerate().map(|(i, s)| Object::new(format!("child {i}"), s)).collect();
    plan.root.children.push(faces);
    document.plans.push(plan.clone());
    document.plans.push(Plan { name: "other".into(), ..Plan::default() });
    document.default_plan = Some("all".into());
    document
}

#[test]
fn text_to_binary_to_text_loses_nothing() {
    let document = everything();
    let written = text::write(&document).unwrap();
    let read = text::parse(Path::new("a.ron"), written.as_bytes()).unwrap();
    assert_eq!(read, document);
    let bytes = binary::write(&read).unwrap();
    let again = binary::parse(Path::new("a.scene"), &bytes).unwrap();
    assert_eq!(again, document);
    assert_eq!(text::write(&again).unwrap(), written);
}

#[test]
fn damaged_binary_scenes_are_told_apart() {
    let bytes = binary::write(&everything()).unwrap();
    let fault = |bytes: &[u8]| binary::parse(Path::new("a.scene"), bytes).unwrap_err().to_string();
    assert!(fault(&bytes[..40]).contains("not a binary"));
    assert!(fault(&bytes[..bytes.len() - 1]).contains("truncated"));
    let mut flipped = bytes.clone();
    *flipped.last_mut().unwrap() ^= 1;
    assert!(fault(&flipped).contains("checksum"));
    let mut newer = bytes;
    newer[12] = 9;
    assert!(fault(&newer).contains("version 9"));
}

#[test]
fn text_errors_have_line_and_column() {
    let text = "Scene(\n  plans: [(\n    name: \"p\",\n    rot: (),\n  )],\n)";
    let error = text::parse(Path::new("s.ron"), text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("s.ron:4:"), "{error}");
    assert!(error.contains("rot"), "{error}");
}

/// Area and, by the divergence theorem, volume of a mesh made ready.
fn measure(shape: &Shape) -> (f64, f64) {
    let geometry = Geometry::new(&shape.mesh().unwrap()).unwrap();
    let mesh = geometry.mesh();
    let (mut area, mut volume) = (0.0, 0.0);
    for face in 0..mesh.face_count() {
        let normal = geometry.normal(face);
        let ring = |corners: &[u32]| -> f64 {
            let p: Vec<DVec3> = corners.iter().map(|c| mesh.points[*c as usize]).collect();
            let sum: DVec3 = (0..p.len()).map(|i| p[i].cross(p[(i + 1) % p.len()])).sum();
            sum.dot(normal) / 2.0
        };
        let holes: f64 = mesh.holes(face).iter().map(|hole| ring(hole).abs()).sum();
        let own = ring(mesh.outline(face)) - holes;
        let at = mesh.points[mesh.outline(face)[0] as usize];
        area += own;
        volume += own * at.dot(normal) / 3.0;
    }
    (area, volume)
}

#[test]
fn primitives_have_the_areas_and_volumes_of_their_formulas() {
    let n = 512;
    let check = |name: &str, shape: &Shape, area: f64, volume: f64| {
        let (a, v) = measure(shape);
        assert!((a / area - 1.0).abs() < 2e-3, "{name}: area {a}, {area}");
        assert!((v / volume - 1.0).abs() < 2e-3, "{name}: volume {v}, {volume}");
    };
    check("box", &Shape::Box { size: [2.0, 3.0, 4.0] }, 52.0, 24.0);
    let square = |r: f64| vec![[-r, -r], [r, -r], [r, r], [-r, r]];
    let shaft = Shape::Prism { outline: square(2.0), holes: vec![square(1.0)], height: 5.0 };
    check("prism", &shaft, 2.0 * 12.0 + 5.0 * 24.0, 60.0);
    for smooth in [true, false] {
        let cylinder = Shape::Cylinder { radius: 1.5, height: 2.0, segments: n, smooth };
        check("cylinder", &cylinder, 2.0 * PI * 1.5 * 3.5, PI * 4.5);
        let cone = Shape::Cone { radius: 3.0, top_radius: 0.0, height: 4.0, segments: n, smooth };
        check("cone", &cone, PI * 3.0 * (3.0 + 5.0), PI * 12.0);
    }
    check("sphere", &Shape::Sphere { radius: 2.0, segments: n }, 16.0 * PI, 32.0 / 3.0 * PI);
    let torus = Shape::Torus { radius: 3.0, tube: 1.0, segments: n };
    check("torus", &torus, 12.0 * PI * PI, 6.0 * PI * PI);
    let bowl = Shape::Revolve {
        profile: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]],
        segments: n,
        angle: 360.0,
        smooth: false,
    };
    check("revolve", &bowl, 6.0 * PI, 2.0 * PI);
    let ring = vec![
        DVec3::new(-2.0, 0.0, -2.0),
        DVec3::new(2.0, 0.0, -2.0),
        DVec3::new(2.0, 0.0, 2.0),
        DVec3::new(-2.0, 0.0, 2.0),
    ];
    let frame = Shape::Sweep {
        profile: vec![[-0.5, 0.0], [0.5, 0.0], [0.5, 1.0], [-0.5, 1.0]],
        path: ring,
        closed: true,
        ring: true,
    };
    // Mitred corners: outer square 5, inner 3.
    check("sweep", &frame, 2.0 * (25.0 - 9.0) + 20.0 + 12.0, 16.0);
}

#[test]
fn curved_primitives_have_the_normals_of_their_formulas() {
    let mesh = Shape::Sphere { radius: 2.0, segments: 24 }.mesh().unwrap();
    for (point, normal) in mesh.points.iter().zip(&mesh.normals) {
        assert!((normal.as_dvec3() - *point / 2.0).length() < 1e-6);
    }
    let flat =
        std::array::from_fn(|j| std::array::from_fn(|i| DVec3::new(i as f64, 0.0, -(j as f64))));
    let mesh = Shape::Patch { points: flat, divisions: [3, 2] }.mesh().unwrap();
    assert!(mesh.normals.iter().all(|normal| (*normal - glam::Vec3::Y).length() < 1e-6));
    assert_eq!(mesh.uvs.last(), Some(&glam::Vec2::ONE));
}

#[test]
fn coplanar_faces_share_one_plane_bit_for_bit() {
    let mut mesh = Mesh::default();
    // A tilted plane, its faces rounded to single precision, one facing the other way.
    let at = |u: f64, v: f64| {
        let p = DVec3::new(0.3, -0.2, 0.9) * u + DVec3::new(0.1, 0.8, 0.5) * v + DVec3::splat(3.0);
        p.as_vec3().as_dvec3()
    };
    for (i, (u, v)) in [(0.0, 0.0), (3.0, 1.0), (-5.0, 2.0), (7.0, -4.0)].into_iter().enumerate() {
        let ring: Vec<u32> = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
            .iter()
            .map(|(s, t)| mesh.add_point(at(u + s, v + t)))
            .collect();
        let ring = if i == 2 { vec![ring[0], ring[2], ring[1]] } else { ring };
        mesh.add_polygon(&ring, None).unwrap();
    }
    let geometry = Geometry::new(&mesh).unwrap();
    assert_eq!(geometry.supports().len(), 1);
    assert!(geometry.normal(0).dot(geometry.normal(2)) < -0.999);
    // A face that is close but not in the plane has its own.
    let off: Vec<u32> = [(9.0, 9.0), (10.0, 9.0), (9.0, 10.0)]
        .iter()
        .map(|(s, t)| mesh.add_point(at(*s, *t) + DVec3::Z * 1e-4))
        .collect();
    mesh.add_polygon(&off, None).unwrap();
    assert_eq!(Geometry::new(&mesh).unwrap().supports().len(), 2);
}

#[test]
fn polygons_that_are_not_planar_are_divided_beyond_the_tolerance() {
    let bent = |z: f64| {
        let mut mesh = Mesh::default();
        let ring: Vec<u32> = [(0.0, 0.0, 0.0), (1.0, 0.0, z), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
            .iter()
            .map(|(x, y, z)| mesh.add_point([*x, *y, *z]))
            .collect();
        mesh.add_polygon(&ring, None).unwrap();
        Geometry::new(&mesh).unwrap()
    };
    assert_eq!(bent(1e-3).mesh().face_count(), 1);
    assert_eq!(bent(1e-2).mesh().face_count(), 2);
    assert_eq!(bent(1e-2).faults().not_planar, 1);
}

#[test]
fn hidden_objects_hide_their_children_and_seals_can_be_hidden() {
    let sealed = || {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let seal = Patch { outline: vec![p(0.2, 0.2), p(0.8, 0.2), p(0.2, 0.8)], material: None };
        Shape::Polygon {
            outline: vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0)],
            holes: vec![],
            seals: vec![seal],
        }
    };
    let shown = |above: Display, below: Display| {
        let child = Object { display: below, ..Object::new("child", sealed()) };
        let object = Object { display: above, children: vec![child], ..Object::default() };
        let scene = Scene::from_object("s", object).unwrap();
        (scene.instances.len(), scene.instances.first().is_some_and(|i| i.shows_seals))
    };
    use Display::{FacesAndSeals, FacesOnly, Hidden};
    assert_eq!(shown(FacesAndSeals, FacesAndSeals), (1, true));
    assert_eq!(shown(FacesAndSeals, FacesOnly), (1, false));
    assert_eq!(shown(FacesOnly, FacesAndSeals), (1, false));
    assert_eq!(shown(FacesAndSeals, Hidden), (0, false));
    assert_eq!(shown(Hidden, FacesAndSeals), (0, false));
}

#[test]
fn options_place_a_files_space() {
    let folder = scratch("options");
    let path = folder.join("a.obj");
    std::fs::write(&path, "v 1000 0 0\nv 1001 0 0\nv 1000 0 1\nf 1 2 3\n").unwrap();
    let read = |options: ReadOptions| {
        let scene = read::scene(&path, None, "a", &options).unwrap();
        let i = &scene.instances[0];
        i.geometry
            .mesh()
            .points
            .iter()
            .map(|p| i.world_from_object.transform_point3(*p))
            .collect::<Vec<_>>()
    };
    assert_eq!(read(ReadOptions::default())[2], DVec3::new(1000.0, 0.0, 1.0));
    let options = ReadOptions {
        unit: Some(0.001),
        up: Some(read::Axis::Z),
        origin: Some([1000.0, 0.0, 0.0]),
        crease: None,
        pictures: None,
        ..ReadOptions::default()
    };
    assert_eq!(read(options)[2], DVec3::new(0.0, 0.001, 0.0));
    assert!(
        read::scene(&path, None, "a", &ReadOptions { unit: Some(0.0), ..Default::default() })
            .is_err()
    );
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn ply_and_stl_in_text_and_binary_are_one_mesh() {
    let folder = scratch("meshes");
    let head = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let numbers = [0.0f32, 0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 1.0, 0.25];
    let mut files = vec![(
        "t.ply",
        format!("{}0 0 0\n1 0.5 0\n0 1 0.25\n3 0 1 2\n", head("ascii")).into_bytes(),
    )];
    for (name, format, little) in
        [("l.ply", "binary_little_endian", true), ("b.ply", "binary_big_endian", false)]
    {
        let mut bytes = head(format).into_bytes();
        let word = |v: [u8; 4]| if little { v } else { [v[3], v[2], v[1], v[0]] };
        numbers.iter().for_each(|v| bytes.extend(word(v.to_le_bytes())));
        bytes.push(3);
        (0..3i32).for_each(|v| bytes.extend(word(v.to_le_bytes())));
        files.push((name, bytes));
    }
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0.5 0\nvertex 0 1 0.25\nendloop\nendfacet\nendsolid s\n";
    files.push(("t.stl", stl.as_bytes().to_vec()));
    let mut binary = vec![0u8; 80];
    binary.extend(1u32.to_le_bytes());
    [0.0f32, 0.0, 1.0].iter().chain(&numbers).for_each(|v| binary.extend(v.to_le_bytes()));
    binary.extend([0, 0]);
    files.push(("b.stl", binary));
    for (name, bytes) in files {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        let reading = read::document(&path, &ReadOptions::default()).unwrap();
        let Shape::Faces(mesh) = &reading.document.plans[0].root.children[0].shape else {
            panic!("{name}")
        };
        let points: Vec<f64> = mesh.points.iter().flat_map(|p| p.to_array()).collect();
        assert_eq!(points, numbers.map(f64::from), "{name}");
        assert_eq!(mesh.outline(0), [0, 1, 2], "{name}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_manual_of_scenes_shows_every_shape_and_all_of_it_parses() {
    let manual = include_str!("../graphs/SCENES.md");
    let blocks = manual.split("```ron\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let (scenes, shapes): (Vec<&str>, Vec<&str>) = blocks.partition(|b| b.starts_with("Scene("));
    assert_eq!((scenes.len(), shapes.len()), (3, 1));
    for scene in scenes {
        let document = text::parse(Path::new("SCENES.md"), scene.as_bytes()).unwrap();
        let key = Key::of(&document);
        Scene::new(&document, None, "manual", key, Path::new("")).unwrap();
    }
    let shapes = shapes[0];
    let parse = |text: &str| spandrel_engine::text::options().from_str::<Shape>(text);
    for shape in shapes.lines() {
        parse(shape).unwrap_or_else(|e| panic!("{shape}: {e}"));
    }
    let Err(ron::Error::NoSuchEnumVariant { expected, .. }) = parse("Nothing").map_err(|e| e.code)
    else {
        panic!("there is a shape called Nothing");
    };
    for kind in expected {
        assert!(shapes.lines().any(|shape| shape.split('(').next() == Some(kind)), "no {kind}");
    }
}
