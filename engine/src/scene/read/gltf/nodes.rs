//! Nodes: where they stand, and what of them is seen.

use ::gltf::json::Root;
use ::gltf::json::scene::Node;
use glam::{DAffine3, DMat4, DQuat, DVec3};

/// The nodes of a file as trees.
pub(super) struct Tree {
    parents: Vec<Option<usize>>,
    /// From each node's space to the world's.
    pub(super) worlds: Vec<DAffine3>,
    /// Whether a mesh hangs on a node or on one under it.
    pub(super) shows: Vec<bool>,
}

impl Tree {
    /// Finds where all nodes stand.
    ///
    /// # Errors
    /// If they are no trees.
    pub(super) fn new(root: &Root) -> Result<Tree, String> {
        let count = root.nodes.len();
        let mut parents = vec![None; count];
        for (above, node) in root.nodes.iter().enumerate() {
            for child in node.children.iter().flatten() {
                let Some(parent) = parents.get_mut(child.value()) else { continue };
                if let Some(other) = parent.replace(above) {
                    let child = child.value();
                    return Err(format!(
                        "node {child} stands under two nodes, {other} and {above}"
                    ));
                }
            }
        }
        let mut worlds = vec![DAffine3::IDENTITY; count];
        let mut open: Vec<usize> = (0..count).filter(|node| parents[*node].is_none()).collect();
        let mut reached = open.len();
        while let Some(at) = open.pop() {
            let node = &root.nodes[at];
            let above = parents[at].map_or(DAffine3::IDENTITY, |above| worlds[above]);
            worlds[at] = above * local(node);
            let children = node.children.iter().flatten().map(|child| child.value());
            let before = open.len();
            open.extend(children);
            reached += open.len() - before;
        }
        if reached < count {
            // None of them is the root of a tree, so that they go round.
            let in_circle = (0..count).find(|node| circles(&parents, *node)).unwrap_or(0);
            return Err(format!("node {in_circle} contains itself"));
        }
        let mut shows = vec![false; count];
        for (at, node) in root.nodes.iter().enumerate() {
            let mut above = (node.mesh.is_some() && node.skin.is_none()).then_some(at);
            while let Some(at) = above.filter(|at| !shows[*at]) {
                shows[at] = true;
                above = parents[at];
            }
        }
        Ok(Tree { parents, worlds, shows })
    }

    /// The nodes that stand under none.
    pub(super) fn roots(&self) -> Vec<usize> {
        (0..self.parents.len()).filter(|node| self.parents[*node].is_none()).collect()
    }

    /// All nodes of a scene, by the roots that it names.
    ///
    /// # Errors
    /// If it names one that stands under another, or one twice.
    pub(super) fn below(&self, root: &Root, roots: &[usize]) -> Result<Vec<usize>, String> {
        let mut all = Vec::new();
        let mut known = vec![false; self.parents.len()];
        for at in roots {
            if let Some(above) = self.parents[*at] {
                return Err(format!("a scene names node {at}, which stands under node {above}"));
            }
            if std::mem::replace(&mut known[*at], true) {
                return Err(format!("a scene names node {at} twice"));
            }
        }
        let mut open: Vec<usize> = roots.iter().rev().copied().collect();
        while let Some(at) = open.pop() {
            all.push(at);
            let children = root.nodes[at].children.iter().flatten().rev();
            open.extend(children.map(|child| child.value()));
        }
        Ok(all)
    }
}

fn circles(parents: &[Option<usize>], start: usize) -> bool {
    let mut at = parents[start];
    for _ in 0..parents.len() {
        match at {
            Some(above) if above == start => return true,
            Some(above) => at = parents[above],
            None => return false,
        }
    }
    false
}

/// From a node's space to that of the one above it.
pub(super) fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let translation = node.translation.unwrap_or_default().map(f64::from);
    let scale = node.scale.unwrap_or([1.0; 3]).map(f64::from);
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    parts(translation.into(), rotation, scale.into())
}

/// A transform by its parts: first the scale, then the rotation (a quaternion of any length), then the move.
pub(super) fn parts(translation: DVec3, rotation: [f64; 4], scale: DVec3) -> DAffine3 {
    let turn = DQuat::from_array(rotation);
    let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(scale, turn, translation)
}
