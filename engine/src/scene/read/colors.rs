//! Colours by vertex, of formats that do not say what their numbers are.

use super::super::material::AlphaMode;
use super::reader::Reader;
use crate::color::decode_srgb;

/// Colours that came as numbers are scene-linear; whole ones, up to 255 and some above 1, are bytes of sRGB.
pub(super) fn settle(reader: &mut Reader, colors: &mut [[f32; 4]], are_linear: bool) {
    let all = || colors.iter().flat_map(|color| &color[..3]);
    let are_bytes =
        all().any(|v| *v > 1.0) && all().all(|v| v.fract() == 0.0 && (0.0..=255.0).contains(v));
    if !are_linear || !are_bytes {
        return;
    }
    reader.note(
        "colours of vertices go up to 255: they are read as bytes of sRGB, not as scene-linear",
    );
    let has_byte_alpha = colors.iter().any(|color| color[3] > 1.0);
    for color in colors {
        let [r, g, b] = [color[0], color[1], color[2]].map(|v| decode_srgb(v / 255.0));
        *color = [r, g, b, if has_byte_alpha { color[3] / 255.0 } else { color[3] }];
    }
}

/// How the alpha of vertices is read. If it is 0 everywhere it means nothing, and becomes 1.
pub(super) fn alpha_mode(reader: &mut Reader, colors: &mut [[f32; 4]]) -> AlphaMode {
    if colors.iter().all(|color| color[3] == 1.0) {
        return AlphaMode::Opaque;
    }
    if colors.iter().all(|color| color[3] == 0.0) {
        reader.note("the alpha of all vertices is 0: it is left out");
        colors.iter_mut().for_each(|color| color[3] = 1.0);
        return AlphaMode::Opaque;
    }
    AlphaMode::Blend
}
