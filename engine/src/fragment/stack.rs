//! Shading stacks: what was done to the faces of a scene since they were rendered.

use serde::{Deserialize, Serialize};
use std::sync::Arc;

use super::world::World;
use super::{
    Around, Batch, Casting, Columns, Fragments, Kept, LinePiece, Painted, PictureShare, Shader,
    Surfaces,
};
use crate::camera::Plane;
use crate::key::{Key, KeyHasher};

/// An entry of a stack.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Stage {
    /// A program runs over its fragments.
    Shade(Shading),
    /// Its faces are moved on the screen or in depth.
    Place(Placement),
    /// Something with this key was done to it before its colours were stored: nothing is left to do. The
    /// least key stands at the end of what was stored.
    Kept(Key),
}

impl Stage {
    /// What it is; what was stored keeps its place among sources.
    pub fn key(&self) -> Key {
        match self {
            Stage::Shade(shading) => shading.key,
            Stage::Kept(key) => *key,
            stage @ Stage::Place(_) => Key::of(stage),
        }
    }
}

/// A shader where it stands in a stack.
#[derive(Clone, Debug)]
pub struct Shading {
    shader: Arc<dyn Shader>,
    /// What was there to be seen from its surfaces, if it wants to know.
    world: Option<Arc<World>>,
    key: Key,
}

impl Shading {
    /// A shader that is applied to sources; `world` is what it sees of them if it looks around.
    pub fn new(shader: Arc<dyn Shader>, world: impl FnOnce() -> Arc<World>) -> Shading {
        let looks = shader.reads().meets(Columns::WORLD | Columns::TRACED);
        // Who does not look around pays for no world, and its key does not change with one.
        let world = looks.then(world);
        let key = Shading::key(&*shader, world.as_deref());
        Shading { shader, world, key }
    }

    fn key(shader: &dyn Shader, world: Option<&World>) -> Key {
        let mut key = KeyHasher::new("shading");
        key.value(shader);
        world.into_iter().for_each(|world| {
            key.key(world.key());
        });
        key.finish()
    }

    /// The shader.
    pub fn shader(&self) -> &Arc<dyn Shader> {
        &self.shader
    }

    /// What is around it.
    pub fn world(&self) -> Option<&Arc<World>> {
        self.world.as_ref()
    }

    /// The same shader with a world of the same key, which has what this one lacks.
    #[must_use]
    pub fn with_world(&self, world: Arc<World>) -> Shading {
        Shading { world: Some(world), ..self.clone() }
    }
}

/// How it is saved: of the world only the key, as many share one.
#[derive(Serialize, Deserialize)]
struct Saved {
    shader: Arc<dyn Shader>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    world: Option<Key>,
}

impl Serialize for Shading {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let world = self.world.as_ref().map(|world| world.key());
        Saved { shader: self.shader.clone(), world }.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Shading {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Shading, D::Error> {
        let Saved { shader, world } = Saved::deserialize(deserializer)?;
        let world = world.map(|key| Arc::new(World::missing(key)));
        let key = Shading::key(&*shader, world.as_deref());
        Ok(Shading { shader, world, key })
    }
}

/// A move of faces: what is seen at (x, y, rho) is seen after it at
/// (x + `x`, y + `y`, rho * `scale` + `offset`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// To the right, in pixels.
    pub x: f64,
    /// Down, in pixels.
    pub y: f64,
    /// Factor of the depth.
    pub scale: f64,
    /// What is added to the depth, after that.
    pub offset: f64,
}

impl Placement {
    /// The plane of a moved face.
    pub fn plane(&self, plane: &Plane) -> Plane {
        let Plane { a, b, c } = *plane;
        let (a, b, c) = (a * self.scale, b * self.scale, c * self.scale + self.offset);
        Plane { a, b, c: c - a * self.x - b * self.y }
    }

    /// Takes fragments back to where they were before.
    fn undo(&self, fragments: &mut Fragments<'_>) {
        fragments.x.iter_mut().for_each(|x| *x -= self.x);
        fragments.y.iter_mut().for_each(|y| *y -= self.y);
        let before = |depth: f64| (depth - self.offset) / self.scale;
        fragments.depth.iter_mut().for_each(|depth| *depth = before(*depth));
    }
}

/// A face's plane before all moves of a stack, and how far they moved it right and down, in pixels.
pub fn unmoved(stack: &[Stage], plane: &Plane) -> (Plane, [f64; 2]) {
    let mut at = (*plane, [0.0, 0.0]);
    for stage in stack.iter().rev() {
        if let Stage::Place(Placement { x, y, scale, offset }) = stage {
            let Plane { a, b, c } = at.0;
            // `plane` backwards, with the slopes that the plane has after the move.
            let c = c + a * x + b * y - offset;
            at.0 = Plane { a: a / scale, b: b / scale, c: c / scale };
            at.1 = [at.1[0] + x, at.1[1] + y];
        }
    }
    at
}

/// The columns that a whole stack reads, and the colour that it changes.
pub fn reads(stack: &[Stage]) -> Columns {
    let shaders = stack.iter().filter_map(|stage| match stage {
        Stage::Shade(shading) => Some(shading.shader.reads()),
        Stage::Place(_) | Stage::Kept(_) => None,
    });
    shaders.fold(Columns::COLOR, |all, reads| all | reads)
}

