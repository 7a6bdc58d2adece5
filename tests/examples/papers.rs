//! The papers' figures at their own size, with as many faces and lines, and how long they took then and now: each by a
//! process that has computed nothing yet, from the files on.
//!
//! `cargo run --release -p spandrel-tests --example papers`

use spandrel_tests::papers::{FIGURES, faces};

fn main() {
    println!(
        "| figure | faces then | now | size | lines | then | now | ratio |\n|---|---|---|---|---|---|---|---|"
    );
    for figure in &FIGURES {
        // The last of three: files are in the system's cache.
        let runs = [0, 1, 2].map(|_| figure.compute(None));
        let seconds = runs.iter().map(|(_, seconds)| *seconds).fold(f64::INFINITY, f64::min);
        let then = figure.faces.map_or("not said".to_owned(), |count| count.to_string());
        let (width, height) = figure.size;
        println!(
            "| {} | {then} | {} | {width}x{height} | `{}` | {} s | {seconds:.2} s | {:.0} |",
            figure.name,
            faces(&runs[0].0),
            figure.lines,
            if figure.seconds < 1.0 {
                format!("{:.2}", figure.seconds)
            } else {
                format!("{:.0}", figure.seconds)
            },
            figure.seconds / seconds
        );
    }
}
