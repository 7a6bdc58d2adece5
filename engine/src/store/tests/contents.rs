//! Objects: what was stored comes back, and nothing else does.

use std::io::{BufRead, ErrorKind, Read, Write};

use super::*;

const BLOCK: usize = 1 << 18;

#[test]
fn what_was_stored_comes_back_in_any_pieces() {
    let scratch = Scratch::new("back");
    let store = scratch.store(1 << 30);
    for length in [0, 1, 79, BLOCK - 1, BLOCK, BLOCK + 1, 3 * BLOCK + 5] {
        let bytes: Vec<u8> = (0..length).map(|i| (i * 7 + i / 256) as u8).collect();
        let key = key(length as u64);
        assert_eq!(store.bytes(key).unwrap(), None);
        let written = store.put(key, 2.5, |out| {
            bytes.chunks(1000).try_for_each(|piece| out.write_all(piece))?;
            out.flush()
        });
        assert_eq!(written.unwrap(), Put::Stored);
        assert_eq!(store.bytes(key).unwrap().as_ref(), Some(&bytes));
        let mut object = store.get(key).unwrap().unwrap();
        assert_eq!((object.length(), object.seconds()), (length as u64, 2.5));
        let mut start = vec![0; 70.min(length)];
        object.read_exact(&mut start).unwrap();
        assert_eq!([start, object.into_bytes().unwrap()].concat(), bytes);
        assert_eq!(
            std::fs::metadata(file(&store, key)).unwrap().len(),
            object::size(length as u64)
        );
        let again = store.put(key, 2.5, |_| panic!("nobody asks for them"));
        assert_eq!(again.unwrap(), Put::Known);
        store.remove(key).unwrap();
        store.remove(key).unwrap();
        assert_eq!(store.bytes(key).unwrap(), None);
    }
    assert_eq!(store.folder.unfinished().unwrap().len(), 0);
    for (given, kept) in [(f64::NAN, 0.0), (-1.0, 0.0), (f64::INFINITY, 1e12), (0.1, 0.1)] {
        put(&store, key(9), given, b"x");
        assert_eq!(store.get(key(9)).unwrap().unwrap().seconds(), kept);
        store.remove(key(9)).unwrap();
    }
}

#[test]
fn a_file_made_as_documented_is_read() {
    let scratch = Scratch::new("hand");
    let store = scratch.store(1 << 30);
    let contents = vec![7; BLOCK + 10];
    let key = key(1);
    let mut bytes = b"spanstor\x01\0\0\0\0\0\0\0".to_vec();
    bytes.extend(key.to_bytes());
    bytes.extend((contents.len() as u64).to_le_bytes());
    bytes.extend(0.5f64.to_le_bytes());
    bytes.extend(blake3::hash(&bytes).as_bytes());
    for (number, block) in (0u64..).zip(contents.chunks(BLOCK)) {
        bytes.extend(block);
        let sum = [&key.to_bytes()[..], &number.to_le_bytes(), block].concat();
        bytes.extend(blake3::hash(&sum).as_bytes());
    }
    let name = format!("{key:?}");
    let folder = scratch.0.join("v1/objects").join(&name[..2]);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(name), bytes).unwrap();
    assert_eq!(store.bytes(key).unwrap(), Some(contents));
}

#[test]
fn what_was_changed_or_cut_is_a_miss_and_removed() {
    let scratch = Scratch::new("damage");
    let store = scratch.store(1 << 30);
    let (one, other) = (key(1), key(2));
    put(&store, one, 1.0, b"the value of the first");
    put(&store, other, 1.0, b"the value of another..");
    let (path, whole) = (file(&store, one), std::fs::read(file(&store, one)).unwrap());
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let said = said(&store, one);
        assert!(said.contains("damaged") && said.contains("it was removed"), "{said}");
        assert!(!path.exists());
        assert_eq!(store.bytes(one).unwrap(), None);
    };
    for bit in 0..whole.len() * 8 {
        let mut changed = whole.clone();
        changed[bit / 8] ^= 1 << (bit % 8);
        refused(&changed);
    }
    (0..whole.len()).for_each(|length| refused(&whole[..length]));
    refused(&[&whole[..], b"\0"].concat());
    refused(&vec![0; whole.len()]);
    refused(&std::fs::read(file(&store, other)).unwrap());
    // A length that fits to nothing, under a sum that fits.
    for length in [0, 21, 1 << 20, u64::MAX - 200, u64::MAX] {
        let mut changed = whole.clone();
        changed[32..40].copy_from_slice(&length.to_le_bytes());
        let sum = blake3::hash(&changed[..48]);
        changed[48..80].copy_from_slice(sum.as_bytes());
        refused(&changed);
    }
    assert_eq!(put(&store, one, 1.0, b"anew"), Put::Stored);
    assert_eq!(store.bytes(one).unwrap(), Some(b"anew".to_vec()));
    assert_eq!(store.bytes(other).unwrap(), Some(b"the value of another..".to_vec()));
}

