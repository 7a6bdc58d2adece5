//! Pictures as bytes, exactly: floats with all their bits, and what is known of the picture.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Attributes, Image, Samples, Window};

/// What is stored of a picture before its samples.
#[derive(Serialize, Deserialize)]
struct Head {
    size: (u32, u32),
    window: [u32; 4],
    /// Each channel, and whether it holds names.
    channels: Vec<(String, bool)>,
    names: BTreeMap<u32, String>,
    how: Option<String>,
    /// The camera that took it, as bits.
    camera: Option<Vec<Option<u32>>>,
}

impl Image {
    /// The picture as bytes; `None` for one that holds what a file says of it.
    pub fn packed(&self) -> Option<Vec<u8>> {
        let camera = match &self.attributes {
            None => None,
            Some(attributes) => {
                let numbers = attributes.camera()?;
                Some(numbers.into_iter().map(|number| number.map(f32::to_bits)).collect())
            }
        };
        let Window { x, y, width, height } = self.window;
        let channels = self.channels();
        let channels = channels.map(|(name, samples)| match samples {
            Samples::Float(_) => Some((name.to_owned(), false)),
            Samples::Id(_) => Some((name.to_owned(), true)),
            Samples::FromFile(_) => None,
        });
        let head = Head {
            size: self.size,
            window: [x, y, width, height],
            channels: channels.collect::<Option<_>>()?,
            names: self.names.clone(),
            how: self.how.clone(),
            camera,
        };
        let head = serde_json::to_vec(&head).ok()?;
        let mut bytes = (head.len() as u64).to_le_bytes().to_vec();
        bytes.extend(head);
        for (_, samples) in self.channels() {
            match samples {
                Samples::Float(samples) => {
                    bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
                }
                Samples::Id(ids) => bytes.extend(ids.iter().flat_map(|id| id.to_le_bytes())),
                Samples::FromFile(_) => return None,
            }
        }
        Some(bytes)
    }

    /// The picture of bytes that [`packed`](Image::packed) made; `None` if they are none.
    pub fn unpacked(bytes: &[u8]) -> Option<Image> {
        let (length, rest) = bytes.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (head, mut rest) = rest.split_at_checked(length)?;
        let head: Head = serde_json::from_slice(head).ok()?;
        let [x, y, width, height] = head.window;
        let mut image = Image::new(head.size, Window { x, y, width, height });
        let area = image.window.area();
        for (name, is_names) in head.channels {
            let (samples, behind) = rest.split_at_checked(area.checked_mul(4)?)?;
            let (words, _) = samples.as_chunks::<4>();
            let samples = match is_names {
                true => Samples::Id(words.iter().map(|word| u32::from_le_bytes(*word)).collect()),
                false => {
                    Samples::Float(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
                }
            };
            image.insert(&name, samples).ok()?;
            rest = behind;
        }
        (image.names, image.how) = (head.names, head.how);
        image.attributes = match head.camera {
            None => None,
            Some(camera) => {
                let numbers: Vec<Option<f32>> =
                    camera.into_iter().map(|bits| bits.map(f32::from_bits)).collect();
                Some(Arc::new(Attributes::from_camera(&numbers)?))
            }
        };
        rest.is_empty().then_some(image)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DMat4, DVec3};

    #[test]
    fn pictures_come_back_bit_for_bit() {
        let mut image = Image::new((4, 2), Window { x: 1, y: 0, width: 2, height: 1 });
        image.insert("R", Samples::Float(vec![0.1, f32::INFINITY])).unwrap();
        image.insert("id", Samples::Id(vec![7, u32::MAX])).unwrap();
        image.names.insert(7, "town/house \u{e9}".to_owned());
        image.how = Some("Sloped(8)".to_owned());
        let camera = DAffine3::from_translation(DVec3::new(0.1, 2.0, 3.0));
        let attributes = Attributes::of_camera(camera, DMat4::IDENTITY, [Some(0.3), None]);
        image.attributes = Some(Arc::new(attributes));
        let bytes = image.packed().unwrap();
        assert_eq!(Image::unpacked(&bytes), Some(image.clone()));
        image.attributes = None;
        let bare = image.packed().unwrap();
        assert_eq!(Image::unpacked(&bare), Some(image));
        for end in 0..bytes.len() {
            assert_eq!(Image::unpacked(&bytes[..end]), None, "{end}");
        }
    }
}
