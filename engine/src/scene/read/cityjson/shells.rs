//! The solids of a city: what is wrong with their shells, told by kind.

use glam::DVec3;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};

use super::super::super::shell::{ShellFault, examine};
use super::model::CityGeometry;

/// How many are named.
const NAMED: usize = 3;

/// What is wrong with solids, and of which objects.
#[derive(Default)]
pub(super) struct Shells {
    count: usize,
    faults: BTreeMap<ShellFault, (usize, Vec<String>)>,
}

impl Shells {
    /// Examines the shells of a solid.
    pub(super) fn examine(&mut self, name: &str, geometry: &CityGeometry, points: &[DVec3]) {
        let solids: Vec<&Value> = match geometry.kind.as_str() {
            "Solid" => vec![&geometry.boundaries],
            "MultiSolid" | "CompositeSolid" => {
                geometry.boundaries.as_array().into_iter().flatten().collect()
            }
            _ => return,
        };
        for solid in solids {
            for (at, shell) in solid.as_array().into_iter().flatten().enumerate() {
                self.count += 1;
                let (faces, points) = faces(shell, points);
                // The first shell is the outer one; all others bound cavities.
                for fault in examine(&faces, &points, at > 0) {
                    let (count, names) = self.faults.entry(fault).or_default();
                    *count += 1;
                    let name = format!("\"{name}\"");
                    if names.len() < NAMED && !names.contains(&name) {
                        names.push(name);
                    }
                }
            }
        }
    }

    /// What is told of them, a line for each kind of fault.
    pub(super) fn told(&self) -> Vec<String> {
        if self.count == 0 {
            return Vec::new();
        }
        let mut lines = vec![match (self.count, self.faults.is_empty()) {
            (1, true) => "the shell of its solid is sound".to_owned(),
            (count, true) => format!("the {count} shells of its solids are sound"),
            (count, false) => format!("shells of its solids: {count}"),
        }];
        for (fault, (count, names)) in &self.faults {
            let names = names.join(", ");
            lines.push(format!("{count} shells {}; the first of {names}", fault.words()));
        }
        lines
    }
}

/// The faces of a shell, and their points, one for all corners in one place.
fn faces(shell: &Value, points: &[DVec3]) -> (Vec<Vec<Vec<u32>>>, Vec<DVec3>) {
    let mut known: HashMap<[u64; 3], u32> = HashMap::new();
    let mut own = Vec::new();
    let mut number = |corner: &Value| {
        let point = *points.get(usize::try_from(corner.as_u64()?).ok()?)?;
        // Zero has two signs.
        let bits = (point + DVec3::ZERO).to_array().map(f64::to_bits);
        Some(*known.entry(bits).or_insert_with(|| {
            own.push(point);
            own.len() as u32 - 1
        }))
    };
    let mut ring = |ring: &Value| -> Vec<u32> {
        ring.as_array().into_iter().flatten().filter_map(&mut number).collect()
    };
    let mut face = |face: &Value| -> Vec<Vec<u32>> {
        face.as_array().into_iter().flatten().map(&mut ring).collect()
    };
    let faces = shell.as_array().into_iter().flatten().map(&mut face).collect();
    (faces, own)
}
