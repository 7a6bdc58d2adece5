//! Shapes whose picture is known in closed form, and how far a rule is from it.

use glam::DVec3;
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Cover, Coverage, Framing, PixelFilter, Rule};
use spandrel_engine::scene::{Face, Mesh, Scene, Seal};
use spandrel_engine::span::SpanImage;
use spandrel_engine::visible::probe::FaceIndex;
use std::sync::Arc;

use crate::scenes;

/// Width and height of the pictures in pixels.
pub const SIZE: u32 = 40;

/// A convex polygon on the screen, in pixels from the lower left.
pub type Polygon = Vec<(f64, f64)>;

/// A scene with what is seen of it.
#[derive(Clone, Debug)]
pub struct Known {
    /// What it is.
    pub name: String,
    /// The scene, seen by [`scenes::pixel_view`] at [`SIZE`].
    pub scene: Arc<Scene>,
    /// For each part of the scene, what is seen of it: convex polygons to add and to take away.
    pub seen: Vec<Vec<(f64, Polygon)>>,
}

/// How far coverage is from the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Root of the mean square, over pixels on an edge.
    pub rmse: f64,
    /// The greatest of all pixels.
    pub most: f64,
    /// Of the whole area of one part, in pixels, the greatest of all parts.
    pub area: f64,
}

/// A half plane left of a line through the middle, with `slope` pixels in x for one in y; horizontal if
/// the slope is infinite. It is moved by a part of a pixel.
pub fn half_plane(slope: f64, offset: (f64, f64)) -> Known {
    let c = f64::from(SIZE) / 2.0;
    let (x, y) = (c + offset.0, c + offset.1);
    let far = 2.0 * c;
    let polygon = if slope.is_infinite() {
        vec![(-far, y - 3.0 * far), (3.0 * far, y - 3.0 * far), (3.0 * far, y), (-far, y)]
    } else {
        // Far above and below the picture, and to its left.
        let at = |dy: f64| (x + slope * dy, y + dy);
        let (low, high) = (at(-2.0 * far), at(2.0 * far));
        let left = low.0.min(high.0).min(0.0) - far;
        vec![(left, low.1), low, high, (left, high.1)]
    };
    let name = match slope {
        s if s.is_infinite() => "half plane, horizontal".to_owned(),
        0.0 => "half plane, vertical".to_owned(),
        s => format!("half plane, dx/dy {s}"),
    };
    flat(&name, polygon)
}

/// A square standing on a corner.
pub fn rotated_square(offset: (f64, f64)) -> Known {
    let (x, y) = (20.0 + offset.0, 20.0 + offset.1);
    let r = 15.3;
    flat("rotated square", vec![(x, y - r), (x + r, y), (x, y + r), (x - r, y)])
}

/// A leaning square with a hole.
pub fn hole(offset: (f64, f64)) -> Known {
    let (outline, hole) = (square(14.0, 0.3, offset), square(7.0, -0.5, offset));
    let mut mesh = Mesh::default();
    let [outer, inner] = [&outline, &hole].map(|ring| add(&mut mesh, ring, 0.0));
    let face = Face { outline: outer, holes: vec![inner], ..Face::default() };
    mesh.add_face(face).expect("a sound face");
    known("square with a hole", mesh, vec![vec![(1.0, outline), (-1.0, hole)]])
}

/// A leaning square with a seal.
pub fn seal(offset: (f64, f64)) -> Known {
    let (outline, seal) = (square(14.0, 0.3, offset), square(7.0, -0.5, offset));
    let mut mesh = Mesh::default();
    let [outer, inner] = [&outline, &seal].map(|ring| add(&mut mesh, ring, 0.0));
    let seals = vec![Seal { outline: inner, ..Seal::default() }];
    mesh.add_face(Face { outline: outer, seals, ..Face::default() }).expect("a sound face");
    let wall = vec![(1.0, outline), (-1.0, seal.clone())];
    known("square with a seal", mesh, vec![wall, vec![(1.0, seal)]])
}

