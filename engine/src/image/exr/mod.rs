//! OpenEXR: any channels of any flat layers and parts in, one layer out.
//!
//! What ids mean is in the attribute `spandrel/names`, one `id name` to a line.

mod b44;
mod chunks;
mod layers;
mod read;
mod write;

use exr::meta::attribute::AttributeValue;
use exr::meta::header::Header;
use exr::prelude::{ImageAttributes, IntegerBounds, LayerAttributes, Text};
use glam::{DAffine2, DAffine3, DMat4, DVec4, Mat4};

pub use layers::{Layer, Layers, Select};
pub(super) use read::{head, read};
pub(super) use write::write;

/// The attribute that says what ids mean.
const NAMES: &str = "spandrel/names";

/// What a file says of its picture beside its pixels, such as who made it, or what the numbers of a Cryptomatte
/// mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Attributes {
    image: ImageAttributes,
    layer: LayerAttributes,
}

impl Attributes {
    /// Those of some parts of a file, the first of which counts most; without what is no longer true of the picture
    /// when it is read.
    fn of<'h>(mut headers: impl Iterator<Item = &'h Header>) -> Option<Attributes> {
        let first = headers.next()?;
        let mut made = Attributes {
            image: first.shared_attributes.clone(),
            layer: first.own_attributes.clone(),
        };
        for header in headers {
            for (name, value) in &header.own_attributes.other {
                made.layer.other.entry(name.clone()).or_insert_with(|| value.clone());
            }
        }
        made.image.chromaticities = None;
        made.layer.layer_name = None;
        made.layer.preview = None;
        made.layer.multi_view_names = None;
        made.layer.view_name = None;
        made.layer.original_data_window = None;
        made.layer.other.remove(&Text::from(NAMES));
        Some(made)
    }

    /// Of a picture that a camera took. `camera` brings the world to the camera, which looks along z with x to the right
    /// and y up; `ndc` brings it to the picture, which is 0 to 1 from the left and from the top; both take columns.
    /// `clips` are the distances of the front and the back plane, if there are such.
    pub fn of_camera(camera: DAffine3, ndc: DMat4, clips: [Option<f64>; 2]) -> Attributes {
        let [front, back] = clips.map(|clip| clip.map(|distance| distance as f32));
        // Files have matrices for points that are rows: the columns one by one.
        let matrix = |matrix: DMat4| Some(matrix.as_mat4().to_cols_array());
        let layer = LayerAttributes {
            world_to_camera: matrix(DMat4::from(camera)),
            world_to_normalized_device: matrix(ndc),
            near_clip_plane: front,
            far_clip_plane: back,
            ..LayerAttributes::default()
        };
        Attributes { image: ImageAttributes::new(IntegerBounds::zero()), layer }
    }

    /// The numbers of a camera's, if there is nothing else: both matrices, column by column, and the two distances.
    pub(in crate::image) fn camera(&self) -> Option<Vec<Option<f32>>> {
        let LayerAttributes { world_to_camera, world_to_normalized_device, .. } = &self.layer;
        let matrices = world_to_camera.iter().chain(world_to_normalized_device).flatten();
        let clips = [self.layer.near_clip_plane, self.layer.far_clip_plane];
        let numbers: Vec<Option<f32>> = matrices.copied().map(Some).chain(clips).collect();
        (Attributes::from_camera(&numbers).as_ref() == Some(self)).then_some(numbers)
    }

    /// A camera's, of such numbers.
    pub(in crate::image) fn from_camera(numbers: &[Option<f32>]) -> Option<Attributes> {
        let [matrices @ .., near, far] = numbers else { return None };
        let known: Option<Vec<f32>> = matrices.iter().copied().collect();
        let known = known?;
        let ([camera, ndc], []) = known.as_chunks::<16>() else { return None };
        let layer = LayerAttributes {
            world_to_camera: Some(*camera),
            world_to_normalized_device: Some(*ndc),
            near_clip_plane: *near,
            far_clip_plane: *far,
            ..LayerAttributes::default()
        };
        Some(Attributes { image: ImageAttributes::new(IntegerBounds::zero()), layer })
    }

    /// The same of the picture in another frame. `frame` brings places in the old one, 0 to 1 from the left and from
    /// the top, to such in the new.
    #[must_use]
    pub fn reframed(&self, frame: DAffine2) -> Attributes {
        let mut made = self.clone();
        if let Some(known) = &mut made.layer.world_to_normalized_device {
            let before = Mat4::from_cols_array(known).as_dmat4();
            let (x, y, at) = (frame.matrix2.x_axis, frame.matrix2.y_axis, frame.translation);
            let frame = DMat4::from_cols(
                DVec4::new(x.x, x.y, 0.0, 0.0),
                DVec4::new(y.x, y.y, 0.0, 0.0),
                DVec4::Z,
                DVec4::new(at.x, at.y, 0.0, 1.0),
            );
            *known = (frame * before).as_mat4().to_cols_array();
        }
        made
    }

    /// The text of an attribute of one's own.
    pub fn text(&self, name: &str) -> Option<String> {
        match self.layer.other.get(&Text::new_or_none(name)?)? {
            AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        }
    }

    /// The names of what is no standard attribute.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.layer.other.keys().map(Text::to_string).collect();
        names.sort();
        names
    }
}
