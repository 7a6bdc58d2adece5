//! Nodes: where they stand, and what of them is seen.

use ::gltf::json::Root;
use ::gltf::json::scene::Node;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use std::collections::BTreeMap;

/// What an animation says of a node at a moment; the rest is as the node has it.
#[derive(Default)]
pub(super) struct Moved {
    pub(super) translation: Option<DVec3>,
    /// A quaternion of any length.
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<DVec3>,
    /// The weights of morph targets.
    pub(super) weights: Option<Vec<f64>>,
}

/// The nodes of a file as trees.
pub(super) struct Tree {
    parents: Vec<Option<usize>>,
    /// The nodes, each behind the one that it stands under.
    order: Vec<usize>,
    /// From each node's space to that of the one above it.
    pub(super) locals: Vec<DAffine3>,
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
        let mut open: Vec<usize> = (0..count).filter(|node| parents[*node].is_none()).collect();
        let mut order = Vec::new();
        while let Some(at) = open.pop() {
            order.push(at);
            open.extend(root.nodes[at].children.iter().flatten().map(|child| child.value()));
        }
        if order.len() < count {
            // None of them is the root of a tree, so that they go round.
            let in_circle = (0..count).find(|node| circles(&parents, *node)).unwrap_or(0);
            return Err(format!("node {in_circle} contains itself"));
        }
        let (locals, worlds, shows) = (Vec::new(), Vec::new(), Vec::new());
        let mut tree = Tree { parents, order, locals, worlds, shows };
        let nodes = root.nodes.iter().enumerate();
        let meshes = nodes.filter(|(_, node)| node.mesh.is_some() && node.skin.is_none());
        tree.shows = tree.carriers(meshes.map(|(at, _)| at));
        tree.place(root, &BTreeMap::new());
        Ok(tree)
    }

    /// Places the nodes, some of them where an animation has them.
    pub(super) fn place(&mut self, root: &Root, moved: &BTreeMap<usize, Moved>) {
        let still = Moved::default();
        let nodes = root.nodes.iter().enumerate();
        self.locals =
            nodes.map(|(at, node)| local(node, moved.get(&at).unwrap_or(&still))).collect();
        self.worlds = vec![DAffine3::IDENTITY; self.locals.len()];
        for at in &self.order {
            let above = self.parents[*at].map_or(DAffine3::IDENTITY, |above| self.worlds[above]);
            self.worlds[*at] = above * self.locals[*at];
        }
    }

    /// For each node, whether it is one of some or stands above one.
    pub(super) fn carriers(&self, carried: impl Iterator<Item = usize>) -> Vec<bool> {
        let mut all = vec![false; self.parents.len()];
        for at in carried {
            let mut above = Some(at);
            while let Some(at) = above.filter(|at| !all[*at]) {
                all[at] = true;
                above = self.parents[at];
            }
        }
        all
    }

    /// For each node, whether a scene shows it; without scenes, all are shown.
    pub(super) fn shown(&self, root: &Root) -> Vec<bool> {
        let mut shown = vec![root.scenes.is_empty(); self.parents.len()];
        let roots = root.scenes.iter().flat_map(|scene| &scene.nodes);
        roots.for_each(|at| shown[at.value()] = true);
        for at in &self.order {
            shown[*at] |= self.parents[*at].is_some_and(|above| shown[above]);
        }
        shown
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
fn local(node: &Node, moved: &Moved) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let or = |moved: Option<DVec3>, own: [f32; 3]| moved.unwrap_or(own.map(f64::from).into());
    let rotation = node.rotation.unwrap_or_default().0.map(f64::from);
    parts(
        or(moved.translation, node.translation.unwrap_or_default()),
        moved.rotation.unwrap_or(rotation),
        or(moved.scale, node.scale.unwrap_or([1.0; 3])),
    )
}

/// A transform by its parts: first the scale, then the rotation (a quaternion of any length), then the move.
pub(super) fn parts(translation: DVec3, rotation: [f64; 4], scale: DVec3) -> DAffine3 {
    let turn = DQuat::from_array(rotation);
    let turn = if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY };
    DAffine3::from_scale_rotation_translation(scale, turn, translation)
}
