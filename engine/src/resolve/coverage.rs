//! From lines to pixels: which faces cover a pixel, and how much of it (\[N] eqs. 1 to 6).
//!
//! All lines of a row are walked together from left to right. Where every one of them shows the same
//! face over whole pixels, they are passed in one step, \[N] eq. 5; only pixels with a boundary in them
//! are added up line by line, eqs. 3, 4 and 6. With a filter that reaches beyond the pixel the same is
//! done with all that it reaches, and what lies left of a boundary weighs the filter's integral.

use super::boundary::Boundaries;
use super::filter::{Filter, Kernel};
use super::rule::{Framing, Rule, Share, shares};
use super::stacks::Stacks;
use crate::span::{FaceId, SpanImage};

/// A face's share of some pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    /// The face, or [`FaceId::NONE`] for background; or, with an id beyond those of all faces, what is
    /// seen through translucent ones ([`Coverage::stack`]).
    pub face: FaceId,
    /// First pixel, a column of the picture.
    pub start: u32,
    /// One beyond the last pixel. More than one pixel only if the face covers all of them whole.
    pub end: u32,
    /// The share of a pixel. Those of a pixel sum to 1; with the box filter they are its areas, above 0
    /// and at most 1, with others they are weights, some of which may be negative.
    pub area: f32,
    /// A point of the picture, in pixels from the left, in the middle of what is covered.
    pub x: f64,
    /// A point of the raster, in pixels from the top, in the middle of what is covered.
    pub y: f64,
}

/// A strip of a row: one line's boundaries, in pixels of the picture.
#[derive(Default)]
struct Strip {
    weight: f64,
    /// Where its points lie, in raster pixels from the top.
    y: f64,
    /// The faces from left to right, background beyond the raster included.
    faces: Vec<FaceId>,
    /// The left boundary of each face, at the top and the bottom of the strip; one more than faces.
    top: Vec<f64>,
    bottom: Vec<f64>,
    /// The face at the pixel that is looked at.
    cursor: usize,
    /// The rightmost point of its left boundary, and the leftmost and rightmost of its right one.
    left_high: f64,
    right_low: f64,
    right_high: f64,
}

/// Computes rows of coverage of one image.
pub struct Coverage<'a> {
    image: &'a SpanImage,
    rule: Rule,
    framing: &'a Framing,
    boundaries: Boundaries<'a>,
    stacks: Stacks<'a>,
    strips: Vec<Strip>,
    reach: Reach,
}

/// How far a pixel reaches, and how it weighs what it reaches.
struct Reach {
    /// Beyond its sides, in pixels.
    beyond: f64,
    /// The integrals of a filter other than the box.
    kernel: Option<&'static Kernel>,
    /// By cover of the pixel at hand, the sum of its weights without their signs.
    masses: Vec<f64>,
}

impl<'a> Coverage<'a> {
    /// Coverage of an image, which must have the rule's line plan.
    pub fn new(image: &'a SpanImage, rule: Rule, framing: &'a Framing) -> Coverage<'a> {
        let (boundaries, stacks) = (Boundaries::new(image), Stacks::new(image));
        let filter = framing.filter;
        let reach = Reach {
            beyond: filter.radius() - 0.5,
            kernel: (filter != Filter::Box).then(|| filter.kernel()),
            masses: Vec::new(),
        };
        Coverage { image, rule, framing, boundaries, stacks, strips: Vec::new(), reach }
    }

    /// The faces that lie over each other in a cover of the last row, the nearest first, an opaque one
    /// last; `None` if the id is that of a face.
    #[inline(always)]
    pub fn stack(&self, id: FaceId) -> Option<&[FaceId]> {
        self.stacks.get(id)
    }

    /// The covers of a row of the picture, pixel by pixel from left to right. Appends to `out`.
    pub fn row(&mut self, row: u32, out: &mut Vec<Cover>) {
        let plan = self.image.plan();
        let all = plan.lines(&(0..self.image.view().raster().height));
        let shares = shares(self.rule, plan, self.framing, row, all.end);
        self.stacks.clear();
        self.strips.resize_with(shares.len().max(self.strips.len()), Strip::default);
        for (i, share) in shares.iter().enumerate() {
            self.fill(i, share);
        }
        let strips = &mut self.strips[..shares.len()];
        let mut pixel = self.framing.columns.start;
        while pixel < self.framing.columns.end {
            let x = f64::from(pixel);
            let left = x - self.reach.beyond;
            let mut run = f64::from(self.framing.columns.end);
            let mut whole = true;
            for strip in strips.iter_mut() {
                strip.go_to(left);
                whole &= strip.left_high <= left;
                run = run.min(strip.right_low - self.reach.beyond);
            }
            let face = strips.first().map_or(FaceId::NONE, Strip::face);
            // Whole pixels only: the conversion cuts off the rest.
            let end = run as u32;
            if whole && end > pixel && strips.iter().all(|strip| strip.face() == face) {
                let y = strips.iter().map(|strip| strip.weight * strip.y).sum();
                out.push(Cover { face, start: pixel, end, area: 1.0, x: x + 0.5, y });
                pixel = end;
            } else {
                self.reach.add_pixel(strips, pixel, out);
                pixel += 1;
            }
        }
    }

    /// Places the boundaries of a share's line in the picture.
    fn fill(&mut self, i: usize, share: &Share) {
        let Coverage { image, rule, framing, boundaries, stacks, strips, .. } = self;
        let strip = &mut strips[i];
        strip.weight = share.weight;
        strip.cursor = 0;
        strip.faces.clear();
        strip.top.clear();
        strip.bottom.clear();
        strip.faces.push(FaceId::NONE);
        strip.top.push(f64::NEG_INFINITY);
        strip.bottom.push(f64::NEG_INFINITY);
        if let Some(k) = share.line {
            let raster = image.view().raster();
            stacks.prepare(k);
            let line = stacks.spans(k);
            strip.y = image.plan().y(k);
            strip.top.push(0.0);
            strip.bottom.push(0.0);
            match rule {
                Rule::Sampled(..) => {
                    strip.top.extend(line[1..].iter().map(|span| raster.pixels(span.x)));
                    strip.bottom.extend_from_slice(&strip.top[2..]);
                }
                Rule::Sloped(_) => {
                    boundaries.of_line(k, stacks, &mut strip.top, &mut strip.bottom);
                }
            }
            strip.faces.extend(line.iter().map(|span| span.face));
            strip.top.push(f64::from(raster.width));
            strip.bottom.push(f64::from(raster.width));
            strip.faces.push(FaceId::NONE);
            let (from, to) = share.strip;
            for (top, bottom) in strip.top.iter_mut().zip(&mut strip.bottom).skip(1) {
                let (above, below) = (*top, *bottom);
                let place = |t: f64| {
                    let x = if above == below { above } else { above + (below - above) * t };
                    x * framing.scale.x + framing.pan.x
                };
                (*top, *bottom) = (place(from), place(to));
            }
            if let Rule::Sloped(_) = rule {
                strip.y += ((from + to) / 2.0 - 0.5) / f64::from(image.plan().per_row);
            }
        } else {
            strip.y = 0.0;
        }
        strip.top.push(f64::INFINITY);
        strip.bottom.push(f64::INFINITY);
        strip.look();
    }
}

