//! What users of deep images do, on spans: laws of slices, crops, moves and holdouts.

use glam::{DVec2, DVec3};
use spandrel_engine::image::{Channel, Image, Window};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::scene::Mesh;
use spandrel_engine::shade::{PictureColors, PictureFrame};
use spandrel_engine::span::{DepthRange, Keep, SpanImage};
use spandrel_tests::scenes;
use std::collections::BTreeSet;
use std::sync::Arc;

const SIZE: (u32, u32) = (48, 36);
const RULE: Rule = Rule::Sampled(4, Weighting::Box);
const RULES: [Rule; 5] = [
    Rule::Sampled(4, Weighting::Trapezoid),
    Rule::Sampled(8, Weighting::Box),
    Rule::Sloped(8),
    Rule::Adaptive(4, 0.01),
    Rule::Exact,
];

fn render(label: &str, mesh: Mesh) -> SpanImage {
    render_for(label, mesh, RULE)
}

fn render_for(label: &str, mesh: Mesh, rule: Rule) -> SpanImage {
    let view = scenes::front_view(SIZE.0, SIZE.1);
    let clusters = &[scenes::scene(label, mesh).into()];
    scanline::render(clusters, &view, rule.plan().unwrap(), 0..SIZE.1).unwrap()
}

/// By pixel, red, green, blue and alpha of a window in the middle of an image shown at a scale.
fn shown(image: &SpanImage, rule: Rule, scale: f64) -> Vec<[f32; 4]> {
    let whole = Framing::scaled(image.view().raster(), DVec2::splat(scale)).unwrap();
    let size = (whole.columns.end.min(240), whole.rows.end.min(180));
    let at = |end: u32, side: u32| (end - side) / 2;
    let (x, y) = (at(whole.columns.end, size.0), at(whole.rows.end, size.1));
    let framing = whole.cut(Window { x, y, width: size.0, height: size.1 }).unwrap();
    let channels = BTreeSet::from([Channel::Color]);
    let picture = resolve(image, rule, &framing, &channels).unwrap();
    let pixels = (0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y)));
    pixels.map(|(x, y)| picture.rgba(x, y)).collect()
}

/// The root of the mean square, and the greatest, of how far pixels are apart.
fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> (f64, f64) {
    let each = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from((a - b).abs()));
    let (sum, worst) = each.fold((0.0, 0.0f64), |(sum, worst), d| (sum + d * d, worst.max(d)));
    ((sum / (a.len() * 4) as f64).sqrt(), worst)
}

fn sum(a: &[[f32; 4]], b: &[[f32; 4]]) -> Vec<[f32; 4]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect()
}

/// A wall that fills the view, and a triangle before it.
fn wall_and_triangle() -> (Mesh, Mesh) {
    let polygon = |corners: &[[f64; 3]]| {
        scenes::polygons(&[corners.iter().map(|p| DVec3::from_array(*p)).collect()])
    };
    let wall = [[-9.0, -9.0, -3.0], [9.0, -9.0, 1.0], [9.0, 9.0, 2.0], [-9.0, 9.0, -2.0]];
    (polygon(&wall), polygon(&[[-3.1, -2.3, 2.5], [3.3, -1.7, 2.5], [0.4, 2.7, 2.5]]))
}

