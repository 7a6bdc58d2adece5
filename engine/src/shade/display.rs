//! How a picture is shown: what is brighter than a screen can be is brought into its range, fragment by fragment.
//!
//! As the last shader of a stack it works before the filter: an edge before something very bright keeps its
//! antialiasing, which cutting a filtered picture takes away.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::color::Color;
use crate::fragment::{Around, Columns, Fragments, Hiding, LightLayers, Shader};
use crate::math;

/// Exposure, white balance, contrast and saturation, and then a view. Colours become scene-linear ones of a screen,
/// from 0 to 1, but for [`DisplayView::Linear`].
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Display {
    /// What each component is multiplied by.
    pub multiply: Color,
    /// The exponent of each component, about a grey of 0.18.
    pub contrast: f32,
    /// 0 makes grey, 1 changes nothing.
    pub saturation: f32,
    /// How the range is compressed.
    pub view: DisplayView,
}

/// How colours of any brightness become those of a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum DisplayView {
    /// Not at all: what is above 1 is cut in the file, in each component.
    Linear,
    /// Khronos' neutral view: colours up to 0.8 stay as they are (darker by 0.04 at most), what is brighter fades to
    /// white.
    #[default]
    Neutral,
    /// AgX: sixteen and a half stops on one curve, and colours that fade as they get brighter, as on film.
    AgX,
    /// A curve of film, in each component: deep shadows and strong colours.
    Filmic,
}

#[typetag::serde]
impl Shader for Display {
    fn reads(&self) -> Columns {
        Columns::COLOR
    }

    fn hiding(&self) -> Hiding {
        Hiding::Keeps
    }

    fn changes(&self) -> Columns {
        Columns::COLOR
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        let shown: Vec<Color> = fragments.color.iter().map(|color| self.shown(*color)).collect();
        if let Some(layers) = &mut fragments.layers {
            // Each part keeps its share, so that they still sum to the colour.
            let share = |shown: f32, color: f32| if color > 0.0 { shown / color } else { 0.0 };
            let of = |i: usize, part: Color| {
                let (shown, color) = (shown[i], fragments.color[i]);
                let shares = [(shown.r, color.r), (shown.g, color.g), (shown.b, color.b)];
                let [r, g, b] = shares.map(|(shown, color)| share(shown, color));
                part * Color::new(r, g, b)
            };
            layers.map(of);
            let rest = layers.layer(LightLayers::REST, shown.len());
            for ((rest, shown), color) in rest.iter_mut().zip(&shown).zip(&fragments.color) {
                // What comes of nothing comes from no light.
                let alone = |shown: f32, color: f32| if color > 0.0 { 0.0 } else { shown };
                let [r, g, b] = [(shown.r, color.r), (shown.g, color.g), (shown.b, color.b)]
                    .map(|(shown, color)| alone(shown, color));
                *rest = *rest + Color::new(r, g, b);
            }
        }
        fragments.color = shown;
    }
}

impl Display {
    /// The colour of a screen that shows a scene-linear one.
    pub fn shown(&self, color: Color) -> Color {
        let mut color = color * self.multiply;
        if self.contrast != 1.0 {
            let bend = |v: f32| 0.18 * math::powf((v / 0.18).max(0.0), self.contrast);
            color = Color::new(bend(color.r), bend(color.g), bend(color.b));
        }
        color = Color::grey(color.luminance()).mix(color, self.saturation);
        match self.view {
            DisplayView::Linear => color,
            DisplayView::Neutral => neutral(color),
            DisplayView::AgX => agx(color),
            DisplayView::Filmic => filmic(color),
        }
    }
}

/// Khronos PBR Neutral (2024).
fn neutral(color: Color) -> Color {
    const START: f32 = 0.8 - 0.04;
    const FADES: f32 = 0.15;
    let color = Color::new(color.r.max(0.0), color.g.max(0.0), color.b.max(0.0));
    let least = color.r.min(color.g).min(color.b);
    let lifted = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = color + Color::grey(-lifted);
    let peak = color.greatest();
    if peak < START {
        return color;
    }
    let rest = 1.0 - START;
    let lower = 1.0 - rest * rest / (peak + rest - START);
    let fades = 1.0 - 1.0 / (FADES * (peak - lower) + 1.0);
    (color * (lower / peak)).mix(Color::grey(lower), fades)
}

