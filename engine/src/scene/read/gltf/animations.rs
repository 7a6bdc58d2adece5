//! Animations: which a file has, what they move, and where the one that is played has the nodes at a moment.
//!
//! One animation is played: the one that is named, or the first. What it does not move stands as the file's nodes do.

use ::gltf::json::animation::{Animation, Channel, Property};
use ::gltf::json::mesh::Mesh;
use ::gltf::json::scene::Node;
use ::gltf::json::validation::Checked;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::super::super::library::ReadOptions;
use super::super::reader::{LeftOut, Names};
use super::Builder;
use super::curves::Curve;
use super::nodes::{Moved, Tree};
use super::parse::File;
use crate::error::{Error, Result};

/// The names that a list shows at most.
const MOST_NAMES: usize = 12;

/// What animations may move.
pub(super) struct Movable {
    /// By node, whether something that is read stands on it or below.
    carries: Vec<bool>,
    /// By node, whether a scene shows it.
    shown: Vec<bool>,
    /// By node, the morph targets of its mesh.
    targets: Vec<usize>,
}

/// What an animation moves of what is read.
struct Effect {
    moved: BTreeSet<usize>,
    morphed: BTreeSet<usize>,
}

/// A curve, and what it moves.
struct Motion {
    node: usize,
    property: Property,
    curve: Curve,
}

impl Movable {
    pub(super) fn new(file: &File, tree: &Tree) -> Movable {
        let root = &file.root;
        let shown = tree.shown(root);
        let nodes = || root.nodes.iter().enumerate().filter(|(at, _)| shown[*at]);
        let seen = nodes().filter(|(at, node)| {
            let has_light = file.extension("nodes", *at, "KHR_lights_punctual").is_some();
            node.mesh.is_some() && node.skin.is_none() || node.camera.is_some() || has_light
        });
        let skinned = nodes().filter(|(_, node)| node.mesh.is_some());
        let skins: BTreeSet<usize> =
            skinned.filter_map(|(_, node)| node.skin).map(|skin| skin.value()).collect();
        let joints = skins.iter().flat_map(|skin| &root.skins[*skin].joints);
        let carried = seen.map(|(at, _)| at).chain(joints.map(|joint| joint.value()));
        let carries = tree.carriers(carried);
        // Once for each mesh, however many nodes place it.
        let of_mesh: Vec<usize> = root.meshes.iter().map(target_count).collect();
        let of_node = |node: &Node| node.mesh.map_or(0, |mesh| of_mesh[mesh.value()]);
        let targets = root.nodes.iter().map(of_node).collect();
        Movable { carries, shown, targets }
    }

    /// Whether an animation moves anything that is read.
    pub(super) fn is_moved_by(&self, animation: &Animation) -> bool {
        let Effect { moved, morphed } = self.effect(animation);
        !moved.is_empty() || !morphed.is_empty()
    }

    fn effect(&self, animation: &Animation) -> Effect {
        let (mut moved, mut morphed) = (BTreeSet::new(), BTreeSet::new());
        for channel in &animation.channels {
            let node = channel.target.node.value();
            if is_morph(channel) && self.shown[node] && self.targets[node] > 0 {
                morphed.insert(node);
            } else if !is_morph(channel) && self.carries[node] {
                moved.insert(node);
            }
        }
        Effect { moved, morphed }
    }
}

fn is_morph(channel: &Channel) -> bool {
    matches!(channel.target.path, Checked::Valid(Property::MorphTargetWeights))
}

/// The morph targets of a mesh.
fn target_count(mesh: &Mesh) -> usize {
    let counts = mesh.primitives.iter().map(|one| one.targets.as_ref().map_or(0, Vec::len));
    counts.max().unwrap_or(0)
}

