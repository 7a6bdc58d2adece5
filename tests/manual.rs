//! The manual: its links lead somewhere, its graphs and scenes are sound, its commands are understood, the tests that it
//! names are there, and a first picture comes out of its tutorial.

use spandrel_engine::graph::Graph;
use spandrel_engine::graph::document::Document;
use spandrel_engine::image::Window;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_tests::data;
use spandrel_tests::graphs::Nodes;
use spandrel_tests::program::{Scratch, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

/// The pages of the manual, and their text.
fn pages() -> Vec<(PathBuf, String)> {
    let root = repository();
    let folders = ["", "cli", "engine", "graphs", "nodes", "tests"];
    let files =
        folders.iter().flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap().flatten());
    let mut pages: Vec<PathBuf> = files.map(|entry| entry.path()).collect();
    pages.retain(|path| path.extension().is_some_and(|ending| ending == "md"));
    assert!(pages.len() >= 7, "{pages:?}");
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path, text)
    };
    pages.into_iter().map(read).collect()
}

/// The fenced blocks of a page: language and text.
fn blocks(text: &str) -> Vec<(&str, &str)> {
    let fenced = text.split("\n```").skip(1).step_by(2);
    fenced.map(|block| block.split_once('\n').unwrap_or((block, ""))).collect()
}

/// What is between two marks, each time.
fn between<'t>(text: &'t str, open: &'t str, close: char) -> impl Iterator<Item = &'t str> {
    text.split(open).skip(1).filter_map(move |rest| rest.split_once(close).map(|(found, _)| found))
}

/// The name by which a heading is linked.
fn anchor(heading: &str) -> String {
    let plain = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = plain.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[test]
fn every_link_leads_somewhere() {
    for (path, text) in pages() {
        let mut links = 0;
        for link in between(&text, "](", ')').filter(|link| !link.starts_with("http")) {
            let (file, place) = link.split_once('#').unwrap_or((link, ""));
            let target =
                if file.is_empty() { path.clone() } else { path.parent().unwrap().join(file) };
            assert!(target.exists(), "{}: ({link})", path.display());
            if !place.is_empty() {
                let text = std::fs::read_to_string(&target).unwrap();
                let mut headings = text.lines().filter(|line| line.starts_with('#'));
                assert!(
                    headings.any(|heading| anchor(heading) == place),
                    "{}: ({link})",
                    path.display()
                );
            }
            links += 1;
        }
        assert!(links > 0, "{} stands alone", path.display());
    }
}

#[test]
fn the_first_page_is_short() {
    let text = std::fs::read_to_string(repository().join("README.md")).unwrap();
    assert!(text.lines().count() <= 120, "{} lines", text.lines().count());
}

#[test]
fn graphs_and_scenes_of_the_manual_are_sound() {
    let mut found = 0;
    for (path, text) in pages() {
        for (language, block) in blocks(&text) {
            let is_first = block.starts_with("// first/");
            if language != "ron" || is_first || path.ends_with("graphs/SCENES.md") {
                continue;
            }
            assert!(block.starts_with("Graph("), "{}: {block}", path.display());
            let document = Document::parse(block).unwrap_or_else(|faults| panic!("{faults:?}"));
            let graph = Graph::check(&document, &spandrel::library(), &repository().join("graphs"));
            if let Err(faults) = graph {
                panic!("{}: {faults:?}", path.display());
            }
            found += 1;
        }
    }
    assert!(found > 0);
}

/// The tutorial's files, as a reader would type them: forty lines, no warning, and a picture of a house.
#[test]
fn the_tutorial_makes_a_picture() {
    let root = repository();
    let text = std::fs::read_to_string(root.join("graphs/README.md")).unwrap();
    let scratch = Scratch::new("manual-first");
    let put = |file: &str, contents: &[u8]| {
        let path = scratch.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, contents).unwrap();
    };
    let photo = "assets/photos/oak.jpg";
    put(photo, &std::fs::read(root.join("graphs").join(photo)).unwrap());
    let mut lines = 0;
    for (_, block) in blocks(&text) {
        if let Some(rest) = block.strip_prefix("// ")
            && let Some((file, contents)) = rest.split_once('\n')
        {
            put(file, contents.as_bytes());
            lines += contents.lines().count();
        }
    }
    assert!((20..=40).contains(&lines), "{lines} lines");
    let folder = scratch.path().join("first");
    let scene = read::document(&folder.join("house.ron"), &ReadOptions::default()).unwrap();
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let graph = std::fs::read_to_string(folder.join("first.ron")).unwrap();
    let nodes = graph.split_once("nodes: {").and_then(|(_, rest)| rest.rsplit_once('}')).unwrap().0;
    let small = nodes.replace("(960, 540)", "(96, 54)").replace("samples: 32", "samples: 4");
    assert_ne!(small, nodes, "smaller, for the test");
    let made = Nodes::new(&folder, &small).picture("picture", None::<Window>).unwrap();
    assert!(made.warnings.is_empty(), "{:?}", made.warnings);
    // The roof is red, the meadow green, the sky blue: at the places where the manual's picture has them.
    let [roof, meadow, sky] = [(48, 19), (70, 50), (48, 3)].map(|(x, y)| made.image.rgba(x, y));
    assert!(roof[0] > 1.4 * roof[2], "{roof:?}");
    assert!(meadow[1] > 1.3 * meadow[2], "{meadow:?}");
    assert!(sky[2] > 1.2 * sky[0] && sky[2] > 0.2, "{sky:?}");
}