/// AgX (Sobotka 2022), by Wrensch's polynomial for its base contrast; what it gives is decoded to linear light.
fn agx(color: Color) -> Color {
    // Columns.
    const IN: [[f32; 3]; 3] = [
        [0.842_479_06, 0.042_328_242, 0.042_375_655],
        [0.078_433_6, 0.878_468_64, 0.078_433_6],
        [0.079_223_745, 0.079_166_13, 0.879_143],
    ];
    const OUT: [[f32; 3]; 3] = [
        [1.196_879, -0.052_896_85, -0.052_971_635],
        [-0.098_020_88, 1.151_903_1, -0.098_043_45],
        [-0.099_029_74, -0.098_961_18, 1.151_073_7],
    ];
    const STOPS: [f64; 2] = [-12.473_93, 4.026_069];
    let times = |columns: [[f32; 3]; 3], v: [f32; 3]| {
        [0, 1, 2].map(|row| (0..3).map(|k| columns[k][row] * v[k]).sum::<f32>())
    };
    let curve = |v: f32| {
        let stops = math::log2(f64::from(v.max(1e-10)));
        let x = ((stops - STOPS[0]) / (STOPS[1] - STOPS[0])).clamp(0.0, 1.0) as f32;
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.429_8 * x2 + 0.119_1 * x
            - 0.002_32
    };
    let [r, g, b] = times(OUT, times(IN, color.to_array()).map(curve));
    let decoded = |v: f32| math::powf(v.clamp(0.0, 1.0), 2.2);
    Color::new(decoded(r), decoded(g), decoded(b))
}

/// A curve of film (Narkowicz 2016), in each component.
fn filmic(color: Color) -> Color {
    let one = |v: f32| {
        let v = v.clamp(0.0, 1e6);
        ((v * (2.51 * v + 0.03)) / (v * (2.43 * v + 0.59) + 0.14)).clamp(0.0, 1.0)
    };
    Color::new(one(color.r), one(color.g), one(color.b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(view: DisplayView) -> Display {
        Display { multiply: Color::WHITE, contrast: 1.0, saturation: 1.0, view }
    }

    #[test]
    fn views_rise_and_stay_within_a_screen() {
        for view in [DisplayView::Neutral, DisplayView::AgX, DisplayView::Filmic] {
            let mut last = -1.0f32;
            for k in 0..400 {
                let grey = math::powf(10.0, k as f32 / 40.0 - 4.0);
                let shown = of(view).shown(Color::grey(grey));
                let parts = shown.to_array();
                assert!(
                    parts.iter().all(|v| (0.0..=1.0).contains(v)),
                    "{view:?} {grey}: {shown:?}"
                );
                let spread = parts.iter().fold(0.0f32, |most, v| most.max((v - parts[0]).abs()));
                assert!(spread < 2e-3, "{view:?}: greys stay grey: {shown:?}");
                assert!(parts[0] >= last - 1e-6, "{view:?} falls at {grey}");
                last = parts[0];
            }
            assert!(last > 0.95, "{view:?} ends at {last}");
            for strange in [f32::MAX, f32::MIN_POSITIVE, -1.0, 0.0] {
                assert!(
                    of(view).shown(Color::new(strange, 0.1, 3.0)).is_finite(),
                    "{view:?} {strange}"
                );
            }
        }
    }

    /// What its authors give: colours of less than 0.8 keep their hue and are darker by 0.04, and white glow is white.
    #[test]
    fn the_neutral_view_leaves_base_colours_alone() {
        let shown = of(DisplayView::Neutral).shown(Color::new(0.5, 0.3, 0.2));
        for (shown, was) in shown.to_array().into_iter().zip([0.5, 0.3, 0.2]) {
            assert!((shown - (was - 0.04)).abs() < 1e-6, "{shown} of {was}");
        }
        let [r, g, b] = of(DisplayView::Neutral).shown(Color::new(40.0, 20.0, 5.0)).to_array();
        assert!(r > 0.99 && g > 0.9 && b > 0.8, "{r} {g} {b}: a bright lamp is nearly white");
    }

    /// Middle grey stands at the pivot of AgX's curve, 0.18^(1/2.4) of the encoded range.
    #[test]
    fn agx_shows_middle_grey_at_its_pivot() {
        let [grey, ..] = of(DisplayView::AgX).shown(Color::grey(0.18)).to_array();
        let encoded = math::powf(grey, 1.0 / 2.2);
        assert!((encoded - 0.489).abs() < 0.01, "{encoded}");
    }
}
