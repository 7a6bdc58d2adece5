//! Folders: those of a store, those of others, those that cannot be written.

use std::io::Write;

use super::*;

#[test]
fn what_a_dead_process_left_is_removed_after_a_day() {
    let scratch = Scratch::new("orphans");
    let store = scratch.store(16 * 10 * 4096);
    put(&store, key(1), 1.0, b"one");
    let orphan = |hours: u32| {
        let mut orphan = store.folder.begin().unwrap();
        orphan.file.take().unwrap().write_all(b"half").unwrap();
        make_older(&orphan.path, HOUR * hours);
        // As a process that is killed.
        let path = orphan.path.clone();
        std::mem::forget(orphan);
        path
    };
    let (old, recent, now) = (orphan(25), orphan(23), orphan(0));
    let foreign = scratch.0.join("v1/tmp/notes.tmp");
    std::fs::write(&foreign, "").unwrap();
    make_older(&foreign, HOUR * 100);
    let stats = Store::stats(&scratch.0).unwrap();
    assert_eq!((stats.all().objects, stats.unfinished.objects), (1, 3));
    put(&store, key(2), 1.0, b"two");
    assert!(!old.exists() && recent.exists() && now.exists() && foreign.exists());
    Store::clear(&scratch.0).unwrap();
    assert!(!recent.exists() && now.exists() && foreign.exists());
}

#[test]
fn a_folder_that_cannot_be_written_is_read() {
    let scratch = Scratch::new("readonly");
    let store = scratch.store(1 << 30);
    put(&store, key(1), 1.0, b"one");
    let v1 = scratch.0.join("v1");
    // A file where a folder should be fails for every user, and so does a folder that may not be written for most.
    let tmp = v1.join("tmp");
    std::fs::remove_dir(&tmp).unwrap();
    std::fs::write(&tmp, "").unwrap();
    assert!(store.put(key(2), 1.0, |_| Ok(())).is_err());
    assert_eq!(store.bytes(key(1)).unwrap(), Some(b"one".to_vec()));
    std::fs::remove_file(&tmp).unwrap();
    let folders = [tmp, file(&store, key(1)).parent().unwrap().to_owned(), v1, scratch.0.clone()];
    let set = |readonly: bool| {
        for folder in folders.iter().filter(|folder| folder.exists()) {
            let mut permissions = std::fs::metadata(folder).unwrap().permissions();
            permissions.set_readonly(readonly);
            #[cfg(unix)]
            if !readonly {
                use std::os::unix::fs::PermissionsExt;
                permissions.set_mode(0o755);
            }
            std::fs::set_permissions(folder, permissions).unwrap();
        }
    };
    make_older(&file(&store, key(1)), HOUR * 9);
    set(true);
    let is_all_powerful = std::fs::write(scratch.0.join("probe"), "").is_ok();
    let store = scratch.store(1 << 30);
    assert_eq!(store.bytes(key(1)).unwrap(), Some(b"one".to_vec()));
    assert!(Store::stats(&scratch.0).is_ok());
    if !is_all_powerful {
        assert!(store.put(key(2), 1.0, |_| Ok(())).unwrap_err().to_string().contains("ermission"));
        assert!(Store::clear(&scratch.0).is_err());
        std::fs::write(file(&store, key(1)), "damaged").unwrap();
        assert!(said(&store, key(1)).contains("cannot be removed"));
    }
    set(false);
}

#[test]
fn a_folder_that_vanishes_is_an_error_until_it_is_opened_again() {
    let scratch = Scratch::new("vanishes");
    let store = scratch.store(1 << 30);
    put(&store, key(1), 1.0, b"one");
    std::fs::remove_dir_all(scratch.0.join("v1")).unwrap();
    assert_eq!(store.bytes(key(1)).unwrap(), None);
    assert_eq!(put(&store, key(1), 1.0, b"one"), Put::Stored, "what is in it is made again");
    std::fs::remove_dir_all(&scratch.0).unwrap();
    assert_eq!(store.bytes(key(1)).unwrap(), None);
    assert!(store.put(key(1), 1.0, |_| Ok(())).is_err());
    assert!(!scratch.0.exists(), "without its mark it would be refused");
    scratch.store(1 << 30);
    assert_eq!(put(&store, key(1), 1.0, b"one"), Put::Stored);
}

