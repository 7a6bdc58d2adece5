//! What is around a surface: everything that was in the image when a shader was applied to it, seen or
//! not. Shadows fall from it, rays meet it.

use std::sync::Arc;

use super::stack::Stage;
use super::{Columns, Surfaces};
use crate::error::{Error, Result};
use crate::key::{Key, KeyHasher};
use crate::trace::Casters;

/// A source as a world holds it: a scene under a stack.
#[derive(Clone, Debug)]
pub struct Member {
    /// The scene's name.
    pub label: String,
    /// The scene's contents.
    pub scene: Key,
    /// What is known of its surfaces.
    pub surfaces: Arc<dyn Surfaces>,
    /// What was done to it before.
    pub stack: Vec<Stage>,
    /// Whether it was not in the image but beside it: seen by rays, not shaded with the rest.
    pub is_beside: bool,
}

/// All sources of an image, for what looks around in it. Its key stands for its contents.
#[derive(Debug)]
pub struct World {
    key: Key,
    /// What casts in it, whatever was done to its colours.
    geometry: Key,
    members: Vec<Member>,
    /// The places of members whose geometry no earlier one has.
    distinct: Vec<usize>,
    is_missing: bool,
}

/// Of surfaces, those that are seen where nothing is met, the nearest first: their places, and the face of each.
pub fn beyond<'a>(surfaces: impl Iterator<Item = &'a dyn Surfaces>) -> Vec<(usize, u32)> {
    let all = surfaces.enumerate().filter_map(|(at, surfaces)| Some((at, surfaces.beyond()?)));
    let mut all: Vec<(usize, (u32, f64))> = all.collect();
    // Where two coincide, the later is seen, as in the merge.
    all.sort_by(|(i, (_, a)), (k, (_, b))| a.total_cmp(b).then(k.cmp(i)));
    all.into_iter().map(|(at, (face, _))| (at, face)).collect()
}

impl World {
    /// A world of sources.
    pub fn new(members: Vec<Member>) -> World {
        let mut key = KeyHasher::new("world");
        for member in &members {
            key.bytes(member.label.as_bytes()).key(member.scene).value(&member.is_beside);
            member.stack.iter().for_each(|stage| {
                key.key(stage.key());
            });
        }
        let same = |a: &Member, b: &Member| a.scene == b.scene && a.label == b.label;
        let is_new = |at: &usize| !members[..*at].iter().any(|known| same(known, &members[*at]));
        let distinct: Vec<usize> = (0..members.len()).filter(is_new).collect();
        let mut geometry = KeyHasher::new("geometry");
        for at in &distinct {
            geometry.bytes(members[*at].label.as_bytes()).key(members[*at].scene);
        }
        let (key, geometry) = (key.finish(), geometry.finish());
        World { key, geometry, members, distinct, is_missing: false }
    }

    /// A world of which only the key is known.
    pub(super) fn missing(key: Key) -> World {
        let (members, distinct) = (Vec::new(), Vec::new());
        World { key, geometry: key, members, distinct, is_missing: true }
    }

    /// What it is.
    pub fn key(&self) -> Key {
        self.key
    }

    /// What casts shadows in it: the same in worlds that differ in shaders alone.
    pub fn geometry(&self) -> Key {
        self.geometry
    }

    /// The sources.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// The sources that cast shadows, each scene once, with their places among the members.
    pub fn casters(&self) -> impl Iterator<Item = (usize, &Casters)> {
        self.distinct
            .iter()
            .filter_map(|at| self.members[*at].surfaces.rays().map(|rays| (*at, rays.casters())))
    }

    /// The sources that are seen where nothing is met, the nearest first: their places among the members, and the
    /// face of each.
    pub fn beyond(&self) -> Vec<(usize, u32)> {
        beyond(self.members.iter().map(|member| &*member.surfaces))
    }

    /// Whether all of it is there.
    ///
    /// # Errors
    /// If the scene of a member is not there, or was moved on the screen, so that it has no place in the
    /// world any more.
    pub fn check(&self) -> Result<()> {
        if self.is_missing {
            return Err(Error::invalid(
                "what cast shadows when this was lit is not in the file of spans: light it again",
            ));
        }
        for member in &self.members {
            if super::stack::moves(&member.stack) {
                return Err(Error::invalid(format!(
                    "\"{}\" was moved on the screen after it was rendered and has no place in the world from \
                     which to cast shadows or be mirrored: light and trace before moving, or light with \
                     `shadows: Off`",
                    member.label
                )));
            }
            member.surfaces.offers(Columns::WORLD)?;
        }
        Ok(())
    }
}
