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
use exr::prelude::{ImageAttributes, LayerAttributes, Text};

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
