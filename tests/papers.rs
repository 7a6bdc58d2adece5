//! The papers' figures are what the papers say of them: faces, size, lines.

use spandrel_engine::image::Image;
use spandrel_tests::papers::{FIGURES, faces};

#[test]
fn figures_have_the_faces_the_size_and_the_lines_of_the_papers() {
    for figure in &FIGURES {
        let text = figure.text();
        let node = format!("\"{}\": Resolve(", figure.nodes[1]);
        let line = text.lines().find(|line| line.trim_start().starts_with(&node)).expect(&node);
        let (width, height) = figure.size;
        let says = format!("size: ({width}, {height}), lines: {}", figure.lines);
        assert!(line.contains(&says), "{}: {line}", figure.name);
        let (evaluated, _) = figure.compute(Some((40, 30)));
        let count = faces(&evaluated);
        if let Some(expected) = figure.faces {
            let off = count.abs_diff(u64::from(expected)) as f64 / f64::from(expected);
            assert!(off <= 0.1, "{}: {count} faces, not {expected}", figure.name);
        }
        assert_eq!(evaluated.value::<Image>(0).size, (40, 30));
    }
}
