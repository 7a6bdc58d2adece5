//! `spandrel convert`: the new file is read, shows the same, and finds its pictures.

use spandrel_engine::scene::Document;
use spandrel_engine::scene::files::Named;
use spandrel_engine::scene::read::{ReadOptions, binary, document, text};
use spandrel_tests::data;
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::{Path, PathBuf};

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

const SCENE: &str = r#"Scene(
    materials: {
        "wood": (color: 1, maps: {"color": (picture: File("tex/wood.png"))}),
        "raw": (color: 1, maps: {"color": (picture: Raw("../shared/wood.png")), "bump": (picture: Wave(3, 4))}),
        "marks": (color: 1, maps: {"color": (picture: Embedded("held.gltf", 0))}),
        "floor": (domains: (define: Picture("tex/wood.png"), table: {0: "wood", 9: "raw"})),
    },
    plans: [(
        name: "p",
        lights: {"lamp": PointLight(lamp: "lamps/a.ies"), "sky": SkyLight(picture: "tex/sky.hdr")},
        definitions: {"far": (shape: File(path: "parts/far.ron"))},
        root: (children: [
            (name: "a", material: "wood", shape: Box(size: (1, 1, 1))),
            (name: "b", material: "marks", transform: [Move(1.2, 0, 0)], shape: Box(size: (1, 1, 1))),
            (name: "c", material: "raw", transform: [Move(-1.2, 0, 0)], shape: Box(size: (1, 1, 1))),
            (name: "many", shape: Array(of: (shape: File(path: "parts/far.ron")), count: (2, 1, 1), step: (3, 0, 0))),
        ]),
    )],
)"#;

/// A glTF that holds a picture itself, which is a mesh of nothing.
fn holder(png: &[u8]) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "images": [{{"mimeType": "image/png", "uri": "data:image/png;base64,{}"}}],
        "scenes": [{{"nodes": []}}], "scene": 0}}"#,
        base64(png)
    )
}

pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let all = three.iter().fold(0u32, |all, byte| all << 8 | u32::from(*byte));
        let all = all << (8 * (3 - three.len()));
        for i in 0..4 {
            let letter = LETTERS[(all >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= three.len() { letter as char } else { '=' });
        }
    }
    text
}

struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = Folder(Scratch::new(name));
        let png = |seed: u8, place: &str| {
            let path = folder.at(place);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            let color = |x: u32, y: u32| image::Rgb([seed, (x * 60) as u8, (y * 60) as u8]);
            image::RgbImage::from_fn(4, 4, color).save(&path).unwrap();
            std::fs::read(path).unwrap()
        };
        png(10, "from/tex/wood.png");
        png(90, "shared/wood.png");
        let held = png(200, "from/held.png");
        std::fs::remove_file(folder.at("from/held.png")).unwrap();
        let put = |place: &str, text: &[u8]| {
            let path = folder.at(place);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        put("from/held.gltf", holder(&held).as_bytes());
        put("from/scene.ron", SCENE.as_bytes());
        put("from/lamps/a.ies", b"not looked at");
        put("from/tex/sky.hdr", b"not looked at");
        put(
            "from/parts/far.ron",
            b"Scene(plans: [(name: \"q\", root: (shape: Sphere(radius: 0.2)))])",
        );
        folder
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, self.0.path())
    }

    /// A small picture of a scene.
    fn picture(&self, scene: &str) -> Vec<u8> {
        let graph = format!(
            "Graph(nodes: {{\"eye\": Camera(position: (2, 3, 5)), \"s\": Scanline(scene: {scene:?}, camera: \"eye\"), \
             \"p\": Resolve(image: \"s\", size: (60, 40), lines: Sloped(2)), \"w\": Write(image: \"p\", path: \"x.png\")}})"
        );
        std::fs::write(self.at("g.ron"), graph).unwrap();
        let ran = self.run(&["render", "g.ron", "-q", "--deny-warnings"]);
        assert_eq!(ran.code, Some(0), "{scene}: {ran:?}");
        std::fs::read(self.at("x.png")).unwrap()
    }
}

/// The files that a scene's file names, as seen from the current folder.
fn named(path: &Path) -> Vec<PathBuf> {
    let mut read = Document::clone(&document(path, &ReadOptions::default()).unwrap().document);
    let mut files = Vec::new();
    read.visit_files(&mut |mut named: Named<'_>| {
        files.extend(named.path_mut().map(|file| path.parent().unwrap().join(&*file)));
        Ok(())
    })
    .unwrap();
    files
}

