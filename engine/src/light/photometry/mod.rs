//! Measured lamps: luminous intensity by direction.

mod eulumdat;
mod ies;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::math;
use crate::open;

/// The most angles of one kind in a file.
const MAX_ANGLES: usize = 4096;

/// The coordinates in which a lamp was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Goniometer {
    /// The polar axis is the vertical of a beam that is level: headlamps.
    A,
    /// The polar axis is level, across the beam: floodlights.
    B,
    /// The polar axis is the aim: everything else. Planes C go round it, angles gamma from it.
    C,
}

/// A lamp as measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Photometry {
    /// The coordinates.
    pub kind: Goniometer,
    /// Angles within a plane, ascending, in degrees: C from 0 (the aim) to 180; A and B from -90 to 90.
    pub vertical: Vec<f64>,
    /// The planes, ascending, in degrees: C from 0 up to below 360 or, closed, with it; A and B from -90
    /// to 90.
    pub horizontal: Vec<f64>,
    /// Candela, plane by plane.
    pub candela: Arc<[f32]>,
    /// What the file says beside.
    pub about: About,
}

/// What a file says of its lamp.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The format.
    pub format: String,
    /// Maker, name and the like.
    pub text: Vec<String>,
    /// The luminous flux of the bare lamps in lumen, if it is known.
    pub lamp_flux: Option<f64>,
    /// The luminous flux that leaves the luminaire as the file says it, if it does.
    pub stated_flux: Option<f64>,
    /// Electrical power in watts.
    pub watts: f64,
    /// Width, length and height of what shines, in metres.
    pub size: [f64; 3],
}

impl Photometry {
    /// Reads a lamp from an IES LM-63 (1986, 1991, 1995, 2002) or EULUMDAT file.
    ///
    /// # Errors
    /// If it cannot be read or is neither; the message names line and column.
    pub fn read(path: &Path) -> Result<Photometry> {
        let bytes = open::bytes(path)?;
        let is_ldt = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ldt"));
        // Old files are in the code page of their maker; only names suffer.
        let text = open::text(path, &bytes)?.text;
        let read = open::guarded(|| Photometry::of_text(&text, is_ldt));
        let read = read.unwrap_or_else(|broke| Err(Error::invalid(broke)));
        read.map_err(|e| Error::in_file(path, e.to_string()))
    }

    /// A lamp from a file's contents; `is_eulumdat` is what its name says, which counts where they do not tell.
    ///
    /// # Errors
    /// If they are not of the format; the message names line and column.
    pub fn parse(bytes: &[u8], is_eulumdat: bool) -> Result<Photometry> {
        Photometry::of_text(&open::text(Path::new("lamp"), bytes)?.text, is_eulumdat)
    }

    fn of_text(text: &str, is_called_eulumdat: bool) -> Result<Photometry> {
        if text.len() > 64 << 20 {
            return Err(Error::invalid("it is larger than 64 MiB: that is no lamp"));
        }
        let is_ies = |line: &str| line.starts_with("IESNA") || line.starts_with("TILT=");
        // Behind its maker a EULUMDAT has numbers, one to a line.
        let numbers =
            text.lines().skip(1).take(4).filter(|line| line.trim().parse::<f64>().is_ok());
        let is_eulumdat = is_called_eulumdat || numbers.count() == 4;
        match is_eulumdat && !text.lines().any(is_ies) {
            true => eulumdat::parse(text),
            false => ies::parse(text),
        }
    }

    /// Puts a measurement together, and the planes that symmetry leaves out.
    fn new(
        kind: Goniometer,
        vertical: Vec<f64>,
        horizontal: Vec<f64>,
        candela: Vec<f32>,
        about: About,
    ) -> Photometry {
        let mut lamp = Photometry { kind, vertical, horizontal, candela: candela.into(), about };
        match kind {
            Goniometer::C => lamp.go_round(),
            Goniometer::A | Goniometer::B => lamp.mirror_half(),
        }
        lamp
    }

    fn plane(&self, at: usize) -> &[f32] {
        let count = self.vertical.len();
        &self.candela[at * count..][..count]
    }

