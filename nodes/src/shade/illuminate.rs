use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::sky::Ambient;
use spandrel_engine::shade::{self, Shadows};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Reductions;
use spandrel_engine::values::{Lamps, Lines};
use std::sync::Arc;

/// Lights the surfaces of an image by any number of lights and a light that is everywhere. Flat faces
/// have one intensity all over under parallel light, curved ones are smooth. Surfaces whose material is
/// unlit stay as they are. What casts shadows is every scene of the image, seen or not: light after a
/// merge, and shadows fall across clusters.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Illuminate {
    /// The image.
    pub image: Link<SpanImage>,
    /// The lights.
    pub lights: Vec<Link<Lamps>>,
    /// Light from above: what a white surface that faces straight up shows without any other light. Absent,
    /// that of the scene's `environment`; if no scene of the image has one, a tenth of white.
    pub ambient: Option<Color>,
    /// Light from below: what a white surface that faces straight down shows. Absent, the same as
    /// `ambient`, and every surface gets the same.
    pub ground: Option<Color>,
    /// The exposure: the illuminance in lux under which a white surface shows 1. 1 for lights in units of
    /// one's own; a room wants some hundred, daylight some ten thousand.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: f32,
    /// How shadows are found: `Off`; `Volumes`, exact for light from one place, by rays for other light;
    /// `Analytic`, as `Volumes`, and exact for panels, bodies and tubes too where not too much stands before
    /// them; `Rays(n)`, n rays to each light, spread over the pixel and the light.
    /// Absent, `Volumes` if the scene's `environment` wants shadows, else none.
    pub shadows: Option<Shadows>,
    /// With `Volumes`, rays to each light that is not in one place; with `Analytic`, to those that cannot be
    /// cut; and with all, how finely such lights are seen in gloss.
    #[schemars(range(min = 1, max = 4096))]
    pub samples: u32,
    /// What the search for shadow volumes leaves out; the picture is the same. `candidates`: `Shafts`, by a tree
    /// for every patch of a face; `Clusters`, \[N]'s; `SixSpaces`, \[D]'s, around point lights; `All`, none.
    /// `contours`: of closed bodies only faces that are turned to the light cast.
    pub less: Reductions,
}

impl Default for Illuminate {
    fn default() -> Illuminate {
        Illuminate {
            image: Link::default(),
            lights: Vec::new(),
            ambient: None,
            ground: None,
            white: 1.0,
            shadows: None,
            samples: 16,
            less: Reductions::default(),
        }
    }
}

impl Node for Illuminate {
    type Output = SpanImage;
    const KIND: &'static str = "Illuminate";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["ReLight", "Lighting", "Shade"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        for (field, color) in [("ambient", self.ambient), ("ground", self.ground)] {
            if color.is_some_and(|color| color.to_array().iter().any(|v| *v < 0.0)) {
                return Err(FieldError::new(field, "light must be 0 or more"));
            }
        }
        match self.shadows {
            Some(Shadows::Rays(n)) if !(1..=4096).contains(&n) => {
                Err(FieldError::new("shadows", format!("Rays({n}): must be 1 to 4096")))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &Lines, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        self.lights.iter().for_each(|light| upstream.ask(light, ()));
        Ok(())
    }

    fn evaluate(&self, _: &Lines, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let image = inputs.get(&self.image);
        let mut lamps = Vec::new();
        for link in &self.lights {
            for lamp in &inputs.get(link).0 {
                let name = match lamp.name.as_str() {
                    "" => link.target().to_owned(),
                    name => format!("{}.{name}", link.target()),
                };
                lamps.push(lamp.named(name));
            }
        }
        if image.shaders().any(|shader| shader.typetag_name() == "Trace") {
            inputs.warn(
                "the image is traced already: its lights fall on what mirrors show. Put Trace after \
                 Illuminate",
            );
        }
        let environment = image.environment();
        let above = self.ambient.or(environment.map(|known| known.ambient));
        let above = above.unwrap_or(Color::grey(0.1));
        let shadows = self.shadows.unwrap_or(match environment {
            Some(known) if known.shadows => Shadows::Volumes,
            _ => Shadows::Off,
        });
        let ambient = Ambient { above, below: self.ground.unwrap_or(above) };
        lamps.push(Lamp::new("own.ambient", true, Color::grey(self.white), Arc::new(ambient)));
        let shader = shade::Illuminate {
            lamps,
            white: self.white,
            shadows,
            samples: self.samples,
            less: self.less,
        };
        let lit = image.shaded(Arc::new(shader))?;
        if shadows != Shadows::Off {
            lit.check_worlds()?;
            for source in image.sources().iter().filter(|source| !source.surfaces.casts()) {
                inputs.warn(&format!(
                    "\"{}\" casts no shadows: its renderer does not say where its surfaces are",
                    source.label
                ));
            }
        }
        Ok(lit)
    }
}
