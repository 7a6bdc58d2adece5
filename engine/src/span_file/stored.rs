//! What a file says of faces whose scene is not there.

use std::any::Any;
use std::sync::Arc;

use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::{Columns, Fragments, Origin, Provenance, Surfaces};

/// What a face looks like by itself: \[N]'s colour table.
#[derive(Clone, Debug)]
pub(super) struct StoredLook {
    pub(super) color: Color,
    pub(super) alpha: f32,
    pub(super) unlit: bool,
    /// Whether the colour differs from place to place, and this is the one of one place.
    pub(super) varies: bool,
    pub(super) object: String,
}

/// A face's look: places in the tables of [`Looks`].
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceLook {
    /// Its number in its source.
    pub(super) ordinal: u32,
    pub(super) paint: u32,
    pub(super) object: u32,
    pub(super) varies: bool,
    pub(super) unlit: bool,
}

/// The looks of a source's faces.
#[derive(Debug, Default)]
pub(super) struct Looks {
    /// By ascending ordinal.
    faces: Vec<FaceLook>,
    paints: Vec<(Color, f32)>,
    objects: Vec<String>,
}

impl Looks {
    /// Adds colours; returns the place of the first.
    pub(super) fn add_paints(&mut self, paints: impl Iterator<Item = (Color, f32)>) -> u32 {
        let base = self.paints.len() as u32;
        self.paints.extend(paints);
        base
    }

    /// Adds names of objects; returns the place of the first.
    pub(super) fn add_objects(&mut self, objects: impl Iterator<Item = String>) -> u32 {
        let base = self.objects.len() as u32;
        self.objects.extend(objects);
        base
    }

    /// Adds a face; ordinals must ascend.
    pub(super) fn push(&mut self, face: FaceLook) {
        self.faces.push(face);
    }

    /// How many faces are stored with the colour of one place only.
    pub(super) fn varying(&self) -> usize {
        self.faces.iter().filter(|face| face.varies).count()
    }

    /// The looks of the faces of both.
    fn united(&self, other: &Looks) -> Looks {
        let mut all = Looks::default();
        let paints = [self, other].map(|looks| all.add_paints(looks.paints.iter().copied()));
        let objects = [self, other].map(|looks| all.add_objects(looks.objects.iter().cloned()));
        for (i, looks) in [self, other].into_iter().enumerate() {
            all.faces.extend(looks.faces.iter().map(|face| FaceLook {
                paint: paints[i] + face.paint,
                object: objects[i] + face.object,
                ..*face
            }));
        }
        all.faces.sort_by_key(|face| face.ordinal);
        all.faces.dedup_by_key(|face| face.ordinal);
        all
    }

    fn of(&self, ordinal: u32) -> Option<&FaceLook> {
        self.place(ordinal).map(|place| &self.faces[place])
    }

    /// The place of a face among all by its number.
    pub(super) fn place(&self, ordinal: u32) -> Option<usize> {
        self.faces.binary_search_by_key(&ordinal, |face| face.ordinal).ok()
    }

    /// The greatest number of a face.
    pub(super) fn last(&self) -> Option<u32> {
        self.faces.last().map(|face| face.ordinal)
    }
}

/// The surfaces of a source whose scene is not there.
#[derive(Debug, Default)]
pub(super) struct Stored {
    pub(super) looks: Looks,
    pub(super) origin: Option<Origin>,
    /// Why the scene is not there.
    pub(super) why: String,
}

impl Surfaces for Stored {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        if !wanted.contains(Columns::COLOR) {
            return;
        }
        for i in 0..fragments.len() {
            let look = self.looks.of(fragments.ordinal[i]);
            let paint =
                look.map_or((Color::grey(0.8), 1.0), |look| self.looks.paints[look.paint as usize]);
            fragments.color.push(paint.0);
            fragments.alpha.push(paint.1);
            fragments.unlit.push(look.is_some_and(|look| look.unlit));
        }
    }

    fn varying(&self, _: u32) -> Columns {
        Columns::NONE
    }

    fn object(&self, ordinal: u32) -> String {
        let look = self.looks.of(ordinal);
        look.map_or(String::new(), |look| self.looks.objects[look.object as usize].clone())
    }

    fn provenance(&self) -> Option<&dyn Provenance> {
        Some(self)
    }

    fn offers(&self, wanted: Columns) -> Result<()> {
        if wanted.meets(Columns::NORMAL | Columns::WORLD) {
            let why = &self.why;
            return Err(Error::invalid(format!(
                "normals are asked for (by lights, or as a channel), or what casts shadows, and {why}: its span file knows depth \
                 and colour only. Put the scene back (`ReadSpans` has a field for its folder), or write the \
                 file with `scenes: Embedded`, or lit, with `shaded: true`"
            )));
        }
        Ok(())
    }
}

impl Provenance for Stored {
    fn origin(&self) -> Option<Origin> {
        self.origin.clone()
    }

    fn united(&self, other: &dyn Surfaces) -> Option<Arc<dyn Surfaces>> {
        let other = (other as &dyn Any).downcast_ref::<Stored>()?;
        // What came with its contents is better than what must be found, and this than nothing.
        let worth = |origin: &&Origin| origin.contents.is_some();
        let origins = self.origin.iter().chain(&other.origin);
        let origin = origins.min_by_key(|origin| !worth(origin)).cloned();
        let looks = self.looks.united(&other.looks);
        Some(Arc::new(Stored { looks, origin, why: self.why.clone() }))
    }
}

/// Whether the colour of a face differs from place to place, of surfaces that may be stored.
pub(super) fn varies(surfaces: &dyn Surfaces, ordinal: u32) -> bool {
    match (surfaces as &dyn Any).downcast_ref::<Stored>() {
        Some(stored) => stored.looks.of(ordinal).is_some_and(|look| look.varies),
        None => surfaces.varying(ordinal).meets(Columns::COLOR),
    }
}

/// The looks of the faces of one source's fragments; `varies` says of which the colour differs from place
/// to place.
pub(super) fn looks(
    fragments: &Fragments<'_>,
    varies: impl Fn(u32) -> bool,
    object: impl Fn(u32) -> String,
) -> Vec<StoredLook> {
    let look = |i: usize| StoredLook {
        color: fragments.color[i],
        alpha: fragments.alpha[i],
        unlit: fragments.unlit.get(i).copied().unwrap_or(false),
        varies: varies(fragments.ordinal[i]),
        object: object(fragments.ordinal[i]),
    };
    (0..fragments.len()).map(look).collect()
}
