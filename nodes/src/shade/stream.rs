//! The node `Stream`: programs over what is visible, after Perlin's Pixel Stream Editor (\[N]
//! describes it in its introduction).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::color::{Color, ValueKind};
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::moment::Moment;
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::stream::{self, Parameter, ProgramFault};
use spandrel_engine::values::SpanDemand;
use spandrel_engine::{Error, Result};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// The stream editor: runs a program over what is visible, surface by surface, before anything is
/// resolved. Before `Illuminate` it makes surfaces such as marble or wood. After it, it grades what
/// is lit, one object by name, without a fringe.
///
/// The program assigns `color`, `alpha`, `normal` or a channel, or ends with a colour. Places are
/// `P` (in the world) and `Po` (in the object), in metres; what differs from 0 by rounding only is
/// 0. `x` and `y` are the place in the picture, 0 to 1. `N` is the normal, `I` the direction to the
/// eye. `width` is what a pixel covers, in metres; `coverage` is how much of its pixel is covered,
/// 0 to 1. The other variables are `u`, `v`, `color`, `alpha`, `depth`, `face`, `front`, `object`
/// and `material`, the last two numbers made from names, the same in every frame; and `frame` and
/// `time`, in seconds, of a film.
///
/// `object('*tree*')` and `material('glass*')` are 1 where the name fits. The name of an object's
/// group fits too, and so does any such part of its path.
///
/// Functions have SeExpr's names: `noise(p)`, `snoise(p)`, `vnoise(p)`, `fbm(p, octaves,
/// lacunarity, gain)`, `turbulence` alike, `cellnoise(p)`, `voronoi`, `mix(a, b, share)`, `clamp`,
/// `smoothstep(x, a, b)`, `fmod`, `fit`, `remap`, `bias`, `gamma`, `contrast`, `saturate`,
/// `rgbtohsl`, `dot`, `norm` and more. `fmod` and `%` are never negative for a positive divisor, so
/// patterns go on across 0.
///
/// There are `if (..) {} else {}`, `a ? b : c`, and vectors `[x, y, z]` with parts `.x` or `[0]`.
/// Your own functions come before all else: `def name(a, b) { c = a * b; c + 1 }`.
///
/// A program that makes `alpha` shows what is behind. All its inputs are then rendered in layers,
/// which takes longer than opaque surfaces do. Shadows stay those of the materials.
///
/// Example: `Stream(image: "lit", code: "if (object('car*')) { color = color * 1.2; }")`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Stream {
    /// The image.
    pub image: Link<SpanImage>,
    /// The program. If absent, nothing changes.
    #[schemars(extend("x-what" = "program of the stream editor"))]
    pub code: String,
    /// Numbers for the program, by name.
    pub numbers: BTreeMap<String, f32>,
    /// Colours for the program, by name.
    pub colors: BTreeMap<String, Color>,
    /// Channels that the program makes, or that it reads if an earlier `Stream` made them. Each
    /// name has the type `Number` or `Color`, as in `{"wet": Number}`. `Write` writes them with the
    /// channel `Made`.
    pub channels: BTreeMap<String, ValueKind>,
}

impl Default for Stream {
    fn default() -> Stream {
        Stream {
            image: Link::default(),
            code: "color".to_owned(),
            numbers: BTreeMap::new(),
            colors: BTreeMap::new(),
            channels: BTreeMap::new(),
        }
    }
}

impl Stream {
    /// The shader at a moment; any will do where nothing depends on it.
    fn shader(&self, moment: Moment) -> std::result::Result<shade::Stream, ProgramFault> {
        let numbers = self.numbers.iter().map(|(name, n)| (name.clone(), Parameter::Number(*n)));
        let colors = self.colors.iter().map(|(name, c)| (name.clone(), Parameter::Color(*c)));
        let times = [("frame", moment.frame), ("time", moment.seconds())];
        let times = times.map(|(name, number)| (name.to_owned(), Parameter::Number(number as f32)));
        let parameters = times.into_iter().chain(numbers).chain(colors).collect();
        shade::Stream::new(&self.code, parameters, self.channels.clone())
    }
}

impl Node for Stream {
    type Output = SpanImage;
    const KIND: &'static str = "Stream";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] =
        &["DeepExpression", "Expression", "PixelStreamEditor", "BlinkScript", "Wrangle"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let at_code = |fault: ProgramFault| FieldError::new("code", fault.to_string()).at(fault.at);
        self.shader(Moment::default()).map(drop).map_err(at_code)
    }

    fn moves(&self, _: &Path) -> bool {
        let own = |name: &str| self.numbers.contains_key(name) || self.colors.contains_key(name);
        let names = stream::names(&self.code).unwrap_or_default();
        names.iter().any(|name| ["frame", "time"].contains(&&**name) && !own(name))
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        // Where it makes opaque surfaces let light through, what is behind them is seen.
        let makes_alpha = self.shader(Moment::default()).is_ok_and(|shader| shader.makes_alpha());
        let layered = wanted.layered || makes_alpha;
        upstream.ask(&self.image, SpanDemand { layered, ..wanted.clone() });
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let moment = inputs.moment().unwrap_or_default();
        let shader = self.shader(moment).map_err(|fault| Error::invalid(fault.to_string()))?;
        let image = inputs.get(&self.image);
        shader.names_of_nothing(|| image.names()).iter().for_each(|said| inputs.warn(said));
        image.shaded(Arc::new(shader))
    }
}
