//! `spandrel cache`: the folder that holds stored results, from outside.

use serde_json::Value as Json;
use spandrel_engine::key::Key;
use spandrel_engine::store::Store;
use spandrel_tests::program::{Ran, Scratch, run};
use std::io::Write;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

fn cache(scratch: &Scratch, arguments: &[&str]) -> Ran {
    run(PROGRAM, &[&["cache"], arguments].concat(), scratch.path())
}

fn filled(scratch: &Scratch) -> Store {
    let store = Store::open(&scratch.path().join("cache"), 1 << 30).unwrap();
    for number in 0..1200u32 {
        let key = Key::of_bytes(&number.to_le_bytes());
        store.put(key, 0.5, |out| out.write_all(b"a value")).unwrap();
    }
    store
}

#[test]
fn a_cache_says_what_it_holds() {
    let scratch = Scratch::new("cache-stats");
    filled(&scratch);
    let ran = cache(&scratch, &["cache"]);
    assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{ran:?}");
    for words in ["1 200 objects", "4.9 MB", "600.00 s", "less than a minute ago"] {
        assert!(ran.out.contains(words), "{words}: {}", ran.out);
    }
    assert_eq!(cache(&scratch, &["cache", "--stats"]).out, ran.out);
    let ran = cache(&scratch, &["cache", "--stats", "--json"]);
    let said: Json = serde_json::from_str(&ran.out).unwrap();
    assert_eq!((&said["objects"], &said["bytes"]), (&1200.into(), &(1200 * 4096).into()));
    let parts = said["parts"].as_array().unwrap();
    let objects = parts.iter().map(|part| part["objects"].as_u64().unwrap());
    assert_eq!((parts.len(), objects.sum::<u64>()), (16, 1200));
    assert!(said["oldest"].as_u64() > Some(1_700_000_000), "{said}");
}

#[test]
fn a_cache_is_cleared_and_nothing_else() {
    let scratch = Scratch::new("cache-clear");
    let store = filled(&scratch);
    std::fs::write(scratch.path().join("cache/notes.txt"), "mine").unwrap();
    let ran = cache(&scratch, &["cache", "--clear"]);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    assert!(ran.out.contains("1 200 objects removed, 4.9 MB"), "{ran:?}");
    assert!(cache(&scratch, &["cache"]).out.contains("a cache of 0 objects"));
    let ran = cache(&scratch, &["cache", "--clear", "--json"]);
    assert_eq!(serde_json::from_str::<Json>(&ran.out).unwrap()["removed"]["objects"], 0);
    assert!(scratch.path().join("cache/notes.txt").exists());
    store.put(Key::of_bytes(b"x"), 1.0, |_| Ok(())).unwrap();

    // What is no cache stays as it is.
    std::fs::create_dir_all(scratch.path().join("home/v1/objects/ab")).unwrap();
    let own = scratch.path().join("home/v1/objects/ab").join("ab".repeat(16));
    std::fs::write(&own, "mine").unwrap();
    for (arguments, code, words) in [
        (&["home", "--clear"][..], 4, "no cache of Spandrel"),
        (&["home"], 4, "no cache of Spandrel"),
        (&["missing"], 4, "No such file"),
        (&["missing", "--clear"], 4, "No such file"),
        (&["cache", "--clear", "--stats"], 2, "cannot be used with"),
        (&[], 2, "DIR"),
    ] {
        let ran = cache(&scratch, arguments);
        assert_eq!(ran.code, Some(code), "{arguments:?}: {ran:?}");
        assert!(ran.err.contains(words), "{arguments:?}: {ran:?}");
    }
    assert!(own.exists() && !scratch.path().join("missing").exists());
}
