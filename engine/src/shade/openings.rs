//! Through which openings a sky is seen: there samples of it are worth a ray.
//!
//! From most places in a room a sky is seen through a small part of all directions. Rays that are sent from about a place
//! tell where, and from there on they are looked for from nearer and nearer. Then three of four samples are taken there,
//! and each counts by as much less. What the rays missed is still found by the fourth (importance sampling with a
//! defensive share: Hesterberg 1995).

use glam::DVec2;
use std::sync::Arc;

use super::bounces::Place;
use super::direct::Blocker;
use super::recorded::{LampSample, RecordedLamp};

/// Parts of the unit square of a lamp's choices along each side.
const SIDE: usize = 32;

/// Rays that look for openings at least and at most, and how many of them must have found one: else parts of it are missed,
/// and the few samples there count for much.
const RAYS: [u32; 2] = [512, 4096];
const ENOUGH: u32 = 128;

/// How many of them tell whether most of the sky is seen.
const FIRST: u32 = 64;

/// The share of samples that are taken evenly.
const EVEN: f32 = 0.25;

/// If more than this share of a sky is seen, even samples are as good.
const MOST: f32 = 0.2;

/// Where a sky is seen from about a place: cumulative shares of rows, and of the parts of each row.
#[derive(Debug)]
pub(super) struct Openings {
    rows: [f32; SIDE],
    parts: [[f32; SIDE]; SIDE],
}

/// What is seen of a sky from about a place.
pub(super) enum Seen {
    Nothing,
    Most,
    Through(Arc<Openings>),
}

impl Openings {
    /// What is seen of a sky from the starts of a place, which is looked for where it is seen from near it.
    pub(super) fn seen(lamp: &RecordedLamp<'_>, place: &Place, near: Option<&Openings>) -> Seen {
        let blocker = Blocker::default();
        let (mut all, mut reaches, mut seen) = (0.0, 0.0, [[false; SIDE]; SIDE]);
        let (mut sent, mut found) = (0, 0);
        while sent < RAYS[0] || found < ENOUGH && sent < RAYS[1] {
            if sent == FIRST && reaches >= MOST * all {
                break;
            }
            let choice = place.pattern.at(sent);
            let (choice, weight) = near.map_or((choice, 1.0), |near| near.at(choice));
            let LampSample { irradiance, lit, .. } =
                lamp.sample(place, (place.start(sent), choice), &blocker);
            let [column, row] = (choice * SIDE as f64).to_array().map(|at| at as usize);
            all += irradiance.luminance() * weight;
            reaches += irradiance.luminance() * weight * lit;
            seen[row][column] |= lit > 0.0;
            sent += 1;
            found += u32::from(lit > 0.0);
        }
        match found {
            0 => Seen::Nothing,
            _ if reaches < MOST * all => Seen::Through(Arc::new(Openings::new(&around(&seen)))),
            _ => Seen::Most,
        }
    }

    fn new(seen: &[[bool; SIDE]; SIDE]) -> Openings {
        let count = seen.iter().flatten().filter(|seen| **seen).count();
        let even = EVEN / (SIDE * SIDE) as f32;
        let share = |seen: bool| if seen { (1.0 - EVEN) / count as f32 + even } else { even };
        let (mut rows, mut parts) = ([0.0; SIDE], [[0.0; SIDE]; SIDE]);
        let mut sum = 0.0;
        for (row, values) in seen.iter().enumerate() {
            let of_row: f32 = values.iter().map(|value| share(*value)).sum();
            sum += of_row;
            rows[row] = sum;
            let mut along = 0.0;
            for (column, value) in values.iter().enumerate() {
                along += share(*value) / of_row;
                parts[row][column] = along;
            }
        }
        Openings { rows, parts }
    }

    /// The choice that even numbers lead to, and how much it counts: the mean of what counts is one.
    pub(super) fn at(&self, choice: DVec2) -> (DVec2, f32) {
        let (row, down, of_row) = chosen(&self.rows, choice.y);
        let (column, across, of_part) = chosen(&self.parts[row], choice.x);
        let at = DVec2::new(column as f64 + across, row as f64 + down) / SIDE as f64;
        (at, 1.0 / ((SIDE * SIDE) as f32 * of_row * of_part))
    }
}

/// The part of cumulative shares that a number in [0, 1) falls into, where in it, and its share.
fn chosen(sums: &[f32; SIDE], number: f64) -> (usize, f64, f32) {
    let at = sums.partition_point(|sum| f64::from(*sum) <= number).min(SIDE - 1);
    let before = if at == 0 { 0.0 } else { sums[at - 1] };
    let share = sums[at] - before;
    let within = (number - f64::from(before)) / f64::from(share);
    // However it is added and divided later, what comes of it is less than one.
    (at, within.clamp(0.0, 1.0 - 1e-9), share)
}

/// The parts beside which a sky is seen: from beside, openings stand beside.
fn around(seen: &[[bool; SIDE]; SIDE]) -> [[bool; SIDE]; SIDE] {
    let near = |at: usize| at.saturating_sub(1)..(at + 2).min(SIDE);
    let is_near = |row: usize, column: usize| near(row).any(|y| near(column).any(|x| seen[y][x]));
    std::array::from_fn(|row| std::array::from_fn(|column| is_near(row, column)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::pattern::Pattern;

    #[test]
    fn what_counts_is_one_in_the_mean_and_most_is_chosen_where_it_is_seen() {
        let mut seen = [[false; SIDE]; SIDE];
        (seen[3][4], seen[3][5], seen[9][12]) = (true, true, true);
        let openings = Openings::new(&seen);
        for number in [0.0, 1.0 - f64::EPSILON] {
            let (at, _) = openings.at(DVec2::splat(number));
            assert!(at.min_element() >= 0.0 && (at * SIDE as f64).max_element() < SIDE as f64);
        }
        let pattern = Pattern::from_seed(7);
        let count = 4096;
        let (mut sum, mut inside) = (0.0, 0);
        for k in 0..count {
            let (at, weight) = openings.at(pattern.at(k));
            assert!(at.min_element() >= 0.0 && at.max_element() < 1.0, "{at}");
            sum += weight;
            let part = (at * SIDE as f64).as_ivec2().to_array();
            inside += i32::from([[4, 3], [5, 3], [12, 9]].contains(&part));
        }
        let mean = sum / count as f32;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        let share = f64::from(inside) / f64::from(count);
        assert!((share - 0.75 - 0.25 * 3.0 / (SIDE * SIDE) as f64).abs() < 0.01, "{share}");
    }
}
