//! What is in a scene, by the names that programs, `Refine` and the like take: its objects as a tree, its materials.

use spandrel_engine::color::Color;
use spandrel_engine::fragment::Optics;
use spandrel_engine::scene::{AlphaMode, Material, Scene, Sides};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write;

use crate::print;

/// How many lines of a list are shown unless all are asked for.
const LINES: usize = 60;
/// How many objects of one parent are.
const SIBLINGS: usize = 12;

/// An object with those in it.
#[derive(Default)]
struct Node {
    name: String,
    /// How often it is there: the places of an array are one node.
    times: usize,
    faces: usize,
    children: Vec<Node>,
    by_name: HashMap<String, usize>,
}

impl Node {
    /// The object at a path below, added if it is new.
    fn add(&mut self, path: &str, faces: usize) {
        self.faces += faces;
        let (name, rest) = path.split_once('/').unwrap_or((path, ""));
        if name.is_empty() {
            self.times += 1;
            return;
        }
        let name = without_numbers(name);
        let next = self.children.len();
        let at = *self.by_name.entry(name.clone()).or_insert(next);
        if at == next {
            self.children.push(Node { name, ..Node::default() });
        }
        self.children[at].add(rest, faces);
    }

    /// How many lines it takes to show what is in it, down to a depth.
    fn lines(&self, depth: usize) -> usize {
        let more = usize::from(self.children.len() > SIBLINGS);
        let shown = self.children.iter().take(SIBLINGS);
        match depth {
            0 => 0,
            _ => shown.map(|child| 1 + child.lines(depth - 1)).sum::<usize>() + more,
        }
    }

    fn depth(&self) -> usize {
        self.children.iter().map(|child| 1 + child.depth()).max().unwrap_or(0)
    }

    fn show(&self, out: &mut String, indent: usize, depth: usize, most: usize) {
        for child in self.children.iter().take(most) {
            let times = match child.times {
                0 | 1 => String::new(),
                times => format!(", {} times", print::grouped(times as u64)),
            };
            let inside = match (depth, child.children.len()) {
                (1, count @ 1..) => format!(", {} in it", print::count(count, "object")),
                _ => String::new(),
            };
            let faces = print::count(child.faces, "face");
            let _ = writeln!(out, "{:indent$}{}: {faces}{times}{inside}", "", child.name);
            if depth > 1 {
                child.show(out, indent + 2, depth - 1, most);
            }
        }
        if let Some(rest) = self.children.get(most..).filter(|rest| !rest.is_empty()) {
            let faces = rest.iter().map(|child| child.faces).sum();
            let (count, faces) = (print::grouped(rest.len() as u64), print::count(faces, "face"));
            let _ = writeln!(out, "{:indent$}and {count} more, {faces} (--all lists them)", "");
        }
    }
}

/// The name of an array's place, `post[7]`, as the pattern that names them all.
fn without_numbers(name: &str) -> String {
    match name.strip_suffix(']').and_then(|name| name.rsplit_once('[')) {
        Some((name, number)) if number.bytes().all(|b| b.is_ascii_digit()) => format!("{name}[*]"),
        _ => name.to_owned(),
    }
}

/// Lists a scene's objects.
pub(crate) fn objects(out: &mut String, scene: &Scene, all: bool) {
    let mut root = Node::default();
    for instance in &scene.instances {
        root.add(&instance.path, instance.geometry.mesh().face_count());
    }
    if root.children.is_empty() {
        return;
    }
    let _ = writeln!(out, "  objects, as `object('..')` names them");
    let deepest = root.depth();
    if all {
        return root.show(out, 4, deepest, usize::MAX);
    }
    let fits = (2..=deepest).take_while(|depth| root.lines(*depth) <= LINES).last();
    root.show(out, 4, fits.unwrap_or(1), SIBLINGS);
}

/// The materials of scenes by name, each with the number of faces that show it in front.
#[derive(Default)]
pub(crate) struct Materials {
    known: BTreeMap<String, (Material, usize)>,
    /// Those that backs, seals and domains show.
    beside: BTreeSet<String>,
    bare: usize,
}