#[test]
fn a_reader_gives_out_nothing_after_the_first_damage() {
    let scratch = Scratch::new("blocks");
    let store = scratch.store(1 << 30);
    let bytes: Vec<u8> = (0..3 * BLOCK).map(|i| (i / BLOCK) as u8).collect();
    let path = file(&store, key(1));
    put(&store, key(1), 1.0, &bytes);
    let whole = std::fs::read(&path).unwrap();
    // The second and the third block in each other's place; and a byte of the second.
    let (head, blocks) = whole.split_at(80);
    let blocks: Vec<&[u8]> = blocks.chunks(BLOCK + 32).collect();
    let swapped = [head, blocks[0], blocks[2], blocks[1]].concat();
    let mut flipped = whole.clone();
    flipped[80 + BLOCK + 32 + 5] ^= 1;
    for damaged in [swapped, flipped] {
        std::fs::write(&path, damaged).unwrap();
        let mut object = store.get(key(1)).unwrap().unwrap();
        let mut read = Vec::new();
        let error = object.read_to_end(&mut read).unwrap_err();
        assert_eq!((error.kind(), read.len()), (ErrorKind::InvalidData, BLOCK));
        assert!(error.to_string().contains("damaged"), "{error}");
        assert!(object.fill_buf().is_err(), "and nothing later");
        assert!(!path.exists());
    }
    // Cut while it is read.
    std::fs::write(&path, &whole).unwrap();
    let object = store.get(key(1)).unwrap().unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(99).unwrap();
    assert!(object.into_bytes().unwrap_err().to_string().contains("cut off"));
    // Removed while it is read.
    std::fs::write(&path, &whole).unwrap();
    let object = store.get(key(1)).unwrap().unwrap();
    store.remove(key(1)).unwrap();
    assert!(object.into_bytes().is_ok_and(|read| read == bytes));
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_a_miss_and_never_waited_for() {
    let scratch = Scratch::new("places");
    let store = scratch.store(1 << 30);
    put(&store, key(1), 1.0, b"one");
    let path = file(&store, key(1));
    let elsewhere = scratch.0.join("elsewhere");
    std::fs::rename(&path, &elsewhere).unwrap();
    let pipe = || {
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
    };
    let link = || std::os::unix::fs::symlink(&elsewhere, &path).unwrap();
    for make in [&pipe as &dyn Fn(), &link] {
        make();
        assert!(said(&store, key(1)).contains("something else in its place; it was removed"));
        make();
        assert_eq!(put(&store, key(1), 1.0, b"one"), Put::Stored, "it is replaced");
        assert_eq!(store.bytes(key(1)).unwrap(), Some(b"one".to_vec()));
        store.remove(key(1)).unwrap();
    }
    assert!(elsewhere.is_file(), "a link is removed, not what it leads to");
    std::fs::create_dir_all(path.join("deep")).unwrap();
    assert!(said(&store, key(1)).contains("cannot be removed"));
    let put = store.put(key(1), 1.0, |_| Ok(()));
    assert!(put.unwrap_err().to_string().contains("a folder is in its place"));
    assert_eq!(Store::stats(&scratch.0).unwrap().all(), Holding::default());
}

#[test]
fn contents_that_fail_leave_nothing() {
    let scratch = Scratch::new("fails");
    let store = scratch.store(1 << 30);
    let bytes = vec![1; BLOCK + 1];
    let failed = store.put(key(1), 1.0, |out| {
        out.write_all(&bytes)?;
        assert_eq!(store.folder.unfinished().unwrap().len(), 1);
        Err(std::io::Error::other("no more"))
    });
    assert!(failed.unwrap_err().to_string().contains("no more"));
    let panicked = std::panic::catch_unwind(|| {
        store.put(key(1), 1.0, |_| std::panic::resume_unwind(Box::new("broken")))
    });
    assert!(panicked.is_err());
    assert_eq!(store.folder.unfinished().unwrap().len(), 0);
    assert_eq!(store.bytes(key(1)).unwrap(), None);
}

#[test]
fn what_is_greater_than_a_share_is_not_stored() {
    let scratch = Scratch::new("large");
    let store = scratch.store(16 * 8192);
    assert_eq!(store.largest(), 8192);
    let most = 8192 - 80 - 32;
    assert_eq!(put(&store, key(1), 1.0, &vec![1; most]), Put::Stored);
    let large = vec![1; most + 1];
    let put = |contents: fn(&mut Writer, &[u8]) -> std::io::Result<()>| {
        store.put(key(2), 1.0, |out| contents(out, &large)).unwrap()
    };
    assert_eq!(put(|out, bytes| out.write_all(bytes)), Put::TooLarge);
    // Whoever writes may overlook it.
    assert_eq!(put(|out, bytes| out.write_all(bytes).or(Ok(()))), Put::TooLarge);
    assert_eq!(store.bytes(key(2)).unwrap(), None);
    assert_eq!(store.folder.unfinished().unwrap().len(), 0);
    let nothing = scratch.store(0);
    assert_eq!(nothing.put(key(3), 1.0, |_| Ok(())).unwrap(), Put::TooLarge);
    assert!(nothing.bytes(key(1)).unwrap().is_some(), "what is there is read");
}
