//! Noise: Perlin's, and points in cells. All of it is deterministic, and filtered by what a pixel covers. Shaders in
//! Rust that use it look as programs do.

/// A number of 32 bits that belongs to three whole numbers.
fn hash(x: i32, y: i32, z: i32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8DA6_B343)
        ^ (y as u32).wrapping_mul(0xD816_3841)
        ^ (z as u32).wrapping_mul(0xCB1A_B31F);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

fn share(h: u32) -> f32 {
    (h >> 8) as f32 / 16_777_216.0
}

/// The cell of a place, and the place in it. Beyond what whole numbers hold there is no noise.
#[inline(always)]
fn cell(v: f32) -> (i32, f32) {
    if v.abs() < 1e9 {
        // As `floor` has it, which is a call where processors have no instruction for it.
        let whole = v as i32;
        let below = whole - i32::from(whole as f32 > v);
        return (below, v - below as f32);
    }
    (0, 0.0)
}

/// The twelve edges of a cube, four of them twice (Perlin, "Improving Noise", 2002).
const EDGES: [[f32; 3]; 16] = {
    let mut edges = [[0.0; 3]; 16];
    let mut h = 0;
    while h < 16 {
        let (u, v) = match h {
            0..=3 | 12 | 14 => (0, 1),
            4..=7 => (0, 2),
            _ => (1, 2),
        };
        edges[h][u] = if h & 1 == 0 { 1.0 } else { -1.0 };
        edges[h][v] = if h & 2 == 0 { 1.0 } else { -1.0 };
        h += 1;
    }
    edges
};

/// One of the edges times a place. Looked up, as no processor foresees which it is.
#[inline(always)]
fn gradient(h: u32, x: f32, y: f32, z: f32) -> f32 {
    let [u, v, w] = EDGES[(h & 15) as usize];
    x * u + y * v + z * w
}

/// Perlin's noise at a place in three numbers, about -1 to 1. What is no finite number is nowhere in its cell.
pub fn perlin([x, y, z]: [f32; 3]) -> f32 {
    let ((i, x), (j, y), (k, z)) = (cell(x), cell(y), cell(z));
    let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (u, v, w) = (fade(x), fade(y), fade(z));
    let at = |a: i32, b: i32, c: i32| {
        let h = hash(i.wrapping_add(a), j.wrapping_add(b), k.wrapping_add(c));
        gradient(h, x - a as f32, y - b as f32, z - c as f32)
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |b, c| mix(at(0, b, c), at(1, b, c), u);
    let plane = |c| mix(row(0, c), row(1, c), v);
    mix(plane(0), plane(1), w)
}

/// How much of noise of one cell to a unit is left where a pixel covers `width` units: 0 to 1.
pub fn left(width: f32) -> f32 {
    // Its waves are about one to two units long: half a wave to a pixel is all that a picture can show.
    let t = ((width - 0.3) / 0.5).clamp(0.0, 1.0);
    1.0 - t * t * (3.0 - 2.0 * t)
}

/// Noise of ever finer cells, each with less of it: a sum about -1 to 1; with `turbulent`, of its amount. There
/// are `count` octaves, 16 at most, each `lacunarity` times finer and `gain` times weaker than the one before.
pub fn octaves(
    at: [f32; 3],
    width: f32,
    [count, lacunarity, gain]: [f32; 3],
    turbulent: bool,
) -> f32 {
    let (mut sum, mut amplitude, mut frequency) = (0.0, 1.0, 1.0);
    for _ in 0..count.clamp(0.0, 16.0) as u32 {
        let left = left(width * frequency);
        let value = if left > 0.0 { perlin(at.map(|v| v * frequency)) } else { 0.0 };
        // What is too fine to be seen leaves its mean.
        sum += amplitude
            * if turbulent {
                MEAN_AMOUNT + (value.abs() - MEAN_AMOUNT) * left
            } else {
                value * left
            };
        amplitude *= gain;
        frequency *= lacunarity;
    }
    sum
}

/// The mean of the amount of Perlin's noise.
const MEAN_AMOUNT: f32 = 0.21;

/// A number for each cell of one unit.
pub fn of_cell([x, y, z]: [f32; 3]) -> f32 {
    share(hash(cell(x).0, cell(y).0, cell(z).0))
}

/// Points in cells (Worley): the way to the nearest and the second nearest, and a number of the nearest.
pub fn voronoi([x, y, z]: [f32; 3], jitter: f32) -> [f32; 3] {
    let ((i, x), (j, y), (k, z)) = (cell(x), cell(y), cell(z));
    let (mut first, mut second, mut whose) = (f32::INFINITY, f32::INFINITY, 0.0);
    for a in -1..=1 {
        for b in -1..=1 {
            for c in -1..=1 {
                let h = hash(i.wrapping_add(a), j.wrapping_add(b), k.wrapping_add(c));
                let place = |shift: u32| {
                    let own = hash(h as i32, shift as i32, 7);
                    0.5 + (share(own) - 0.5) * jitter
                };
                let (dx, dy, dz) =
                    (a as f32 + place(1) - x, b as f32 + place(2) - y, c as f32 + place(3) - z);
                let way = dx * dx + dy * dy + dz * dz;
                if way < first {
                    (second, first, whose) = (first, way, share(hash(h as i32, 4, 11)));
                } else if way < second {
                    second = way;
                }
            }
        }
    }
    [first.sqrt(), second.sqrt(), whose]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_nothing_on_the_grid_and_has_its_mean_and_range() {
        assert_eq!(perlin([3.0, -4.0, 0.0]), 0.0);
        let (mut sum, mut amount, mut most, mut count) = (0.0f64, 0.0f64, 0.0f32, 0.0f64);
        for i in 0..200_000u32 {
            let at = [i as f32 * 0.137, i as f32 * 0.0731 + 0.3, i as f32 * 0.0517 + 0.7];
            let value = perlin(at);
            sum += f64::from(value);
            amount += f64::from(value.abs());
            most = most.max(value.abs());
            count += 1.0;
        }
        assert!((sum / count).abs() < 0.005, "{}", sum / count);
        assert!((amount / count - f64::from(MEAN_AMOUNT)).abs() < 0.02, "{}", amount / count);
        assert!(most > 0.8 && most <= 1.05, "{most}");
    }

    #[test]
    fn what_is_too_fine_to_be_seen_is_its_mean() {
        assert_eq!((left(0.1), left(5.0)), (1.0, 0.0));
        let at = [0.3, 0.7, 0.2];
        assert_eq!(octaves(at, 9.0, [6.0, 2.0, 0.5], false), 0.0);
        let fine = octaves(at, 9.0, [3.0, 2.0, 0.5], true);
        assert!((fine - MEAN_AMOUNT * 1.75).abs() < 1e-6);
    }

    #[test]
    fn numbers_that_are_no_place_do_no_harm() {
        for wild in [f32::NAN, f32::INFINITY, -1e30, 2_147_483_648.0] {
            assert!(perlin([wild, 0.5, 0.5]).is_finite());
            let [a, b, _] = voronoi([wild, 0.5, wild], 1.0);
            assert!(a.is_finite() && b.is_finite());
            assert!(of_cell([wild; 3]).is_finite());
        }
    }
}
