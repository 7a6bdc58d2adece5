//! Light from a picture of everything around: an equirectangular panorama of high dynamic range.

use glam::{DVec2, DVec3};
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::normals::{ByNormal, fold, unfold};
use super::{Light, Receiver, Sample};
use crate::color::Color;
use crate::error::{Error, Result};
use crate::image::{Image, file};
use crate::math;
use crate::packed;
use crate::trace::Toward;

/// The greatest height of a panorama that is kept; larger ones are reduced by whole factors.
const MOST_ROWS: u32 = 512;

/// The least height of a panorama: less tells no directions apart.
const LEAST_ROWS: u32 = 8;

/// Rows of the coarser panorama of which irradiance is summed.
const COARSE: usize = 64;

/// Rows of the cells by which directions are chosen, at most, and twice as many columns.
const CELLS: usize = 16;

/// Normals along a side of the square of octahedral coordinates for which cells are weighed: odd, so that the axes are
/// among them.
const NORMALS: usize = 17;

/// How far directions of a cell and normals between those that are weighed are from what stands for them, at most, as an
/// angle.
const SLACK: f64 = 0.3;

/// A panorama, of which an open horizontal plane receives 1 lux. Its middle lies towards -z, its top is the
/// zenith.
#[derive(Clone, Debug)]
pub struct Panorama {
    /// Columns; half as many rows.
    width: u32,
    /// Luminance in cd/m2, row by row.
    colors: Arc<[Color]>,
    /// By how much it is turned clockwise, seen from above, in radians.
    turn: f64,
    tables: OnceLock<Tables>,
}

#[derive(Clone, Debug)]
struct Tables {
    /// By pixel, the light of it and those left of it in its row.
    columns: Vec<f64>,
    /// By normal, how often cells are chosen.
    choices: Vec<Choices>,
    irradiance: ByNormal<[f32; 3]>,
}

/// How often the cells of a panorama are chosen for a normal: as bright as they are, as the cosine has them, and a little
/// more where the cosine is not the same all over a cell.
#[derive(Clone, Debug)]
struct Choices {
    /// By cell, the share of its light that counts.
    shares: Vec<f64>,
    /// By row of cells, the sum of it and all rows above; by cell, of it and those left of it in its row.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Choices {
    /// Of cells, each with its middle and its light.
    fn new(normal: DVec3, cells: &[(DVec3, f64)], columns_of_cells: usize) -> Choices {
        // The greatest cosine that there may be.
        let share = |middle: &DVec3| {
            let angle = math::acos(middle.dot(normal).clamp(-1.0, 1.0));
            // Never less than the true cosine within the cell: what is never chosen would be
            // missing from the sum.
            math::cos((angle - SLACK).clamp(0.0, PI)).max(0.0)
        };
        let shares: Vec<f64> = cells.iter().map(|(middle, _)| share(middle)).collect();
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        let mut all = 0.0;
        let weights: Vec<f64> =
            cells.iter().zip(&shares).map(|((_, light), share)| light * share).collect();
        for row in weights.chunks(columns_of_cells) {
            let mut sum = 0.0;
            for weight in row {
                sum += weight;
                columns.push(sum);
            }
            all += sum;
            rows.push(all);
        }
        Choices { shares, rows, columns }
    }

    fn all(&self) -> f64 {
        self.rows.last().copied().unwrap_or(0.0)
    }
}

/// The place in a list of growing sums at a share of the last, and how far it is on the way from the sum before to its
/// own.
fn chosen(sums: &[f64], share: f64) -> (usize, f64) {
    let wanted = share * sums[sums.len() - 1];
    let at = sums.partition_point(|sum| *sum <= wanted).min(sums.len() - 1);
    let before = if at == 0 { 0.0 } else { sums[at - 1] };
    let own = sums[at] - before;
    (at, if own > 0.0 { ((wanted - before) / own).clamp(0.0, 1.0 - 1e-12) } else { 0.5 })
}

impl Panorama {
    /// Reads a panorama and turns it by an angle in radians.
    ///
    /// # Errors
    /// If it cannot be read, or is none.
    pub fn read(path: &Path, turn: f64) -> Result<Panorama> {
        let (picture, _) = file::Encoded::open(path)?.image(&file::Select::color(), None)?;
        let made = Panorama::of(&picture, turn);
        Ok(made.map_err(|error| Error::in_file(path, error.to_string()))?.0)
    }