impl Strip {
    #[inline(always)]
    fn face(&self) -> FaceId {
        self.faces[self.cursor]
    }

    /// Goes to the face at a pixel.
    #[inline(always)]
    fn go_to(&mut self, x: f64) {
        while self.right_high <= x {
            self.cursor += 1;
            self.look();
        }
    }

    /// Notes the boundaries of the face at the cursor.
    #[inline(always)]
    fn look(&mut self) {
        let i = self.cursor;
        self.left_high = self.top[i].max(self.bottom[i]);
        self.right_low = self.top[i + 1].min(self.bottom[i + 1]);
        self.right_high = self.top[i + 1].max(self.bottom[i + 1]);
    }

    /// How far boundary `i` lies to the right of `x`, cut off at 0 and `width`: the mean over the strip's
    /// height.
    #[inline(always)]
    fn clipped(&self, i: usize, x: f64, width: f64) -> f64 {
        let (top, bottom) = (self.top[i] - x, self.bottom[i] - x);
        if top <= 0.0 && bottom <= 0.0 {
            return 0.0;
        }
        if top >= width && bottom >= width {
            return width;
        }
        if (bottom - top).abs() < 1e-9 {
            return top.clamp(0.0, width);
        }
        // The integral of a line cut off at 0 and `width`, over its length.
        let integral = |z: f64| {
            let z = z.max(0.0);
            if z < width { z * z / 2.0 } else { (z - width / 2.0) * width }
        };
        ((integral(bottom) - integral(top)) / (bottom - top)).clamp(0.0, width)
    }
}

impl Reach {
    /// Adds up the strips of one pixel.
    fn add_pixel(&mut self, strips: &[Strip], pixel: u32, out: &mut Vec<Cover>) {
        let (first, width) = (out.len(), 1.0 + 2.0 * self.beyond);
        let x = f64::from(pixel) - self.beyond;
        self.masses.clear();
        for strip in strips {
            let mut i = strip.cursor;
            // Where a boundary lies, and how much lies left of it.
            let mut left = strip.clipped(i, x, width);
            let mut before = self.weight(strip, i, x, left);
            while left < width && i < strip.faces.len() {
                let right = strip.clipped(i + 1, x, width).max(left);
                let after = self.weight(strip, i + 1, x, right);
                let area = (after - before) * strip.weight;
                if area != 0.0 {
                    let cover = Cover {
                        face: strip.faces[i],
                        start: pixel,
                        end: pixel + 1,
                        area: area as f32,
                        x: x + (left + right) / 2.0,
                        y: strip.y,
                    };
                    self.add(out, first, cover);
                }
                (left, before) = (right, after);
                i += 1;
            }
        }
    }

    /// The weight of what lies left of boundary `i` in a strip, which is `clipped` for the box.
    #[inline(always)]
    fn weight(&self, strip: &Strip, i: usize, x: f64, clipped: f64) -> f64 {
        match self.kernel {
            None => clipped,
            Some(_) if clipped <= 0.0 => 0.0,
            Some(_) if clipped >= 1.0 + 2.0 * self.beyond => 1.0,
            Some(kernel) => {
                let middle = x + self.beyond + 0.5;
                kernel.mean_left_of(strip.top[i] - middle, strip.bottom[i] - middle)
            }
        }
    }

    /// Adds a piece to the covers of its pixel, which begin at `first`: pieces of one face are one
    /// cover, at their common middle.
    #[inline(always)]
    fn add(&mut self, out: &mut Vec<Cover>, first: usize, piece: Cover) {
        let mass = f64::from(piece.area.abs());
        match out[first..].iter().position(|cover| cover.face == piece.face) {
            Some(at) => {
                let cover = &mut out[first + at];
                self.masses[at] += mass;
                let t = mass / self.masses[at];
                cover.x += (piece.x - cover.x) * t;
                cover.y += (piece.y - cover.y) * t;
                cover.area += piece.area;
            }
            None => {
                self.masses.push(mass);
                out.push(piece);
            }
        }
    }
}
