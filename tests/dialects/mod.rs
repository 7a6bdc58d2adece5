//! Scene files as programs really write them: text however it was saved, formats under wrong names, and the
//! dialects of STL, PLY, OBJ and MTL. Each is read as what it means, or told.

use glam::{DVec2, DVec3, dvec3 as v};
use spandrel_engine::color::{Color, decode_srgb};
use spandrel_engine::fragment::{Gloss, Optics};
use spandrel_engine::image::Channel;
use spandrel_engine::light::photometry::Photometry;
use spandrel_engine::raster::{LinePlan, Phase, Rows};
use spandrel_engine::render::scanline::render;
use spandrel_engine::scene::read::{self, Axis, ReadOptions, Reading};
use spandrel_engine::scene::{AlphaMode, Material, Mesh, Shape};
use spandrel_engine::shade::Illuminate;
use spandrel_engine::span::SpanImage;
use spandrel_tests::lights::{illuminate, sun};
use spandrel_tests::program::{Scratch, run};
use spandrel_tests::random::Random;
use spandrel_tests::scenes::front_view;
use spandrel_tests::spans::picture;
use std::path::Path;
use std::sync::Arc;

mod meshes;
mod mtl;
mod obj;
mod text;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A folder with files.
struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        Folder(Scratch::new(&format!("dialects-{name}")))
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> &Folder {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
        self
    }

    fn read(&self, name: &str) -> Result<Reading, String> {
        let path = self.0.path().join(name);
        let before = format!("{}/", self.0.path().display());
        let read = read::document(&path, &ReadOptions::default());
        read.map_err(|e| e.to_string().replace(&before, ""))
    }

    /// Reads a file that has these contents.
    fn take(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Reading, String> {
        self.put(name, bytes).read(name)
    }

    fn image(&self, name: &str) -> SpanImage {
        let path = self.0.path().join(name);
        let scene = read::scene(&path, None, "scene", &ReadOptions::default()).unwrap();
        let (plan, rows) = (LinePlan::new(4, Phase::Centre).unwrap(), Rows { start: 0, end: 9 });
        render(&[Arc::new(scene).into()], &front_view(9, 9), plan, rows).unwrap()
    }

    /// What is seen in the middle, before any light.
    fn seen(&self, name: &str) -> [f32; 4] {
        middle(&self.image(name))
    }
}

fn middle(image: &SpanImage) -> [f32; 4] {
    picture(image, &[Channel::Color]).pixels().nth(9 * 4 + 4).unwrap()
}

fn near(a: [f32; 4], b: [f32; 4]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5)
}

fn meshes(reading: &Reading) -> Vec<(&str, &Mesh)> {
    let children = reading.document.plans[0].root.children.iter();
    let named = children.map(|child| match &child.shape {
        Shape::Faces(mesh) => (child.name.as_str(), mesh),
        _ => panic!("no mesh"),
    });
    named.collect()
}

/// The points of a file's first face.
fn first(reading: &Reading) -> Vec<DVec3> {
    let (_, mesh) = meshes(reading)[0];
    mesh.outline(0).iter().map(|i| mesh.points[*i as usize]).collect()
}

fn told(reading: &Reading, words: &[&str]) {
    for word in words {
        assert!(
            reading.notes.iter().any(|note| note.contains(word)),
            "{word}: {:?}",
            reading.notes
        );
    }
}

const NOTHING: [String; 0] = [];

const TRIANGLE: [DVec3; 3] = [v(-4.0, -4.0, 0.0), v(4.0, -4.0, 0.0), v(0.0, 4.0, 0.0)];
const OBJ: &str = "v -4 -4 0\nv 4 -4 0\nv 0 4 0\nf 1 2 3\n";
const STL: &str = "solid t\nfacet normal 0 0 1\nouter loop\nvertex -4 -4 0\nvertex 4 -4 0\nvertex 0 4 0\n\
                   endloop\nendfacet\nendsolid t\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
                   -4 -4 0\n4 -4 0\n0 4 0\n3 0 1 2\n";
