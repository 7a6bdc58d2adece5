//! Levels of detail: which geometry of a building and its parts is shown.
//!
//! A building and its parts are one: all are shown in one level, the finest that any of them has or the one that is
//! asked for. What a part has only in coarser levels is shown in the nearest of them, unless the building around it has
//! the level for the whole. A geometry of the whole in a coarser level is not shown beside parts in a finer one.
//! Installations, furniture and rooms are additions: they take their own level and hide nothing.

use std::collections::BTreeSet;
use std::fmt;

/// A level of detail, in hundredths: 220 is level 2.2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Level(i64);

impl Level {
    /// The level of a number.
    pub(super) fn of(number: f64) -> Level {
        Level((number * 100.0).round() as i64)
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0 as f64 / 100.0)
    }
}

/// What is asked of a building and its parts together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Wanted {
    /// The finest level.
    Finest,
    /// A level, or what is nearest to it.
    Near(Level),
    /// A level, because the building around shows it for the whole; nothing else.
    Only(Level),
}

/// Whether a kind of object is a part of a building, bridge or tunnel, and no addition to it.
pub(super) fn is_part(kind: &str) -> bool {
    kind.ends_with("Part")
}

/// Of several levels the one that is meant: the same or, for a whole number, the finest of its refinements (2.3 for 2);
/// else the nearest coarser one; else the coarsest.
pub(super) fn near(levels: &BTreeSet<Level>, wanted: Level) -> Option<Level> {
    if levels.contains(&wanted) {
        return Some(wanted);
    }
    // The refinements 2.0 to 2.3 are those of Biljecki, Ledoux and Stoter (2016).
    let most = if wanted.0 % 100 == 0 { Level(wanted.0 + 99) } else { wanted };
    levels.range(..=most).next_back().or_else(|| levels.first()).copied()
}

/// Whether a level is one that was wanted: the same, or a refinement of a whole number.
pub(super) fn is_meant(level: Level, wanted: Level) -> bool {
    level == wanted || (wanted.0 % 100 == 0 && level.0.div_euclid(100) * 100 == wanted.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_met_by_itself_its_refinements_or_the_nearest() {
        let levels = |all: &[f64]| all.iter().map(|lod| Level::of(*lod)).collect::<BTreeSet<_>>();
        let met = |all: &[f64], wanted: f64| {
            near(&levels(all), Level::of(wanted)).map(|level| level.to_string())
        };
        assert_eq!(met(&[0.0, 1.2, 1.3, 2.2], 1.0).unwrap(), "1.3");
        assert_eq!(met(&[0.0, 1.2, 1.3, 2.2], 1.2).unwrap(), "1.2");
        assert_eq!(met(&[2.0, 2.2], 2.0).unwrap(), "2");
        assert_eq!(met(&[1.2, 2.2], 2.1).unwrap(), "1.2");
        assert_eq!(met(&[1.0, 3.0], 2.0).unwrap(), "1");
        assert_eq!(met(&[2.0, 3.0], 1.0).unwrap(), "2");
        assert_eq!(met(&[], 1.0), None);
    }
}
