//! Makes the gallery's volumes: `cargo run --release -p spandrel-tests --example volume_assets -- graphs/assets/papers`.
//!
//! `ethanol.nrrd` is a promolecule: the sum of the densities of free atoms, by Slater's rules, at the places that the
//! bond lengths and angles of ethanol give. `head.nrrd` is a phantom: a head of ellipsoids and capsules, with the
//! absorption of bone, soft tissue and air.

#![allow(
    clippy::disallowed_methods,
    reason = "nothing depends on the last bits of an asset that is made once"
)]

use flate2::Compression;
use flate2::write::GzEncoder;
use glam::DVec3;
use std::io::Write;
use std::path::{Path, PathBuf};

fn main() {
    let folder = std::env::args().nth(1).map(PathBuf::from).expect("the folder to write to");
    ethanol(&folder.join("ethanol.nrrd"));
    head(&folder.join("head.nrrd"));
}

/// Writes a volume of samples that are given by place.
fn write(path: &Path, about: &str, grid: Grid, unit: &str, bytes: &[u8], of: &str) {
    let Grid { counts: [x, y, z], origin, step } = grid;
    let head = format!(
        "NRRD0005\n# {about}\ntype: {of}\ndimension: 3\nspace dimension: 3\nsizes: {x} {y} {z}\nendian: little\n\
         encoding: gzip\nspace directions: ({step},0,0) (0,{step},0) (0,0,{step})\nspace origin: ({},{},{})\n\
         space units: \"{unit}\" \"{unit}\" \"{unit}\"\n\n",
        origin.x, origin.y, origin.z
    );
    let mut file = head.into_bytes();
    let mut encoder = GzEncoder::new(&mut file, Compression::best());
    encoder.write_all(bytes).expect("memory takes it");
    encoder.finish().expect("memory takes it");
    println!("{}: {} bytes", path.display(), file.len());
    std::fs::write(path, file).expect("the file can be written");
}

/// Points of a cubic grid, the first axis fastest.
#[derive(Clone, Copy)]
struct Grid {
    counts: [usize; 3],
    origin: DVec3,
    step: f64,
}

impl Grid {
    fn each(self, mut at: impl FnMut(DVec3)) {
        let [columns, rows, layers] = self.counts;
        for k in 0..layers {
            for j in 0..rows {
                for i in 0..columns {
                    at(self.origin + self.step * DVec3::new(i as f64, j as f64, k as f64));
                }
            }
        }
    }
}

/// An element, and where an atom of it is, in bohr.
struct Atom {
    element: char,
    place: DVec3,
}

impl Atom {
    /// Electrons per cubic bohr at a distance: shells of Slater's orbitals.
    fn density(&self, point: DVec3) -> f64 {
        let r = self.place.distance(point);
        let pi = std::f64::consts::PI;
        let inner = |z: f64| z.powi(3) / pi * (-2.0 * z * r).exp();
        let outer = |z: f64| z.powi(5) / (3.0 * pi) * r * r * (-2.0 * z * r).exp();
        match self.element {
            // A bound hydrogen is smaller than a free one.
            'H' => inner(1.2),
            'C' => 2.0 * inner(5.7) + 4.0 * outer(1.625),
            _ => 2.0 * inner(7.7) + 6.0 * outer(2.275),
        }
    }
}

