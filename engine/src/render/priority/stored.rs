//! A tree as bytes, without the scene that it was made of.

use glam::DVec3;
use std::sync::Arc;

use super::{BspTree, NONE, Node};
use crate::scene::Scene;

/// The first bytes, with the version.
const MAGIC: [u64; 2] = [u64::from_le_bytes(*b"SPANDREL"), u64::from_le_bytes(*b"bsptree1")];

impl BspTree {
    /// The tree as bytes.
    pub fn packed(&self) -> Vec<u8> {
        let numbers = |vector: DVec3| vector.to_array().map(f64::to_bits);
        let mut words = Vec::from(MAGIC);
        let counts = [self.faces.len(), self.listed.len(), self.nodes.len()];
        words.extend(counts.map(|count| count as u64));
        words.extend([self.splits, u64::from(self.depth)]);
        words.extend(numbers(self.centre));
        words.extend(self.faces.iter().map(|face| u64::from(*face)));
        words.extend(self.listed.iter().map(|face| u64::from(*face)));
        for Node { normal, distance, end, children: [front, back] } in &self.nodes {
            words.extend(numbers(*normal));
            words.extend([distance.to_bits(), u64::from(*end)]);
            words.push(u64::from(*front) << 32 | u64::from(*back));
        }
        words.into_iter().flat_map(u64::to_le_bytes).collect()
    }

    /// The tree of a scene, from what [`packed`](BspTree::packed) made of it; `None` if the bytes are none of its.
    pub fn unpacked(scene: &Arc<Scene>, bytes: &[u8]) -> Option<BspTree> {
        let (words, []) = bytes.as_chunks::<8>() else { return None };
        let (head, rest) = words.split_first_chunk::<10>()?;
        let head = head.map(u64::from_le_bytes);
        let [a, b, faces, listed, nodes, splits, depth, x, y, z] = head;
        let all = nodes.checked_mul(6)?.checked_add(faces)?.checked_add(listed)?;
        if [a, b] != MAGIC || rest.len() as u64 != all {
            return None;
        }
        let mut rest = rest.iter().map(|word| u64::from_le_bytes(*word));
        let mut small = |count: u64| -> Option<Vec<u32>> {
            let numbers = rest.by_ref().take(count as usize);
            numbers.map(|number| u32::try_from(number).ok()).collect()
        };
        let (faces, listed) = (small(faces)?, small(listed)?);
        let number = f64::from_bits;
        let mut node = || -> Option<Node> {
            let normal =
                DVec3::new(number(rest.next()?), number(rest.next()?), number(rest.next()?));
            let distance = number(rest.next()?);
            let end = u32::try_from(rest.next()?).ok()?;
            let children = rest.next()?;
            Some(Node {
                normal,
                distance,
                end,
                children: [(children >> 32) as u32, children as u32],
            })
        };
        let nodes: Vec<Node> = (0..nodes).map(|_| node()).collect::<Option<_>>()?;
        let centre = DVec3::new(number(x), number(y), number(z));
        let depth = u32::try_from(depth).ok()?;
        let tree = BspTree { scene: scene.clone(), faces, nodes, listed, centre, splits, depth };
        tree.is_sound().then_some(tree)
    }

    /// Whether it is a tree, of its scene's faces.
    fn is_sound(&self) -> bool {
        let scene = &self.scene;
        let firsts = scene.instances.iter().flat_map(|instance| {
            let geometry = &*instance.geometry;
            let faces = 0..geometry.mesh().face_count();
            faces.map(|face| instance.first_ordinal + geometry.first_part(face))
        });
        let is_child = |at: usize| {
            // A child comes after its parent, so that no way leads back.
            move |child: &u32| *child == NONE || (*child as usize > at)
        };
        let mut start = 0;
        let nodes = self.nodes.iter().enumerate().all(|(at, node)| {
            let is_ascending = start <= node.end;
            start = node.end;
            let known = |child: &u32| *child == NONE || (*child as usize) < self.nodes.len();
            is_ascending && node.children.iter().all(|child| is_child(at)(child) && known(child))
        });
        nodes
            && start as usize == self.listed.len()
            && self.listed.iter().all(|face| (*face as usize) < self.faces.len())
            && firsts.eq(self.faces.iter().copied())
    }
}
