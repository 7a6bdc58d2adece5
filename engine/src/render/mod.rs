//! Renderers: programs that make span images. What is seen of each, and how images meet, is the same for
//! all; each is tuned to its kind of object, as \[N] wants it.
//!
//! | renderer | renders | paper |
//! |---|---|---|
//! | [`scanline`] | the faces of scenes | \[N], \[D] |
//! | [`priority`] | the same, by a tree that gives faces their order for any eye | \[D] |
//! | [`rays`] | the same, as far as rays from the eye nominate them | \[D] |
//! | [`background`] | what stands behind everything, in all directions | \[N] |
//! | [`billboards`] | trees from photographs, on cards | \[N] 4.2 |
//!
//! One that is not here makes the faces of its frame and finds them on lines: see
//! [`LineRenderer`](crate::span::LineRenderer) and [`SpanWriter`](crate::span::SpanWriter).

pub mod background;
pub mod billboards;
pub mod priority;
pub mod rays;
pub mod scanline;
