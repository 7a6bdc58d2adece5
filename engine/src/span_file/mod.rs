//! Span files (`.span`): span images on disk, for merging, lighting and resolving later.
//!
//! A file holds what \[N] keeps of an image ("Image data structure"): the boundaries on every line, the
//! faces with their depth, the colour table, the vertices; and the camera, the line plan, what shades the
//! faces, and where their scenes are or the scenes themselves (materials, vertex normals, mapping). It has
//! only the faces that are seen: reading what was written gives [the image pruned](crate::span::SpanImage::pruned),
//! and merging files gives what merging the images gives.
//!
//! Of an image whose scenes are not there, depth, merging, stored colours and what acts on these remain;
//! lights need normals, which only a scene knows. An image that was read holds its lines and no more: it cannot be
//! [probed](crate::span::probe).
//!
//! # The bytes
//!
//! All numbers are little-endian. A file begins with the 12 bytes `SPANDRELspan` and the version, 1, as u32.
//! Blocks follow, the last of which is `end `. A block's head has 36 bytes:
//!
//! | bytes | contents |
//! |---|---|
//! | 4 | kind: `head`, `scen`, `line`, `face` or `end `; others are skipped |
//! | 4, 4 | a and b, u32; see below |
//! | 8 | stored length, u64: bytes that follow the head |
//! | 8 | length, u64: bytes when unpacked. Equal to the stored length, the contents are not packed; else they are a zlib stream (RFC 1950). At most 2^30 and, above 2^16, at most 32 times the stored length |
//! | 4 | CRC-32 of the stored bytes (as zlib has it) |
//! | 4 | CRC-32 of the 32 bytes before |
//!
//! In what follows, a *number* is an unsigned integer of seven bits to a byte, the lowest first, the highest
//! bit of a byte saying that more follow; a *signed* number n is the number 2n, or -2n - 1 if it is
//! negative; a *run* is a number of bytes and then those; *doubles* are the eight bytes of each value
//! combined by exclusive or with those of the value before, the highest byte of all values first, then the next
//! of all, to the lowest; *floats* likewise with four.
//!
//! **`head`** is the first block, and the only one of its kind: JSON with `writer`, `camera` (as in
//! graphs), `width`, `height` (1 to 65536), `lines_per_row` (1 to 1024), `phase` (`"Centre"`: line k lies at
//! (k + 1/2) / n rows, `"Border"`: at k / n), `rows` (first, and one beyond the last), `sources`, `limits` if
//! planes other than the camera's front and back cut faces by depth (each a, b and c, as those of faces)
//! and, for this program's own scenes, `scenes`. A source has `label` and `scene`, 32 hexadecimal digits: both
//! together say whether sources of two files are the same, and none may be there twice. What this program writes of
//! scenes and sources beside that (`path`, `how`, `key`, `embedded`; `found_in`, `stack`, `matte`, `held`)
//! other programs leave out, as they do **`scen`**, which holds the a-th of the scenes in the form of this
//! program's version; `key` is a hash of the scene's files, and `scene` of that and the priority.
//!
//! The rows r to s have the lines r n to s n and, with `"Border"`, the line s n too, even if s = r.
//!
//! **`line`** holds the lines a to a + b, 1 to 4096 of them with at most 2^24 items; the lines of all
//! blocks, in the order of the file, follow each other without a gap. It is four runs for the
//! opaque spans, four for the segments of translucent faces and, if there are any, four for *cuts*:
//! *operations*, *moves*, *faces* and *places*.
//! A line's items are told by what changed since the line before, of which there is none at the beginning of a
//! block. For every line there is the number of its items in the operations, and then numbers `4 (count - 1) +
//! kind` until all are there:
//!
//! - kind 0, keep: the next `count` items of the line before are here too. For each boundary, in the moves, a
//!   signed number: how much farther it moved than from the line before that one to the line before (as
//!   long as the item was kept; 0 for a new one).
//! - kind 1, drop: the next `count` items of the line before are not here.
//! - kind 2, new: for each item, in the faces, a signed number: its face less that of the item before it (0 at
//!   the line's beginning; no face is -1); and in the places, its first boundary less that of the
//!   item before it and, for a segment, its length.
//!
//! A span is a face and the cell at which it begins, until the next begins; the first begins at 0, neighbours
//! differ in face; every line has one. A segment is a face, the cell at which it begins and the cell before which it ends; segments
//! are in the order of their beginning. A cut is a boundary that an edge or the plane of a face made which is not seen
//! any more, such as a matte: the first cell to the right of it, and the face; cuts are in the order of their cells. A cell is 2^-f pixels, f being the number of leading zero bits of
//! the width as u32.
//!
//! **`face`** holds b faces of source a, as 13 runs; a source may have several such blocks, in all of which
//! both numbers of its faces ascend. No number in the lines may be that of two faces. What is counted from what came
//! before begins anew in every block.
//!
//! 1. numbers: by how much the face's number in the lines exceeds the one before it, the first 0
//! 2. numbers: the same of its number in its source, which identifies it when files are merged
//! 3. a byte: 1 its front is seen, 2 translucent, 4 a seal, 8 a drawn edge, 16 its colour differs from place to
//!    place, 32 lights leave it alone
//! 4. numbers: its rank, which decides between equal depths
//! 5. numbers, for seals: its number in its source less that of the face on which it lies, which comes before
//!    it and is no seal; it has the same depth and a lesser rank
//! 6. doubles: all a, all b, all c of the depth a x + b y + c at (x, y) pixels from the top left: 1 / distance
//!    along the view axis in metres or, for a parallel camera, minus the distance; what is greater is seen. At
//!    most 1e290
//! 7. numbers: how many rings it has, and how many corners each (those of fewer than three do not count); without
//!    rings, edges are resolved as steps
//! 8. numbers: for each corner, 0 if it is the next of the points, otherwise how many points before that
//! 9. the number of points; doubles: all x, all y of the points, in pixels
//! 10. numbers: its colour, as the place in the table that follows
//! 11. the number of colours; floats: all red, green, blue (scene-linear) and alpha
//! 12. numbers: its object, as the place in the table that follows
//! 13. the number of objects; runs: their names, in UTF-8
//!
//! **`end `** is empty; its a is the number of blocks before it.

mod block;
mod column;
mod faces;
mod head;
mod lines;
mod read;
mod scenes;
mod stored;
mod stream;
mod write;

pub use read::SpanFile;
pub use scenes::SceneState;
pub use stream::{Difference, compare, merge};
pub use write::{Options, Scenes, Written, write};
