//! Sources: who rendered a face, and what shades it.

use std::cmp::Ordering;
use std::sync::Arc;

use super::face::{FaceTable, FaceTableBuilder};
use crate::error::Result;
use crate::fragment::{Columns, Fragments, Shader, Surfaces};
use crate::key::Key;

/// The faces of one scene under one shading stack. Merging unites sources; a shader applies to the
/// sources of its input, so that fog on one cluster before a merge and fog on all after it both mean
/// what they say.
///
/// Sources are ordered by (label, scene, stack), and this order decides between faces that coincide.
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
    /// The shaders to run over its fragments, first to last.
    pub stack: Vec<Arc<dyn Shader>>,
    /// Its faces on the screen.
    pub faces: Arc<FaceTable>,
}

impl Source {
    /// How two sources are ordered. `Equal` means that they are the same.
    pub fn order(&self, other: &Source) -> Ordering {
        let stack = |source: &Source| source.stack.iter().map(|s| s.key()).collect::<Vec<_>>();
        self.label
            .cmp(&other.label)
            .then(self.scene.cmp(&other.scene))
            .then_with(|| stack(self).cmp(&stack(other)))
    }

    /// The columns that the whole stack reads, and the colour that it changes.
    pub fn reads(&self) -> Columns {
        self.stack.iter().fold(Columns::COLOR, |all, shader| all | shader.reads())
    }

    /// Whether a face is shaded alike all over, so that one evaluation serves all of it: \[N]'s
    /// uniform intensity.
    pub fn shades_alike(&self, ordinal: u32) -> bool {
        !self.reads().meets(self.surfaces.varying(ordinal) | Columns::PLACE)
    }

    /// Fills and shades a batch of this source's fragments: its surfaces first, then its stack.
    pub fn shade(&self, fragments: &mut Fragments<'_>) {
        if fragments.is_empty() {
            return;
        }
        fragments.fill(self.reads(), &*self.surfaces);
        for shader in &self.stack {
            shader.shade(fragments);
        }
    }

    /// The name of the object that a face belongs to, with its source's: `"cars.glb/truck/wheel"`.
    pub fn object(&self, ordinal: u32) -> String {
        let path = self.surfaces.object(ordinal);
        if path.is_empty() { self.label.clone() } else { format!("{}/{path}", self.label) }
    }

    /// The same source with the faces of `other`, which must be equal in order, added. Returns it with
    /// the place of each face of the two tables in the new one; `None` if places stay.
    pub(super) fn unite(&self, other: &Source) -> Result<(Source, [Option<Vec<u32>>; 2])> {
        let ordinals = |source: &Source| source.faces.faces().len();
        let same = Arc::ptr_eq(&self.faces, &other.faces)
            || (ordinals(self) == ordinals(other)
                && self
                    .faces
                    .faces()
                    .iter()
                    .zip(other.faces.faces())
                    .all(|(a, b)| a.ordinal == b.ordinal));
        if same {
            return Ok((self.clone(), [None, None]));
        }
        let (faces, places) = FaceTableBuilder::union(&self.faces, &other.faces)?;
        Ok((Source { faces: Arc::new(faces), ..self.clone() }, places.map(Some)))
    }
}
