//! A part of a picture is that part of the picture: tiles that a farm renders, joined, are the whole, bit for bit.

use spandrel_engine::image::Window;
use spandrel_tests::graphs::Nodes;
use spandrel_tests::program::Scratch;
use spandrel_tests::random::Random;

const SIZE: (u32, u32) = (54, 36);

const SCENE: &str = r#"Scene(version: 1,
    materials: {
        "matt": (color: (0.8, 0.3, 0.1)),
        "glass": (color: (0.1, 0.5, 0.9), alpha: 0.6, alpha_mode: Blend),
        "floor": (color: 0.7, finish: (gloss: Phong(share: 0.3, exponent: 20))),
    },
    plans: [(name: "p", root: (children: [
        (name: "a", material: "matt", transform: [TurnY(30)], shape: Box(size: (1, 1, 1))),
        (name: "b", material: "glass", transform: [Move(0.6, 0, 0.4)], shape: Sphere(radius: 0.6)),
        (name: "f", material: "floor", shape: Polygon(outline: [(-9, 0, 9), (9, 0, 9), (9, 0, -9), (-9, 0, -9)])),
    ]))])"#;

/// The nodes up to what is lit.
fn lit(shadows: &str) -> String {
    format!(
        r#""eye": Camera(position: (1, 1.5, 4), look_at: (0, 0.4, 0)),
        "s": Scanline(scene: "s.ron", camera: "eye"),
        "sun": ParallelLight(direction: (-0.5, -0.8, -0.4), illuminance: 0.9),
        "lamp": AreaLight(outline: [(-1, 3, -1), (1, 3, -1), (1, 3, 1), (-1, 3, 1)], luminance: 0.3, two_sided: true),
        "lit": Illuminate(image: "s", lights: ["sun", "lamp"], white: 1, shadows: {shadows}, samples: 3),"#
    )
}

/// Compares random parts of a picture with the whole.
fn parts_are_the_whole(
    what: &str,
    shadows: &str,
    resolve: &str,
    node: &str,
    scale: f64,
    random: &mut Random,
) {
    let folder = Scratch::new(&format!("parts-{}", random.below(1 << 30)));
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let (width, height) = SIZE;
    let nodes = format!(
        r#"{} "p": Resolve(image: "lit", size: ({width}, {height}){resolve}), "x": {node}"#,
        lit(shadows)
    );
    let nodes = Nodes::new(folder.path(), &nodes);
    let whole = nodes.picture("x", None).unwrap().image;
    let side = |pixels: u32| (f64::from(pixels) * scale).round() as u32;
    let (width, height) = (side(width), side(height));
    assert_eq!(whole.size, (width, height), "{what}");
    let cuts = |length: u32, random: &mut Random| {
        let mut cuts = vec![0, 1 + random.below(length - 1), length];
        cuts.dedup();
        cuts
    };
    let (columns, rows) = (cuts(width, random), cuts(height, random));
    for x in columns.windows(2) {
        for y in rows.windows(2) {
            let window = Window { x: x[0], y: y[0], width: x[1] - x[0], height: y[1] - y[0] };
            let part = nodes.picture("x", Some(window)).unwrap().image;
            assert_eq!(part.window, window, "{what}");
            for row in y[0]..y[1] {
                for column in x[0]..x[1] {
                    let (a, b) = (whole.rgba(column, row), part.rgba(column - x[0], row - y[0]));
                    assert_eq!(a, b, "{what}: pixel {column}, {row} of {window:?}");
                }
            }
        }
    }
}

#[test]
fn tiles_joined_are_the_whole_bit_for_bit() {
    let plain = r#"Grade(image: "p")"#;
    let cases: [(&str, &str, &str, &str, f64); 15] = [
        ("as it is", "Volumes", "", plain, 1.0),
        ("Lanczos", "Volumes", ", filter: Lanczos", plain, 1.0),
        ("Gaussian", "Analytic", ", filter: Gaussian", plain, 1.0),
        ("Adaptive", "Volumes", ", lines: Adaptive(4, 0.02)", plain, 1.0),
        ("Sampled", "Volumes", ", lines: Sampled(4, Trapezoid), vertical: Whole", plain, 1.0),
        ("larger", "Volumes", ", scale: (1.5, 1.5)", plain, 1.5),
        ("smaller", "Volumes", ", scale: (0.5, 0.5)", plain, 0.5),
        ("Face", "Volumes", ", shading: Face", plain, 1.0),
        ("Line", "Volumes", ", shading: Line, lines: Sloped(2)", plain, 1.0),
        ("Rays", "Rays(2)", "", plain, 1.0),
        ("Blur", "Off", "", r#"Blur(image: "p", radius: 0.05)"#, 1.0),
        ("Reformat", "Off", "", r#"Reformat(image: "p", turn: 20)"#, 1.0),
        ("own colours", "Off", "", r#"Quantize(image: "p", colors: 6, dither: Diffused)"#, 1.0),
        (
            "given colours",
            "Off",
            "",
            r##"Quantize(image: "p", palette: ["#000", "#842", "#26c", "#ccc"], dither: Ordered(0.5))"##,
            1.0,
        ),
        ("Segment", "Off", "", r#"Segment(image: "p", colors: 4)"#, 1.0),
    ];
    let mut random = Random::new(17);
    for (what, shadows, resolve, node, scale) in cases {
        parts_are_the_whole(what, shadows, resolve, node, scale, &mut random);
    }
}

#[test]
fn a_face_shaded_once_is_alike_in_every_part() {
    let folder = Scratch::new("a_face_shaded_once");
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let nodes =
        format!(r#"{} "p": Resolve(image: "lit", size: (54, 36), shading: Face)"#, lit("Off"));
    let nodes = Nodes::new(folder.path(), &nodes);
    // The floor at the lower edge, of which tiles see different pieces.
    let part = |x| {
        let window = Window { x, y: 32, width: 9, height: 4 };
        nodes.picture("p", Some(window)).unwrap().image.rgba(4, 2)
    };
    let first = part(0);
    assert!(first[0] > 0.0 && first[3] == 1.0, "{first:?}");
    assert!((9..45).step_by(9).all(|x| part(x) == first), "{first:?}");
}

#[test]
fn a_part_of_a_picture_that_could_not_be_computed_whole_is_computed() {
    let folder = Scratch::new("a_part_of_a_huge_picture");
    std::fs::write(folder.path().join("s.ron"), SCENE).unwrap();
    let nodes = format!(
        r#"{} "p": Resolve(image: "lit", size: (1600, 900), scale: (64, 64), lines: Sloped(2)),
        "q": Resolve(image: "lit", size: (1600, 900), lines: Sloped(2))"#,
        lit("Off")
    );
    let nodes = Nodes::new(folder.path(), &nodes);
    let window = Window { x: 51_200, y: 51_200, width: 100, height: 100 };
    let made = nodes.picture("p", Some(window)).unwrap().image;
    assert_eq!((made.size, made.window), ((102_400, 57_600), window));
    // It shows what the pixel of the picture at its own size shows there.
    let own = Window { x: 800, y: 800, width: 2, height: 2 };
    let (near, far) = (made.rgba(10, 10), nodes.picture("q", Some(own)).unwrap().image.rgba(0, 0));
    assert!(near[3] == 1.0 && near[0] > 0.0, "{near:?}");
    assert!(near.iter().zip(far).all(|(a, b)| (a - b).abs() < 0.01), "{near:?} {far:?}");
    // The whole is too large, and the error says so.
    let error = nodes.picture("p", None).unwrap_err();
    assert!(error.contains("in windows"), "{error}");
}