    /// A panorama in memory, turned by an angle in radians, and the illuminance that an open horizontal plane
    /// receives of the picture as it is: in lux, if its values are cd/m2.
    ///
    /// # Errors
    /// If it is not twice as wide as high, or nothing of its upper half shines.
    pub fn of(picture: &Image, turn: f64) -> Result<(Panorama, f64)> {
        let fault = |what: String| Error::invalid(what);
        let (width, height) = picture.size;
        if width != 2 * height || picture.window.area() != width as usize * height as usize {
            return Err(fault(format!(
                "{width} by {height} pixels: a panorama of all directions is twice as wide as high"
            )));
        }
        if height < LEAST_ROWS {
            return Err(fault(format!("{height} rows: a panorama needs {LEAST_ROWS} or more")));
        }
        if let Some(name) = ["R", "G", "B"].into_iter().find(|name| picture.float(name).is_none()) {
            return Err(fault(format!("it has no channel {name}: a panorama has R, G and B")));
        }
        let pixels: Vec<[f32; 4]> = picture.pixels().collect();
        let is_finite = |[r, g, b, _]: &[f32; 4]| [r, g, b].iter().all(|v| v.is_finite());
        if let Some(at) = pixels.iter().position(|pixel| !is_finite(pixel)) {
            let (x, y) = (at as u32 % width, at as u32 / width);
            return Err(fault(format!("pixel {x}, {y} is not a finite number")));
        }
        // What is left over at the right and the bottom, fewer than `by` pixels, is not seen.
        let by = height.div_ceil(MOST_ROWS).max(1);
        let rows = height / by;
        let mean = |at: u32| {
            let (left, top) = (at % (2 * rows) * by, at / (2 * rows) * by);
            let parts = (0..by * by).map(|i| {
                let [r, g, b, _] = pixels[((top + i / by) * width + left + i % by) as usize];
                // Colours that no display shows have parts below 0; no light has.
                Color::new(r.max(0.0), g.max(0.0), b.max(0.0))
            });
            parts.fold(Color::BLACK, |sum, part| sum + part) * (1.0 / (by * by) as f32)
        };
        let colors: Vec<Color> = (0..2 * rows * rows).map(mean).collect();
        let made =
            Panorama { width: 2 * rows, colors: colors.into(), turn, tables: OnceLock::new() };
        let open = made.horizontal();
        if open <= 0.0 {
            return Err(fault("nothing of its upper half shines".to_owned()));
        }
        let scaled = |v: f32| (f64::from(v) / open) as f32;
        let colors: Arc<[Color]> =
            made.colors.iter().map(|c| Color::new(scaled(c.r), scaled(c.g), scaled(c.b))).collect();
        if !colors.iter().all(|color| color.is_finite()) {
            return Err(fault(
                "its brightest pixels are too bright beside its upper half".to_owned(),
            ));
        }
        Ok((Panorama { colors, ..made }, open))
    }

    fn rows(&self) -> usize {
        self.width as usize / 2
    }

    /// The solid angle of a pixel of a row.
    fn solid(&self, row: usize) -> f64 {
        let edge = |row: usize| math::cos(PI * row as f64 / self.rows() as f64);
        // Archimedes: a zone's area is its height.
        (edge(row) - edge(row + 1)) * TAU / f64::from(self.width)
    }

