//! Spans against rays: an independent program that knows nothing of planes over the screen, clipping
//! or lines sees the same face at every point that is not a hair's breadth from an edge.

use glam::{DVec2, DVec3};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::raster::{LinePlan, Phase, Raster};
use spandrel_engine::render::scanline;
use spandrel_engine::scene::Mesh;
use spandrel_engine::span::{FaceId, line};
use spandrel_tests::random::Random;
use spandrel_tests::scenes;

/// What a ray sees: the part's number, or none; and whether that is certain.
struct Sight {
    part: Option<u32>,
    certain: bool,
}

/// A part of a face: its number, and what bounds it.
struct Area {
    part: u32,
    inside: Vec<Vec<DVec3>>,
    outside: Vec<Vec<DVec3>>,
    rank: u32,
}

fn areas(mesh: &Mesh) -> Vec<Area> {
    let ring = |corners: &[u32]| -> Vec<DVec3> {
        corners.iter().map(|c| mesh.points[*c as usize]).collect()
    };
    let mut areas = Vec::new();
    let mut part = 0;
    for face in mesh.faces() {
        let outside: Vec<Vec<DVec3>> = face.holes.iter().map(|hole| ring(hole)).collect();
        let outline = ring(&face.outline);
        areas.push(Area { part, inside: vec![outline.clone()], outside: outside.clone(), rank: 0 });
        part += 1;
        for (i, seal) in face.seals.iter().enumerate() {
            let inside = vec![outline.clone(), ring(&seal.outline)];
            areas.push(Area { part, inside, outside: outside.clone(), rank: i as u32 + 1 });
            part += 1;
        }
    }
    areas
}

/// Even-odd in the plane's dominant projection, and the distance to the nearest edge.
fn contains(ring: &[DVec3], normal: DVec3, p: DVec3) -> (bool, f64) {
    let n = normal.abs();
    let flat = |v: DVec3| {
        if n.x >= n.y && n.x >= n.z {
            DVec2::new(v.y, v.z)
        } else if n.y >= n.z {
            DVec2::new(v.x, v.z)
        } else {
            DVec2::new(v.x, v.y)
        }
    };
    let p = flat(p);
    let mut inside = false;
    let mut nearest = f64::INFINITY;
    for i in 0..ring.len() {
        let (a, b) = (flat(ring[i]), flat(ring[(i + 1) % ring.len()]));
        if (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        nearest = nearest.min((a + (b - a) * t - p).length());
    }
    (inside, nearest)
}

fn look(areas: &[Area], origin: DVec3, direction: DVec3, limits: (f64, f64)) -> Sight {
    let mut hits: Vec<(f64, u32, u32)> = Vec::new();
    let mut certain = true;
    for area in areas {
        let outline = &area.inside[0];
        let normal = (outline[1] - outline[0]).cross(outline[2] - outline[0]).normalize();
        let along = normal.dot(direction);
        let t = normal.dot(outline[0] - origin) / along;
        if along.abs() < 1e-9 || !t.is_finite() {
            continue;
        }
        let p = origin + direction * t;
        let tolerance = 1e-7 * (1.0 + t.abs()) / along.abs();
        let mut covered = true;
        let mut near_edge = false;
        for (ring, keep) in area
            .inside
            .iter()
            .map(|ring| (ring, true))
            .chain(area.outside.iter().map(|ring| (ring, false)))
        {
            let (inside, distance) = contains(ring, normal, p);
            covered &= inside == keep;
            near_edge |= distance < tolerance;
        }
        let near_limit = (t - limits.0).abs() < 1e-6 || (t - limits.1).abs() < 1e-6;
        if near_edge || (near_limit && covered) {
            certain = false;
        } else if covered && t > limits.0 && t < limits.1 {
            hits.push((t, area.rank, area.part));
        }
    }
    // The nearest; among equals the greater rank, then the later.
    hits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(first) = hits.first().copied() else { return Sight { part: None, certain } };
    let equal = |hit: &&(f64, u32, u32)| hit.0 - first.0 <= 1e-7 * (1.0 + first.0.abs());
    let best = hits.iter().filter(equal).max_by_key(|hit| (hit.1, hit.2));
    // Faces that nearly coincide but are no copies of each other may differ by rounding.
    let close = hits.iter().filter(equal).count();
    Sight { part: best.map(|hit| hit.2), certain: certain && close == 1 }
}

fn compare(seed: u64, camera: Camera) -> (usize, usize) {
    let mesh = scenes::random_faces(seed, 30);
    let areas = areas(&mesh);
    let scene = scenes::scene("faces", mesh);
    let view = View::new(&camera, Raster::new(64, 48).unwrap()).unwrap();
    let plan = LinePlan::new(2, Phase::Centre).unwrap();
    let image = scanline::render(&[scene.into()], &view, plan, 0..48).unwrap();
    let raster = view.raster();
    let mut random = Random::new(seed);
    let (mut asked, mut wrong) = (0, 0);
    for _ in 0..400 {
        let k = random.below(96);
        let cell = random.below(raster.cells());
        let (x, y) = (raster.pixels(cell) + 0.5 / raster.cells_per_pixel(), plan.y(k));
        let mut seen = line::segments(image.lines().line(k), raster.cells());
        let face = seen.find(|(range, _)| range.contains(&cell)).unwrap().1;
        let spans = (face != FaceId::NONE).then(|| image.face(face).1.ordinal);
        // The ray through (x, y), from two points on it.
        let (p, q) =
            (view.world_point(x, y, view.depth(1.0)), view.world_point(x, y, view.depth(2.0)));
        let (origin, direction) = (p - (q - p), q - p);
        let limits = (camera.front, camera.back.unwrap_or(f64::INFINITY));
        let sight = look(&areas, origin, direction, limits);
        if sight.certain {
            asked += 1;
            wrong += usize::from(sight.part != spans);
        }
    }
    (asked, wrong)
}

#[test]
fn every_camera_sees_by_spans_what_it_sees_by_rays() {
    let perspective = Camera::default();
    let parallel = Camera { parallel_height: Some(7.0), ..perspective.clone() };
    // In the midst of the faces: many reach behind the eye.
    let inside = Camera {
        position: DVec3::new(0.3, 0.2, 1.0),
        look_at: DVec3::new(0.0, -0.3, -2.0),
        field_of_view: 100.0,
        roll: 33.0,
        ..Camera::default()
    };
    let limited = Camera { front: 6.0, back: Some(12.0), ..perspective.clone() };
    let (mut asked, mut wrong) = (0, 0);
    for (i, camera) in [perspective, parallel, inside, limited].into_iter().enumerate() {
        for seed in 0..25 {
            let (a, w) = compare(seed + 1000 * i as u64, camera.clone());
            assert_eq!(w, 0, "camera {i}, seed {seed}: {w} of {a} points differ");
            (asked, wrong) = (asked + a, wrong + w);
        }
    }
    assert!(asked > 20_000, "only {asked} points were certain");
    assert_eq!(wrong, 0);
}