#[test]
fn what_is_cut_away_leaves_its_edges_behind() {
    // Each boundary is there in several images; whatever happened to them, it lies where it lies.
    let (wall, triangle) = wall_and_triangle();
    for rule in RULES {
        let wall = render_for("wall", wall.clone(), rule);
        let triangle = render_for("triangle", triangle.clone(), rule);
        let depth = Some(wall.view().depth(9.3));
        let behind = DepthRange { front: Some(wall.view().depth(8.0)), back: None };
        for scale in [1.0, 3.0, 16.0, 64.0] {
            let shown = |image: &SpanImage| shown(image, rule, scale);
            let alone = |image: &SpanImage| -> Vec<[f32; 4]> {
                // All that is seen has the same colour.
                shown(image).iter().map(|p| [p[3]; 4]).collect()
            };
            let check = |what: &str, found: Vec<[f32; 4]>, expected: Vec<[f32; 4]>| {
                let (_, worst) = apart(&found, &expected);
                // Divided pixels are divided until they are right to a part in a hundred thousand.
                let bound = if rule == Rule::Exact { 1e-4 } else { 2e-6 };
                let bound = if matches!(rule, Rule::Adaptive(..)) { 0.04 } else { bound };
                assert!(worst < bound, "{rule:?} x {scale}, {what}: {worst}");
            };
            let [outside, inside] =
                [Keep::Outside, Keep::Inside].map(|keep| wall.held(&triangle, keep).unwrap());
            let holds: Vec<[f32; 4]> = shown(&triangle).iter().map(|p| [p[3]; 4]).collect();
            check("held in", alone(&inside), holds.clone());
            check("held out", sum(&alone(&outside), &holds), vec![[1.0; 4]; holds.len()]);
            // Once more, and through operations that come after.
            let again = SpanImage::merge(&[outside.clone(), triangle.clone()]).unwrap();
            let merged = SpanImage::merge(&[wall.clone(), triangle.clone()]).unwrap();
            check("held out, merged again", shown(&again), shown(&merged));
            let moved = |image: &SpanImage| image.moved(2.5, 8, 0..SIZE.1).unwrap();
            let both = SpanImage::merge(&[moved(&outside), moved(&triangle)]).unwrap();
            check("held out and moved", shown(&both), shown(&moved(&merged)));
            let crop = |image: &SpanImage| image.cropped(3.0..41.7, 2.0..30.0);
            let both = SpanImage::merge(&[crop(&outside), crop(&triangle)]).unwrap();
            check("held out and cropped", shown(&both), shown(&crop(&merged)));
            let deeper = |image: &SpanImage| image.with_depths(1.25, 0.01).unwrap();
            let both = SpanImage::merge(&[deeper(&outside), deeper(&triangle)]).unwrap();
            check("held out and brought nearer", shown(&both), shown(&deeper(&merged)));
            // A matte that is itself held out of another lets through what lies between.
            let left = wall.cropped(0.0..20.3, 0.0..36.0);
            let rest = triangle.held(&left.with_depths(2.0, 0.0).unwrap(), Keep::Outside).unwrap();
            let past = wall.held(&rest, Keep::Outside).unwrap();
            let holds: Vec<[f32; 4]> = shown(&rest).iter().map(|p| [p[3]; 4]).collect();
            check("twice", sum(&alone(&past), &holds), vec![[1.0; 4]; holds.len()]);
            // Slices: of a wall that leans, and of what a near face hid.
            let near = wall.sliced(DepthRange { front: None, back: depth });
            let far = wall.sliced(DepthRange { front: depth, back: None });
            check("slices", sum(&shown(&near), &shown(&far)), shown(&wall));
            check("what the front hid", shown(&merged.sliced(behind)), shown(&outside));
            let nearer = |image: &SpanImage| image.with_depths(1.1, 0.0).unwrap();
            let slices = sum(&shown(&nearer(&near)), &shown(&nearer(&far)));
            check("slices brought nearer", slices, shown(&wall));
        }
    }
}

#[test]
fn held_out_and_held_in_are_as_right_as_a_merge() {
    // Where many faces cross within a strip, a rule with slopes is off; no more so than in the merge, in which
    // every face that bounds another is seen.
    let scenes = |seed: u64, rule| {
        let image = render_for("image", scenes::random_faces(seed, 15), rule);
        (image, render_for("matte", scenes::random_faces(seed + 100, 12), rule))
    };
    let all = |seed: u64, rule: Rule, scale: f64| {
        let (image, matte) = scenes(seed, rule);
        let depth = Some(image.view().depth(9.0));
        let far = DepthRange { front: depth, back: None };
        let near = DepthRange { front: None, back: depth };
        let merged = SpanImage::merge(&[image.clone(), matte.clone()]).unwrap();
        let held = |keep| image.held(&matte, keep).unwrap();
        [
            merged.clone(),
            held(Keep::Outside),
            held(Keep::Inside),
            merged.sliced(near),
            merged.sliced(far),
        ]
        .map(|image| shown(&image, rule, scale))
    };
    for (rule, scale) in [(Rule::Sloped(8), 1.0), (Rule::Sloped(8), 4.0), (Rule::Sloped(3), 1.0)] {
        let mut errors = [0.0; 5];
        for seed in 0..4 {
            let found = all(seed, rule, scale).into_iter().zip(all(seed, Rule::Exact, scale));
            for (error, (found, right)) in errors.iter_mut().zip(found) {
                *error += apart(&found, &right).0.powi(2);
            }
        }
        let [merged, others @ ..] = errors;
        assert!(others.iter().all(|error| *error < 1.1 * merged), "{rule:?} x {scale}: {errors:?}");
    }
}

fn picture(image: &SpanImage) -> Image {
    let channels = BTreeSet::from([Channel::Color, Channel::Z, Channel::N]);
    resolve(image, RULE, &Framing::whole(image.view().raster()), &channels).unwrap()
}

/// Whether two images show the same, in every cell of every line.
fn shows(a: &SpanImage, b: &SpanImage) -> bool {
    a.lines() == b.lines() && a.layers() == b.layers()
}

