//! Solids of cities: what is wrong with their shells, in small cubes and in the cases of a validator.

use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_tests::data;
use spandrel_tests::program::Scratch;
use std::path::Path;

type Face = Vec<Vec<usize>>;

/// What is told of the shells of a solid, the outer first.
fn told(folder: &Path, corners: &[[f64; 3]], shells: &[Vec<Face>]) -> String {
    let text = format!(
        "{{\"type\":\"CityJSON\",\"version\":\"2.0\",\"CityObjects\":{{\"tower\":{{\"type\":\"Building\",\"geometry\":\
         [{{\"type\":\"Solid\",\"lod\":\"2\",\"boundaries\":{shells:?}}}]}}}},\"vertices\":{corners:?}}}"
    );
    let path = folder.join("s.city.json");
    std::fs::write(&path, text).unwrap();
    read::examined(&path, &ReadOptions::default()).unwrap().about.join("\n")
}

/// The validator's numbers of the faults that are told.
fn numbers(told: &str) -> Vec<u32> {
    let numbers = told.match_indices('(').filter_map(|(at, _)| told[at + 1..].split(')').next());
    numbers.filter_map(|number| number.parse().ok()).collect()
}

/// The corners of a cube with a side, its lowest at a place, and its faces turned outwards.
fn cube(at: f64, side: f64, base: usize) -> (Vec<[f64; 3]>, Vec<Face>) {
    let place = |far: bool| at + if far { side } else { 0.0 };
    let corner =
        |i: usize| [[1, 2, 5, 6], [2, 3, 6, 7], [4, 5, 6, 7]].map(|far| place(far.contains(&i)));
    let faces =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let faces = faces.map(|face| vec![face.map(|i| i + base).to_vec()]);
    ((0..8).map(corner).collect(), faces.to_vec())
}

fn turned(faces: &[Face]) -> Vec<Face> {
    let turn = |ring: &Vec<usize>| ring.iter().rev().copied().collect();
    faces.iter().map(|face| face.iter().map(turn).collect()).collect()
}

#[test]
fn each_fault_of_a_shell_is_told() {
    let scratch = Scratch::new("shells");
    let folder = scratch.path();
    let (corners, faces) = cube(0.0, 4.0, 0);
    let of = |faces: Vec<Face>| told(folder, &corners, &[faces]);
    let sound = of(faces.clone());
    assert!(sound.contains("is sound") && numbers(&sound).is_empty(), "{sound}");
    // The same corners under numbers of their own.
    let loose: Vec<[f64; 3]> = faces.iter().flatten().flatten().map(|i| corners[*i]).collect();
    let apart: Vec<Face> = (0..6).map(|k| vec![(4 * k..4 * k + 4).collect()]).collect();
    assert!(told(folder, &loose, &[apart]).contains("is sound"));
    let open = of(faces[1..].to_vec());
    assert_eq!(numbers(&open), [302]);
    assert!(open.contains("1 shells are not closed (302); the first of \"tower\""), "{open}");
    assert_eq!(numbers(&of(faces[..3].to_vec())), [301]);
    let mut one = faces.clone();
    one[2][0].reverse();
    assert_eq!(numbers(&of(one)), [307]);
    assert_eq!(numbers(&of(turned(&faces))), [405]);
    // A wall between, a second body apart, one that touches in a corner, and two bodies in each other.
    let wall = [faces.clone(), vec![vec![vec![0, 2, 6, 4]]]].concat();
    assert_eq!(numbers(&of(wall)), [302, 303]);
    let two = |at: f64| {
        let (more, others) = cube(at, 4.0, 8);
        numbers(&told(
            folder,
            &[corners.clone(), more].concat(),
            &[[faces.clone(), others].concat()],
        ))
    };
    assert_eq!(two(9.0), [305]);
    assert_eq!(two(4.0), [303, 305]);
    // A shell within is turned the other way.
    let (more, others) = cube(1.0, 2.0, 8);
    let both = [corners.clone(), more].concat();
    assert!(
        told(folder, &both, &[faces.clone(), turned(&others)])
            .contains("shells of its solids are sound")
    );
    assert_eq!(numbers(&told(folder, &both, &[faces.clone(), others])), [405]);
    // The top pushed below the floor: closed, and through itself.
    let mut pushed = corners.clone();
    pushed[6] = [2.0, 2.0, -3.0];
    let triangles = turned(&turned(&faces)).into_iter().flat_map(|face| {
        let [a, b, c, d] = [face[0][0], face[0][1], face[0][2], face[0][3]];
        let is_split = [a, c].contains(&6) || [a, c].contains(&0);
        if is_split {
            [vec![vec![a, b, c]], vec![vec![a, c, d]]]
        } else {
            [vec![vec![a, b, d]], vec![vec![b, c, d]]]
        }
    });
    assert_eq!(numbers(&told(folder, &pushed, &[triangles.collect()])), [306]);
}

#[test]
fn the_shells_of_the_hague_are_sound() {
    let Some(path) = data::find("city/DH_01_subs.city.json") else { return };
    let about = read::examined(&path, &ReadOptions::default()).unwrap().about.join("\n");
    assert!(about.contains("the 9 shells of its solids are sound"), "{about}");
}

/// A shell in the validator's text form.
fn poly(text: &str) -> (Vec<[f64; 3]>, Vec<Face>) {
    let mut numbers = text.split_whitespace().map(|word| word.parse::<f64>().unwrap());
    let mut next = || numbers.next().unwrap();
    let count = next() as usize;
    let _about: [f64; 3] = std::array::from_fn(|_| next());
    let points: Vec<[f64; 4]> = (0..count).map(|_| std::array::from_fn(|_| next())).collect();
    let first = points[0][0] as usize;
    let corners = points.iter().map(|[_, x, y, z]| [*x, *y, *z]).collect();
    let count = next() as usize;
    next();
    let mut faces: Vec<Face> = Vec::new();
    for _ in 0..count {
        let rings = next() as usize;
        next();
        let mut face = Face::new();
        for _ in 0..rings {
            let corners = next() as usize;
            face.push((0..corners).map(|_| next() as usize - first).collect());
        }
        faces.push(face);
    }
    (corners, faces)
}

#[test]
fn a_validators_cases_are_told_by_its_numbers() {
    let Some(folder) = data::find("malformed/val3dity_invalid/test_geometry_generic") else {
        return;
    };
    let scratch = Scratch::new("val3dity");
    let mut tried = 0;
    for path in data::files(&folder, &[".poly"]) {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let wanted: u32 = name[..3].parse().unwrap_or(0);
        if !(301..=307).contains(&wanted) {
            continue;
        }
        let (corners, faces) = poly(&std::fs::read_to_string(&path).unwrap());
        let told = told(scratch.path(), &corners, &[faces]);
        assert!(numbers(&told).contains(&wanted), "{name}: {told}");
        tried += 1;
    }
    assert!(tried > 0);
}
