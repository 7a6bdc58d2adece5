//! Columns of numbers as bytes.

/// What is wrong with a block's contents.
pub(super) type Fault = String;

/// Appends a number, seven bits to a byte, the lowest first; the highest bit says that more follow.
pub(super) fn put(out: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        out.push(number as u8 | 0x80);
        number >>= 7;
    }
    out.push(number as u8);
}

/// Appends a number with a sign: 0, -1, 1, -2, .. become 0, 1, 2, 3, ..
pub(super) fn put_signed(out: &mut Vec<u8>, number: i64) {
    put(out, ((number << 1) ^ (number >> 63)) as u64);
}

/// Appends a run of bytes with its length before it.
pub(super) fn put_run(out: &mut Vec<u8>, run: &[u8]) {
    put(out, run.len() as u64);
    out.extend_from_slice(run);
}

/// Appends doubles: each is combined with the one before by exclusive or, so that what is alike is zero,
/// then all first bytes are put down, all second bytes and so on, the highest first.
pub(super) fn put_doubles(out: &mut Vec<u8>, values: impl Iterator<Item = f64>) {
    put_planes(out, values.map(f64::to_bits).collect(), 8);
}

/// Appends floats, likewise.
pub(super) fn put_floats(out: &mut Vec<u8>, values: impl Iterator<Item = f32>) {
    put_planes(out, values.map(|v| u64::from(v.to_bits())).collect(), 4);
}

fn put_planes(out: &mut Vec<u8>, mut values: Vec<u64>, width: usize) {
    // From the end, so that the one before is still as it was.
    for i in (1..values.len()).rev() {
        values[i] ^= values[i - 1];
    }
    for byte in (0..width).rev() {
        out.extend(values.iter().map(|v| (v >> (8 * byte)) as u8));
    }
}

/// Bytes being read.
#[derive(Clone, Debug)]
pub(super) struct Bytes<'b>(&'b [u8]);

impl<'b> Bytes<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Bytes<'b> {
        Bytes(bytes)
    }

    pub(super) fn left(&self) -> usize {
        self.0.len()
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'b [u8], Fault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("it ends too soon")?;
        self.0 = rest;
        Ok(taken)
    }

    #[inline]
    pub(super) fn number(&mut self) -> Result<u64, Fault> {
        let mut number = 0u64;
        for (i, byte) in self.0.iter().enumerate().take(10) {
            number |= u64::from(byte & 0x7f) << (7 * i);
            if byte & 0x80 == 0 {
                self.0 = &self.0[i + 1..];
                return Ok(number);
            }
        }
        Err("a number does not end".into())
    }

    #[inline]
    pub(super) fn signed(&mut self) -> Result<i64, Fault> {
        let number = self.number()?;
        Ok((number >> 1) as i64 ^ -((number & 1) as i64))
    }

    /// A number that an index can be.
    pub(super) fn index(&mut self) -> Result<u32, Fault> {
        u32::try_from(self.number()?).map_err(|_| "a number is too large".into())
    }

    pub(super) fn run(&mut self) -> Result<Bytes<'b>, Fault> {
        let length = usize::try_from(self.number()?).unwrap_or(usize::MAX);
        self.take(length).map(Bytes)
    }

    pub(super) fn doubles(&mut self, count: usize) -> Result<Vec<f64>, Fault> {
        Ok(self.planes(count, 8)?.into_iter().map(f64::from_bits).collect())
    }

    pub(super) fn floats(&mut self, count: usize) -> Result<Vec<f32>, Fault> {
        Ok(self.planes(count, 4)?.into_iter().map(|v| f32::from_bits(v as u32)).collect())
    }

    fn planes(&mut self, count: usize, width: usize) -> Result<Vec<u64>, Fault> {
        // Before anything is allocated: a count that lies costs no memory.
        let bytes = self.take(count.checked_mul(width).ok_or("it ends too soon")?)?;
        let mut values = vec![0u64; count];
        for (plane, byte) in (0..width).rev().enumerate() {
            for (value, bits) in values.iter_mut().zip(&bytes[plane * count..]) {
                *value |= u64::from(*bits) << (8 * byte);
            }
        }
        for i in 1..count {
            values[i] ^= values[i - 1];
        }
        Ok(values)
    }

    pub(super) fn end(&self) -> Result<(), Fault> {
        match self.0 {
            [] => Ok(()),
            rest => Err(format!("{} bytes are left over", rest.len())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back() {
        let mut out = Vec::new();
        let numbers = [0, 1, 127, 128, 300, u64::MAX];
        let signed = [0, -1, 1, 63, -64, i64::MIN, i64::MAX];
        let doubles = [1.5, -0.0, 1e300, f64::MIN_POSITIVE, 1.5];
        numbers.iter().for_each(|n| put(&mut out, *n));
        signed.iter().for_each(|n| put_signed(&mut out, *n));
        put_doubles(&mut out, doubles.into_iter());
        put_floats(&mut out, [0.25f32, 7.0].into_iter());
        let mut bytes = Bytes::new(&out);
        numbers.iter().for_each(|n| assert_eq!(bytes.number().unwrap(), *n));
        signed.iter().for_each(|n| assert_eq!(bytes.signed().unwrap(), *n));
        let read = bytes.doubles(5).unwrap();
        assert!(read.iter().zip(doubles).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(bytes.floats(2).unwrap(), [0.25, 7.0]);
        bytes.end().unwrap();
    }

    #[test]
    fn what_ends_too_soon_is_a_fault() {
        assert!(Bytes::new(&[0x80, 0x80]).number().is_err());
        assert!(Bytes::new(&[0xff; 20]).number().is_err());
        assert!(Bytes::new(&[5, 1]).run().is_err());
        assert!(Bytes::new(&[1]).doubles(usize::MAX).is_err());
    }
}