/// Two planes that cross at a line which leans by 0.3 pixels a row.
pub fn crossing_planes(offset: (f64, f64)) -> Known {
    let (x, y) = (20.0 + offset.0, 20.0 + offset.1);
    let corners = [(-9.0, -9.0), (69.0, -9.0), (69.0, 69.0), (-9.0, 69.0)];
    let rise = |p: &(f64, f64)| DVec3::new(p.0, p.1, p.0 - x - 0.3 * (p.1 - y));
    let level = corners.iter().map(|p| DVec3::new(p.0, p.1, 0.0)).collect();
    let rising = corners.iter().map(rise).collect();
    let at = |py: f64| (x + 0.3 * (py - y), py);
    let (low, high) = (at(-9.0), at(69.0));
    let left = vec![(-9.0, -9.0), low, high, (-9.0, 69.0)];
    let right = vec![low, (69.0, -9.0), (69.0, 69.0), high];
    let seen = vec![vec![(1.0, left)], vec![(1.0, right)]];
    known("two crossing planes", scenes::polygons(&[level, rising]), seen)
}

/// Three bars, each over the next at one end and under the one before at the other: a circle that no
/// sorting of whole faces solves.
pub fn three_bars(offset: (f64, f64)) -> Known {
    let corners = [(-16.0, -9.0, 1.0), (16.0, -9.0, -1.0), (16.0, -5.0, -1.0), (-16.0, -5.0, 1.0)];
    let bar = |i: u32| -> Vec<DVec3> {
        let angle = f64::from(i) * std::f64::consts::TAU / 3.0;
        let (s, c) = (spandrel_engine::math::sin(angle), spandrel_engine::math::cos(angle));
        let turn = |(x, y, z): (f64, f64, f64)| {
            let (u, v) = (x * c - y * s, x * s + y * c);
            DVec3::new(20.0 + offset.0 + u, 20.0 + offset.1 + v, z)
        };
        corners.map(turn).to_vec()
    };
    let polygons: Vec<Vec<DVec3>> = (0..3).map(bar).collect();
    let screen: Vec<Polygon> =
        polygons.iter().map(|bar| bar.iter().map(|p| (p.x, p.y)).collect()).collect();
    // A bar is near at its beginning, where the one before ends: the latter is hidden there.
    let part = |i: usize| {
        let over = clip_to(&screen[i], &screen[(i + 1) % 3]);
        vec![(1.0, screen[i].clone()), (-1.0, over)]
    };
    let seen = (0..3).map(part).collect();
    known("three bars in a circle", scenes::polygons(&polygons), seen)
}

/// The errors of a rule over shapes.
pub fn errors(shapes: &[Known], rule: Rule) -> Errors {
    let mut total = Errors::default();
    let (mut squares, mut count) = (0.0, 0u32);
    for shape in shapes {
        for part in differences(shape, rule) {
            for (truth, error) in &part {
                total.most = total.most.max(error.abs());
                let on_edge = *truth > 1e-9 && *truth < 1.0 - 1e-9;
                if on_edge {
                    squares += error * error;
                    count += 1;
                }
            }
            total.area = total.area.max(part.iter().map(|(_, error)| error).sum::<f64>().abs());
        }
    }
    total.rmse = (squares / f64::from(count.max(1))).sqrt();
    total
}

/// The greatest error of any part in every pixel, in rows from the top.
pub fn worst(shape: &Known, rule: Rule) -> Vec<f64> {
    let mut worst = vec![0.0f64; (SIZE * SIZE) as usize];
    for part in differences(shape, rule) {
        for (worst, (_, error)) in worst.iter_mut().zip(part) {
            *worst = worst.max(error.abs());
        }
    }
    worst
}

/// By part and pixel, the true share and the error.
fn differences(shape: &Known, rule: Rule) -> Vec<Vec<(f64, f64)>> {
    let found = coverage(&shape.scene, rule, PixelFilter::Box);
    let part = |(seen, found): (&Vec<(f64, Polygon)>, Vec<f64>)| {
        let pixel = |(i, found): (usize, f64)| {
            let (x, row) = (i as u32 % SIZE, i as u32 / SIZE);
            let pixel = (f64::from(x), f64::from(SIZE - 1 - row));
            let truth: f64 = seen.iter().map(|(sign, ring)| sign * inside(ring, pixel, 1.0)).sum();
            (truth, found - truth)
        };
        found.into_iter().enumerate().map(pixel).collect()
    };
    shape.seen.iter().zip(found).map(part).collect()
}

/// The covers of an image, row by row.
pub fn covers(image: &SpanImage, rule: Rule, framing: &Framing) -> Vec<Vec<Cover>> {
    let index = rule.tolerance().map(|_| FaceIndex::new(image));
    let mut coverage = Coverage::new(image, rule, framing, index.as_ref());
    let row = |row| {
        let mut out = Vec::new();
        coverage.row(row, &mut out);
        out
    };
    framing.rows.clone().map(row).collect()
}

