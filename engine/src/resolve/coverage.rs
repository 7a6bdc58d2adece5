//! From lines to pixels: which faces cover a pixel, and how much of it (\[N] eqs. 1 to 6).
//!
//! All lines of a row are walked together from left to right. Where every one of them shows the same
//! face over whole pixels, they are passed in one step, \[N] eq. 5; only pixels with a boundary in them
//! are added up line by line, eqs. 3, 4 and 6. With a filter that reaches beyond the pixel the same is
//! done with all that it reaches, and what lies left of a boundary weighs the filter's integral.

use super::boundary::Boundaries;
use super::doubt::Doubt;
use super::filter::{Kernel, PixelFilter};
use super::rule::{Framing, LineShare, Rule, shares};
use super::stacks::Stacks;
use super::strip::Strip;
use crate::span::{FaceId, SpanImage};
use crate::visible::probe::FaceIndex;

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

/// Computes rows of coverage of one image.
pub struct Coverage<'a> {
    image: &'a SpanImage,
    rule: Rule,
    framing: &'a Framing,
    boundaries: Boundaries<'a>,
    stacks: Stacks<'a>,
    strips: Vec<Strip>,
    reach: PixelReach,
    masses: Masses,
    doubt: Option<Doubt<'a>>,
}

/// How far a pixel reaches, and how it weighs what it reaches.
struct PixelReach {
    /// The height of a row of the picture, in pixels of the raster.
    height: f64,
    /// Beyond its sides, in pixels.
    beyond: f64,
    /// The integrals of a filter other than the box.
    kernel: Option<&'static Kernel>,
}

/// By cover of the pixel at hand, the sum of its weights without their signs.
type Masses = Vec<f64>;

