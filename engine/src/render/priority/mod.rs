//! List priority: a tree over faces gives their order for any eye (\[D], "Near-real-time display", after Fuchs, Kedem
//! and Naylor 1980).
//!
//! The paper's four stages: a [`BspTree`] is *generated* once for a scene; *attributes* (camera, lights, environment)
//! come from elsewhere and change without it; *display* is [`render`], a traversal; *deletion* is letting go of it.
//!
//! The paper draws pieces of faces from the farthest to the nearest, so that a nearer one paints over. Here whole faces
//! go from the nearest to the farthest into the solver that all renderers share, each where its first piece comes, and
//! what hides the rest is there before it. So no edge is ever cut by a plane, which would round elsewhere than the
//! whole edge does: **the spans are those of the [scan line](super::scanline), bit for bit**, whatever the roots were.
//! The order decides how fast they are found, and nothing else.
//!
//! Where the paper takes the view vector, perspective needs the side of the plane on which the eye is. Faces in one
//! plane share a node; which of them is seen is decided by rank and number, as everywhere. Faces with holes are divided
//! in convex pieces; seals and drawn edges go with their face. Faces that overlap each other in a circle are cut.

mod generate;
mod stored;

use glam::{DAffine3, DVec3};
use std::sync::Arc;

use super::scanline::{self, Cluster};
use crate::camera::View;
use crate::error::Result;
use crate::raster::{LinePlan, Rows};
use crate::scene::{Scene, surfaces::normal_matrix};
use crate::span::{FaceId, SpanImage};
use crate::visible;
pub use generate::Roots;

/// No node, or no child.
const NONE: u32 = u32::MAX;

/// The faces of a scene, divided by planes again and again (\[D], "BSP tree").
#[derive(Clone, Debug)]
pub struct BspTree {
    scene: Arc<Scene>,
    /// Of every face the number of its first part in the scene, in order.
    faces: Vec<u32>,
    nodes: Vec<Node>,
    /// The faces of all nodes, node by node.
    listed: Vec<u32>,
    /// What the planes' distances are measured from.
    centre: DVec3,
    splits: u64,
    depth: u32,
}

/// A plane that divides, and the faces in it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    /// Its unit normal; 0 where nothing is divided any more.
    normal: DVec3,
    /// How far it lies from the tree's centre, along the normal.
    distance: f64,
    /// The end of its faces among all; they begin where those of the node before end.
    end: u32,
    /// The nodes on the normal's side and on the other.
    children: [u32; 2],
}

impl BspTree {
    /// Divides the faces of a scene. With the best roots it takes time n log n for n faces that do not cross; where planes cut more pieces
    /// than there are faces eight times over, what is left is not divided.
    ///
    /// # Errors
    /// If the work is stopped.
    pub fn generate(scene: Arc<Scene>, roots: Roots) -> Result<BspTree> {
        generate::tree(scene, roots)
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The faces from the nearest to the farthest for an eye: of each, the number of its first part in the scene. Each is
    /// there once, where its first piece comes.
    pub fn front_to_back(&self, view: &View) -> Vec<u32> {
        let eye = view.eye_from_object(&DAffine3::IDENTITY);
        let turned = normal_matrix(&eye.matrix3);
        let mut is_listed = vec![false; self.faces.len()];
        let mut order = Vec::with_capacity(self.faces.len());
        let mut list = |at: u32| {
            let start = at.checked_sub(1).map_or(0, |before| self.nodes[before as usize].end);
            for face in &self.listed[start as usize..self.nodes[at as usize].end as usize] {
                if !std::mem::replace(&mut is_listed[*face as usize], true) {
                    order.push(self.faces[*face as usize]);
                }
            }
        };
        // Nodes whose near side was gone through wait for their own faces and the far side.
        let mut waiting: Vec<(u32, u32)> = Vec::new();
        let mut at = if self.nodes.is_empty() { NONE } else { 0 };
        loop {
            while at != NONE {
                let node = &self.nodes[at as usize];
                let point = self.centre + node.normal * node.distance;
                let [front, back] = node.children;
                let normal = turned * node.normal;
                let sees_front = view.faces_viewer(normal, eye.transform_point3(point));
                let (near, far) = if sees_front { (front, back) } else { (back, front) };
                waiting.push((at, far));
                at = near;
            }
            let Some((node, far)) = waiting.pop() else { break };
            list(node);
            at = far;
        }
        let left = self.faces.iter().zip(&is_listed).filter(|(_, is_listed)| !**is_listed);
        order.extend(left.map(|(face, _)| *face));
        order
    }

    /// How many faces, nodes and cuts of pieces it has, and how deep it is.
    pub fn counts(&self) -> TreeCounts {
        let (faces, nodes) = (self.faces.len() as u64, self.nodes.len() as u64);
        TreeCounts { faces, nodes, splits: self.splits, depth: self.depth }
    }

    /// Bytes held, without the scene.
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + (self.faces.len() + self.listed.len()) * 4
    }
}

/// How large a [`BspTree`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TreeCounts {
    /// Faces.
    pub faces: u64,
    /// Planes that divide, and parts that are not divided any more.
    pub nodes: u64,
    /// Pieces of faces that a plane cut in two.
    pub splits: u64,
    /// The nodes from the root to the deepest one.
    pub depth: u32,
}

/// Renders a tree's scene as [`scanline::render`] does, bit for bit, by a traversal.
///
/// # Errors
/// As [`scanline::render`].
pub fn render(
    tree: &BspTree,
    priority: i32,
    view: &View,
    plan: LinePlan,
    rows: Rows,
) -> Result<SpanImage> {
    let cluster = Cluster { priority, ..tree.scene().clone().into() };
    let frame = scanline::frame(&[cluster], view, plan, rows)?;
    let order = listed(tree, &frame);
    Ok(visible::solve_in_order(frame, &order))
}

/// The faces of a frame of a tree's scene, seals and drawn edges too, from the nearest to the farthest.
pub fn listed(tree: &BspTree, frame: &SpanImage) -> Vec<FaceId> {
    let faces = frame.sources().first().map_or(&[][..], |source| source.faces.faces());
    // Parts follow their face in the table, which ascends by number: where each face's begin.
    let mut starts = vec![NONE; tree.faces.len()];
    let mut at = 0;
    for (place, face) in faces.iter().enumerate() {
        while tree.faces.get(at + 1).is_some_and(|next| *next <= face.ordinal) {
            at += 1;
        }
        starts[at] = starts[at].min(place as u32);
    }
    let mut order = Vec::with_capacity(faces.len());
    for first in tree.front_to_back(frame.view()) {
        let Ok(at) = tree.faces.binary_search(&first) else { continue };
        if starts[at] == NONE {
            continue;
        }
        let end = tree.faces.get(at + 1).copied().unwrap_or(u32::MAX);
        let parts = faces[starts[at] as usize..].iter().take_while(|face| face.ordinal < end);
        order.extend((starts[at] as usize..).zip(parts).map(|(place, _)| frame.id(0, place)));
    }
    order
}