fn ethanol(path: &Path) {
    // Lengths in angstrom: C-C 1.51, C-O 1.43, C-H 1.09, O-H 0.97; all angles those of a tetrahedron.
    let bohr = 1.0 / 0.529_177_210_544;
    let tetrahedral = (-1.0f64 / 3.0).acos();
    // Two bonds in the plane x = 0, and two out of it.
    let turned = |from: DVec3, angle: f64| {
        let (sin, cos) = angle.sin_cos();
        DVec3::new(from.x, from.y * cos - from.z * sin, from.y * sin + from.z * cos)
    };
    let middle = DVec3::ZERO;
    let to_methyl = turned(DVec3::Y, tetrahedral / 2.0);
    let to_oxygen = turned(DVec3::Y, -tetrahedral / 2.0);
    let sideways = |axis: DVec3, sign: f64| {
        // The two bonds that the plane does not hold, opposite to the mean of the two that it does.
        let half = tetrahedral / 2.0;
        axis * -half.cos() + DVec3::X * sign * half.sin()
    };
    let methyl = middle + to_methyl * 1.51 * bohr;
    let oxygen = middle + to_oxygen * 1.43 * bohr;
    let mut atoms = vec![('C', middle), ('C', methyl), ('O', oxygen)];
    let up = (to_methyl + to_oxygen).normalize();
    for sign in [-1.0, 1.0] {
        atoms.push(('H', middle + sideways(up, sign) * 1.09 * bohr));
        // Of the methyl group, two beside the plane.
        let in_plane = turned(-to_methyl, -tetrahedral);
        let axis = (in_plane - to_methyl).normalize();
        atoms.push(('H', methyl + sideways(axis, sign) * 1.09 * bohr));
    }
    atoms.push(('H', methyl + turned(-to_methyl, -tetrahedral) * 1.09 * bohr));
    atoms.push(('H', oxygen + turned(-to_oxygen, tetrahedral) * 0.97 * bohr));
    let atoms: Vec<Atom> =
        atoms.into_iter().map(|(element, place)| Atom { element, place }).collect();
    let (low, high) =
        atoms.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), atom| {
            (low.min(atom.place), high.max(atom.place))
        });
    let step = 0.25;
    let origin = ((low - 3.0) / step).floor() * step;
    let counts = ((high + 3.0 - origin) / step).ceil().to_array().map(|count| count as usize + 1);
    let grid = Grid { counts, origin, step };
    let mut bytes = Vec::new();
    grid.each(|point| {
        let density: f64 = atoms.iter().map(|atom| atom.density(point)).sum();
        // To 1/32768, and no more than 2 near the nuclei: the file is a quarter as long.
        let density = (density.min(2.0) * 32768.0).round() / 32768.0;
        bytes.extend((density as f32).to_le_bytes());
    });
    let about =
        "the density of ethanol as a sum of free atoms, in bohr^-3; lengths in bohr, called metres";
    write(path, about, grid, "m", &bytes, "float");
}

/// Distances from surfaces in millimetres, below 0 within. They are near enough to distances.
fn ellipsoid(point: DVec3, middle: [f64; 3], radii: [f64; 3]) -> f64 {
    let (to, radii) = (point - DVec3::from(middle), DVec3::from(radii));
    let (k, l) = ((to / radii).length(), (to / (radii * radii)).length());
    if l < 1e-12 { -radii.min_element() } else { k * (k - 1.0) / l }
}

fn capsule(point: DVec3, from: [f64; 3], to: [f64; 3], radius: f64) -> f64 {
    let (from, to) = (DVec3::from(from), DVec3::from(to));
    let along = to - from;
    let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    (from + along * share).distance(point) - radius
}

/// Both, joined with a fillet of a radius.
fn joined(a: f64, b: f64, radius: f64) -> f64 {
    let h = (radius - (a - b).abs()).max(0.0) / radius;
    a.min(b) - h * h * radius / 4.0
}

fn skin(p: DVec3) -> f64 {
    // Both sides alike.
    let p = DVec3::new(p.x.abs(), p.y, p.z);
    let mut d = ellipsoid(p, [0.0, 12.0, 32.0], [76.0, 95.0, 88.0]);
    d = joined(d, ellipsoid(p, [0.0, -28.0, -34.0], [68.0, 66.0, 76.0]), 30.0);
    d = joined(d, capsule(p, [0.0, 38.0, -60.0], [0.0, 48.0, -150.0], 50.0), 25.0);
    d = joined(d, ellipsoid(p, [0.0, -62.0, -92.0], [27.0, 25.0, 19.0]), 22.0);
    d = joined(d, ellipsoid(p, [0.0, -94.0, -26.0], [12.0, 20.0, 20.0]), 12.0);
    d = joined(d, ellipsoid(p, [0.0, -92.0, -60.0], [21.0, 9.0, 9.0]), 10.0);
    d = joined(d, ellipsoid(p, [78.0, 14.0, -8.0], [7.0, 18.0, 30.0]), 8.0);
    // Eyes lie deep.
    let socket = ellipsoid(p, [31.0, -96.0, 0.0], [19.0, 15.0, 13.0]);
    -joined(-d, socket, 14.0)
}