#[test]
fn pictures_are_found_from_the_new_folder() {
    let folder = Folder::new("convert-far");
    let before = folder.picture("from/scene.ron");
    for to in ["new/deep/scene.ron", "other/scene.scene", "from/beside.ron", "here.ron"] {
        let ran = folder.run(&["convert", "from/scene.ron", to]);
        assert_eq!((ran.code, ran.err.contains("warning")), (Some(0), false), "{ran:?}");
        let files = named(&folder.at(to));
        assert_eq!(files.len(), 8, "{files:?}");
        for file in files {
            assert!(file.exists(), "{to}: {}", file.display());
        }
        assert!(folder.picture(to) == before, "{to} looks different");
    }
    let text = std::fs::read_to_string(folder.at("new/deep/scene.ron")).unwrap();
    for path in ["../../from/tex/wood.png", "../../shared/wood.png", "../../from/lamps/a.ies"] {
        assert!(text.contains(&format!("\"{path}\"")), "{path}: {text}");
    }
    // In the same folder the file says what it said.
    let text = std::fs::read_to_string(folder.at("from/beside.ron")).unwrap();
    assert!(text.contains("\"tex/wood.png\"") && text.contains("\"../shared/wood.png\""), "{text}");
}

#[test]
fn copied_pictures_need_nothing_of_the_old_folder() {
    let folder = Folder::new("convert-copy");
    let before = folder.picture("from/scene.ron");
    let ran = folder.run(&["convert", "from/scene.ron", "new/a.ron", "--copy-pictures"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    // Two that have one name stay two; one that is named twice is copied once.
    let mut names: Vec<_> = std::fs::read_dir(folder.at("new/a_pictures"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["2_wood.png", "a.ies", "held_0.png", "sky.hdr", "wood.png"]);
    let _ = std::fs::remove_dir_all(folder.at("shared"));
    let _ = std::fs::remove_dir_all(folder.at("from/tex"));
    let _ = std::fs::remove_file(folder.at("from/held.gltf"));
    assert!(folder.picture("new/a.ron") == before);
    // What is not there any more is told.
    let ran = folder.run(&["convert", "from/scene.ron", "new/b.ron", "--copy-pictures"]);
    assert!(ran.err.contains("warning: from/tex/wood.png: there is no such file"), "{ran:?}");
    let ran = folder.run(&["convert", "from/scene.ron", "new/b.ron", "--deny-warnings"]);
    assert_eq!(ran.code, Some(1), "{ran:?}");
}

#[test]
fn what_the_text_cannot_hold_is_not_written() {
    let folder = Folder::new("convert-deep");
    let nodes: Vec<String> = (0..60)
        .map(|i| if i < 59 { format!("{{\"children\": [{}]}}", i + 1) } else { "{}".to_owned() })
        .collect();
    let gltf = format!(
        "{{\"asset\": {{\"version\": \"2.0\"}}, \"nodes\": [{}], \"scenes\": [{{\"nodes\": [0]}}], \"scene\": 0}}",
        nodes.join(",")
    );
    std::fs::write(folder.at("deep.gltf"), gltf).unwrap();
    for to in ["deep.ron", "deep.scene"] {
        let ran = folder.run(&["convert", "deep.gltf", to]);
        let is_read = folder.run(&["info", to]).code == Some(0);
        assert_eq!((ran.code == Some(0), folder.at(to).exists()), (is_read, is_read), "{ran:?}");
    }
    assert!(folder.at("deep.scene").exists());
    let ran = folder.run(&["convert", "deep.gltf", "deep.ron"]);
    assert!(ran.code == Some(0) || ran.err.contains("convert it to a .scene"), "{ran:?}");
}

#[test]
fn real_models_are_the_same_after_both_formats() {
    let mut count = 0;
    for folder in ["models", "city"].into_iter().filter_map(data::find) {
        let endings = [".gltf", ".glb", ".obj", ".ply", ".stl", ".json", ".gml", ".xml"];
        for path in data::files(&folder, &endings) {
            if std::fs::metadata(&path).unwrap().len() > 150_000 {
                continue;
            }
            let Ok(reading) = document(&path, &ReadOptions::default()) else { continue };
            let (written, packed) = (
                text::write(&reading.document).unwrap(),
                binary::write(&reading.document).unwrap(),
            );
            assert!(!written.contains("r#"), "{}", path.display());
            let again = text::parse(&path, written.as_bytes()).unwrap();
            assert!(again == *reading.document, "{}", path.display());
            let again = binary::parse(&path, &packed).unwrap();
            assert!(again == *reading.document, "{}", path.display());
            count += 1;
        }
    }
    assert!(count == 0 || count > 20, "{count}");
}

#[test]
fn real_models_keep_their_pictures_in_another_folder() {
    let folder = Folder::new("convert-real");
    let Some(models) = data::find("models/kaykit_city") else { return };
    let with_pictures: Vec<PathBuf> = data::files(&models, &[".gltf", ".obj"])
        .into_iter()
        .filter(|path| !named(path).is_empty())
        .take(2)
        .collect();
    assert!(!with_pictures.is_empty());
    for path in with_pictures {
        let path = path.to_str().unwrap();
        let before = folder.picture(path);
        for to in ["new/a.ron", "new/a.scene"] {
            assert_eq!(folder.run(&["convert", path, to]).code, Some(0));
            assert!(folder.picture(to) == before, "{path}");
            assert_eq!(folder.run(&["convert", path, to, "--copy-pictures"]).code, Some(0));
            assert!(folder.picture(to) == before, "{path}");
        }
    }
}
