//! What may stand in the way of light, and what need not be looked at.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is left out of the search for shadow volumes. What is dark is the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Reductions {
    /// Which faces are candidates for a patch of a visible face.
    pub candidates: CasterSearch,
    /// Of closed bodies, only faces that are turned to the light cast: \[D]'s contours, without their edges.
    pub contours: bool,
}

impl Default for Reductions {
    fn default() -> Reductions {
        Reductions { candidates: CasterSearch::Shafts, contours: true }
    }
}

/// Which faces are candidates for the shadow on a patch of a visible face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum CasterSearch {
    /// Those in the space between the patch and the light, by a tree.
    #[default]
    Shafts,
    /// Those in the space between the light and all that is visible, in some rows, of the patch's cluster: \[N]'s
    /// clusters.
    Clusters,
    /// Those in the pyramids around a point light, of six, that the patch lies in: \[D]'s six-space subdivision.
    SixSpaces,
    /// All.
    All,
}

/// Pieces by the six pyramids around a point that they reach into: -x, x, -y, y, -z, z.
pub type Spaces = [Vec<u32>; 6];

/// The six spaces that the convex hull of points around the origin reaches into, or more.
pub fn spaces_of(points: impl Iterator<Item = DVec3> + Clone) -> impl Iterator<Item = usize> {
    // By the box around them: a face may reach into a pyramid in which none of its corners lies.
    let low = points.clone().fold(DVec3::INFINITY, DVec3::min);
    let high = points.fold(DVec3::NEG_INFINITY, DVec3::max);
    (0..6).filter(move |space| {
        // Farthest along the axis, and nearest to it across: a box of the pyramid.
        let (axis, is_up) = (space / 2, space % 2 == 1);
        let far = if is_up { high[axis] } else { -low[axis] };
        let across = [(axis + 1) % 3, (axis + 2) % 3];
        let near = across.map(|a| if low[a] > 0.0 { low[a] } else { (-high[a]).max(0.0) });
        far >= 0.0 && near.iter().all(|near| *near <= far)
    })
}