fn bone(p: DVec3) -> f64 {
    let p = DVec3::new(p.x.abs(), p.y, p.z);
    let case = ellipsoid(p, [0.0, 13.0, 34.0], [69.0, 87.0, 80.0]);
    let brain = ellipsoid(p, [0.0, 13.0, 34.0], [62.0, 79.5, 73.0]);
    let brow = ellipsoid(p, [30.0, -68.0, 16.0], [28.0, 12.0, 9.0]);
    let face = ellipsoid(p, [0.0, -52.0, -32.0], [38.0, 30.0, 34.0]);
    let cheek = ellipsoid(p, [46.0, -50.0, -22.0], [15.0, 22.0, 13.0]);
    let arch = capsule(p, [54.0, -40.0, -22.0], [66.0, 10.0, -18.0], 4.5);
    let mut d = joined(joined(case, face, 14.0), joined(brow, cheek, 8.0), 10.0);
    d = joined(d, arch, 6.0);
    // Holes: the brain, the eyes' sockets, the nose, the mouth behind the teeth.
    d = d.max(-brain);
    d = d.max(-ellipsoid(p, [31.0, -74.0, -2.0], [19.0, 36.0, 17.0]));
    d = d.max(-ellipsoid(p, [0.0, -84.0, -30.0], [11.0, 34.0, 17.0]));
    d = d.max(-ellipsoid(p, [0.0, -36.0, -58.0], [27.0, 36.0, 22.0]));
    let back = capsule(p, [55.0, 6.0, -24.0], [50.0, -8.0, -74.0], 7.0);
    let side = capsule(p, [50.0, -8.0, -76.0], [14.0, -68.0, -92.0], 8.0);
    let chin = capsule(p, [0.0, -72.0, -92.0], [14.0, -68.0, -92.0], 9.5);
    d = d.min(joined(joined(back, side, 8.0), chin, 8.0));
    // Teeth in two arches.
    for (z, radius) in [(-62.0, 31.0), (-76.0, 29.0)] {
        for number in 0..7 {
            let angle = (f64::from(number) + 0.5) * 0.2;
            let (sin, cos) = angle.sin_cos();
            let tooth = [radius * sin * 0.95, -46.0 - radius * cos, z];
            d = d.min(ellipsoid(p, tooth, [3.6, 3.8, 6.4]));
        }
    }
    for number in 0..6 {
        let down = f64::from(number);
        let y = 30.0 + 2.2 * down;
        d = d.min(ellipsoid(p, [0.0, y, -52.0 - 17.0 * down], [17.0, 14.0, 7.5]));
        d = d.min(capsule(
            p,
            [0.0, y + 10.0, -52.0 - 17.0 * down],
            [0.0, y + 30.0, -57.0 - 17.0 * down],
            4.0,
        ));
    }
    d
}

fn head(path: &Path) {
    let step = 2.2;
    let origin = DVec3::new(-88.0, -121.0, -132.0);
    let grid = Grid { counts: [81, 106, 119], origin, step };
    let mut bytes = Vec::new();
    // A distance as a share, blurred over a sample and a half to each side, as scanners do.
    let share = |distance: f64| {
        let t = (0.5 - distance / (3.0 * step)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    grid.each(|point| {
        let (outer, inner) = (share(skin(point)), share(bone(point)));
        let units = -1000.0 + 1045.0 * outer + 900.0 * inner * outer;
        bytes.extend(((units / 5.0).round() as i16 * 5).to_le_bytes());
    });
    let about = "a phantom of a head, in Hounsfield units: air -1000, soft tissue 45, bone 945";
    write(path, about, grid, "mm", &bytes, "short");
}
