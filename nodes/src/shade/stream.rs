use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::stream::Parameter;
use spandrel_engine::values::Lines;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The stream editor: runs a program over what is visible, surface by surface, before anything is resolved.
/// Before `Illuminate` it makes what surfaces look like (marble, wood); after it, it grades what is lit, one
/// object by name without a fringe.
///
/// The program assigns `color`, `alpha` or `normal`, or ends with a colour. It knows `P` and `Po` (the place
/// in the world and in the object, metres), `N`, `I` (to the eye), `u`, `v`, `x`, `y` (the place in the
/// picture, 0 to 1), `color`, `alpha`, `depth`, `width` (what a pixel covers, metres), `face` (number),
/// `front`, and `object("*tree*")`, 1 where the object's
/// name, or the end of it after a `/`, fits. Functions have SeExpr's names: `noise`,
/// `snoise`, `vnoise`, `fbm`, `turbulence`, `cellnoise`, `voronoi`, `mix`, `clamp`, `smoothstep(x, a, b)`,
/// `fmod` (never negative for a positive divisor, as is `%`: patterns go on across 0), `fit`, `bias`, `gamma`, `contrast`, `saturate`, `rgbtohsl`, `dot`, `norm` and more. There are `if (..) {}
/// else {}`, `a ? b : c`, vectors `[x, y, z]` with parts `.x` or `[0]`, and functions of one's own,
/// `def name(a, b) { c = a * b; c + 1 }`, before all else.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stream {
    /// The image.
    pub image: Link<SpanImage>,
    /// The program. Absent, it changes nothing.
    pub code: String,
    /// Numbers that it knows by name.
    pub numbers: BTreeMap<String, f32>,
    /// Colours that it knows by name.
    pub colors: BTreeMap<String, Color>,
}

impl Default for Stream {
    fn default() -> Stream {
        let (numbers, colors) = (BTreeMap::new(), BTreeMap::new());
        Stream { image: Link::default(), code: "color".to_owned(), numbers, colors }
    }
}

impl Stream {
    fn shader(&self) -> Result<shade::Stream> {
        let numbers = self.numbers.iter().map(|(name, n)| (name.clone(), Parameter::Number(*n)));
        let colors = self.colors.iter().map(|(name, c)| (name.clone(), Parameter::Color(*c)));
        shade::Stream::new(&self.code, numbers.chain(colors).collect())
    }
}

impl Node for Stream {
    type Output = SpanImage;
    const KIND: &'static str = "Stream";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] =
        &["DeepExpression", "Expression", "PixelStreamEditor", "BlinkScript", "Wrangle"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        self.shader().map(drop).map_err(|error| FieldError::new("code", error.to_string()))
    }

    fn demand(&self, wanted: &Lines, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &Lines, inputs: &Inputs<'_>) -> Result<SpanImage> {
        inputs.get(&self.image).shaded(Arc::new(self.shader()?))
    }
}
