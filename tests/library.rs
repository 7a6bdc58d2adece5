//! The library of nodes and the gallery, as a whole: every node is documented, has defaults, stands in
//! a graph of the gallery, and refuses nonsense. And the house: who may use whom.

use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::{Graph, Registry};
use spandrel_tests::data;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().unwrap()
}

fn registry() -> Registry {
    spandrel::library()
}

fn gallery() -> Vec<PathBuf> {
    let all = data::files(&repository().join("graphs"), &[".ron"]);
    all.into_iter().filter(|path| !path.to_string_lossy().contains("/assets/")).collect()
}

#[test]
fn every_node_and_every_field_is_documented() {
    for kind in registry().kinds() {
        assert!(kind.doc.len() > 20, "{} has no documentation", kind.name);
        for field in &kind.fields {
            assert!(field.doc.len() > 5, "{}.{} has no documentation", kind.name, field.name);
            // What has no type is a "value"; a field may be called so, and one may take any.
            let known = field.kind.replace("any value", "").replace("value:", "");
            assert!(!known.contains("value"), "{}.{}: {}", kind.name, field.name, field.kind);
        }
    }
}

#[test]
fn defaults_parse_and_only_links_and_files_are_needed() {
    let registry = registry();
    for kind in registry.kinds() {
        let mut text = format!("Graph(nodes: {{\"it\": {}(", kind.name);
        for field in &kind.fields {
            match &field.default {
                Some(default) => text += &format!("{}: {default}, ", field.name),
                None => assert!(
                    field.kind.starts_with("link") || field.kind.starts_with("file"),
                    "{}.{} has no default",
                    kind.name,
                    field.name
                ),
            }
        }
        text += ")})";
        let document = Document::parse(&text).unwrap();
        if let Err(faults) = Graph::check(&document, &registry, Path::new("")) {
            for fault in faults {
                // What must be given may be missing; nothing else may be wrong.
                let missing = fault.message.contains("needs")
                    || ["name a file", "at least one image"]
                        .iter()
                        .any(|w| fault.message.contains(w));
                assert!(missing, "{}: {}", kind.name, fault.message);
            }
        }
    }
}

/// The example with which the manual of each node ends: it is understood, but for the nodes and files that it names.
#[test]
fn every_node_ends_with_an_example() {
    let registry = registry();
    for kind in registry.kinds() {
        let (_, example) =
            kind.doc.rsplit_once("Example: `").unwrap_or_else(|| panic!("{}", kind.name));
        let example =
            example.strip_suffix('`').unwrap_or_else(|| panic!("{}: it ends there", kind.name));
        assert!(example.starts_with(&format!("{}(", kind.name)), "{example}");
        let document = Document::parse(&format!("Graph(nodes: {{\"it\": {example}}})")).unwrap();
        for fault in Graph::check(&document, &registry, Path::new("")).err().unwrap_or_default() {
            let names = ["there is no node", "there is no file"];
            assert!(names.iter().any(|name| fault.message.contains(name)), "{example}: {fault:?}");
        }
    }
}

#[test]
fn every_node_refuses_nonsense() {
    let registry = registry();
    for kind in registry.kinds() {
        for nonsense in ["nonsense: 1", "1", "\"text\""] {
            let text = format!("Graph(nodes: {{\"it\": {}({nonsense})}})", kind.name);
            let document = Document::parse(&text).unwrap();
            assert!(Graph::check(&document, &registry, Path::new("")).is_err(), "{text}");
        }
        for field in &kind.fields {
            for nonsense in ["Nonsense(1, 2)", "{1: 2}", "NaN", "-1e999"] {
                let text =
                    format!("Graph(nodes: {{\"it\": {}({}: {nonsense})}})", kind.name, field.name);
                let document = Document::parse(&text).unwrap();
                assert!(Graph::check(&document, &registry, Path::new("")).is_err(), "{text}");
            }
        }
    }
}

#[test]
fn every_node_stands_in_the_gallery_and_every_graph_is_sound() {
    let registry = registry();
    let mut used = BTreeSet::new();
    for path in gallery() {
        let document = Document::parse(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let graph = match Graph::check(&document, &registry, path.parent().unwrap()) {
            Ok(graph) => graph,
            Err(faults) => panic!("{}: {faults:?}", path.display()),
        };
        used.extend(graph.nodes().map(|node| node.kind.to_owned()));
    }
    for kind in registry.kinds() {
        assert!(used.contains(&kind.name), "no graph of the gallery uses {}", kind.name);
    }
}

/// A picture that depends on the gallery's own products would change with each of them.
#[test]
fn the_gallery_reads_nothing_that_it_makes() {
    for path in gallery() {
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("\"pictures/"), "{} reads from pictures/", path.display());
    }
}

