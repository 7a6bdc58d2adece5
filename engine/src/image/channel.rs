//! The channels of pictures: what they hold, under which names, and how they are stored. How each is made of fragments
//! is said in `resolve::channel`.

/// A channel, or group of channels, of a picture.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[non_exhaustive]
pub enum Channel {
    /// `R`, `G`, `B`, `A`: colour with associated alpha.
    Color,
    /// `Z`: the distance along the view axis in metres, infinite where there is background.
    Z,
    /// `N.X`, `N.Y`, `N.Z`: the unit normal in world axes.
    N,
    /// `P.X`, `P.Y`, `P.Z`: the position in the world in metres.
    P,
    /// `id`: the object, as a hash of its name; 0 is background.
    Id,
    /// `light_NAME.R`, `.G`, `.B` for each light: what it adds to the colour, as it is shown; and
    /// `rest.R`, `.G`, `.B`, what comes from none. They sum to the colour.
    Light,
    /// `NAME`, or `NAME.R`, `.G`, `.B`, for each channel that programs made of fragments (the node `Stream`),
    /// resolved as the colour is: the mean over the pixel, nothing where nothing is.
    Made,
    /// Of pictures that were read: whatever else they have, under its own names. Nothing else has any.
    Others,
    /// `light_error.R`, `.G`, `.B`: an estimate of the error of light that is found by samples, soft light and
    /// that of `Rays`: by how much the colour may be off, as the standard deviation of as many random
    /// samples, of which those taken are mostly better. One sample estimates nothing, and is taken to be off by
    /// half of the light. Gloss is not in it.
    #[serde(rename = "light_error")]
    LightError,
    /// `aa_error`: an estimate of the error of antialiasing: by which share of the pixel its coverage may
    /// be off, 0 to 1.
    #[serde(rename = "aa_error")]
    Error,
}

impl Channel {
    /// Which of them a picture's channel of a name is; `None` for those that programs or files have beside them.
    pub fn of(name: &str) -> Option<Channel> {
        let layer = name.rsplit_once('.').map_or("", |(layer, _)| layer);
        Some(match name {
            "R" | "G" | "B" | "A" => Channel::Color,
            "Z" => Channel::Z,
            "id" => Channel::Id,
            "aa_error" => Channel::Error,
            "N.X" | "N.Y" | "N.Z" => Channel::N,
            "P.X" | "P.Y" | "P.Z" => Channel::P,
            _ if layer == "light_error" => Channel::LightError,
            _ if is_layer_of_light(layer) => Channel::Light,
            _ => return None,
        })
    }

    /// Whether a picture's channel is of the colour, or of a layer of light.
    pub(super) fn is_color(name: &str) -> bool {
        matches!(Channel::of(name), Some(Channel::Color | Channel::Light))
    }

    /// Whether half precision would spoil it: distances and positions reach far and are computed with.
    pub(super) fn is_exact(name: &str) -> bool {
        matches!(Channel::of(name), Some(Channel::Z | Channel::P))
    }
}

/// Whether a layer is what a light adds to the colour, or the rest: they sum to the colour.
pub(crate) fn is_layer_of_light(layer: &str) -> bool {
    layer == "rest" || (layer.starts_with("light_") && layer != "light_error")
}
