//! Volumes: numbers on a grid, and the surfaces on which they are equal (\[D], "Applications").
//!
//! | format | ends in | unit | up | remarks |
//! |---|---|---|---|---|
//! | NRRD | `.nrrd`, `.nhdr` | its `space units`, else 1 mm | z | raw, gzip and text; all types of numbers; any directions |
//! | Gaussian cube | `.cube`, `.cub` | 1 bohr, shown as 1 m | y | angstrom by negative counts, orbitals, several values a point |
//!
//! The first bytes say which it is. Coordinates are those of the file until a scene is made: [`Volume::unit`] and
//! [`Volume::up`] say how.
//!
//! Reading path: this file, [`mod@isosurface`] (tetrahedral cells), [`clip`] (planes), [`decimate`] (fewer triangles within
//! a distance), [`mod@measure`] (area, volume, Euler number),
//! [`surface`] (scenes of several levels).

pub mod clip;
mod cube;
pub mod decimate;
pub mod isosurface;
pub mod measure;
mod nrrd;
mod resample;
pub mod surface;

use glam::{DMat3, DVec3};
use std::path::Path;

pub use isosurface::{Inside, isosurface};
pub use measure::{Measure, measure};

use crate::error::{Error, Result};
use crate::key::{Key, KeyHasher};
use crate::open;
use crate::scene::document::Axis;

/// The most samples of a volume: 8 GiB of them.
pub const MOST_SAMPLES: usize = 1 << 31;

/// Numbers on a grid of parallelepipeds.
#[derive(Clone, Debug)]
pub struct Volume {
    counts: [usize; 3],
    origin: DVec3,
    steps: DMat3,
    samples: Vec<f32>,
    /// Metres per unit of its coordinates.
    pub unit: f64,
    /// The axis of its coordinates that points up.
    pub up: Axis,
    /// What its coordinates are measured in, in words.
    pub unit_name: String,
    /// What the file says of itself.
    pub about: Vec<String>,
    /// What is doubtful in the file and was taken as well as could be.
    pub notes: Vec<String>,
    key: Key,
}

impl Volume {
    /// A volume of samples, the first axis fastest. Sample (i, j, k) lies at `origin + i a + j b + k c`, where a, b and
    /// c are the columns of `steps`. Its unit is a metre and y is up; both may be set.
    ///
    /// ```
    /// # use glam::{DMat3, DVec3};
    /// # use spandrel_engine::volume::{Inside, Volume, isosurface, measure};
    /// // A ball of radius 10 on a grid of 25 x 25 x 25 points.
    /// let field = |p: DVec3| (10.0 - p.length()) as f32;
    /// let ball = Volume::of([25; 3], DVec3::splat(-12.0), DMat3::IDENTITY, field)?;
    /// let surface = measure(&isosurface(&ball, 0.0, Inside::Above)?);
    /// assert_eq!(surface.euler, 2);
    /// assert!((surface.volume / (4.0 / 3.0 * std::f64::consts::PI * 1000.0) - 1.0).abs() < 0.01);
    /// # Ok::<(), spandrel_engine::Error>(())
    /// ```
    ///
    /// # Errors
    /// If an axis has fewer than two samples, there are not as many samples as the counts say, or more than
    /// [`MOST_SAMPLES`], a number of the grid is not finite, or its steps lie in a plane.
    pub fn new(
        counts: [usize; 3],
        origin: DVec3,
        steps: DMat3,
        samples: Vec<f32>,
    ) -> Result<Volume> {
        check(counts, origin, steps)?;
        let wanted = counts.iter().product::<usize>();
        if samples.len() != wanted {
            let there = samples.len();
            return Err(Error::invalid(format!("a volume of {wanted} samples: {there} are there")));
        }
        let mut key = KeyHasher::new("volume");
        key.value(&(counts, origin, steps));
        for some in samples.chunks(4096) {
            key.bytes(&some.iter().flat_map(|sample| sample.to_le_bytes()).collect::<Vec<u8>>());
        }
        Ok(Volume {
            counts,
            origin,
            steps,
            samples,
            unit: 1.0,
            up: Axis::Y,
            unit_name: "m".to_owned(),
            about: Vec::new(),
            notes: Vec::new(),
            key: key.finish(),
        })
    }

