//! B44 and B44A of channels with fewer samples than pixels, which the library does not unpack: blocks of 4 by 4 halves
//! as a first one and differences, or as one for all of them.

use exr::meta::header::Header;
use exr::prelude::{IntegerBounds, SampleType, f16};

/// The samples of a block of 14 bytes, left to right and top to bottom.
fn block(b: &[u8; 14]) -> [u16; 16] {
    let (shift, [first, second]) = (b[2] >> 2, [b[0], b[1]]);
    let bias = 0x20u16 << shift;
    let mut s = [0u16; 16];
    s[0] = u16::from_be_bytes([first, second]);
    // Six bits each, the columns from left to right: the first downwards, the others from the one beside.
    let bits = b[2..].iter().fold(0u128, |bits, byte| bits << 8 | u128::from(*byte));
    let difference = |k: u32| ((bits >> (90 - 6 * (k + 1))) & 0x3f) as u16;
    for k in 0..15 {
        let (at, from) = match k {
            0..3 => (4 * (k as usize + 1), 4 * k as usize),
            _ => {
                let (column, row) = ((k as usize - 3) / 4 + 1, (k as usize - 3) % 4);
                (4 * row + column, 4 * row + column - 1)
            }
        };
        s[at] = s[from].wrapping_add(difference(k) << shift).wrapping_sub(bias);
    }
    s
}

/// From the order in which differences are small to the bits of a half.
fn half_of(ordered: u16) -> u16 {
    if ordered & 0x8000 == 0 { !ordered } else { ordered & 0x7fff }
}

/// From what is coded by its exponential, exp(v / 8), where a channel says that it is seen linearly.
fn linear(bits: u16) -> u16 {
    let v = f16::from_bits(bits).to_f32();
    let most = f64::from(f16::MAX.to_f32());
    let v = match f64::from(v) {
        v if !v.is_finite() || v < 0.0 => 0.0,
        0.0 => -most,
        v => (8.0 * std::f64::consts::LN_2 * crate::math::log2(v)).clamp(-most, most),
    };
    f16::from_f64(v).to_bits()
}

/// The rows of a chunk: of each row, one channel after the other. `None` if it breaks off.
pub(super) fn unpacked(header: &Header, bounds: IntegerBounds, packed: &[u8]) -> Option<Vec<u8>> {
    let (left, top) = (bounds.position.0.max(0) as usize, bounds.position.1.max(0) as usize);
    let (right, bottom) = (left + bounds.size.0, top + bounds.size.1);
    let within = |from: usize, to: usize, by: usize| to.div_ceil(by) - from.div_ceil(by);
    let mut rest = packed;
    let mut take = |count: usize| {
        let (taken, after) = rest.split_at_checked(count)?;
        rest = after;
        Some(taken)
    };
    // Channel by channel, its samples as bytes.
    let mut planes = Vec::new();
    for channel in &header.channels.list {
        let (width, height) =
            (within(left, right, channel.sampling.0), within(top, bottom, channel.sampling.1));
        let bytes = channel.sample_type.bytes_per_sample();
        let mut plane = vec![0u8; width * height * bytes];
        if channel.sample_type != SampleType::F16 {
            plane = take(plane.len())?.to_vec();
        } else {
            for y in (0..height).step_by(4) {
                for x in (0..width).step_by(4) {
                    let head = take(3)?;
                    // B44A's blocks of one value take 3 bytes. A shift of 13 or more marks them, as
                    // no other has it.
                    let samples = if head[2] >= 13 << 2 {
                        [u16::from_be_bytes([head[0], head[1]]); 16]
                    } else {
                        let mut whole = [0u8; 14];
                        whole[..3].copy_from_slice(head);
                        whole[3..].copy_from_slice(take(11)?);
                        block(&whole)
                    };
                    for (k, sample) in samples.into_iter().enumerate() {
                        let (x, y) = (x + k % 4, y + k / 4);
                        // Blocks at the right and the bottom are filled up by repeats.
                        if x < width && y < height {
                            let bits = half_of(sample);
                            let bits = if channel.quantize_linearly { linear(bits) } else { bits };
                            let at = 2 * (y * width + x);
                            plane[at..at + 2].copy_from_slice(&bits.to_le_bytes());
                        }
                    }
                }
            }
        }
        planes.push((plane, width * bytes));
    }
    let mut rows = Vec::new();
    for y in top..bottom {
        for (channel, (plane, row)) in header.channels.list.iter().zip(&planes) {
            if y.is_multiple_of(channel.sampling.1) {
                let number = y / channel.sampling.1 - top.div_ceil(channel.sampling.1);
                rows.extend(&plane[number * row..(number + 1) * row]);
            }
        }
    }
    Some(rows)
}