    /// Completes planes from 0 to 90 or 180 degrees, or from 90 to 270, to the whole turn.
    fn go_round(&mut self) {
        let (first, last) = (self.horizontal[0], self.horizontal[self.horizontal.len() - 1]);
        if self.horizontal.len() == 1 {
            return;
        }
        // Each plane, by the ways in which symmetry shows it.
        let mut planes: Vec<(f64, usize)> = Vec::new();
        for (at, angle) in self.horizontal.iter().enumerate() {
            let angle = *angle;
            planes.push((angle.rem_euclid(360.0), at));
            if first == 0.0 && last == 90.0 {
                planes.extend([
                    (180.0 - angle, at),
                    (180.0 + angle, at),
                    ((360.0 - angle) % 360.0, at),
                ]);
            } else if first == 0.0 && last == 180.0 {
                planes.push(((360.0 - angle) % 360.0, at));
            } else if first == 90.0 && last == 270.0 {
                planes.push(((540.0 - angle).rem_euclid(360.0), at));
            }
        }
        planes.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Planes on the axes of symmetry are their own mirror images.
        planes.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-6);
        self.take(planes);
    }

    /// Completes planes from 0 to 90 degrees to both sides.
    fn mirror_half(&mut self) {
        if self.horizontal[0] == 0.0 && self.horizontal.len() > 1 {
            // The plane at 0 stands once: it lies in the mirror.
            let mirrored = (1..self.horizontal.len()).rev().map(|at| (-self.horizontal[at], at));
            let planes =
                mirrored.chain(self.horizontal.iter().copied().zip(0..)).collect::<Vec<_>>();
            self.take(planes);
        }
        if self.vertical[0] == 0.0 && self.vertical.len() > 1 {
            let count = self.vertical.len();
            let mut candela = Vec::new();
            for plane in 0..self.horizontal.len() {
                candela.extend((1..count).rev().chain(0..count).map(|i| self.plane(plane)[i]));
            }
            let below = (1..count).rev().map(|i| -self.vertical[i]);
            self.vertical = below.chain(self.vertical.iter().copied()).collect();
            self.candela = candela.into();
        }
    }

    fn take(&mut self, planes: Vec<(f64, usize)>) {
        self.candela = planes.iter().flat_map(|(_, at)| self.plane(*at)).copied().collect();
        self.horizontal = planes.into_iter().map(|(angle, _)| angle).collect();
    }

    /// The intensity in a direction, a unit vector in the lamp's own axes (x to its right, y up, z along
    /// its aim), in candela: linear between the angles that were measured, nothing beyond them.
    pub fn intensity(&self, d: DVec3) -> f64 {
        let degrees = |radians: f64| radians.to_degrees();
        let arc_sine = |v: f64| 90.0 - degrees(math::acos(v.clamp(-1.0, 1.0)));
        let (vertical, horizontal) = match self.kind {
            Goniometer::A => (arc_sine(d.y), degrees(math::atan2(d.x, d.z))),
            // Type B's poles lie to the sides, type A's above and below: the two angles change
            // places.
            Goniometer::B => (degrees(math::atan2(d.y, d.z)), arc_sine(d.x)),
            Goniometer::C => (
                degrees(math::acos(d.z.clamp(-1.0, 1.0))),
                degrees(math::atan2(d.y, d.x)).rem_euclid(360.0),
            ),
        };
        let Some((low, along)) = between(&self.vertical, vertical) else { return 0.0 };
        let within = |plane: usize| {
            let plane = self.plane(plane);
            let next = (low + 1).min(plane.len() - 1);
            f64::from(plane[low]) * (1.0 - along) + f64::from(plane[next]) * along
        };
        let count = self.horizontal.len();
        // One plane says that the lamp is alike all round its aim.
        if count == 1 {
            return within(0);
        }
        let (plane, next, across) = match between(&self.horizontal, horizontal) {
            Some((plane, across)) => (plane, (plane + 1).min(count - 1), across),
            None if self.kind != Goniometer::C => return 0.0,
            // Between the last plane and the first.
            None => {
                let (first, last) = (self.horizontal[0], self.horizontal[count - 1]);
                let gap = first + 360.0 - last;
                (count - 1, 0, (horizontal - last).rem_euclid(360.0) / gap)
            }
        };
        within(plane) * (1.0 - across) + within(next) * across
    }

    /// The luminous flux in lumen, by integration of the intensities.
    pub fn flux(&self) -> f64 {
        let (rows, columns) = (4096, 144);
        let mut sum = 0.0;
        for row in 0..rows {
            // From the aim on, in equal steps of angle.
            let at = |i: f64| i / f64::from(rows) * std::f64::consts::PI;
            let (from, to) = (at(f64::from(row)), at(f64::from(row) + 1.0));
            let solid = math::cos(from) - math::cos(to);
            let (sine, cosine) = (math::sin((from + to) / 2.0), math::cos((from + to) / 2.0));
            for column in 0..columns {
                let round = (f64::from(column) + 0.5) / f64::from(columns) * std::f64::consts::TAU;
                let d = DVec3::new(sine * math::cos(round), sine * math::sin(round), cosine);
                sum += self.intensity(d) * solid;
            }
        }
        sum * std::f64::consts::TAU / f64::from(columns)
    }

    /// The greatest intensity in candela.
    pub fn peak(&self) -> f32 {
        self.candela.iter().copied().fold(0.0, f32::max)
    }
}

/// The place of a value among ascending ones: the last that is not greater, and how far it is to the
/// next. `None` if the value lies beyond the ends.
fn between(values: &[f64], value: f64) -> Option<(usize, f64)> {
    let (first, last) = (values.first()?, values.last()?);
    // A direction along an end may be a rounding beyond it.
    if value < first - 1e-6 || value > last + 1e-6 {
        return None;
    }
    let at = values.partition_point(|v| *v <= value).saturating_sub(1);
    let along = values.get(at + 1).map_or(0.0, |next| (value - values[at]) / (next - values[at]));
    Some((at, along.clamp(0.0, 1.0)))
}

/// Whether angles ascend, and how many there may be.
fn check_angles(what: &str, angles: &[f64]) -> std::result::Result<(), String> {
    match angles.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]).is_none_or(|o| o.is_ge())) {
        Some(pair) => {
            Err(format!("the {what} angles do not ascend: {} after {}", pair[1], pair[0]))
        }
        None => Ok(()),
    }
}
