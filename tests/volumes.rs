//! Volumes and their surfaces: closed forms, laws, formats, real files.

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::{DMat3, DVec3};
use spandrel_engine::math;
use spandrel_engine::scene::Mesh;
use spandrel_engine::volume::clip::clip;
use spandrel_engine::volume::decimate::decimate;
use spandrel_engine::volume::surface::{Level, Surface};
use spandrel_engine::volume::{Inside, Measure, Volume, isosurface, measure};
use spandrel_tests::data;
use spandrel_tests::program::Scratch;
use std::f64::consts::PI;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A field on a cube of points around the origin.
fn volume(count: usize, half: f64, field: impl Fn(DVec3) -> f64) -> Volume {
    let step = 2.0 * half / (count - 1) as f64;
    let steps = DMat3::from_diagonal(DVec3::splat(step));
    Volume::of([count; 3], DVec3::splat(-half), steps, |p| field(p) as f32).unwrap()
}

fn surface(volume: &Volume, level: f64) -> (Mesh, Measure) {
    let mesh = isosurface(volume, level, Inside::Above).unwrap();
    let measure = measure(&mesh);
    (mesh, measure)
}

fn torus(p: DVec3) -> f64 {
    2.0 - DVec3::new((p.x * p.x + p.y * p.y).sqrt() - 6.0, 0.0, p.z).length()
}

/// Whether two numbers differ by at most a share of the second.
fn near(found: f64, right: f64, share: f64) -> bool {
    (found / right - 1.0).abs() <= share
}

#[test]
fn analytic_fields_have_their_areas_volumes_and_euler_numbers() {
    let ball = |p: DVec3| 7.3 - p.length();
    let two = |p: DVec3| (2.4 - (p - 4.0).length()).max(2.4 - (p + 4.0).length());
    type Field<'f> = (&'f str, &'f dyn Fn(DVec3) -> f64, f64, [f64; 2], i64, usize);
    let fields: [Field<'_>; 3] = [
        ("ball", &ball, 7.3, [4.0 * PI * 7.3 * 7.3, 4.0 / 3.0 * PI * 7.3f64.powi(3)], 2, 1),
        ("torus", &torus, 2.0, [4.0 * PI * PI * 12.0, 2.0 * PI * PI * 24.0], 0, 1),
        ("two balls", &two, 2.4, [8.0 * PI * 2.4 * 2.4, 8.0 / 3.0 * PI * 2.4f64.powi(3)], 4, 2),
    ];
    for (name, field, radius, [area, held], euler, parts) in fields {
        let errors = [25, 49, 97].map(|count| {
            let (_, found) = surface(&volume(count, 9.0, field), 0.0);
            assert_eq!((found.open_edges, found.faulty_edges), (0, 0), "{name}");
            assert_eq!((found.euler, found.parts), (euler, parts), "{name}");
            [found.area / area - 1.0, found.volume / held - 1.0].map(f64::abs)
        });
        for kind in 0..2 {
            // With half the step a quarter of the error.
            let [coarse, middle, fine] = errors.map(|error| error[kind]);
            assert!(middle < coarse / 3.0 && fine < middle / 3.0, "{name} {kind}: {errors:?}");
            // Of the square of step by radius.
            let share = (18.0 / 96.0 / radius) * (18.0 / 96.0 / radius);
            assert!(fine < 0.6 * share, "{name} {kind}: {errors:?}");
        }
    }
}

/// The gyroid, by its own constant: 3.0914 times a side's area in a unit cell of the approximation by trigonometric
/// functions (3.0923 by quadrature of that approximation).
#[test]
fn a_gyroid_has_its_area_and_leaves_the_grid_open() {
    let gyroid = |p: DVec3| {
        let ([a, b, c], [d, e, f]) = (p.to_array().map(math::sin), p.to_array().map(math::cos));
        a * e + b * f + c * d
    };
    let (_, found) = surface(&volume(97, 2.0 * PI, gyroid), 0.0);
    let side = 16.0 * PI * PI;
    // Two cells along each axis: eight cells, each with its area.
    assert!(near(found.area / (2.0 * side), 3.0919, 2e-3), "{}", found.area / (2.0 * side));
    assert!(found.open_edges > 0 && found.faulty_edges == 0);
}