    /// A volume of a field.
    ///
    /// # Errors
    /// As [`new`](Volume::new).
    pub fn of(
        counts: [usize; 3],
        origin: DVec3,
        steps: DMat3,
        field: impl Fn(DVec3) -> f32,
    ) -> Result<Volume> {
        check(counts, origin, steps)?;
        let mut samples = Vec::with_capacity(counts.iter().product());
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                let place = |i| origin + steps * DVec3::new(i as f64, j as f64, k as f64);
                samples.extend((0..counts[0]).map(|i| field(place(i))));
            }
        }
        Volume::new(counts, origin, steps, samples)
    }

    /// Reads a volume of any known format. Where a point has several values, `component` is the number of the one
    /// that is taken, from 0 on.
    ///
    /// # Errors
    /// If the file cannot be read, is no volume, or is faulty: the file and the place in it.
    pub fn read(path: &Path, component: Option<u32>) -> Result<Volume> {
        let bytes = open::bytes(path)?;
        let read = open::guarded(|| match Format::of(&bytes) {
            Some(Format::Nrrd) => nrrd::read(path, &bytes, component),
            Some(Format::Cube) => cube::read(path, &bytes, component),
            None => Err(Error::in_file(path, unknown(&bytes))),
        });
        read.unwrap_or_else(|broke| Err(Error::in_file(path, broke)))
    }

    /// Whether a file's first bytes are those of a volume.
    pub fn is_volume(start: &[u8]) -> bool {
        Format::of(start).is_some()
    }

    /// How many samples there are along each axis.
    pub fn counts(&self) -> [usize; 3] {
        self.counts
    }

    /// Where sample (0, 0, 0) lies.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// From sample to sample along each axis: the columns.
    pub fn steps(&self) -> DMat3 {
        self.steps
    }

    /// All samples, the first axis fastest.
    pub fn samples(&self) -> &[f32] {
        &self.samples
    }

    /// The least and the greatest sample that is a number; none if there is none.
    pub fn range(&self) -> Option<(f32, f32)> {
        let numbers = self.samples.iter().filter(|sample| !sample.is_nan());
        let wide = (f32::INFINITY, f32::NEG_INFINITY);
        let range = numbers.fold(wide, |(low, high), sample| (low.min(*sample), high.max(*sample)));
        (range.0 <= range.1).then_some(range)
    }

    /// Its contents and its place.
    pub fn key(&self) -> Key {
        Key::of(&(self.key, self.unit, self.up))
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.samples)
    }

    /// The place of a point of the grid.
    pub fn place(&self, at: [usize; 3]) -> DVec3 {
        self.origin + self.steps * DVec3::from_array(at.map(|i| i as f64))
    }

    /// Its least and greatest coordinates.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let corner = |bits: usize| {
            self.place(std::array::from_fn(|axis| (bits >> axis & 1) * (self.counts[axis] - 1)))
        };
        let wide = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        (0..8).map(corner).fold(wide, |(low, high), corner| (low.min(corner), high.max(corner)))
    }

    /// The number of a sample.
    fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.counts[1] + j) * self.counts[0] + i
    }
}

fn check(counts: [usize; 3], origin: DVec3, steps: DMat3) -> Result<()> {
    let [x, y, z] = counts;
    if counts.iter().any(|count| *count < 2) {
        return Err(Error::invalid(format!(
            "a grid of {x} x {y} x {z} samples: each axis needs at least 2"
        )));
    }
    let all = counts.iter().try_fold(1usize, |product, count| product.checked_mul(*count));
    if all.is_none_or(|all| all > MOST_SAMPLES) {
        return Err(Error::invalid(format!(
            "a grid of {x} x {y} x {z} samples: at most {MOST_SAMPLES}"
        )));
    }
    if !(origin.is_finite() && steps.is_finite()) {
        return Err(Error::invalid("a number of the grid's place is not finite"));
    }
    let [a, b, c] = [steps.x_axis, steps.y_axis, steps.z_axis].map(DVec3::length);
    if steps.determinant().abs().partial_cmp(&(1e-9 * a * b * c))
        != Some(std::cmp::Ordering::Greater)
    {
        return Err(Error::invalid("the steps of the grid's axes lie in one plane, or one is 0"));
    }
    Ok(())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Nrrd,
    Cube,
}

impl Format {
    fn of(bytes: &[u8]) -> Option<Format> {
        if bytes.starts_with(b"NRRD00") {
            return Some(Format::Nrrd);
        }
        cube::is_cube(bytes).then_some(Format::Cube)
    }
}

fn unknown(bytes: &[u8]) -> String {
    let is = match open::kind(bytes) {
        Some("compressed by gzip") => "it is compressed by gzip: unpack it first".to_owned(),
        Some(kind) => format!("it is {kind}"),
        None => "it is neither NRRD nor a Gaussian cube".to_owned(),
    };
    format!("not a volume that is read: {is}. Other programs convert to NRRD (.nrrd)")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_that_cannot_be_are_refused() {
        let make = |counts: [usize; 3], steps| {
            let samples = vec![0.0; counts.iter().product::<usize>().min(100)];
            Volume::new(counts, DVec3::ZERO, steps, samples)
        };
        assert!(make([2, 2, 2], DMat3::IDENTITY).is_ok());
        assert!(make([1, 2, 2], DMat3::IDENTITY).is_err());
        assert!(make([2, 2, 200], DMat3::IDENTITY).is_err());
        assert!(make([1 << 20, 1 << 20, 1 << 20], DMat3::IDENTITY).is_err());
        let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::X + DVec3::Y);
        assert!(make([2, 2, 2], flat).is_err());
        assert!(make([2, 2, 2], DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0))).is_err());
    }
}