#[test]
fn folders_of_others_are_refused() {
    let scratch = Scratch::new("foreign");
    let said = |folder: &Path| Store::open(folder, 1 << 30).unwrap_err().to_string();
    std::fs::create_dir_all(scratch.0.join("home/v1/objects/ab")).unwrap();
    let home = scratch.0.join("home");
    assert!(said(&home).contains("no cache of Spandrel"), "{}", said(&home));
    assert!(Store::clear(&home).is_err() && Store::stats(&home).is_err());
    std::fs::write(home.join("spandrel-cache"), "a program of that name").unwrap();
    assert!(said(&home).contains("no cache of Spandrel"));
    assert!(said(&home.join("spandrel-cache")).contains("it is a file: name a folder"));
    assert!(home.join("v1/objects/ab").exists() && !home.join("CACHEDIR.TAG").exists());
    let missing = scratch.0.join("missing");
    assert!(Store::stats(&missing).is_err() && Store::clear(&missing).is_err());
    assert!(!missing.exists(), "who only looks makes nothing");
    // One that is empty, one that is not there, and one that another process is just making.
    let [empty, deep, begun] = ["empty", "not/there", "begun"].map(|name| scratch.0.join(name));
    std::fs::create_dir(&empty).unwrap();
    std::fs::create_dir(&begun).unwrap();
    std::fs::write(begun.join("spandrel-cache"), "A cache of").unwrap();
    for folder in [empty, deep, begun] {
        let store = Store::open(&folder, 1 << 30).unwrap();
        put(&store, key(1), 1.0, b"one");
        assert!(Store::open(&folder, 1 << 30).unwrap().bytes(key(1)).unwrap().is_some());
    }
    let made = scratch.0.join("at once");
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| Store::open(&made, 1 << 30).unwrap());
        }
    });
}

#[test]
fn clearing_removes_what_is_the_stores_own() {
    let scratch = Scratch::new("clear");
    let store = scratch.store(1 << 30);
    (0..50).for_each(|n| assert_eq!(put(&store, key(n), 2.0, b"some bytes"), Put::Stored));
    let objects = scratch.0.join("v1/objects");
    let two = format!("{:?}", key(0))[..2].to_owned();
    let foreign = [
        scratch.0.join("notes.txt"),
        scratch.0.join("video/objects/ab").join("ab".repeat(16)),
        objects.join("notes.txt"),
        objects.join("zz").join("zz".repeat(16)),
        objects.join(&two).join("notes.txt"),
        objects.join(&two).join("AB".repeat(16)),
        objects.join(&two).join(format!("{two}0")),
        scratch.0.join("v1/tmp/.notes.tmp"),
    ];
    for path in &foreign {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, "").unwrap();
    }
    let later = scratch.0.join("v2/objects/ab").join("ab".repeat(16));
    std::fs::create_dir_all(later.parent().unwrap()).unwrap();
    std::fs::write(&later, "of a later program").unwrap();
    let stats = Store::stats(&scratch.0).unwrap();
    let all = stats.all();
    assert_eq!((all.objects, all.bytes, all.seconds), (50, 50 * 4096, 100.0));
    assert!(all.oldest <= all.newest && all.newest <= Some(SystemTime::now()));
    assert_eq!(stats.other_versions.objects, 1);
    assert!(stats.parts.iter().filter(|part| part.objects > 0).count() > 8);
    assert_eq!(Store::clear(&scratch.0).unwrap().objects, 51);
    assert!(!later.exists() && foreign.iter().all(|path| path.exists()));
    let stats = Store::stats(&scratch.0).unwrap();
    assert_eq!((stats.all(), stats.other_versions), Default::default());
    // Whoever has it open goes on.
    assert_eq!(put(&store, key(1), 1.0, b"one"), Put::Stored);
}