/// Normals point out, along the field's gradient, and faces turn with them, on mirrored and skewed grids too.
#[test]
fn faces_turn_outwards_on_any_grid() {
    let field = |p: DVec3| (4.0 - (p - DVec3::new(1.0, 0.5, 0.0)).length()) as f32;
    let skewed = DMat3::from_cols(
        DVec3::new(0.5, 0.0, 0.1),
        DVec3::new(0.2, 0.6, 0.0),
        DVec3::new(0.0, -0.1, 0.7),
    );
    let mirrored = DMat3::from_diagonal(DVec3::new(-0.5, 0.5, 0.5));
    for (steps, count) in [(skewed, 31), (mirrored, 31)] {
        let origin = -(steps * DVec3::splat((count - 1) as f64 / 2.0));
        let grid = Volume::of([count; 3], origin, steps, field).unwrap();
        for (level, inside, outwards) in [(0.0, Inside::Above, 1.0), (0.0, Inside::Below, -1.0)] {
            let mesh = isosurface(&grid, level, inside).unwrap();
            let found = measure(&mesh);
            assert!(near(found.volume, outwards * 4.0 / 3.0 * PI * 64.0, 0.03), "{found:?}");
            assert_eq!((found.open_edges, found.euler), (0, 2));
            for (point, normal) in mesh.points.iter().zip(&mesh.normals) {
                let right = outwards * (*point - DVec3::new(1.0, 0.5, 0.0)).normalize();
                assert!(right.dot(normal.as_dvec3()) > 0.99, "{point} {normal}");
            }
        }
    }
}

/// Whole numbers on whole levels, as scanners give them: the surface is closed, and every edge has two faces.
#[test]
fn samples_on_the_level_itself_leave_no_holes() {
    let field = |p: DVec3| (100.0 - p.length_squared()).round();
    for level in [0.0, 19.0, 36.0, 51.0, 84.0, 100.0] {
        let (_, found) = surface(&volume(25, 12.0, field), level);
        assert_eq!((found.open_edges, found.faulty_edges, found.euler), (0, 0, 2), "{level}");
        assert!(found.volume > 0.0 && found.parts == 1, "{level}: {found:?}");
    }
    // What does not reach a level has no surface, and what is flat has none at its own value.
    assert_eq!(surface(&volume(25, 12.0, field), 100.5).1.triangles, 0);
    assert_eq!(surface(&volume(5, 1.0, |_| 3.0), 3.0).1.triangles, 0);
}

/// Noise is the worst that a surface can have: every cell is cut somehow.
#[test]
fn noise_has_a_closed_surface() {
    let mut random = spandrel_tests::random::Random::new(7);
    let samples: Vec<f32> = (0..20 * 21 * 22)
        .map(|at| {
            let [x, y, z] = [at % 20, at / 20 % 21, at / 420];
            let is_border = x == 0 || y == 0 || z == 0 || x == 19 || y == 20 || z == 21;
            if is_border { 0.0 } else { (8.0 * random.unit()).floor() as f32 }
        })
        .collect();
    let grid = Volume::new([20, 21, 22], DVec3::ZERO, DMat3::IDENTITY, samples.clone()).unwrap();
    for level in [1.0, 3.5, 4.0, 7.0] {
        let (_, found) = surface(&grid, level);
        assert_eq!((found.open_edges, found.faulty_edges), (0, 0), "{level}");
        assert!(found.triangles > 1000, "{level}");
    }
    // Samples that are no numbers leave holes, infinite ones do not.
    let with = |value: f32| {
        let mut samples = samples.clone();
        for (at, sample) in samples.iter_mut().enumerate() {
            // Not at the border, where a surface is open anyway.
            if at % 97 == 50 && *sample > 0.0 {
                *sample = value;
            }
        }
        Volume::new([20, 21, 22], DVec3::ZERO, DMat3::IDENTITY, samples).unwrap()
    };
    let (mesh, found) = surface(&with(f32::NAN), 3.5);
    assert!(found.open_edges > 0 && found.faulty_edges == 0);
    assert!(mesh.validate().is_ok());
    let (mesh, found) = surface(&with(f32::INFINITY), 3.5);
    assert_eq!((found.open_edges, found.faulty_edges), (0, 0));
    assert!(mesh.validate().is_ok());
}

