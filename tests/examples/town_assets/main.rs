//! Writes the scenes of `graphs/town.ron`: `cargo run --release -p spandrel-tests --example town_assets`.
//!
//! A street at the end of the day: old gabled houses, mansards, a brick warehouse, an office behind a
//! concrete grid, a corner house with a turret, and a church where the street ends. Everything is made
//! of the primitives and instances of the scene format, so that the files stay small enough to read.

mod buildings;
mod cars;
mod houses;
mod kit;
mod sky;
mod street;
mod trees;

use spandrel_engine::scene::read::text;
use std::path::Path;

/// Where the street's sides stand.
const FRONT: f64 = 11.0;

fn main() {
    let folder = Path::new("graphs/assets/town");
    std::fs::create_dir_all(folder).expect("the folder can be made");
    for (name, document) in [
        ("buildings", buildings::buildings()),
        ("roads", street::roads()),
        ("trees", trees::trees()),
        ("cars", cars::cars()),
        ("sky", sky::sky()),
    ] {
        let text = text::write(&document).expect("generated numbers are finite");
        let path = folder.join(format!("{name}.ron"));
        std::fs::write(&path, &text).expect("the file can be written");
        println!("{} ({} bytes)", path.display(), text.len());
    }
}
