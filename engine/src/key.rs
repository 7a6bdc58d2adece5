//! Content keys: what a value *is*, so that equal work is done once.
//!
//! A key hashes everything that a value depends on. Nobody writes one by hand: the graph hashes a
//! node's declaration, its parameters, its demand, its inputs' keys and the files it reads; a
//! scene's key hashes its contents. Two values with equal keys are interchangeable bit for bit.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A 128-bit content hash. Keys order sources where nothing else does.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Key(u128);

impl Key {
    /// The key of any serialisable value, by its canonical text form.
    ///
    /// Floats enter with all their bits' meaning (shortest text that reads back equal); maps enter
    /// in their own order, so use ordered maps in parameters.
    pub fn of<T: Serialize + ?Sized>(value: &T) -> Key {
        let mut hasher = KeyHasher::new("value");
        hasher.value(value);
        hasher.finish()
    }

    /// The key of a run of bytes.
    pub fn of_bytes(bytes: &[u8]) -> Key {
        let mut hasher = KeyHasher::new("bytes");
        hasher.bytes(bytes);
        hasher.finish()
    }

    /// The key of a file's bytes, as [`of_bytes`](Key::of_bytes) has it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn of_file(mut file: std::fs::File) -> std::io::Result<Key> {
        let length = file.metadata()?.len();
        let mut hasher = KeyHasher::new("bytes");
        hasher.0.update(&length.to_le_bytes());
        hasher.0.update_reader(&mut file)?;
        Ok(hasher.finish())
    }

    /// A number that belongs to a name, 1 to 2^32 - 1: the same in every frame and every program.
    pub fn id_of_name(name: &str) -> u32 {
        let [a, b, c, d, ..] = Key::of_bytes(name.as_bytes()).to_bytes();
        u32::from_be_bytes([a, b, c, d]).max(1)
    }

    /// The key's 16 bytes, big end first.
    pub fn to_bytes(self) -> [u8; 16] {
        self.0.to_be_bytes()
    }
}

impl Serialize for Key {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&format!("{self:?}"))
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Key, D::Error> {
        let text = String::deserialize(deserializer)?;
        let key = u128::from_str_radix(&text, 16);
        key.map(Key)
            .map_err(|_| de::Error::custom(format!("{text:?} is no key: 32 hexadecimal digits")))
    }
}

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl std::fmt::Display for Key {
    /// The first 8 hexadecimal digits: enough to tell keys apart by eye.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:08x}", self.0 >> 96)
    }
}

/// Builds a [`Key`] from parts. Every part is framed by its length, so that no two sequences of
/// parts hash alike.
pub struct KeyHasher(blake3::Hasher);

impl KeyHasher {
    /// Starts a key in a domain of its own, such as `"scene"`.
    pub fn new(domain: &str) -> KeyHasher {
        let mut hasher = KeyHasher(blake3::Hasher::new());
        hasher.bytes(domain.as_bytes());
        hasher
    }

    /// Adds a run of bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut KeyHasher {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Adds another key.
    pub fn key(&mut self, key: Key) -> &mut KeyHasher {
        self.bytes(&key.to_bytes())
    }

    /// Adds a serialisable value, by its canonical text form.
    pub fn value<T: Serialize + ?Sized>(&mut self, value: &T) -> &mut KeyHasher {
        match serde_json::to_vec(value) {
            Ok(text) => self.bytes(&text),
            // Only a map whose keys are no strings gets here; its own debug name must not matter.
            Err(error) => self.bytes(error.to_string().as_bytes()),
        }
    }

    /// The finished key.
    pub fn finish(&self) -> Key {
        let mut first = [0u8; 16];
        first.copy_from_slice(&self.0.finalize().as_bytes()[..16]);
        Key(u128::from_be_bytes(first))
    }
}