/// How far a point lies from a mesh of triangles, found in another way than decimation does.
fn distance(mesh: &Mesh, point: DVec3) -> f64 {
    let to_face = |face: usize| {
        let [a, b, c] = [0, 1, 2].map(|i| mesh.points[mesh.outline(face)[i] as usize]);
        // Walk to the nearest point by projecting on the plane, then clamping to the edges.
        let (u, v) = (b - a, c - a);
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let (pu, pv) = ((point - a).dot(u), (point - a).dot(v));
        let det = uu * vv - uv * uv;
        let (s, t) = ((vv * pu - uv * pv) / det, (uu * pv - uv * pu) / det);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return (a + u * s + v * t).distance(point);
        }
        let edges = [(a, b), (b, c), (c, a)].map(|(p, q): (DVec3, DVec3)| {
            let share = ((point - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            p.lerp(q, share).distance(point)
        });
        edges.into_iter().fold(f64::INFINITY, f64::min)
    };
    (0..mesh.face_count()).map(to_face).fold(f64::INFINITY, f64::min)
}

#[test]
fn decimation_keeps_its_promise() {
    for (field, euler) in
        [(&(|p: DVec3| 7.3 - p.length()) as &dyn Fn(DVec3) -> f64, 2), (&torus, 0)]
    {
        let (whole, before) = surface(&volume(25, 9.0, field), 0.0);
        let mut last = before.triangles;
        for error in [0.02, 0.1, 0.4] {
            let few = decimate(&whole, error).unwrap();
            let after = measure(&few);
            assert_eq!((after.open_edges, after.faulty_edges, after.euler), (0, 0, euler));
            assert!(after.triangles < last, "{error}: {} of {last}", after.triangles);
            last = after.triangles;
            let furthest = whole.points.iter().map(|p| distance(&few, *p)).fold(0.0, f64::max);
            assert!(furthest <= error, "{error}: {furthest}");
            assert!(near(after.area, before.area, 2.0 * error / 2.0), "{error}");
            // What is left are vertices of the first, with their normals.
            for (point, normal) in few.points.iter().zip(&few.normals) {
                let at = whole.points.iter().position(|p| p == point).unwrap();
                assert_eq!(whole.normals[at], *normal);
            }
        }
        assert!(last * 8 < before.triangles, "{last} of {}", before.triangles);
    }
    let (whole, _) = surface(&volume(9, 9.0, torus), 0.0);
    assert!(decimate(&whole, 0.0).is_err());
    assert!(decimate(&whole, f64::NAN).is_err());
}

#[test]
fn planes_cut_surfaces_open() {
    let (ball, whole) = surface(&volume(49, 9.0, |p| 7.3 - p.length()), 0.0);
    for direction in [DVec3::X, DVec3::new(1.0, 2.0, -0.7)] {
        let half = clip(&ball, DVec3::ZERO, direction).unwrap();
        let found = measure(&half);
        assert!(near(found.area, whole.area / 2.0, 2e-3), "{found:?}");
        // A disc: one part, one border.
        assert_eq!((found.euler, found.parts, found.faulty_edges), (1, 1, 0));
        assert!(found.open_edges > 50);
        assert!(half.points.iter().all(|p| p.dot(direction) <= 1e-9));
        assert!(half.normals.iter().zip(&half.points).all(|(n, p)| n.as_dvec3().dot(*p) > 6.0));
    }
    // Away from it nothing changes, and behind it nothing is left.
    assert_eq!(clip(&ball, DVec3::X * 8.0, DVec3::X).unwrap(), ball);
    assert_eq!(clip(&ball, DVec3::X * 8.0, -DVec3::X).unwrap().face_count(), 0);
    // A box that holds an eighth.
    let grid = volume(49, 9.0, |p| 7.3 - p.length());
    let level = Level::new(0.0, Inside::Above, "()").unwrap();
    let within = Some([DVec3::ZERO, DVec3::splat(9.0)]);
    let eighth = Surface { levels: vec![level], within, ..Surface::default() };
    let mesh = &eighth.meshes(&grid).unwrap()[0];
    assert!(near(measure(mesh).area, whole.area / 8.0, 5e-3));
}

fn written(scratch: &Scratch, name: &str, bytes: &[u8]) -> PathBuf {
    let path = scratch.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

/// The same numbers in every way that the format has to write them.
#[test]
fn nrrd_is_read_in_all_its_forms() {
    let scratch = Scratch::new("nrrd");
    let values: Vec<i64> = (0..24).map(|i| (i * 7) % 24).collect();
    let right: Vec<f32> = values.iter().map(|v| *v as f32).collect();
    let head = |of: &str, more: &str| {
        format!("NRRD0004\n# made by hand\ntype: {of}\ndimension: 3\nsizes: 2 3 4\n{more}\n")
    };
    type Bytes<'f> = &'f dyn Fn(i64, bool) -> Vec<u8>;
    let types: [(&str, Bytes<'_>); 6] = [
        ("uchar", &|v, _| vec![v as u8]),
        ("short", &|v, big| {
            if big { (v as i16).to_be_bytes() } else { (v as i16).to_le_bytes() }.to_vec()
        }),
        ("uint32", &|v, big| {
            if big { (v as u32).to_be_bytes() } else { (v as u32).to_le_bytes() }.to_vec()
        }),
        ("long long", &|v, big| if big { v.to_be_bytes() } else { v.to_le_bytes() }.to_vec()),
        ("float", &|v, big| {
            if big { (v as f32).to_be_bytes() } else { (v as f32).to_le_bytes() }.to_vec()
        }),
        ("double", &|v, big| {
            if big { (v as f64).to_be_bytes() } else { (v as f64).to_le_bytes() }.to_vec()
        }),
    ];
    for (of, bytes) in types {
        for big in [false, true] {
            let data: Vec<u8> = values.iter().flat_map(|v| bytes(*v, big)).collect();
            let endian = if big { "endian: big\n" } else { "endian: little\n" };
            for (encoding, data) in [("raw", data.clone()), ("gzip", gzip(&data))] {
                let mut file = head(of, &format!("{endian}encoding: {encoding}\n")).into_bytes();
                file.extend(data);
                let volume = Volume::read(&written(&scratch, "a.nrrd", &file), None).unwrap();
                assert_eq!(volume.samples(), right, "{of} {encoding} {big}");
                assert_eq!((volume.counts(), volume.unit), ([2, 3, 4], 1e-3));
            }
        }
    }
    let words: Vec<String> = values.iter().map(i64::to_string).collect();
    let text = head("int", "encoding: text\n") + &words.join(" ");
    assert_eq!(
        Volume::read(&written(&scratch, "a.nrrd", text.as_bytes()), None).unwrap().samples(),
        right
    );
    // Places, units, and lines that end as on Windows.
    let data: Vec<u8> = values.iter().map(|v| *v as u8).collect();
    let placed = "encoding: raw\nspace: right-anterior-superior\nspace directions: (0.5,0,0) (0,0,2) (0,1.5,0)\n\
                  space origin: (1,2,3)\nspace units: \"um\" \"um\" \"um\"\nkind:=brain\n";
    let mut file = head("uchar", placed).replace('\n', "\r\n").into_bytes();
    file.extend(&data);
    let volume = Volume::read(&written(&scratch, "a.nrrd", &file), None).unwrap();
    assert_eq!(volume.place([1, 1, 1]), DVec3::new(1.5, 3.5, 5.0));
    assert_eq!((volume.unit, volume.samples()), (1e-6, &right[..]));
    // A space whose axes turn the other way mirrors what is in it: that is told.
    let left = placed.replace("right-anterior-superior", "left-anterior-superior");
    let mut file = head("uchar", &left).into_bytes();
    file.extend(&data);
    let mirrored = Volume::read(&written(&scratch, "a.nrrd", &file), None).unwrap();
    assert!(mirrored.notes[0].contains("mirror image") && volume.notes.is_empty());
    // Spacings, and data beside the head, the last bytes of its file.
    let beside = head(
        "uchar",
        "encoding: raw\nspacings: 1 2 nan\naxis mins: 5 0 0\nbyte skip: -1\ndata file: a.raw\n",
    );
    written(&scratch, "a.raw", &[&[9; 100], &data[..]].concat());
    let volume = Volume::read(&written(&scratch, "a.nhdr", beside.as_bytes()), None).unwrap();
    assert_eq!(
        (volume.place([1, 1, 1]), volume.samples()),
        (DVec3::new(6.0, 2.0, 1.0), &right[..])
    );
    // Several values at each point, in front and behind.
    for (sizes, directions, pick) in [
        ("3 2 2 2", "none (1,0,0) (0,1,0) (0,0,1)", [1, 4, 7, 10, 13, 16, 19, 22]),
        ("2 2 2 3", "(1,0,0) (0,1,0) (0,0,1) none", [8, 9, 10, 11, 12, 13, 14, 15]),
    ] {
        let head = format!(
            "NRRD0004\ntype: uchar\ndimension: 4\nsizes: {sizes}\nencoding: raw\nspace: LPS\n\
             space directions: {directions}\n\n"
        );
        let mut file = head.into_bytes();
        file.extend(&data);
        let path = written(&scratch, "a.nrrd", &file);
        let volume = Volume::read(&path, Some(1)).unwrap();
        assert_eq!(volume.samples(), pick.map(|at| right[at]));
        assert_eq!(Volume::read(&path, None).unwrap().notes.len(), 1);
        assert!(Volume::read(&path, Some(3)).unwrap_err().to_string().contains("0 to 2"));
    }
}

#[test]
fn damaged_nrrd_ends_in_errors() {
    let scratch = Scratch::new("nrrd_bad");
    let good = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n\n";
    let read = |text: &str, data: &[u8]| {
        let mut file = text.as_bytes().to_vec();
        file.extend(data);
        Volume::read(&written(&scratch, "a.nrrd", &file), None).map(|_| ()).unwrap_err().to_string()
    };
    for (from, to, told) in [
        ("2 3 4", "2 3 5", "30 bytes of samples are announced, 24 are there"),
        ("2 3 4", "2 3", ":4:"),
        ("2 3 4", "1 3 4", "at least 2"),
        ("2 3 4", "2 3 -4", "no count of samples"),
        ("2 3 4", "2000000 2000000 4", "at most"),
        ("dimension: 3", "dimension: 2", "2 axes"),
        ("dimension: 3\n", "", "no field `dimension`"),
        ("uchar", "block", "type \"block\""),
        ("uchar", "short", "48 bytes of samples are announced"),
        ("raw", "bzip2", "\"bzip2\" is not read"),
        ("raw", "gzip", "its gzip data breaks off"),
        ("raw", "raw\nspacings: 1 0 1", "one is 0"),
        ("raw", "raw\nspace directions: (1,0,0) (2,0,0) (0,0,1)", "lie in one plane"),
        ("raw", "raw\nspace directions: (1,0,0) (0,1) (0,0,1)", "three numbers"),
        ("raw", "raw\nspace units: \"ell\" \"ell\" \"ell\"", "\"ell\" is not known"),
        ("raw", "raw\nbyte skip: -5", "no count"),
        ("raw", "raw\ndata file: b.raw", "b.raw"),
        ("raw", "raw\na line of words", "should be a field"),
    ] {
        let error = read(&good.replacen(from, to, 1), &[7; 24]);
        assert!(
            error.contains(told) && error.contains("a.nrrd") | error.contains("b.raw"),
            "{to}: {error}"
        );
    }
    // Cut anywhere: an error, or whole.
    let mut whole = good.replace("raw", "gzip").into_bytes();
    whole.extend(gzip(&[7; 24]));
    for end in 0..whole.len() - 8 {
        let path = written(&scratch, "a.nrrd", &whole[..end]);
        assert!(Volume::read(&path, None).is_err(), "{end}");
    }
    // A bomb unpacks no further than it is wanted.
    let mut bomb = good.replace("raw", "gzip").into_bytes();
    bomb.extend(gzip(&vec![0; 50 << 20]));
    assert!(Volume::read(&written(&scratch, "a.nrrd", &bomb), None).is_ok());
}

#[test]
fn cubes_are_read_in_all_their_variants() {
    let scratch = Scratch::new("cube");
    let values: Vec<f32> = (0..24).map(|i| i as f32 / 4.0).collect();
    // The last axis is the fastest in the file.
    let turned = |values: &[f32], many: usize, which: usize| {
        let at = |i: usize, j: usize, k: usize| values[((i * 3 + j) * 4 + k) * many + which];
        let mut turned = Vec::new();
        for k in 0..4 {
            for j in 0..3 {
                turned.extend((0..2).map(|i| at(i, j, k)));
            }
        }
        turned
    };
    let text = |atoms: &str, sign: &str, more: &str, values: &[f32]| {
        let words: Vec<String> = values.iter().map(|v| format!("{v:.5E}")).collect();
        format!(
            "a title\nanother\n {atoms}\n {sign}2 0.5 0 0\n {sign}3 0 0.5 0\n {sign}4 0 0 0.5\n 1 1.0 0 0 0\n{more}{}\n",
            words.chunks(6).map(|line| line.join(" ")).collect::<Vec<_>>().join("\n")
        )
    };
    let read = |text: &str, component| {
        Volume::read(&written(&scratch, "a.cube", text.as_bytes()), component)
    };
    let plain = read(&text("1 -1 -2 -3", "", "", &values), None).unwrap();
    assert_eq!((plain.counts(), plain.samples()), ([2, 3, 4], &turned(&values, 1, 0)[..]));
    assert_eq!(plain.place([1, 0, 0]), DVec3::new(-0.5, -2.0, -3.0));
    // In angstrom: lengths become bohr.
    let angstrom = read(&text("1 -1 -2 -3", "-", "", &values), None).unwrap();
    assert!(
        (angstrom.place([1, 0, 0]) * 0.529_177_210_544 - DVec3::new(-0.5, -2.0, -3.0)).length()
            < 1e-12
    );
    assert_eq!(angstrom.samples(), plain.samples());
    // Orbitals: three values at each point, whose numbers stand on two lines.
    let many: Vec<f32> = (0..72).map(|i| (i as f32 - 36.0) / 8.0).collect();
    let orbitals = text("-1 0 0 0", "", "3 12\n13 17\n", &many);
    for which in 0..3 {
        let found = read(&orbitals, Some(which)).unwrap();
        assert_eq!(found.samples(), turned(&many, 3, which as usize));
        assert!(found.about.iter().any(|line| line == "orbitals 12, 13, 17"), "{:?}", found.about);
    }
    assert_eq!(read(&orbitals, None).unwrap().notes.len(), 1);
    // The count of values in the line of atoms.
    let counted = text("1 0 0 0 3", "", "", &many);
    assert_eq!(read(&counted, Some(2)).unwrap().samples(), turned(&many, 3, 2));
    // Numbers as Fortran writes them.
    let fortran = text("1 0 0 0", "", "", &values).replacen("2.50000E-1", "0.25D+00", 1);
    assert_eq!(
        read(&fortran.replacen("5.00000E-1", "5.0-001", 1), None).unwrap().samples(),
        plain.samples()
    );

    let good = text("1 0 0 0", "", "", &values);
    for (from, to, told) in [
        (" 1 0 0 0\n", " 1 0 0\n", "not a volume"),
        (" 1 0 0 0\n", " 1 0 0 0 0\n", ":3:"),
        (" 1 0 0 0\n", " -1 0 0 0\n", "orbital"),
        (" 1 0 0 0\n", " 99999999 0 0 0\n", "atoms: at most"),
        ("4 0 0 0.5", "5 0 0 0.5", "it ends after 24 of 30 values"),
        ("4 0 0 0.5", "4 0 0 0.0", ":6:"),
        ("4 0 0 0.5", "40000000 0 0 0.5", "cut short"),
        ("4 0 0 0.5", "3 0 0 0.5", "stands behind the last value"),
        ("1.25000E0", "one", ":8:"),
    ] {
        assert!(good.contains(from), "{from}");
        let read = read(&good.replacen(from, to, 1), None).map(|_| ());
        let error = read.expect_err(to).to_string();
        assert!(error.contains(told), "{to}: {error}");
    }
}

/// The density of ethanol and the skull of a scanner, against marching cubes of scikit-image 0.26.
#[test]
fn real_volumes_have_the_areas_that_another_program_finds() {
    let read = |name: &str| data::find(name).map(|path| Volume::read(&path, None).unwrap());
    if let Some(ethanol) = read("volumes/ethanol_rhf631gss_density_64.cube") {
        // The values are of a grid of 96 points; between 64 they need the cubic spline.
        let fine = ethanol.resampled(0.5).unwrap();
        for (level, area, held) in [(0.1, 105.6, 59.34), (0.125, 95.0, 47.93)] {
            let (_, coarse) = surface(&ethanol, level);
            let (_, found) = surface(&fine, level);
            assert!(near(found.area, area, 5e-3), "{level}: {found:?}");
            assert!(near(found.volume, held, 5e-3), "{level}: {found:?}");
            assert!(near(coarse.area, area, 1e-2) && near(coarse.volume, held, 1e-2), "{coarse:?}");
            assert_eq!((found.open_edges, found.parts, found.euler), (0, 1, 2));
        }
    }
    if let Some(orbital) = read("volumes/ethanol_rhf631gss_homo_48.cube") {
        let lobes = [(0.05, Inside::Above), (-0.05, Inside::Below)];
        let held = lobes.map(|(level, inside)| {
            let found = measure(&isosurface(&orbital, level, inside).unwrap());
            assert!(found.open_edges == 0 && found.volume > 0.0, "{level}: {found:?}");
            found.volume
        });
        // The highest orbital has its nodal plane in the plane of the heavy atoms: two lobes alike.
        assert!(near(held[0], held[1], 1e-3), "{held:?}");
    }
    if let Some(head) = read("volumes/cranium_ct.nrrd") {
        for (level, area) in [(226.0, 293_313.0), (-142.0, 214_935.0)] {
            let (_, found) = surface(&head, level);
            assert!(near(found.area, area, 1e-2), "{level}: {found:?}");
            assert_eq!(found.faulty_edges, 0);
        }
    }
    assert!(Volume::read(Path::new("Cargo.toml"), None).is_err());
}