#[test]
fn slices_of_depth_merge_to_the_whole() {
    for seed in 0..20 {
        let image = render("faces", scenes::random_panes(seed, 25));
        for distance in [4.0, 8.0, 11.0] {
            let depth = Some(image.view().depth(distance));
            let near = image.sliced(DepthRange { front: None, back: depth });
            let far = image.sliced(DepthRange { front: depth, back: None });
            let whole = SpanImage::merge(&[far.clone(), near.clone()]).unwrap();
            assert_eq!(whole.lines(), image.lines(), "seed {seed}");
            // What was clipped by the near part alone comes back where both are.
            assert_eq!(whole.layers(), image.layers(), "seed {seed}");
            let z = |image: &SpanImage| picture(image).float("Z").unwrap().to_vec();
            assert!(z(&far).iter().all(|z| f64::from(*z) >= distance * (1.0 - 1e-5)));
            let within = |z: &f32| z.is_infinite() || f64::from(*z) <= distance * (1.0 + 1e-5);
            assert!(z(&near).iter().all(within));
        }
    }
}

#[test]
fn crops_merge_to_the_whole() {
    for seed in 0..10 {
        let image = render("faces", scenes::random_panes(seed, 25));
        let parts: Vec<SpanImage> = [0.0, 17.3, 30.0]
            .into_iter()
            .zip([17.3, 30.0, 48.0])
            .flat_map(|(left, right)| {
                [image.cropped(left..right, 0.0..20.0), image.cropped(left..right, 20.0..36.0)]
            })
            .collect();
        assert!(shows(&SpanImage::merge(&parts).unwrap(), &image), "seed {seed}");
        assert!(
            image.cropped(60.0..90.0, 0.0..36.0).lines().items().iter().all(|s| !s.face.is_some())
        );
    }
}

#[test]
fn moved_images_show_the_moved_picture() {
    let image = render("ball", ball());
    let before = picture(&image);
    let after = picture(&image.moved(5.0, 3 * 4, 0..SIZE.1).unwrap());
    for y in 3..SIZE.1 {
        for x in 5..SIZE.0 {
            let (a, b) = (before.rgba(x - 5, y - 3), after.rgba(x, y));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5), "({x}, {y}): {a:?} {b:?}");
        }
    }
    // Normals are those of the surface, wherever it is shown.
    let at = |image: &Image, x: u32, y: u32| {
        ["N.X", "N.Y", "N.Z"].map(|c| image.float(c).unwrap()[(y * SIZE.0 + x) as usize])
    };
    let (a, b) = (at(&before, 20, 15), at(&after, 25, 18));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{a:?} {b:?}");
    assert!(a != [0.0, 0.0, 1.0]);
    let gone = image.moved(1e12, 0, 0..SIZE.1).unwrap();
    assert!(gone.lines().items().iter().all(|span| !span.face.is_some()));
}

/// A coarse ball with the normals of a fine one.
fn ball() -> Mesh {
    let mut mesh = Mesh::default();
    let point = |i: u32, j: u32| {
        let (u, v) = (f64::from(i) / 12.0, f64::from(j) / 6.0);
        let (u, v) = (u * std::f64::consts::TAU, (v - 0.5) * std::f64::consts::PI * 0.999);
        let (su, cu) = (spandrel_engine::math::sin(u), spandrel_engine::math::cos(u));
        let (sv, cv) = (spandrel_engine::math::sin(v), spandrel_engine::math::cos(v));
        DVec3::new(cu * cv, sv, su * cv) * 2.0
    };
    for j in 0..=6 {
        for i in 0..12 {
            let p = point(i, j);
            mesh.points.push(p);
            mesh.normals.push(p.normalize().as_vec3());
        }
    }
    for j in 0..6 {
        for i in 0..12 {
            let at = |i: u32, j: u32| j * 12 + i % 12;
            for ring in [
                [at(i, j), at(i, j + 1), at(i + 1, j)],
                [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)],
            ] {
                mesh.add_polygon(&ring, None).unwrap();
            }
        }
    }
    mesh
}

#[test]
fn depths_are_scaled_and_moved_as_said() {
    let wall = |z: f64| {
        let corner = |x: f64, y: f64| DVec3::new(x, y, z);
        let ring = [corner(-9.0, -9.0), corner(9.0, -9.0), corner(9.0, 9.0), corner(-9.0, 9.0)];
        render(&format!("wall {z}"), scenes::polygons(&[ring.to_vec()]))
    };
    let z = |image: &SpanImage| f64::from(picture(image).float("Z").unwrap()[500]);
    // The camera stands at z = 10.
    let (near, far) = (wall(2.0), wall(0.0));
    assert!((z(&far.with_depths(2.0, 0.0).unwrap()) - 5.0).abs() < 1e-6);
    assert!((z(&far.with_depths(1.0, 0.1).unwrap()) - 5.0).abs() < 1e-6);
    let both = SpanImage::merge(&[near.clone(), far.with_depths(2.0, 0.0).unwrap()]).unwrap();
    assert!((z(&both) - 5.0).abs() < 1e-6);
    // Beyond infinity nothing is seen.
    assert!(z(&far.with_depths(1.0, -0.2).unwrap()).is_infinite());
    assert!(far.with_depths(0.0, 0.0).is_err() && far.with_depths(1.0, f64::NAN).is_err());
}

