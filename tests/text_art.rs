//! Lines as pictures: a sub-scanline in, a sub-scanline out. One letter is one pixel, `.` is background.
//! Capitals are translucent. \[N] figs. 5 and 6.

use spandrel_engine::camera::Plane;
use spandrel_engine::fragment::{Columns, Fragments, Surfaces};
use spandrel_engine::key::Key;
use spandrel_engine::raster::{LinePlan, Phase};
use spandrel_engine::span::{FaceHead, FaceId, Role, SpanImage, SpanWriter, layer, line};
use spandrel_tests::scenes;
use std::sync::Arc;

/// Surfaces that nobody looks at.
#[derive(Debug)]
struct Plain;

impl Surfaces for Plain {
    fn fill(&self, _: Columns, _: &mut Fragments<'_>) {}
    fn varying(&self, _: u32) -> Columns {
        Columns::NONE
    }
    fn object(&self, _: u32) -> String {
        String::new()
    }
}

/// A face: its letter, its depth at the left and the right end of the line, its rank.
type Depth = (char, f64, f64, u32);

/// Draws a line: every letter a segment of its face.
fn draw(art: &str, faces: &[Depth]) -> SpanImage {
    let width = art.len() as u32;
    let view = scenes::front_view(width, 1);
    let plan = LinePlan::new(1, Phase::Centre).unwrap();
    let mut writer = SpanWriter::new(view, plan, 0..1);
    for (ordinal, (letter, left, right, rank)) in faces.iter().enumerate() {
        let a = (right - left) / f64::from(width);
        let head = FaceHead {
            ordinal: ordinal as u32,
            plane: Plane { a, b: 0.0, c: *left },
            rank: *rank,
            role: Role::Face,
            sees_front: true,
            is_translucent: letter.is_uppercase(),
        };
        writer.face(head, &[]).unwrap();
    }
    for (x, letter) in art.chars().enumerate() {
        if let Some(face) = faces.iter().position(|face| face.0 == letter) {
            writer.segment(0, x as f64..x as f64 + 1.0, FaceId(face as u32)).unwrap();
        }
    }
    writer.finish("art", Key::default(), Arc::new(Plain)).unwrap()
}

/// The letter in the middle of every pixel.
fn show(image: &SpanImage, faces: &[Depth]) -> String {
    let raster = image.view().raster();
    let segments: Vec<_> = line::segments(image.lines().line(0), raster.cells()).collect();
    (0..raster.width)
        .map(|pixel| {
            let cell = raster.cell(f64::from(pixel) + 0.5);
            let (_, face) = segments.iter().find(|(range, _)| range.contains(&cell)).unwrap();
            if face.is_some() { faces[image.face(*face).1.ordinal as usize].0 } else { '.' }
        })
        .collect()
}

fn merge(a: &str, b: &str, faces: &[Depth]) -> String {
    let (a, b) = (draw(a, faces), draw(b, faces));
    let ab = SpanImage::merge(&[a.clone(), b.clone()]).unwrap();
    let ba = SpanImage::merge(&[b.clone(), a.clone()]).unwrap();
    assert!(ab == ba, "the order of inputs changed a bit");
    assert!(SpanImage::merge(&[ab.clone(), a]).unwrap() == ab, "merging again changed a bit");
    assert!(SpanImage::merge(&[ab.clone(), b]).unwrap() == ab, "merging again changed a bit");
    show(&ab, faces)
}

/// What is seen through what: a row for each layer, from front to back, and one for what is opaque.
fn merge_layers(a: &str, b: &str, faces: &[Depth]) -> Vec<String> {
    let opaque = merge(a, b, faces);
    let image = SpanImage::merge(&[draw(a, faces), draw(b, faces)]).unwrap();
    let (raster, y) = (image.view().raster(), image.plan().y(0));
    let mut rows: Vec<Vec<char>> = Vec::new();
    let each = |stack: layer::Stack| {
        let pixels =
            (0..raster.width).filter(|x| stack.cells.contains(&raster.cell(f64::from(*x) + 0.5)));
        for pixel in pixels {
            for (i, face) in stack.layers.iter().enumerate() {
                rows.resize_with(rows.len().max(i + 1), || vec!['.'; raster.width as usize]);
                rows[i][pixel as usize] = faces[image.face(*face).1.ordinal as usize].0;
            }
        }
    };
    let (spans, segments) = (image.lines().line(0), image.layers().line(0));
    layer::stacks(spans, segments, raster.cells(), |face| image.on_line(face, y), each);
    let layers = rows.into_iter().map(|row| row.into_iter().collect());
    layers.chain([opaque]).collect()
}

#[test]
fn translucent_spans_stay_before_what_they_do_not_hide() {
    // Fig. 6 (a) with layers: the nearer lets the farther through, the farther is hidden.
    let faces = [('P', 2.0, 2.0, 0), ('f', 1.0, 1.0, 0), ('B', 0.0, 0.0, 0)];
    assert_eq!(merge_layers("..PPPP....", "ffffffffff", &faces), ["..PPPP....", "ffffffffff"]);
    assert_eq!(merge_layers("BBBBBBBBBB", "...ffff...", &faces), ["BBB....BBB", "...ffff..."]);
    let both = merge_layers("PPPPPPP...", "..BBBBBBBB", &faces);
    assert_eq!(both, ["PPPPPPPBBB", "..BBBBB...", ".........."]);
}

#[test]
fn translucent_spans_change_order_where_their_planes_meet() {
    // Fig. 6 (b) with layers.
    let faces = [('U', 0.0, 2.0, 0), ('d', 2.0, 0.0, 0), ('D', 2.0, 0.0, 0)];
    assert_eq!(merge_layers("UUUUUUUUUU", "dddddddddd", &faces), [".....UUUUU", "dddddddddd"]);
    let crossing = merge_layers("UUUUUUUUUU", "DDDDDDDDDD", &faces);
    assert_eq!(crossing, ["DDDDDUUUUU", "UUUUUDDDDD", ".........."]);
}

#[test]
fn coincident_translucent_spans_lie_in_order_of_rank_and_face() {
    // Fig. 6 (c) with layers.
    let faces = [('P', 1.0, 1.0, 0), ('a', 1.0, 1.0, 0), ('Q', 1.0, 1.0, 0), ('S', 1.0, 1.0, 1)];
    assert_eq!(merge_layers("PPPPPP....", "..aaaaaa..", &faces), ["PP........", "..aaaaaa.."]);
    assert_eq!(merge_layers("QQQQQQ....", "..aaaaaa..", &faces), ["QQQQQQ....", "..aaaaaa.."]);
    let ranks = merge_layers("SSSSSS....", "..QQQQQQ..", &faces);
    assert_eq!(ranks, ["SSSSSSQQ..", "..QQQQ....", ".........."]);
}

#[test]
fn spans_that_do_not_cross_show_the_nearer() {
    // Fig. 6 (a). Greater depth is nearer.
    let faces = [('n', 2.0, 2.0, 0), ('f', 1.0, 1.0, 0)];
    assert_eq!(merge("..nnnnnn..", "ffffffffff", &faces), "ffnnnnnnff");
    assert_eq!(merge("nnnn......", "..ffffffff", &faces), "nnnnffffff");
    assert_eq!(merge("nn......nn", "....ff....", &faces), "nn..ff..nn");
}

#[test]
fn crossing_spans_split_where_their_planes_meet() {
    // Fig. 6 (b): equal in the middle.
    let faces = [('u', 0.0, 2.0, 0), ('d', 2.0, 0.0, 0)];
    assert_eq!(merge("uuuuuuuuuu", "dddddddddd", &faces), "ddddduuuuu");
    // Only where both are.
    assert_eq!(merge("uuuuuuuu..", ".ddddddddd", &faces), "udddduuudd");
}

#[test]
fn overlapping_spans_show_the_higher_rank_then_the_later_face() {
    // Fig. 6 (c).
    let faces = [('a', 1.0, 2.0, 0), ('b', 1.0, 2.0, 0), ('s', 1.0, 2.0, 1)];
    assert_eq!(merge("aaaaaaaa..", "..bbbbbbbb", &faces), "aabbbbbbbb");
    assert_eq!(merge("..ssss....", "bbbbbbbbbb", &faces), "bbssssbbbb");
}

#[test]
fn touching_at_an_end_is_not_crossing() {
    // Equal at the right end of the line, nowhere else.
    let faces = [('n', 2.0, 2.0, 0), ('f', 0.0, 2.0, 9)];
    assert_eq!(merge("nnnnnnnnnn", "ffffffffff", &faces), "nnnnnnnnnn");
    let image =
        SpanImage::merge(&[draw("nnnnnnnnnn", &faces), draw("ffffffffff", &faces)]).unwrap();
    assert_eq!(image.lines().line(0).len(), 1);
}

#[test]
fn a_line_has_one_form() {
    let faces = [('a', 1.0, 1.0, 0)];
    // Segments drawn pixel by pixel are one span; background is a span too.
    assert_eq!(draw("..aaaa..aa", &faces).lines().line(0).len(), 4);
    assert_eq!(draw("aaaaaaaaaa", &faces).lines().line(0).len(), 1);
    assert_eq!(draw("..........", &faces).lines().line(0).len(), 1);
}

#[test]
fn unequal_images_are_refused_and_named() {
    let faces = [('a', 1.0, 1.0, 0)];
    let message = |a: &SpanImage, b: &SpanImage| {
        SpanImage::merge(&[a.clone(), b.clone()]).unwrap_err().to_string()
    };
    let image = draw("aaaa", &faces);
    assert!(message(&image, &draw("aaaaa", &faces)).contains("raster"));
    let view = image.view().clone();
    let other = SpanImage::empty(view.clone(), LinePlan::new(2, Phase::Centre).unwrap(), 0..1);
    let said = message(&image, &other);
    assert!(said.contains("1 lines per row") && said.contains("2 lines per row"), "{said}");
    let empty = SpanImage::empty(view, image.plan(), 0..1);
    assert!(
        SpanImage::merge(&[image.clone(), empty]).unwrap() == image,
        "the empty image changes nothing"
    );
}