const RON: &str = "Scene(version: 1, plans: [(name: \"p\", root: (children: [(name: \"t\", shape: Faces(\
                   points: [(-4, -4, 0), (4, -4, 0), (0, 4, 0)], faces: [(outline: [0, 1, 2])]))]))])";
const CITY: &str = r#"{"type":"CityJSON","version":"1.0","CityObjects":{"b":{"type":"Building","geometry":[
    {"type":"MultiSurface","lod":"2","boundaries":[[[0,1,2]]]}]}},"vertices":[[-4,-4,0],[4,-4,0],[0,4,0]]}"#;

/// A text as it may have been saved.
fn saved(text: &str) -> Vec<Vec<u8>> {
    let lines = |end: &str| text.replace('\n', end);
    let words = |unit: fn(u16) -> [u8; 2], mark: &[u8]| -> Vec<u8> {
        let units: Vec<u8> = lines("\r\n").encode_utf16().flat_map(unit).collect();
        [mark, &units].concat()
    };
    vec![
        text.into(),
        lines("\r\n").into(),
        lines("\r").into(),
        [b"\xef\xbb\xbf", lines("\r\n").as_bytes()].concat(),
        words(u16::to_le_bytes, b"\xff\xfe"),
        words(u16::to_be_bytes, b"\xfe\xff"),
        [text.as_bytes(), b"\x1a"].concat(),
    ]
}

/// No reader may break on what it was not told of: it reads, or names the file and the fault.
#[test]
fn readers_end_civilly_on_what_is_damaged() {
    let folder = Folder::new("damaged");
    folder.put(
        "m.mtl",
        "newmtl m\nKd 1 0 0\nmap_Kd -s 1 2 a.png\nillum 7\nPr .5\nmap_Pr r.png\nTr 1\n",
    );
    let obj = format!(
        "mtllib m.mtl\nusemtl m\no a\nvt 0 0\nvn 0 0 1\ns 1\n{OBJ}f 1/1/1 2//1 \\\n -1/-1 # x\n"
    );
    let mut binary =
        PLY[..PLY.find("-4 -4 0").unwrap()].replace("ascii", "binary_little_endian").into_bytes();
    let numbers = TRIANGLE.iter().flat_map(|p| p.to_array());
    binary.extend(numbers.flat_map(|number| (number as f32).to_le_bytes()));
    binary.extend([3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
    assert_eq!(first(&folder.take("b.ply", &binary).unwrap()), TRIANGLE);
    let mtl = std::fs::read(folder.0.path().join("m.mtl")).unwrap();
    let words: [&[u8]; 8] =
        [b"-1", b"4294967296", b"nan", b" \\\n", b"#", b"\xff", b"1e999", b"list"];
    let mut random = Random::new(3);
    let (mut read, mut refused) = (0, 0);
    for (name, seed) in [
        ("a.obj", obj.as_bytes()),
        ("m.mtl", &mtl),
        ("a.stl", STL.as_bytes()),
        ("a.ply", PLY.as_bytes()),
        ("b.ply", &binary),
    ] {
        for _ in 0..150 {
            let mut bytes = seed.to_vec();
            for _ in 0..1 + random.below(4) {
                let at = random.below(bytes.len() as u32) as usize;
                let word = words[random.below(8) as usize];
                let over = match random.below(4) {
                    0 => at..at + 1,
                    1 => at..at,
                    2 => at..(at + word.len()).min(bytes.len()),
                    _ => at.max(9).min(bytes.len())..bytes.len(),
                };
                bytes.splice(over, word.iter().copied());
            }
            folder.put(name, &bytes);
            match folder.read(if name == "m.mtl" { "a.obj" } else { name }) {
                Ok(_) => read += 1,
                Err(error) => {
                    refused += 1;
                    assert!(error.contains(name) && !error.contains("decoder broke"), "{error}");
                }
            }
        }
        folder.put(name, seed);
    }
    assert!(read > 100 && refused > 100, "{read} are read, {refused} refused");
}
