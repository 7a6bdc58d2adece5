//! Spandrel's engine: what a span is, and what can be done with it.
//!
//! A picture is stored as **spans, not pixels**. On every sub-scanline (*line*) stand the visible
//! segments, each with its face; a face is a plane, so that depth anywhere is three numbers away.
//! Visibility is solved once, exactly along x; images from any number of programs merge by the same
//! rule; light, fog and antialiasing at any size are computed from the merged spans. The methods are
//! those of Nakamae, Ishizaki, Nishita and Takita 1989, cited as \[N], and of Doi, Aono, Urano and
//! Sugimoto 1991, cited as \[D].
//!
//! ```text
//!   scene ──> render ───> SpanImage ──merge──> SpanImage ──> resolve ──> Image ──> file
//!                                         ^                  ^
//!                              shade (stacks of shaders) fragment (batches)
//! ```
//!
//! # Reading path
//!
//! 1. [`raster`]: pixels, cells and lines, the integers that everything stands on.
//! 2. [`camera`]: how the world gets onto the screen; the depth rho.
//! 3. [`span`]: the winner rule, lines, the merge, faces, images. The heart.
//! 4. [`render`]: from scenes to spans; [`visible`]: what is seen of faces, by the same winner rule.
//! 5. [`fragment`] and [`shade`]: programs that run over what is visible.
//! 6. [`resolve`]: from spans to pixels, at any size.
//! 7. [`scene`]: documents of plans, objects and faces; the readers of files.
//! 8. [`graph`]: nodes, demand and evaluation; knows none of the above. [`values`] joins the two.
//!
//! Modules know only what stands before them in the arrow's direction: `span` knows no `scene`,
//! `graph` no `span`; the test `library` asserts it.
//!
//! # Conventions
//!
//! The world is right-handed, y up, in metres. A camera looks down its -z. Pixel (0, 0) is at the top
//! left, its centre at (0.5, 0.5); ranges are half-open. Colour is scene-linear with the primaries of
//! Rec. 709, alpha is associated, sRGB exists only in 8 and 16 bit files. Angles are degrees in files
//! and radians in code. Depth is `rho = 1 / distance` along the view axis, or `-distance` for parallel
//! cameras: larger is nearer, and affine on the screen.

pub mod cache;
pub mod camera;
pub mod color;
pub mod error;
pub mod fragment;
pub mod graph;
pub mod image;
pub mod key;
pub mod light;
pub(crate) mod machine;
pub mod math;
pub mod moment;
pub mod motion;
pub mod open;
pub mod output;
pub(crate) mod packed;
pub mod picture;
pub mod plugin;
pub(crate) mod polygon;
pub mod raster;
pub mod render;
pub mod resolve;
pub mod scene;
pub mod shade;
pub(crate) mod shadow;
pub mod span;
pub mod span_file;
pub mod store;
pub mod stream;
pub mod text;
pub mod texture;
pub mod trace;
pub mod values;
pub mod visible;
pub mod volume;
pub mod watch;

pub use error::{Error, Result};