/// The share that each part of a scene has in the pixels of a picture of [`SIZE`], in rows from the top.
pub fn coverage(scene: &Arc<Scene>, rule: Rule, filter: PixelFilter) -> Vec<Vec<f64>> {
    let view = scenes::pixel_view(SIZE, SIZE);
    let plan = rule.plan().expect("rules of tests are in range");
    let clusters = &[scene.clone().into()];
    let image = scanline::render(clusters, &view, plan, 0..SIZE).expect("a small picture");
    let framing = Framing { filter, ..Framing::whole(view.raster()) };
    let mut parts = vec![vec![0.0; (SIZE * SIZE) as usize]; scene.part_count() as usize];
    for (row, covers) in covers(&image, rule, &framing).into_iter().enumerate() {
        for cover in covers.iter().filter(|cover| cover.face.is_some()) {
            let part = &mut parts[image.face(cover.face).1.ordinal as usize];
            for pixel in cover.start..cover.end {
                part[row * SIZE as usize + pixel as usize] += f64::from(cover.area);
            }
        }
    }
    parts
}

fn known(name: &str, mesh: Mesh, seen: Vec<Vec<(f64, Polygon)>>) -> Known {
    Known { name: name.to_owned(), scene: scenes::scene(name, mesh), seen }
}

fn flat(name: &str, polygon: Polygon) -> Known {
    let points = polygon.iter().map(|p| DVec3::new(p.0, p.1, 0.0)).collect();
    known(name, scenes::polygons(&[points]), vec![vec![(1.0, polygon)]])
}

fn add(mesh: &mut Mesh, ring: &Polygon, z: f64) -> Vec<u32> {
    ring.iter().map(|p| mesh.add_point(DVec3::new(p.0, p.1, z))).collect()
}

/// A square around the middle whose sides lean.
fn square(half: f64, lean: f64, offset: (f64, f64)) -> Polygon {
    let (u, v) = ((half, half * lean), (-half * lean, half));
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(a, b)| (20.0 + offset.0 + a * u.0 + b * v.0, 20.0 + offset.1 + a * u.1 + b * v.1))
        .to_vec()
}

/// The area of a polygon inside the square of `side` with the given lower left corner.
pub fn inside(ring: &Polygon, (x, y): (f64, f64), side: f64) -> f64 {
    let pixel = vec![(x, y), (x + side, y), (x + side, y + side), (x, y + side)];
    let (apart_x, apart_y) = (ring.iter().map(|p| p.0), ring.iter().map(|p| p.1));
    let beside = |low: f64, high: f64, at: f64| high <= at || low >= at + side;
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    };
    let (x_range, y_range) = (range(&mut apart_x.into_iter()), range(&mut apart_y.into_iter()));
    if beside(x_range.0, x_range.1, x) || beside(y_range.0, y_range.1, y) {
        return 0.0;
    }
    area(&clip_to(&pixel, ring)).abs()
}

/// The part of one convex polygon that lies in another, by Sutherland and Hodgman.
fn clip_to(subject: &Polygon, clip: &Polygon) -> Polygon {
    let turn = area(clip).signum();
    let mut rest = subject.clone();
    for (i, a) in clip.iter().enumerate() {
        let b = clip[(i + 1) % clip.len()];
        let side = |p: &(f64, f64)| turn * ((b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0));
        let mut kept = Vec::new();
        for (j, p) in rest.iter().enumerate() {
            let q = rest[(j + 1) % rest.len()];
            let (s, t) = (side(p), side(&q));
            if s >= 0.0 {
                kept.push(*p);
            }
            if (s >= 0.0) != (t >= 0.0) {
                let k = s / (s - t);
                kept.push((p.0 + k * (q.0 - p.0), p.1 + k * (q.1 - p.1)));
            }
        }
        rest = kept;
    }
    rest
}

/// The area of a polygon, positive if it runs counter-clockwise.
fn area(ring: &Polygon) -> f64 {
    let cross = |(i, p): (usize, &(f64, f64))| {
        let q = ring[(i + 1) % ring.len()];
        p.0 * q.1 - p.1 * q.0
    };
    ring.iter().enumerate().map(cross).sum::<f64>() / 2.0
}

/// Offsets of a part of a pixel, over which errors are taken: 16, spread evenly, none a simple fraction.
pub fn offsets() -> Vec<(f64, f64)> {
    // The sequence of the plastic number fills a square evenly.
    let at = |i: u32, step: f64| (f64::from(i) * step + 0.5).fract();
    (0..16).map(|i| (at(i, 0.754_877_666), at(i, 0.569_840_290))).collect()
}