/// What stands after `$` in a shell, or at the beginning of a line, is understood; nothing is run.
#[test]
fn commands_of_the_manual_are_understood() {
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    let scratch = Scratch::new("manual-commands");
    let mut known = BTreeSet::new();
    for (path, text) in pages() {
        let fenced = blocks(&text);
        let in_blocks = fenced.iter().flat_map(|(_, block)| block.lines());
        let in_text = between(&text, "`spandrel ", '`').map(|rest| format!("spandrel {rest}"));
        let all = in_blocks.map(str::to_owned).chain(in_text);
        for line in all.filter(|line| line.starts_with("spandrel ") || line.contains("; spandrel "))
        {
            let from = line.rfind("spandrel ").unwrap();
            let command = line[from..].split(" #").next().unwrap();
            // Words that stand for others are no commands.
            if command.contains(['[', '|', '<']) || command.contains("..") {
                continue;
            }
            let words: Vec<String> = words(command).into_iter().skip(1).collect();
            let stands_for = |word: &str| {
                word.len() > 1 && word.chars().all(|c| c.is_ascii_uppercase() || c == '_')
            };
            if words.iter().any(|word| stands_for(word))
                || words.len() < 2
                || !known.insert(words.clone())
            {
                continue;
            }
            let mut arguments: Vec<&str> = words.iter().map(String::as_str).collect();
            arguments.push("--help");
            let ran = run(program, &arguments, scratch.path());
            assert_eq!(ran.code, Some(0), "{}: {command}\n{}", path.display(), ran.err);
        }
    }
    assert!(known.len() > 8, "{known:?}");
}

/// The words of a command as a shell has them.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), String::new(), None);
    for c in command.chars() {
        match quote {
            Some(mark) if c == mark => quote = None,
            Some(_) => word.push(c),
            None if matches!(c, '"' | '\'') => quote = Some(c),
            None if c.is_whitespace() => words.push(std::mem::take(&mut word)),
            None => word.push(c),
        }
    }
    words.push(word);
    words.retain(|word| !word.is_empty() && word != "<");
    words
}

/// Examples, benches, scripts and tests that the manual names.
#[test]
fn what_the_manual_names_is_there() {
    let tests = repository().join("tests");
    let sources = data::files(&tests, &[".rs"]);
    let mut all: String =
        sources.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect();
    for path in data::files(&repository().join("engine/src"), &[".rs"]) {
        all += &std::fs::read_to_string(&path).unwrap();
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    for (path, text) in pages() {
        let said = |what: &str| format!("{}: {what}", path.display());
        for (mark, folder) in [("--example ", "examples"), ("--bench ", "benches")] {
            for rest in text.split(mark).skip(1) {
                let name = rest.split(|c| !is_word(c)).next().unwrap();
                let file = tests.join(folder).join(name);
                assert!(file.with_extension("rs").exists() || file.is_dir(), "{}", said(name));
            }
        }
        for name in between(&text, "tests/peers/", '`').filter_map(|rest| rest.split(' ').next()) {
            assert!(name.is_empty() || tests.join("peers").join(name).exists(), "{}", said(name));
        }
        for code in between(&text, "`", '`').filter(|code| code.contains("::")) {
            let Some((module, name)) = code.rsplit_once("::") else { continue };
            if code.chars().all(|c| is_word(c) || c == ':')
                && tests.join(module).with_extension("rs").exists()
            {
                assert!(all.contains(&format!("fn {name}(")), "{}", said(code));
            }
        }
    }
}
