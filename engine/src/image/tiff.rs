//! What the directory of a TIFF says beside what its decoder tells.

/// What a TIFF says of its first picture, and how many there are.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct About {
    pub(super) pictures: usize,
    /// Whether its colours are shrunk by alpha.
    pub(super) is_associated: bool,
}

/// The tag that says what samples after the colours are.
const EXTRA_SAMPLES: u64 = 338;

/// Reads what can be read: a damaged file says nothing here.
pub(super) fn about(bytes: &[u8]) -> About {
    let mut about = About::default();
    let is_little = bytes.first() == Some(&b'I');
    let number = |at: usize, count: usize| -> Option<u64> {
        let own = bytes.get(at..at.checked_add(count)?)?;
        let fold = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
        Some(if is_little { own.iter().rev().fold(0, fold) } else { own.iter().fold(0, fold) })
    };
    let is_big = number(2, 2) == Some(43);
    // Bytes of a place, of a count of entries, and of an entry.
    let (place, count, entry) = if is_big { (8, 8, 20) } else { (4, 2, 12) };
    let mut next = number(if is_big { 8 } else { 4 }, place);
    while let Some(at) = next.filter(|at| *at > 0 && about.pictures < 10_000) {
        let Ok(at) = usize::try_from(at) else { break };
        let Some(entries) = number(at, count).filter(|entries| *entries < 65_536) else { break };
        about.pictures += 1;
        let first = at + count;
        for k in 0..entries as usize {
            let from = first + k * entry;
            if about.pictures == 1 && number(from, 2) == Some(EXTRA_SAMPLES) {
                about.is_associated = number(from + 4 + place, 2) == Some(1);
            }
        }
        next = number(first + entries as usize * entry, place);
    }
    about
}