#[test]
fn no_node_is_missing_from_the_librarys_list() {
    let mut files = 0;
    for path in data::files(&repository().join("nodes/src"), &[".rs"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        files += text.matches("const KIND: &'static str = \"").count();
    }
    assert_eq!(files, registry().kinds().count());
}

/// The modules of the engine, each with those that it may use. Arrows point down only.
const LAYERS: [(&str, &[&str]); 36] = [
    ("error", &["text"]),
    ("math", &[]),
    ("key", &[]),
    ("output", &["error"]),
    ("text", &[]),
    ("machine", &[]),
    ("moment", &[]),
    ("watch", &["error", "key"]),
    ("open", &["error", "key", "output", "text", "watch"]),
    ("cache", &["key", "machine", "watch"]),
    ("store", &["error", "key", "output"]),
    ("color", &["math"]),
    ("raster", &["error"]),
    ("camera", &["error", "math", "raster"]),
    ("image", &["color", "error", "machine", "math", "open", "output", "text", "watch"]),
    ("polygon", &[]),
    ("packed", &["color"]),
    ("trace", &["camera", "polygon"]),
    ("stream", &["color", "math", "text"]),
    ("motion", &["color", "moment", "stream", "text"]),
    ("texture", &["color", "error", "image", "key", "math", "watch"]),
    ("picture", &["color", "error", "image", "key", "math", "polygon", "texture", "watch"]),
    ("fragment", &["cache", "camera", "color", "error", "key", "texture", "trace"]),
    (
        "light",
        &[
            "color", "error", "fragment", "image", "key", "math", "open", "packed", "polygon",
            "trace",
        ],
    ),
    ("span", &["cache", "camera", "color", "error", "fragment", "key", "math", "raster", "watch"]),
    (
        "scene",
        &[
            "camera", "color", "error", "fragment", "image", "key", "light", "math", "moment",
            "motion", "open", "polygon", "text", "texture", "trace", "watch",
        ],
    ),
    ("volume", &["error", "key", "open", "scene", "text", "watch"]),
    ("shadow", &["cache", "camera", "fragment", "key", "span", "trace", "watch"]),
    ("visible", &["cache", "camera", "error", "key", "raster", "span", "watch"]),
    (
        "render",
        &[
            "camera", "color", "error", "fragment", "image", "key", "light", "math", "polygon",
            "raster", "scene", "span", "texture", "trace", "visible", "watch",
        ],
    ),
    (
        "shade",
        &[
            "camera", "color", "error", "fragment", "key", "light", "math", "packed", "polygon",
            "shadow", "stream", "text", "trace",
        ],
    ),
    (
        "resolve",
        &[
            "cache", "camera", "color", "error", "fragment", "image", "key", "math", "raster",
            "shadow", "span", "text", "texture", "trace", "visible", "watch",
        ],
    ),
    (
        "span_file",
        &[
            "camera", "color", "error", "fragment", "key", "output", "raster", "scene", "span",
            "watch",
        ],
    ),
    (
        "graph",
        &[
            "cache", "color", "error", "key", "moment", "motion", "open", "output", "store",
            "text", "watch",
        ],
    ),
    (
        "values",
        &[
            "camera", "error", "graph", "image", "key", "light", "raster", "render", "resolve",
            "scene", "span", "visible", "volume",
        ],
    ),
    (
        "plugin",
        &[
            "camera", "color", "error", "fragment", "graph", "image", "key", "light", "math",
            "moment", "open", "raster", "scene", "span", "trace", "values", "volume", "watch",
        ],
    ),
];

#[test]
fn modules_use_only_what_stands_below_them() {
    let source = repository().join("engine/src");
    for path in data::files(&source, &[".rs"]) {
        let within = path.strip_prefix(&source).unwrap().to_string_lossy().into_owned();
        let module = within.split(['/', '.']).next().unwrap().to_owned();
        if module == "lib" {
            continue;
        }
        let known = LAYERS.iter().find(|(name, _)| *name == module);
        let (_, below) = known.unwrap_or_else(|| panic!("{module} is not in the list of layers"));
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for used in code
            .match_indices("crate::")
            .filter_map(|(at, _)| code[at + 7..].split([':', ';', ' ', '{', ')']).next())
        {
            let own = used == module || used.starts_with(char::is_uppercase);
            assert!(
                own || below.contains(&used),
                "{within} uses {used}, which does not stand below {module}"
            );
        }
    }
}

/// The plug-in of the tests, and what `spandrel new` writes, need nothing of the engine but its face for plug-ins.
#[test]
fn plug_ins_need_one_place() {
    let plugin = data::files(&repository().join("tests/plugin/src"), &[".rs"]);
    let new =
        ["cli/src/new/tint.rs", "cli/src/new/main.rs.txt"].map(|file| repository().join(file));
    for path in plugin.into_iter().chain(new) {
        let text = std::fs::read_to_string(&path).unwrap();
        for (at, _) in text.match_indices("spandrel_engine::") {
            assert!(text[at + 17..].starts_with("plugin"), "{}", path.display());
        }
    }
}

#[test]
fn nodes_know_the_engine_and_never_each_other() {
    for path in data::files(&repository().join("nodes/src"), &[".rs"]) {
        if path.ends_with("lib.rs") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(!text.contains("crate::") && !text.contains("super::"), "{}", path.display());
    }
}