    /// The direction of a place, in pixels.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        let round = (x / f64::from(self.width) - 0.5) * TAU + self.turn;
        let down = PI * y / self.rows() as f64;
        let across = math::sin(down);
        DVec3::new(math::sin(round) * across, math::cos(down), -math::cos(round) * across)
    }

    /// The place of a direction, in pixels.
    fn place(&self, direction: DVec3) -> (f64, f64) {
        let round = math::atan2(direction.x, -direction.z) - self.turn;
        let x = (round / TAU + 0.5).rem_euclid(1.0) * f64::from(self.width);
        (x, math::acos(direction.y.clamp(-1.0, 1.0)) / PI * self.rows() as f64)
    }

    /// What an open plane receives, as the mean of the colours.
    fn horizontal(&self) -> f64 {
        let width = self.width as usize;
        let row = |y: usize| {
            // The integral of the cosine over a pixel of the row, down to the horizon.
            let edge = |row: usize| math::cos(PI * row as f64 / self.rows() as f64).max(0.0);
            let up = (edge(y) * edge(y) - edge(y + 1) * edge(y + 1)) / 2.0 * TAU / width as f64;
            self.colors[y * width..][..width].iter().map(|c| grey(*c)).sum::<f64>() * up
        };
        (0..self.rows().div_ceil(2)).map(row).sum()
    }

    fn tables(&self) -> &Tables {
        self.tables.get_or_init(|| {
            let (width, height) = (self.width as usize, self.rows());
            let mut columns = Vec::new();
            for y in 0..height {
                let solid = self.solid(y);
                let mut sum = 0.0;
                for color in &self.colors[y * width..][..width] {
                    sum += grey(*color) * solid;
                    columns.push(sum);
                }
            }
            let [cell_columns, cell_rows] = self.cells();
            let cells = (0..cell_columns * cell_rows).map(|cell| {
                let [left, top, right, bottom] = self.cell(cell);
                let middle = [left + right, top + bottom].map(|sum| sum as f64 / 2.0);
                let row = |y: usize| between(&columns[y * width..][..width], left, right);
                (self.direction(middle[0], middle[1]), (top..bottom).map(row).sum())
            });
            let lit: Vec<(DVec3, f64)> = cells.collect();
            let side = |i: usize| i as f64 / (NORMALS - 1) as f64 * 2.0 - 1.0;
            let normal = |i: usize| unfold(DVec2::new(side(i % NORMALS), side(i / NORMALS)));
            let choices = (0..NORMALS * NORMALS)
                .map(|i| Choices::new(normal(i), &lit, cell_columns))
                .collect();
            // By coarse cell its light, in the direction that is its middle.
            let by = height.div_ceil(COARSE);
            let mut cells = vec![(DVec3::ZERO, Color::BLACK); COARSE * 2 * COARSE];
            for (at, color) in self.colors.iter().enumerate() {
                let (x, y) = (at % width, at / width);
                let light = *color * self.solid(y) as f32;
                let cell = &mut cells[(y / by) * 2 * COARSE + x / by];
                let direction = self.direction(x as f64 + 0.5, y as f64 + 0.5);
                // The middle by light, so that a sun stays where it is.
                cell.0 += direction * grey(light);
                cell.1 = cell.1 + light;
            }
            let cells: Vec<(DVec3, Color)> = cells
                .into_iter()
                .filter_map(|(toward, light)| Some((toward.try_normalize()?, light)))
                .collect();
            let irradiance = ByNormal::new(|normal| {
                let parts = cells.iter().map(|(d, light)| *light * d.dot(normal).max(0.0) as f32);
                parts.fold(Color::BLACK, |sum, part| sum + part).to_array()
            });
            Tables { columns, choices, irradiance }
        })
    }
}

/// The light of some pixels of a row, by its growing sums.
fn between(sums: &[f64], left: usize, right: usize) -> f64 {
    let until = |x: usize| if x == 0 { 0.0 } else { sums[x - 1] };
    until(right) - until(left)
}

fn grey(color: Color) -> f64 {
    (f64::from(color.r) + f64::from(color.g) + f64::from(color.b)) / 3.0
}

#[typetag::serde(name = "Panorama")]
impl Light for Panorama {
    fn toward(&self) -> Option<Toward> {
        None
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        let [r, g, b] = self.tables().irradiance.at(at.normal);
        Color::new(r, g, b)
    }

    fn is_mirrored(&self) -> bool {
        false
    }