#[test]
fn what_is_held_out_and_what_is_held_in_add_up() {
    for seed in 0..20 {
        let image = render("image", scenes::random_faces(seed, 15));
        let matte = render("matte", scenes::random_panes(seed + 100, 12));
        let whole = picture(&image);
        let outside = picture(&image.held(&matte, Keep::Outside).unwrap());
        let inside = picture(&image.held(&matte, Keep::Inside).unwrap());
        for (x, y) in (0..SIZE.0).flat_map(|x| (0..SIZE.1).map(move |y| (x, y))) {
            let [w, o, i] = [&whole, &outside, &inside].map(|picture| picture.rgba(x, y));
            for c in 0..4 {
                assert!((o[c] + i[c] - w[c]).abs() < 1e-5, "{seed} ({x}, {y}): {o:?} {i:?} {w:?}");
            }
        }
    }
}

#[test]
fn an_opaque_holdout_is_the_merge_without_its_matte() {
    for seed in 0..20 {
        let image = render("image", scenes::random_faces(seed, 15));
        let matte = render("matte", scenes::random_faces(seed + 100, 12));
        let held = image.held(&matte, Keep::Outside).unwrap();
        let again = SpanImage::merge(&[held.clone(), matte.clone()]).unwrap();
        let merged = SpanImage::merge(&[image, matte]).unwrap();
        let (a, b) = (picture(&again), picture(&merged));
        for name in ["R", "G", "B", "A", "Z"] {
            assert_eq!(a.float(name), b.float(name), "seed {seed} {name}");
        }
    }
}

#[test]
fn a_holdout_holds_out_nothing_that_comes_later() {
    // A wall held out by a pane: half of it is left, and a wall behind shows through the other half;
    // the pane itself, merged from elsewhere, does not hold that one out.
    let mesh = |front: Option<u32>, z: f64| {
        let mut mesh = Mesh::default();
        mesh.materials = vec!["pane".into(), "tint".into()];
        let corners = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
        let ring: Vec<u32> = corners.map(|(x, y)| mesh.add_point(DVec3::new(x, y, z))).to_vec();
        mesh.add_polygon(&ring, front).unwrap();
        mesh
    };
    let (wall, pane) = (render("wall", mesh(None, 0.0)), render("pane", mesh(Some(0), 1.0)));
    let held = wall.held(&pane, Keep::Outside).unwrap();
    let rgba = |image: &SpanImage| picture(image).rgba(20, 20);
    let close = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6);
    assert!(close(rgba(&held), [0.4, 0.4, 0.4, 0.5]), "{:?}", rgba(&held));
    let behind = render("behind", mesh(None, -1.0));
    let both = SpanImage::merge(&[held, behind]).unwrap();
    assert!(close(rgba(&both), [0.8, 0.8, 0.8, 1.0]), "{:?}", rgba(&both));
}

#[test]
fn a_flat_picture_put_on_its_surfaces_comes_out_again() {
    for seed in 0..10 {
        let image = render("image", scenes::random_faces(seed, 15));
        // Anything with the alpha of the image: here, the image turned to other colours after resolving.
        let flat = picture(&image);
        let (width, height) = SIZE;
        let frame = PictureFrame { size: SIZE, corner: (0, 0), part: SIZE };
        let pixels: Vec<[f32; 4]> = (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| {
                let a = flat.rgba(x, y)[3];
                [a * 0.5, a * x as f32 / width as f32, a * (y % 5) as f32, a]
            })
            .collect();
        let colors = PictureColors::new(frame, pixels.iter().copied()).unwrap();
        let recolored = image.shaded(Arc::new(colors)).unwrap();
        let again = picture(&recolored);
        for (i, expected) in pixels.iter().enumerate() {
            let found = again.rgba(i as u32 % width, i as u32 / width);
            let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
            assert!(
                apart.fold(0.0, f32::max) < 1e-5,
                "seed {seed} pixel {i}: {found:?} {expected:?}"
            );
        }
        // The colours go with the surfaces: what is merged before them hides them.
        let wall = render("wall", scenes::random_faces(seed + 50, 3));
        let merged = picture(&SpanImage::merge(&[recolored, wall.clone()]).unwrap());
        let alone = picture(&SpanImage::merge(&[image, wall]).unwrap());
        let mut alphas = merged.float("A").unwrap().iter().zip(alone.float("A").unwrap());
        assert!(alphas.all(|(a, b)| (a - b).abs() < 1e-6), "seed {seed}");
        assert_eq!(merged.float("Z"), alone.float("Z"));
    }
}
