//! Sources: who rendered a face, and what shades it.

use std::cmp::Ordering;
use std::sync::Arc;

use super::face::{FaceTable, FaceTableBuilder};
use super::hold::Held;
use crate::error::Result;
use crate::fragment::{
    Batch, Columns, Fragments, Member, Painted, Stage, Surfaces, object_name, stack,
};
use crate::key::Key;

/// The faces of one scene under one shading stack. Merging unites sources; a shader applies to the
/// sources of its input, so that fog on one cluster before a merge and fog on all after it both mean
/// what they say.
///
/// Sources are ordered by (label, scene, stack, mattes), and this order decides between faces that coincide.
/// The label comes first so that the decision survives a change of the scene's contents: in an
/// animation nothing flickers.
#[derive(Clone, Debug)]
pub struct Source {
    /// The scene's name, such as its file as the graph names it.
    pub label: String,
    /// The scene's contents.
    pub scene: Key,
    /// What is known of its surfaces.
    pub surfaces: Arc<dyn Surfaces>,
    /// What was done to it since it was rendered, first to last.
    pub stack: Vec<Stage>,
    /// Its faces on the screen.
    pub faces: Arc<FaceTable>,
    /// If it is a matte, which: its faces are not seen, but [dim](super::hold) what they hold.
    pub matte: Option<Key>,
    /// The mattes that dim it, sorted.
    pub held: Vec<Held>,
}

impl Source {
    /// How two sources are ordered. `Equal` means that they are the same.
    pub fn order(&self, other: &Source) -> Ordering {
        let stack = |source: &Source| source.stack.iter().map(Stage::key).collect::<Vec<_>>();
        self.label
            .cmp(&other.label)
            .then(self.scene.cmp(&other.scene))
            .then_with(|| stack(self).cmp(&stack(other)))
            .then_with(|| (&self.matte, &self.held).cmp(&(&other.matte, &other.held)))
    }

    /// The columns that the whole stack reads, and the colour that it changes.
    pub fn reads(&self) -> Columns {
        stack::reads(&self.stack)
    }

    /// The source as part of what is around a shader.
    pub fn member(&self) -> Member {
        Member {
            label: self.label.clone(),
            scene: self.scene,
            surfaces: self.surfaces.clone(),
            stack: self.stack.clone(),
            is_beside: false,
        }
    }

    /// Whether a face is shaded alike all over, so that one evaluation serves all of it: \[N]'s
    /// uniform intensity.
    pub fn shades_alike(&self, ordinal: u32) -> bool {
        !self.reads().meets(self.surfaces.varying(ordinal) | Columns::PLACE)
    }

    /// Fills and shades a batch of this source's fragments: its surfaces first, then its stack. Surfaces
    /// know their faces where they were rendered; each shader sees them where they were then.
    pub fn shade(&self, fragments: &mut Fragments<'_>, batch: &dyn Batch) {
        if fragments.is_empty() {
            return;
        }
        fragments.label.clone_from(&self.label);
        fragments.scene = self.scene;
        stack::shade(&self.stack, &*self.surfaces, batch, fragments);
    }

    /// Finds what pictures show of some fragments of a batch, given by their places in it.
    pub fn paint(&self, fragments: &Fragments<'_>, which: &[usize]) -> Painted {
        stack::paint(&self.stack, &*self.surfaces, fragments, which)
    }

    /// Fills columns of a batch of this source's fragments without shading them.
    pub fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        let places = stack::fill_at_start(&self.stack, &*self.surfaces, wanted, fragments);
        if let Some(last) = places.into_iter().next() {
            fragments.go_to(last);
        }
    }

    /// The name of the object that a face belongs to, with its source's: `"cars.glb/truck/wheel"`.
    pub fn object(&self, ordinal: u32) -> String {
        object_name(&self.label, &self.surfaces.object(ordinal))
    }

    /// The same source with the faces of `other`, which must be equal in order, added. Returns it with
    /// the place of each face of the two tables in the new one; `None` if places stay.
    pub(super) fn unite(&self, other: &Source) -> Result<(Source, [Option<Vec<u32>>; 2])> {
        let surfaces = self.unite_surfaces(other);
        let same = Arc::ptr_eq(&self.faces, &other.faces) || {
            let ordinals = |source: &Source| source.faces.faces().len();
            let pairs = self.faces.faces().iter().zip(other.faces.faces());
            ordinals(self) == ordinals(other) && { pairs }.all(|(a, b)| a.ordinal == b.ordinal)
        };
        if same {
            return Ok((Source { surfaces, ..self.clone() }, [None, None]));
        }
        let (faces, places) = FaceTableBuilder::union(&self.faces, &other.faces)?;
        Ok((Source { faces: Arc::new(faces), surfaces, ..self.clone() }, places.map(Some)))
    }

    /// Surfaces that know the faces of both: a scene does; without, what is stored of either.
    fn unite_surfaces(&self, other: &Source) -> Arc<dyn Surfaces> {
        let knows_all = |source: &Source| source.surfaces.offers(Columns::NORMAL).is_ok();
        match (knows_all(self), knows_all(other)) {
            (true, _) => self.surfaces.clone(),
            (_, true) => other.surfaces.clone(),
            _ => {
                let united = self.surfaces.provenance();
                let united = united.and_then(|provenance| provenance.united(&*other.surfaces));
                united.unwrap_or_else(|| self.surfaces.clone())
            }
        }
    }
}