impl<'a> Coverage<'a> {
    /// Coverage of an image, which must have the rule's line plan; `index`, of its faces, if the rule
    /// divides pixels.
    pub fn new(
        image: &'a SpanImage,
        rule: Rule,
        framing: &'a Framing,
        index: Option<&'a FaceIndex>,
    ) -> Coverage<'a> {
        let (boundaries, stacks) = (Boundaries::new(image), Stacks::new(image));
        let filter = framing.filter;
        let reach = PixelReach {
            height: 1.0 / framing.scale.y,
            beyond: filter.radius() - 0.5,
            kernel: (filter != PixelFilter::Box).then(|| filter.kernel()),
        };
        let tolerance = rule.tolerance().zip(index);
        let doubt =
            tolerance.map(|(tolerance, index)| Doubt::new(image, index, framing, tolerance));
        Coverage {
            image,
            rule,
            framing,
            boundaries,
            stacks,
            strips: Vec::new(),
            reach,
            masses: Vec::new(),
            doubt,
        }
    }

    /// The same, with an estimate of the error of every pixel whether or not the rule divides any.
    #[must_use]
    pub fn with_estimates(self) -> Coverage<'a> {
        let Coverage { image, framing, .. } = self;
        let doubt = self.doubt.or_else(|| Some(Doubt::estimate(image, framing)));
        Coverage { doubt, ..self }
    }

    /// The same without layers that are hidden behind others, as their alpha says.
    #[must_use]
    pub fn without_hidden(self) -> Coverage<'a> {
        let Coverage { image, framing, .. } = self;
        Coverage { stacks: self.stacks.without_hidden(image, framing), ..self }
    }

    /// The faces that lie over each other in a cover of the last row, the nearest first, an opaque one
    /// last; `None` if the id is that of a face.
    #[inline(always)]
    pub fn stack(&self, id: FaceId) -> Option<&[FaceId]> {
        self.stacks.get(id)
    }

    /// By pixel of the last row, by how much its coverage may be off; empty if nobody asked.
    pub fn errors(&self) -> &[f32] {
        self.doubt.as_ref().map_or(&[], |doubt| doubt.errors())
    }

    /// The covers of a row of the picture, pixel by pixel from left to right. Appends to `out`.
    pub fn row(&mut self, row: u32, out: &mut Vec<Cover>) {
        let plan = self.image.plan();
        let all = plan.lines(&(0..self.image.view().raster().height));
        let mut shares = shares(self.rule, plan, self.framing, row, all.end);
        let count = shares.len();
        // The strips above and below the row stand behind its own. They weigh nothing and are only
        // compared with.
        let beside = if self.doubt.is_some() { beside(&shares, all.end) } else { [None; 2] };
        shares.extend(beside.into_iter().flatten());
        let lines = shares.iter().filter_map(|share| share.line);
        self.stacks.go_to(row, lines);
        self.strips.resize_with(shares.len().max(self.strips.len()), Strip::default);
        for (i, share) in shares.iter().enumerate() {
            self.fill(i, share);
        }
        let (strips, others) = self.strips[..shares.len()].split_at_mut(count);
        if let Some(doubt) = &mut self.doubt {
            let mut others = others.iter_mut();
            let beside = beside.map(|share| share.and_then(|_| others.next()));
            doubt.examine(row, strips, beside, &mut self.stacks);
        }
        let mut divided =
            self.doubt.as_ref().map_or(&[][..], |doubt| doubt.divided()).iter().peekable();
        let mut pixel = self.framing.columns.start;
        while pixel < self.framing.columns.end {
            if let Some(divided) = divided.next_if(|divided| divided.pixel == pixel) {
                self.reach.add_pixel(&divided.strips, pixel, &mut self.masses, out);
                pixel += 1;
                continue;
            }
            let x = f64::from(pixel);
            let left = x - self.reach.beyond;
            let stop = divided.peek().map_or(self.framing.columns.end, |divided| divided.pixel);
            let mut run = f64::from(stop);
            let mut whole = true;
            for strip in strips.iter_mut() {
                strip.go_to(left);
                whole &= strip.left_high <= left;
                run = run.min(strip.right_low - self.reach.beyond);
            }
            let face = strips.first().map_or(FaceId::NONE, Strip::face);
            // Whole pixels only: the conversion cuts off the rest.
            let end = run as u32;
            // [N] eq. 5, [x_k] < i < [x_(k+1)], for all lines of the row and any number of pixels
            // at once.
            if whole && end > pixel && strips.iter().all(|strip| strip.face() == face) {
                let y = strips.iter().map(|strip| strip.weight * strip.y).sum();
                out.push(Cover { face, start: pixel, end, area: 1.0, x: x + 0.5, y });
                pixel = end;
            } else {
                self.reach.add_pixel(strips, pixel, &mut self.masses, out);
                pixel += 1;
            }
        }
    }

    /// Places the boundaries of a share's line in the picture.
    fn fill(&mut self, i: usize, share: &LineShare) {
        let Coverage { image, rule, framing, boundaries, stacks, strips, .. } = self;
        let strip = &mut strips[i];
        let Some(k) = share.line else {
            strip.begin(share.weight, 0.0, FaceId::NONE);
            strip.end();
            return;
        };
        let raster = image.view().raster();
        strip.begin(share.weight, image.plan().y(k), FaceId::NONE);
        strip.top.push(0.0);
        strip.bottom.push(0.0);
        stacks.prepare(image, k);
        let line = stacks.spans(image, k);
        match rule {
            Rule::Sampled(..) => {
                strip.top.extend(line[1..].iter().map(|span| raster.pixels(span.x)));
                // The first two stand left of all spans and are in both already.
                strip.bottom.extend_from_slice(&strip.top[2..]);
            }
            _ => boundaries.of_line(k, line, stacks, &mut strip.top, &mut strip.bottom),
        }
        strip.faces.extend(line.iter().map(|span| span.face));
        strip.top.push(f64::from(raster.width));
        strip.bottom.push(f64::from(raster.width));
        strip.faces.push(FaceId::NONE);
        let (from, to) = share.strip;
        for (top, bottom) in strip.top.iter_mut().zip(&mut strip.bottom).skip(1) {
            let (above, below) = (*top, *bottom);
            // [N], "Regeneration of images with scaling": intersections are multiplied by the
            // scale, and visibility is not solved again.
            let place = |t: f64| {
                let x = if above == below { above } else { above + (below - above) * t };
                x * framing.scale.x + framing.pan.x
            };
            (*top, *bottom) = (place(from), place(to));
        }
        if !matches!(rule, Rule::Sampled(..)) {
            // A share that takes a part of the strip is shaded in the middle of that part. Sampled
            // lines are shaded on the line itself.
            strip.y += ((from + to) / 2.0 - 0.5) / f64::from(image.plan().per_row);
        }
        strip.end();
    }
}

/// What is above and below a row, to compare with; it weighs nothing. That is the next line; or more of
/// the row's own, if the row cuts its strip; or the same line gone on, where the raster ends.
fn beside(shares: &[LineShare], lines: u32) -> [Option<LineShare>; 2] {
    let share = |k, strip| Some(LineShare { line: Some(k), weight: 0.0, strip });
    let above = |first: &LineShare| match (first.line?, first.strip.0) {
        (k, from) if from > 0.0 => share(k, (0.0, from)),
        (0, _) => share(0, (-1.0, 0.0)),
        (k, _) => share(k - 1, (0.0, 1.0)),
    };
    let below = |last: &LineShare| match (last.line?, last.strip.1) {
        (k, to) if to < 1.0 => share(k, (to, 1.0)),
        (k, _) if k + 1 == lines => share(k, (1.0, 2.0)),
        (k, _) => share(k + 1, (0.0, 1.0)),
    };
    [shares.first().and_then(above), shares.last().and_then(below)]
}