impl Builder<'_> {
    /// Brings the nodes to where an animation has them, if a moment is asked for.
    ///
    /// # Errors
    /// If there is no animation of the name that is asked for, or it cannot be played.
    pub(super) fn play(&mut self, options: &ReadOptions) -> Result<()> {
        let file = self.file;
        if let Some(why) = &file.unplayable {
            let message = format!("its animations cannot be played: {why}");
            if options.moment.is_some() || options.animation.is_some() {
                return Err(self.reader.fault(message));
            }
            self.reader.note(message);
        }
        let names = animation_names(file);
        let chosen = match &options.animation {
            Some(wanted) => names.iter().position(|name| name == wanted).ok_or_else(|| {
                let all = match names.is_empty() {
                    true => "none".to_owned(),
                    false => quoted(&names, MOST_NAMES),
                };
                self.reader.fault(format!("there is no animation \"{wanted}\": the file has {all}"))
            })?,
            None => 0,
        };
        let movable = Movable::new(file, &self.tree);
        let Some(moment) = options.moment else {
            // Who examines a file is told of each.
            if !self.reader.examines
                && file.root.animations.iter().any(|one| movable.is_moved_by(one))
            {
                self.reader
                    .note("animations are not played: everything stands as the file's nodes do");
            }
            return Ok(());
        };
        let seconds = moment.seconds();
        if !seconds.is_finite() {
            return Err(Error::invalid(format!("frame {} has no time", moment.frame)));
        }
        let Some(name) = names.get(chosen) else { return Ok(()) };
        if names.len() > 1 && options.animation.is_none() {
            let others = quoted(&names[1..], MOST_NAMES);
            self.reader.note(format!(
                "animation \"{name}\" is played, the file's first; `animation` chooses another: {others}"
            ));
        }
        self.tell_left_out(chosen, name);
        let moved = self.moved(chosen, &movable, seconds);
        self.moved = moved.map_err(|e| self.in_file(&format!("animation \"{name}\""), e))?;
        self.tree.place(&file.root, &self.moved);
        Ok(())
    }

    /// Tells of all animations: their time, and what they move.
    pub(super) fn tell_animations(&mut self) {
        let file = self.file;
        let movable = Movable::new(file, &self.tree);
        let names = animation_names(file);
        for (at, name) in names.iter().enumerate() {
            let effect = movable.effect(&file.root.animations[at]);
            let mut ranges = Vec::new();
            let motions = self.motions(at, &movable, |motion| ranges.push(motion.curve.range()));
            let about = match motions {
                Ok(()) => format!(": {}, {}", told_time(&ranges), effect.told(file)),
                Err(error) => format!(" cannot be played: {error}"),
            };
            let is_first = at == 0 && names.len() > 1;
            let first = if is_first { "; played unless `animation` names another" } else { "" };
            self.reader.about.push(format!("animation \"{name}\"{about}{first}"));
        }
    }

    /// Remarks on channels of an animation that move no node.
    fn tell_left_out(&mut self, animation: usize, name: &str) {
        let json = self.file.json.get("animations").and_then(|all| all.get(animation));
        let channels = json.and_then(|one| one.get("channels")).and_then(Value::as_array);
        // Those of this extension are told with it.
        let is_told = |channel: &&Value| {
            channel.pointer("/target/extensions/KHR_animation_pointer").is_some()
        };
        let all = channels.map_or(0, |all| all.iter().filter(|one| !is_told(one)).count());
        let played = self.file.root.animations[animation].channels.len();
        if all > played {
            let count = all - played;
            self.reader.note(format!(
                "animation \"{name}\": {count} of its channels move nothing that is known, and are not played"
            ));
        }
    }

    /// Where an animation has the nodes that it moves.
    fn moved(
        &mut self,
        animation: usize,
        movable: &Movable,
        seconds: f64,
    ) -> Result<BTreeMap<usize, Moved>> {
        let mut all: BTreeMap<usize, Moved> = BTreeMap::new();
        self.motions(animation, movable, |Motion { node, property, curve }| {
            let moved = all.entry(node).or_default();
            match property {
                Property::Translation => moved.translation = Some(curve.vector(seconds).into()),
                Property::Rotation => moved.rotation = Some(curve.rotation(seconds)),
                Property::Scale => moved.scale = Some(curve.vector(seconds).into()),
                Property::MorphTargetWeights => moved.weights = Some(curve.weights(seconds)),
            }
        })?;
        Ok(all)
    }

    /// Makes the curves of an animation, one after the other: all at once may take much more memory than the file.
    ///
    /// # Errors
    /// If one is faulty, or moves what cannot be moved.
    fn motions(
        &mut self,
        animation: usize,
        movable: &Movable,
        mut made: impl FnMut(Motion),
    ) -> Result<()> {
        let animation = &self.file.root.animations[animation];
        let mut taken = HashSet::new();
        let mut left_out = LeftOut::default();
        for channel in &animation.channels {
            let Checked::Valid(property) = channel.target.path else { continue };
            let (node, number) = (channel.target.node.value(), channel.sampler.value());
            let targets = movable.targets[node];
            if is_morph(channel) && targets == 0 {
                left_out.add(|| format!("node {node}"));
                continue;
            }
            let curve = if !taken.insert((node, property as u8)) {
                Err(Error::invalid("another sampler moves the same"))
            } else if self.file.root.nodes[node].matrix.is_some() && !is_morph(channel) {
                Err(Error::invalid("the node has a matrix, and such nodes cannot be animated"))
            } else {
                let sampler = animation.samplers.get(number);
                let sampler = sampler.ok_or_else(|| Error::invalid("there is no such sampler"));
                sampler.and_then(|sampler| Curve::new(self, sampler, property, targets))
            };
            let curve = curve.map_err(|error| {
                let what = property_name(property);
                super::within(&format!("sampler {number}, {what} of node {node}"), error)
            })?;
            made(Motion { node, property, curve });
        }
        left_out.tell(self.reader, "nodes without morph targets are morphed by an animation");
        Ok(())
    }
}

