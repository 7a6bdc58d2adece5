//! The command line as a farm uses it: what it is told, what is written, what stays whole.

mod told;
mod written;

use serde_json::Value as Json;
use spandrel_tests::program::{Ran, Scratch, run};
use std::path::PathBuf;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

const GRAPH: &str = r#"Graph(nodes: {
    "eye": Camera(position: (2, 2, 5)),
    "boxes": Scanline(scene: "box.ron", camera: "eye"),
    "picture": Resolve(image: "boxes", size: (40, 30), lines: Sloped(2)),
    "file": Write(image: "picture", path: "out/a.png"),
    "blurred": Blur(image: "picture", radius: 1),
    "soft": Write(image: "blurred", path: "out/b.exr"),
})"#;

struct Folder(Scratch);

impl Folder {
    fn new(name: &str) -> Folder {
        let folder = Folder(Scratch::new(name));
        folder.put(
            "box.ron",
            "Scene(plans: [(name: \"p\", root: (name: \"table\", shape: Box(size: (1, 1, 1))))])",
        );
        folder.put("g.ron", GRAPH);
        folder
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.at(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Ran {
        run(PROGRAM, arguments, self.0.path())
    }

    fn shell(&self, script: &str) -> Ran {
        let script = script.replace("spandrel", PROGRAM);
        run("bash", &["-c", &script], self.0.path())
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_default()
    }

    /// All names in a folder.
    fn names(&self, sub: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.at(sub)).into_iter().flatten().flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn stats(ran: &Ran) -> Json {
    serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {ran:?}"))
}

/// The texts of a list of the statistics, or a field of its entries.
fn list(stats: &Json, of: &str, field: &str) -> Vec<String> {
    let entries = stats[of].as_array().unwrap_or_else(|| panic!("no {of}: {stats}"));
    let text = |entry: &Json| match field {
        "" => entry.as_str().unwrap().to_owned(),
        field => entry[field].as_str().unwrap().to_owned(),
    };
    entries.iter().map(text).collect()
}