impl PixelReach {
    /// Adds up the strips of one pixel.
    fn add_pixel(&self, strips: &[Strip], pixel: u32, masses: &mut Masses, out: &mut Vec<Cover>) {
        let (first, width) = (out.len(), 1.0 + 2.0 * self.beyond);
        let x = f64::from(pixel) - self.beyond;
        masses.clear();
        for strip in strips {
            let mut i = strip.cursor;
            // Where a boundary lies, and how much lies left of it.
            let at = |i: usize| {
                let clipped = strip.clipped(i, x, width);
                (clipped, self.weight(strip, i, x, clipped))
            };
            // Boundaries may run beyond the raster's sides; what they bound does not.
            let most = at(strip.faces.len() - 1);
            let (mut left, mut before) = at(i);
            while left < width && i < strip.faces.len() {
                let (right, after) = match at(i + 1) {
                    end if end.0 < left => (left, before),
                    end if end.0 > most.0 && i + 1 < strip.faces.len() => most,
                    end => end,
                };
                // [N] eqs. 3, 4 and 6: what lies left of x_(k+1) in the pixel, less what lies left
                // of x_k. The cut at the pixel's sides makes one formula of the three cases; the
                // weight is d_j.
                let area = (after - before) * strip.weight;
                if area != 0.0 {
                    let (across, down) = middle(strip, i, x, width, (left + right) / 2.0);
                    let cover = Cover {
                        face: strip.faces[i],
                        start: pixel,
                        end: pixel + 1,
                        area: area as f32,
                        x: x + across,
                        y: strip.y + down * strip.weight * self.height,
                    };
                    add(out, masses, first, cover);
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
}

/// The middle of the piece of face `i` in a strip, cut off at `x` and `width` right of it: from there to
/// the right, and from the strip's own middle down in heights of the strip. So that a piece whose face
/// ends within the strip is shaded where the face is.
#[inline(always)]
fn middle(strip: &Strip, i: usize, x: f64, width: f64, straight: f64) -> (f64, f64) {
    // The corners of a trapezoid, clockwise from the upper left; its height runs from -1/2 to 1/2.
    let sides = [strip.top[i], strip.top[i + 1], strip.bottom[i + 1], strip.bottom[i]];
    let [a, b, c, d] = sides.map(|at| at - x);
    if (a == d && b == c) || !(a + b + c + d).is_finite() {
        return (straight, 0.0);
    }
    let is_inside = |at: f64| (0.0..=width).contains(&at);
    if [a, b, c, d].into_iter().all(is_inside) {
        let (above, below) = (b - a, c - d);
        let sum = above + below;
        if sum <= 1e-9 {
            return (straight, 0.0);
        }
        // Its centroid in closed form.
        let across = (b * b + b * c + c * c - a * a - a * d - d * d) / (3.0 * sum);
        return (across, (below - above) / (6.0 * sum));
    }
    // Cut at the pixel's sides it has up to eight corners.
    let mut corners = [(0.0, 0.0); 8];
    let mut count = 0;
    let mut last = (d, 0.5);
    for at in [(a, -0.5), (b, -0.5), (c, 0.5), (d, 0.5)] {
        let (from, to) = (last, at);
        let y = |x: f64| from.1 + (to.1 - from.1) * ((x - from.0) / (to.0 - from.0));
        let mut ends = [0.0, width];
        if to.0 < from.0 {
            ends.reverse();
        }
        for end in ends {
            let crosses = (from.0 < end) != (to.0 < end);
            if crosses && count < 8 {
                corners[count] = (end, y(end));
                count += 1;
            }
        }
        if is_inside(to.0) && count < 8 {
            corners[count] = to;
            count += 1;
        }
        last = at;
    }
    // Twice the area and six times the moments, as sums over the sides.
    let (mut area, mut across, mut down) = (0.0, 0.0, 0.0);
    for k in 0..count {
        let ((px, py), (qx, qy)) = (corners[k], corners[(k + 1) % count]);
        let part = px * qy - qx * py;
        area += part;
        across += (px + qx) * part;
        down += (py + qy) * part;
    }
    if area.abs() <= 1e-9 {
        return (straight, 0.0);
    }
    ((across / (3.0 * area)).clamp(0.0, width), (down / (3.0 * area)).clamp(-0.5, 0.5))
}

/// Adds a piece to the covers of its pixel, which begin at `first`: pieces of one face are one cover, at
/// their common middle.
#[inline(always)]
fn add(out: &mut Vec<Cover>, masses: &mut Masses, first: usize, piece: Cover) {
    let mass = f64::from(piece.area.abs());
    match out[first..].iter().position(|cover| cover.face == piece.face) {
        Some(at) => {
            let cover = &mut out[first + at];
            // Middles are weighed without signs. Where a filter has weights below 0, a mean with
            // signs could lie far outside the pixel.
            masses[at] += mass;
            let t = mass / masses[at];
            cover.x += (piece.x - cover.x) * t;
            cover.y += (piece.y - cover.y) * t;
            cover.area += piece.area;
        }
        None => {
            masses.push(mass);
            out.push(piece);
        }
    }
}