impl Materials {
    /// Adds those of a file that may be in no use.
    pub(crate) fn of_file(&mut self, materials: &BTreeMap<String, Material>) {
        for (name, material) in materials {
            self.known.entry(name.clone()).or_insert_with(|| (material.clone(), 0));
        }
    }

    /// Adds those that a scene's faces show.
    pub(crate) fn of_scene(&mut self, scene: &Scene) {
        let mut faces = vec![0; scene.materials.len()];
        let mut beside = vec![false; scene.materials.len()];
        for instance in &scene.instances {
            let mesh = instance.geometry.mesh();
            let mut show = |sides: Sides, front: bool| {
                beside[instance.material_of(sides, front) as usize] = true;
            };
            for face in 0..mesh.face_count() {
                faces[instance.material_of(mesh.sides(face), true) as usize] += 1;
                show(mesh.sides(face), false);
                for seal in mesh.seals(face) {
                    show(seal.sides, true);
                    show(seal.sides, false);
                }
            }
        }
        let shown = scene.material_names.iter().zip(beside).filter(|(_, is)| *is);
        self.beside.extend(shown.map(|(name, _)| name.clone()));
        let domains = scene.materials.iter().filter_map(|material| material.domains.as_ref());
        self.beside.extend(domains.flat_map(|domains| domains.table.values().cloned()));
        let named = scene.material_names.iter().zip(&scene.materials).zip(faces);
        for ((name, material), faces) in named {
            if name.is_empty() {
                self.bare += faces;
                continue;
            }
            self.known.entry(name.clone()).or_insert_with(|| (material.clone(), 0)).1 += faces;
        }
    }

    /// Lists them.
    pub(crate) fn show(&self, out: &mut String, all: bool) {
        if self.known.is_empty() {
            return;
        }
        let _ = writeln!(out, "materials, as `material('..')` names them");
        let most = if all { usize::MAX } else { LINES };
        for (name, (material, faces)) in self.known.iter().take(most) {
            let line = about(name, material);
            let faces = match faces {
                0 if self.beside.contains(name) => "on backs, seals or in domains".to_owned(),
                0 => "on no face".to_owned(),
                faces => print::count(*faces, "face"),
            };
            let _ = writeln!(out, "{line}; {faces}");
        }
        if self.known.len() > most {
            let count = print::grouped((self.known.len() - most) as u64);
            let _ = writeln!(out, "  and {count} more (--all lists them)");
        }
        if self.bare > 0 {
            let _ = writeln!(out, "  without a material: {}", print::count(self.bare, "face"));
        }
    }
}

fn about(name: &str, material: &Material) -> String {
    let [r, g, b] = material.color.to_array();
    let mut line = format!("  \"{name}\": color ({r:.3}, {g:.3}, {b:.3})");
    if material.alpha_mode != AlphaMode::Opaque {
        let _ = write!(line, ", alpha {} ({:?})", material.alpha, material.alpha_mode);
    }
    if material.finish.shines() {
        let _ = write!(line, ", {:?}", material.finish.gloss);
    }
    if let Some(optics) = material.finish.optics {
        let Optics { reflect, refract, index, .. } = optics;
        let shares = |color: Color| color.to_array().map(|v| format!("{v:.3}")).join(", ");
        let _ = write!(line, ", mirrors ({})", shares(reflect));
        if refract != Color::BLACK {
            let _ = write!(line, ", refracts ({}) by {index}", shares(refract));
        }
    }
    for (what, map) in &material.maps {
        let _ = write!(line, ", {what} from {:?}", map.picture);
    }
    if let Some(domains) = &material.domains {
        let table = domains.table.iter();
        let table: Vec<String> =
            table.map(|(index, bundle)| format!("{index} \"{bundle}\"")).collect();
        let _ = write!(line, ", domains by {:?}: {}", domains.define, table.join(", "));
    }
    line
}