    fn luminance(&self, direction: DVec3) -> Option<Color> {
        let (x, y) = self.place(direction);
        let (width, rows) = (self.width as usize, self.rows());
        // Pixels have their colour in their middle; round the axis the last column is beside the
        // first.
        let (x, y) = ((x - 0.5).rem_euclid(width as f64), (y - 0.5).clamp(0.0, rows as f64 - 1.0));
        let (left, top) = (x as usize % width, y as usize);
        let at = |x: usize, y: usize| self.colors[y.min(rows - 1) * width + x % width];
        let (u, v) = (x.fract() as f32, y.fract() as f32);
        let upper = at(left, top).mix(at(left + 1, top), u);
        Some(upper.mix(at(left, top + 1).mix(at(left + 1, top + 1), u), v))
    }

    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample {
        let Tables { columns, choices, .. } = self.tables();
        // The nearest normal that was weighed. `SLACK` covers the difference.
        let near = (fold(at.normal) + 1.0) / 2.0 * (NORMALS - 1) as f64;
        let place = |v: f64| (v.round() as usize).min(NORMALS - 1);
        let choices = &choices[place(near.y) * NORMALS + place(near.x)];
        if choices.all() <= 0.0 {
            return Sample { toward: Toward::Direction(at.normal), irradiance: Color::BLACK };
        }
        // A cell, a row of it and a pixel of that, as often as they are bright, each with what is left of both numbers.
        let (row, down) = chosen(&choices.rows, choice.y);
        let [cell_columns, _] = self.cells();
        let of_row = &choices.columns[row * cell_columns..][..cell_columns];
        let (column, across) = chosen(of_row, choice.x);
        let cell = row * cell_columns + column;
        let [left, top, right, bottom] = self.cell(cell);
        let width = self.width as usize;
        let of_pixels = |y: usize| &columns[y * width..][..width];
        let mut sums = [0.0; 2 * MOST_ROWS as usize / CELLS + 1];
        let mut sum = 0.0;
        for (y, known) in (top..bottom).zip(&mut sums) {
            sum += between(of_pixels(y), left, right);
            *known = sum;
        }
        let (y, v) = chosen(&sums[..bottom - top], down);
        let y = top + y;
        let sums = of_pixels(y);
        let before = if left == 0 { 0.0 } else { sums[left - 1] };
        let wanted = before + across * (sums[right - 1] - before);
        let x = (left + sums[left..right].partition_point(|sum| *sum <= wanted)).min(right - 1);
        let own = between(sums, x, x + 1);
        let u = if own > 0.0 { (wanted - (sums[x] - own)) / own } else { 0.5 };
        let direction = self.direction(x as f64 + u.clamp(0.0, 1.0), y as f64 + v);
        let color = self.colors[y * width + x];
        // Per solid angle: a pixel is chosen by its light, over its solid angle that is its colour.
        let density = grey(color) * choices.shares[cell] / choices.all();
        let cosine = at.normal.dot(direction).max(0.0);
        let lux = if density > 0.0 { cosine / density } else { 0.0 };
        Sample { toward: Toward::Direction(direction), irradiance: color * lux as f32 }
    }
}

impl Panorama {
    /// Columns and rows of cells.
    fn cells(&self) -> [usize; 2] {
        let rows = self.rows().min(CELLS);
        [2 * rows, rows]
    }

    /// The pixels of a cell: from the left and the top, to the right and the bottom.
    fn cell(&self, cell: usize) -> [usize; 4] {
        let [columns, rows] = self.cells();
        let (row, column) = (cell / columns, cell % columns);
        let edge = |at: usize, cells: usize, pixels: usize| at * pixels / cells;
        let (width, height) = (self.width as usize, self.rows());
        [
            edge(column, columns, width),
            edge(row, rows, height),
            edge(column + 1, columns, width),
            edge(row + 1, rows, height),
        ]
    }
}

/// How it is saved.
#[derive(Serialize, Deserialize)]
struct Saved {
    width: u32,
    turn: f64,
    colors: String,
}

impl Serialize for Panorama {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let colors = packed::pack(&self.colors).map_err(S::Error::custom)?;
        Saved { width: self.width, turn: self.turn, colors }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Panorama {
    fn deserialize<D: Deserializer<'de>>(
        deserializer: D,
    ) -> std::result::Result<Panorama, D::Error> {
        let Saved { width, turn, colors } = Saved::deserialize(deserializer)?;
        if width == 0 || width % 2 == 1 || width > 4 * MOST_ROWS || !turn.is_finite() {
            return Err(D::Error::custom(format!("a panorama {width} wide, turned by {turn}")));
        }
        let count = u64::from(width) * u64::from(width / 2);
        let colors = packed::unpack(&colors, count).map_err(D::Error::custom)?;
        Ok(Panorama { width, colors: colors.into(), turn, tables: OnceLock::new() })
    }
}