/// Whether a stack moves its faces.
pub fn moves(stack: &[Stage]) -> bool {
    stack.iter().any(|stage| matches!(stage, Stage::Place(_)))
}

/// Takes fragments to where they were rendered, and fills columns there. Returns where they were after
/// every move, the last first.
pub fn fill_at_start(
    stack: &[Stage],
    surfaces: &dyn Surfaces,
    wanted: Columns,
    fragments: &mut Fragments<'_>,
) -> Vec<[Vec<f64>; 3]> {
    let places = undo(stack, fragments);
    fragments.fill(wanted, surfaces);
    places
}

/// Fills and shades fragments where they were rendered: surfaces first, then the stack. What a pixel covers of
/// several attribute domains is shaded domain by domain, and blended by area.
pub fn shade(
    stack: &[Stage],
    surfaces: &dyn Surfaces,
    batch: &dyn Batch,
    fragments: &mut Fragments<'_>,
) {
    let places = undo(stack, fragments);
    let (parts, shown) = match batch.painted() {
        [] => (surfaces.divide(fragments), Vec::new()),
        painted => Painted::spread(painted, fragments.len()),
    };
    if parts.is_empty() {
        fragments.shown = shown;
        fragments.fill(reads(stack), surfaces);
        run(stack, places, batch, fragments);
        return;
    }
    // From here on each part is a fragment of its own, at its fragment's place.
    let widen = |column: &Vec<f64>| parts.iter().map(|(at, ..)| column[*at]).collect();
    let wide_places = places.iter().map(|place| place.each_ref().map(widen)).collect();
    let mut wide = fragments.parts(&parts);
    wide.shown = shown;
    wide.fill(reads(stack), surfaces);
    run(stack, wide_places, &FragmentParts { outer: batch, parts: &parts }, &mut wide);
    fragments.unite(&wide, &parts);
    // The parts went through the moves; their fragments go straight to the end of them.
    if let Some(last) = places.into_iter().next() {
        fragments.go_to(last);
    }
}

/// Finds what pictures show of some fragments of a batch, given by their places in it, for [`shade`] to find it known.
pub fn paint(
    stack: &[Stage],
    surfaces: &dyn Surfaces,
    fragments: &Fragments<'_>,
    which: &[usize],
) -> Painted {
    let chosen: Vec<PictureShare> = which.iter().map(|at| (*at, None, 1.0)).collect();
    let mut some = fragments.parts(&chosen);
    // Pictures lie on surfaces, so they are looked at where these were rendered, before every move.
    undo(stack, &mut some);
    let parts = surfaces.divide(&some);
    let wanted = Painted::COLUMNS.into_iter().filter(|columns| reads(stack).contains(*columns));
    let wanted = wanted.fold(Columns::NONE, |all, columns| all | columns);
    if parts.is_empty() {
        some.fill(wanted, surfaces);
        return Painted::of(chosen, some);
    }
    let mut wide = some.parts(&parts);
    wide.fill(wanted, surfaces);
    let outer = parts.into_iter().map(|(at, bundle, share)| (which[at], bundle, share));
    Painted::of(outer.collect(), wide)
}

/// Parts of fragments.
struct FragmentParts<'a> {
    outer: &'a dyn Batch,
    parts: &'a [PictureShare],
}

impl Batch for FragmentParts<'_> {
    fn kept(&self, key: Key) -> Option<Kept> {
        self.outer.kept(key)
    }

    fn keep(&self, key: Key, value: Kept, bytes: usize, seconds: f64) {
        self.outer.keep(key, value, bytes, seconds);
    }

    fn is_stopped(&self) -> bool {
        self.outer.is_stopped()
    }

    fn lit(&self, casting: &Casting<'_>) -> Option<Vec<f32>> {
        let lit = self.outer.lit(casting)?;
        Some(self.parts.iter().map(|(at, ..)| lit[*at]).collect())
    }

    fn count(&self, what: &'static str, number: u64) {
        self.outer.count(what, number);
    }

    fn coverage(&self, fragment: usize) -> f32 {
        let (at, _, share) = self.parts[fragment];
        self.outer.coverage(at) * share
    }

    fn pieces(&self, fragment: usize) -> Vec<LinePiece> {
        self.outer.pieces(self.parts[fragment].0)
    }
}

/// Takes fragments to where they were rendered. Returns where they were after every move, the last first.
fn undo(stack: &[Stage], fragments: &mut Fragments<'_>) -> Vec<[Vec<f64>; 3]> {
    let mut places = Vec::new();
    for stage in stack.iter().rev() {
        if let Stage::Place(placement) = stage {
            places.push([&fragments.x, &fragments.y, &fragments.depth].map(Vec::clone));
            placement.undo(fragments);
        }
    }
    places
}

/// Runs a stack over fragments whose columns are filled, and takes them to `places`, the last first.
fn run(
    stack: &[Stage],
    mut places: Vec<[Vec<f64>; 3]>,
    batch: &dyn Batch,
    fragments: &mut Fragments<'_>,
) {
    for (at, stage) in stack.iter().enumerate() {
        match stage {
            Stage::Shade(shading) => {
                let world = shading.world.as_deref();
                let around = Around { world, stack, at, batch };
                shading.shader.shade(fragments, &around);
            }
            Stage::Place(_) => {
                // The list has the last move first, so this is the next one.
                if let Some(place) = places.pop() {
                    fragments.go_to(place);
                }
            }
            Stage::Kept(_) => {}
        }
    }
}