impl Effect {
    fn told(&self, file: &File) -> String {
        let names = |nodes: &BTreeSet<usize>| {
            let names: Vec<String> = nodes.iter().map(|node| node_name(file, *node)).collect();
            quoted(&names, 3)
        };
        match (self.moved.is_empty(), self.morphed.is_empty()) {
            (true, true) => "moves nothing that is read".to_owned(),
            (false, true) => format!("moves {}", names(&self.moved)),
            (true, false) => format!("morphs {}", names(&self.morphed)),
            (false, false) => {
                format!("moves {}, morphs {}", names(&self.moved), names(&self.morphed))
            }
        }
    }
}

fn node_name(file: &File, node: usize) -> String {
    file.root.nodes[node].name.clone().unwrap_or_else(|| format!("node {node}"))
}

/// The names of a file's animations, each another.
fn animation_names(file: &File) -> Vec<String> {
    let mut names = Names::default();
    let all = file.root.animations.iter().enumerate();
    all.map(|(at, animation)| {
        names.unique(animation.name.as_deref().unwrap_or(&format!("animation {at}")))
    })
    .collect()
}

fn property_name(property: Property) -> &'static str {
    match property {
        Property::Translation => "translation",
        Property::Rotation => "rotation",
        Property::Scale => "scale",
        Property::MorphTargetWeights => "weights",
    }
}

/// From the first key to the last, by those of each curve.
fn told_time(ranges: &[[f64; 2]]) -> String {
    let first = ranges.iter().fold(f64::INFINITY, |first, [from, _]| first.min(*from));
    let last = ranges.iter().fold(f64::NEG_INFINITY, |last, [_, to]| last.max(*to));
    let [first, last] = [first, last].map(|time| (time * 1e4).round() / 1e4 + 0.0);
    match ranges.is_empty() {
        true => "no keys".to_owned(),
        false if first == 0.0 => format!("{last} s"),
        false => format!("{first} to {last} s"),
    }
}

/// Names in quotes: so many, and how many more there are.
fn quoted(names: &[String], most: usize) -> String {
    let (shown, more) = names.split_at(names.len().min(most));
    let shown: Vec<String> = shown.iter().map(|name| format!("\"{name}\"")).collect();
    let more = if more.is_empty() { String::new() } else { format!(" and {} more", more.len()) };
    format!("{}{more}", shown.join(", "))
}
