//! Keys: what a value is made of, and nothing else. Looked at from outside, over every kind of node: every field, the
//! names of links, every file that was read.

use spandrel_engine::graph::demand::Wishes;
use spandrel_engine::graph::document::Document;
use spandrel_engine::graph::registry::Kind;
use spandrel_engine::graph::{Graph, Registry, Run, Schedule};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::key::Key;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::priority::BspTree;
use spandrel_engine::resolve::Rule;
use spandrel_engine::scene::Scene;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Delivery, Lamps, Override, PictureDemand, SpanDemand};
use spandrel_engine::volume::Volume;
use spandrel_tests::program::{Scratch, run};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const PROGRAM: &str = env!("CARGO_BIN_EXE_spandrel-under-test");

/// A node of every kind.
const ALL: &str = r##"Graph(nodes: {
    "box": ReadScene(file: "box.obj"),
    "own": ReadScene(file: "own.ron", plan: "p"),
    "eye": Camera(position: (1, 2, 7), look_at: (0, 0, 0)),
    "front": SceneCamera(scene: "own", name: "front"),
    "listed": SceneLights(scene: "own", names: ["a"]),
    "bulb": PointLight(position: (1, 3, 3), lamp: "lamp.ies"),
    "shining": LightFaces(lights: ["tube"]),
    "sun": SunLight(),
    "sky": SkyLight(model: Overcast),
    "dome": SkyLight(picture: "photo.png"),
    "beam": ParallelLight(),
    "spot": SpotLight(position: (0, 3, 0)),
    "tube": LinearLight(intensity: 2),
    "measured": LinearLight(flux: 2),
    "made": SpotLight(position: (0, 3, 0), lamp: "lamp.ies"),
    "panel": AreaLight(),
    "body": PolyhedralLight(),
    "ambient": AmbientLight(),
    "around": Background(camera: "eye", color: "#6080a0"),
    "above": Background(camera: "eye", sky: "sky"),
    "plate": Background(camera: "eye", picture: "photo"),
    "round": Background(camera: "eye", picture: "photo", by: Direction),
    "panorama": Panorama(image: "around", rows: 8),
    "clouds": PanoramaLight(image: "panorama"),
    "solid": Scanline(scene: "box", camera: "eye"),
    "others": Scanline(scene: "own", camera: "eye"),
    "tree": BspTree(scene: "own"),
    "drawn": ListPriority(tree: "tree", camera: "eye"),
    "cast": RayTracing(scene: "own", camera: "eye"),
    "grid": ReadVolume(file: "grid.nrrd"),
    "surface": Isosurface(volume: "grid", levels: [(value: 2)]),
    "photo": Read(file: "photo.png"),
    "cut": Matte(image: "photo"),
    "trees": Billboards(camera: "eye", pictures: ["cut"], trees: [(0, (0, 0, 0), 1)]),
    "stored": ReadSpans(file: "kept.span"),
    "merged": DepthMerge(inputs: ["solid", "others"]),
    "lit": Illuminate(image: "merged", lights: ["sun", "bulb"], shadows: Rays(1)),
    "foggy": Fog(image: "lit"),
    "mirrored": Trace(image: "lit"),
    "held": Holdout(image: "solid", matte: "others"),
    "slice": DepthSlice(image: "solid", near: 2),
    "part": Crop(image: "solid"),
    "moved": Transform(image: "solid"),
    "scaled": DepthScale(image: "solid"),
    "graded": Recolor(image: "solid"),
    "displayed": Display(image: "graded"),
    "painted": RecolorFrom(image: "solid", picture: "photo"),
    "program": Stream(image: "solid", code: "color = color * 0.5;"),
    "picture": Resolve(image: "lit", size: (24, 16), lines: Sloped(2)),
    "fine": Refine(over: "picture", image: "foggy", size: (24, 16), lines: Sloped(2)),
    "bright": Grade(image: "picture"),
    "soft": Blur(image: "picture"),
    "small": Reformat(image: "picture", size: (12, 8)),
    "few": Quantize(image: "picture"),
    "regions": Segment(image: "picture"),
    "wires": Wireframe(scene: "box"),
    "shown": Lookup(image: "solid", size: (24, 16)),
    "both": Over(front: "cut", back: "photo"),
    "file": Write(image: "picture", path: "out.png"),
    "spans": WriteSpans(image: "solid", path: "out.span", size: (24, 16), lines: Sloped(2)),
})"##;

/// The files that they read, and for each of them another one.
fn files() -> Vec<(&'static str, [Vec<u8>; 2])> {
    let texts = |a: &str| [a.as_bytes().to_vec(), a.replace("0.25", "0.75").into_bytes()];
    let picture = |value: u8| {
        let pixel = |x, y| image::Rgba([value, (x * 15) as u8, (y * 30) as u8, 255]);
        let mut bytes = std::io::Cursor::new(Vec::new());
        let made = image::RgbaImage::from_fn(16, 8, pixel);
        made.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    let pictures = || [picture(40), picture(200)];
    let lamp = |candela: &str| {
        let text = format!(
            "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 2 1 2 0 0 0\n1 1 1\n0 90\n0 90\n{candela} 5\n9 2\n"
        );
        text.into_bytes()
    };
    vec![
        (
            "box.obj",
            texts(
                "mtllib box.mtl\nusemtl wood\nv -1 -1 0\nv 1 -1 0.25\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n\
                 f 1/1 2/2 3/3\n",
            ),
        ),
        ("box.mtl", texts("newmtl wood\nKd 0.25 1 1\nmap_Kd wood.png\n")),
        ("wood.png", pictures()),
        (
            "own.ron",
            texts(
                r#"Scene(
                    parameters: {"grey": 0.25},
                    materials: {"tiles": (domains: (define: Picture("index.png"), table: {40: "one", 200: "two"})),
                        "one": (color: Ref("grey")), "two": (color: 0.5)},
                    plans: [(name: "p",
                        cameras: {"front": (position: (0, 0, 9)), "side": (position: (9, 0, 0))},
                        lights: {"a": PointLight(intensity: 3), "b": ParallelLight()},
                        root: (children: [
                            (name: "tri", material: "tiles", shape: File(path: "tri.obj")),
                        ])), (name: "q", root: (shape: Box(size: (1, 1, 1))))])"#,
            ),
        ),
        ("index.png", {
            let grey = |value: u8| {
                let mut bytes = std::io::Cursor::new(Vec::new());
                let made = image::GrayImage::from_pixel(4, 4, image::Luma([value]));
                made.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
                bytes.into_inner()
            };
            [grey(40), grey(200)]
        }),
        ("tri.obj", texts("v 0 0 1\nv 2 0 1\nv 2 0.25 1\nf 1 2 3\n")),
        ("lamp.ies", [lamp("10"), lamp("20")]),
        ("photo.png", pictures()),
        (
            "grid.nrrd",
            texts(
                "NRRD0004\ntype: float\ndimension: 4\nsizes: 2 3 2 2\nencoding: text\n\n\
                 0 0 1 0 3 1 0 2 5 3 0.25 4 0 0 1 3 3 0 0 4 5 3 0.25 4",
            ),
        ),
    ]
}

fn registry() -> Registry {
    spandrel::library()
}

/// A folder with all files; `kept.span` too.
fn folder(name: &str) -> Scratch {
    let scratch = Scratch::new(name);
    for (file, [contents, _]) in files() {
        std::fs::write(scratch.path().join(file), contents).unwrap();
    }
    let text = "Graph(nodes: {\"s\": Scanline(scene: \"box.obj\", camera: \"e\"), \"e\": Camera(), \
                \"w\": WriteSpans(image: \"s\", path: \"kept.span\", size: (24, 16), lines: Sloped(2))})";
    keys(&Run::new(), text, scratch.path(), &["w"]).unwrap();
    scratch
}

/// The keys of nodes and of all that they use.
fn keys(
    run: &Run,
    text: &str,
    folder: &Path,
    nodes: &[&str],
) -> Result<BTreeMap<String, Key>, String> {
    let document = Document::parse(text).map_err(|faults| format!("{faults:?}"))?;
    let graph = Graph::check(&document, &registry(), folder);
    let graph = graph.map_err(|faults| format!("{:?}", faults[0].message))?;
    let mut wishes = Wishes::new();
    for id in nodes {
        let node = graph.nodes().find(|node| node.id == *id).expect("the graph has it");
        let raster = Raster::new(24, 16).unwrap();
        let plan = Rule::Sloped(2).plan().unwrap();
        let lines = SpanDemand { raster, plan, rows: 0..16, layered: false };
        let channels = BTreeSet::from([Channel::Color]);
        let picture = PictureDemand { channels, changed: Override::default() };
        match node.output {
            "Scene" => wishes.want::<Scene>(id, ()),
            "Camera" => wishes.want::<spandrel_engine::camera::Camera>(id, ()),
            "BspTree" => wishes.want::<BspTree>(id, ()),
            "Volume" => wishes.want::<Volume>(id, ()),
            "Light" => wishes.want::<Lamps>(id, ()),
            "SpanImage" => wishes.want::<SpanImage>(id, lines),
            "Image" => wishes.want::<Image>(id, picture),
            "File" => wishes.want::<Delivery>(id, Override::default()),
            other => panic!("{other}: what is asked of it?"),
        };
    }
    let plan = Schedule::new(&graph, &wishes).map_err(|failure| failure.to_string())?;
    let done = run.evaluate(&graph, &plan, &()).map_err(|failure| failure.to_string())?;
    // A node that is asked in two ways is there twice: one of them is taken, always the same.
    let mut keys: Vec<(String, Key)> =
        done.reports.iter().map(|report| (report.node.clone(), report.key)).collect();
    keys.sort();
    Ok(keys.into_iter().collect())
}

/// Every node of the graph.
fn all() -> Vec<(String, String)> {
    let document = Document::parse(ALL).unwrap();
    document.nodes.iter().map(|raw| (raw.id.clone(), raw.kind.clone())).collect()
}

/// Other values of a field, of which at least one can be computed.
fn others(kind: &str, field: &str, is: &str, default: Option<&str>) -> Vec<String> {
    match (kind, field, default) {
        ("PolyhedralLight", "points", Some(points)) => return vec![points.replace("0.5", "0.625")],
        ("PolyhedralLight", "faces", Some(faces)) => {
            return vec![faces.replace("[0,1,2,3]", "[1,2,3,0]")];
        }
        _ => {}
    }
    let special: &[&str] = match (kind, field) {
        ("AreaLight", "outline") => &["[(0, 0, 0), (1, 0, 0), (1, 0, 1)]"],
        ("AreaLight", "holes") => &["[[(-0.1, 0, -0.1), (0.1, 0, -0.1), (0.1, 0, 0.1)]]"],
        ("Background", "gradient") => &["[(0, \"#102030\"), (90, \"#405060\")]"],
        ("Background", "by") => &["Stretch"],
        ("Billboards", "trees") => &["[(0, (0, 0, 0), 2)]"],
        ("Billboards", "crown") => &["0.2"],
        ("Billboards", "rows") => {
            &["[(along: [(-1, 0, 0), (1, 0, 0)], every: 1, heights: (1, 2))]"]
        }
        ("Billboards", "areas") => {
            &["[(corners: [(-1, 0, 0), (1, 0, 0), (1, 0, 1)], count: 2, heights: (1, 2))]"]
        }
        ("Billboards", "pictures") => &["[\"photo\"]"],
        ("Crop", "window") => &["(0.1, 0.1, 0.5, 0.5)"],
        ("Camera", "viewport") => &["(0, 0, 0.5, 0.5)"],
        ("Fog", "law") => &["Squared"],
        ("Illuminate", "less") => &["(candidates: All)"],
        ("Illuminate", "gather") => &["Rays(2)"],
        ("Illuminate", "shadows") => &["Off"],
        ("Display", "temperature") => &["4000.0"],
        ("Display", "view") => &["Linear"],
        ("Matte", "keys") => &["[Brighter(0.2, 0.4)]"],
        ("Matte", "garbage" | "keep") => {
            &["[[(0.1, 0.1), (0.9, 0.1), (0.5, 0.9)]]", "[(0.1, 0.1), (0.9, 0.1), (0.5, 0.9)]"]
        }
        ("Matte", "edge") => &["0.02"],
        ("PointLight" | "SpotLight", "lamp") => &["\"other.ies\""],
        ("PointLight" | "SpotLight", "aim" | "up") => &["(1, 0, 0.2)"],
        ("PointLight", "intensity" | "flux") => &["4.0"],
        ("Isosurface", "levels") => &["[(value: 3)]"],
        ("Isosurface", "error") => &["0.5"],
        ("Isosurface", "within") => &["(least: (0, 0, 0), greatest: (1, 1, 1))"],
        ("Isosurface", "cuts") => &["[(point: (0.5, 0, 0), direction: (1, 0, 0))]"],
        ("LinearLight", "flux") => &["3.0"],
        ("Lookup", "colors") => &["{\"wood\": \"#102030\"}"],
        ("Lookup", "entries") => &["7"],
        ("Lookup", "size") => &["(30, 20)"],
        ("Quantize", "palette") => &["[\"#000000\", \"#ffffff\"]"],
        ("Quantize", "dither") => &["None"],
        ("Read" | "ReadScene" | "ReadSpans" | "ReadVolume", "file") => {
            &["\"other.png\"", "\"tri.obj\"", "\"other.span\"", "\"other.nrrd\""]
        }
        ("Read", "layer" | "part" | "view") => return Vec::new(),
        ("ReadScene", "plan") => &["\"q\""],
        ("ReadScene", "objects") => &["[\"tri\"]"],
        ("ReadScene", "parameters") => &["{\"grey\": 0.5}"],
        ("ReadScene", "origin") => &["(1, 2, 3)"],
        ("ReadVolume", "component") => &["1"],
        ("ReadSpans", "scenes") => &["\".\""],
        ("Refine", "select") => &["Objects([\"*\"])"],
        ("Refine" | "Resolve", "textures") => &["Nearest"],
        ("Reformat", "filter") => &["Nearest"],
        ("Refine" | "Resolve", "pan") => &["(1, 2)"],
        ("Refine" | "Resolve" | "Reformat", "scale") => &["(2, 1)"],
        ("Resolve", "window") | ("Refine", "window") => &["(2, 2, 4, 4)"],
        ("Refine" | "Resolve" | "WriteSpans", "lines") => &["Sampled(2, Box)"],
        ("Refine" | "Resolve" | "WriteSpans", "size") => &["(30, 20)"],
        ("Reformat", "size") => &["(10, 9)"],
        ("Reformat", "part") => &["(0.1, 0, 0.5, 1)"],
        ("Segment", "thresholds") => &["[0.5]"],
        ("SceneCamera", "name") => &["\"side\""],
        ("SceneLights", "names") => &["[\"b\"]"],
        ("SkyLight", "picture") => &["\"other.png\""],
        ("SkyLight", "sun") => &["(0, 1, 0)"],
        ("Stream", "code") => &["\"color = color * 0.25;\""],
        ("Stream", "numbers") => &["{\"k\": 2}"],
        ("Stream", "colors") => &["{\"k\": \"#102030\"}"],
        ("Stream", "channels") => &["{\"color2\": Number}", "{\"wet\": Number}"],
        ("SunLight", "time") => &["\"2026-06-21T15:00+09:00\""],
        ("Trace" | "RayTracing", "accelerator") => &["Grid(cells: (4, 4, 4))"],
        ("Wireframe", "hidden") => &["Shown"],
        ("Write", "path") => &["\"out2.png\""],
        ("WriteSpans", "path") => &["\"out2.span\""],
        ("Write", "channels") => &["[Color]"],
        ("Write", "bits") => &["16"],
        _ => &[],
    };
    let special: Vec<String> = special.iter().map(|text| (*text).to_owned()).collect();
    if !special.is_empty() {
        return special;
    }
    if is.starts_with("number") || is.starts_with("whole number") {
        let value: f64 = default.and_then(|text| text.parse().ok()).unwrap_or(1.0);
        let mut others = vec![value * 0.5 + 0.25, value + 1.0, 20.0, value + 10.0, 1000.0, 5000.0];
        if is.starts_with("whole") {
            others = vec![value + 1.0, value - 1.0, 4.0];
            return others.iter().map(|other| format!("{other:.0}")).collect();
        }
        others.retain(|other| *other != value);
        return others.iter().map(|other| format!("{other:?}")).collect();
    }
    match is {
        "true | false" => vec!["true".into(), "false".into()],
        "color" => vec!["\"#204060\"".into()],
        "text" => vec!["\"else\"".into()],
        "(x, y, z)" => vec!["(0.5, 1, 3)".into()],
        "(x, y)" | "(right, down)" | "(least, most)" => vec!["(0.25, 0.5)".into()],
        _ => is.split(" | ").filter(|word| !word.contains('(')).map(str::to_owned).collect(),
    }
}

/// The text of the graph with a field of a node set.
fn with(id: &str, field: &str, value: &str) -> Result<String, String> {
    let mut document = Document::parse(ALL).unwrap();
    document.set(id, field, value).map_err(|fault| format!("{fault:?}"))?;
    // What is refined must be resolved as the picture was.
    if id == "fine" && field != "select" && document.set("picture", field, value).is_err() {
        return Err("the picture has no such field".to_owned());
    }
    let node = |raw: &spandrel_engine::graph::document::RawNode| {
        format!("{:?}: {}", raw.id, raw.text.text())
    };
    let nodes: Vec<String> = document.nodes.iter().map(node).collect();
    Ok(format!("Graph(nodes: {{{}}})", nodes.join(", ")))
}

#[test]
fn every_field_of_every_kind_is_in_the_key() {
    let scratch = folder("keys-fields");
    let folder = scratch.path();
    for (file, [_, other]) in files() {
        let known = ["lamp.ies", "photo.png", "grid.nrrd"];
        let name = known.into_iter().find(|name| *name == file);
        let name = name.and_then(|name| Some(format!("other.{}", name.rsplit_once('.')?.1)));
        name.into_iter().for_each(|name| std::fs::write(folder.join(name), &other).unwrap());
    }
    let kept = std::fs::read(folder.join("kept.span")).unwrap();
    let text = "Graph(nodes: {\"s\": Scanline(scene: \"tri.obj\", camera: \"e\"), \"e\": Camera(), \
                \"w\": WriteSpans(image: \"s\", path: \"other.span\", size: (24, 16), lines: Sloped(2))})";
    keys(&Run::new(), text, folder, &["w"]).unwrap();
    assert_ne!(kept, std::fs::read(folder.join("other.span")).unwrap());
    let registry = registry();
    let run = Run::new();
    let nodes = all();
    let ids: Vec<&str> = nodes.iter().map(|(id, _)| id.as_str()).collect();
    let base = keys(&run, ALL, folder, &ids).unwrap();
    let used: BTreeSet<&str> = nodes.iter().map(|(_, kind)| kind.as_str()).collect();
    let kinds: BTreeSet<&str> = registry.kinds().map(|kind| kind.name.as_str()).collect();
    assert_eq!(used, kinds, "the graph has every kind");
    let mut unknown = Vec::new();
    for Kind { name, fields, .. } in registry.kinds() {
        let own: Vec<&str> =
            nodes.iter().filter(|(_, kind)| kind == name).map(|(id, _)| id.as_str()).collect();
        for field in fields.iter().filter(|field| !field.kind.contains("link to")) {
            let others = others(name, &field.name, &field.kind, field.default.as_deref());
            let mut seen = Vec::new();
            let found = own.iter().any(|id| {
                others.iter().any(|other| {
                    let made = with(id, &field.name, other)
                        .and_then(|text| keys(&run, &text, folder, &[id]));
                    match made {
                        Ok(made) if made[*id] != base[*id] => true,
                        Ok(_) => {
                            seen.push(format!("{id}: {other}: the same key"));
                            false
                        }
                        Err(fault) => {
                            seen.push(format!("{id}: {other}: {fault}"));
                            false
                        }
                    }
                })
            });
            if !found && !others.is_empty() {
                unknown.push(format!("{name}.{}: {seen:?}", field.name));
            }
        }
    }
    assert!(unknown.is_empty(), "{}", unknown.join("\n"));
}

#[test]
fn names_count_only_where_they_are_shown() {
    let scratch = folder("keys-names");
    let nodes = all();
    let ids: Vec<&str> = nodes.iter().map(|(id, _)| id.as_str()).collect();
    let base = keys(&Run::new(), ALL, scratch.path(), &ids).unwrap();
    // Every node is called otherwise; comments and the order of fields change too.
    let mut text = ALL.replace("Graph(nodes: {", "// Otherwise.\nGraph(nodes: {");
    for id in &ids {
        text = text.replace(&format!("\"{id}\""), &format!("\"the_{id}\""));
    }
    // These are names within files.
    text = text.replace("name: \"the_front\"", "name: \"front\"");
    text = text.replace(
        "Scanline(scene: \"the_box\", camera: \"the_eye\")",
        "Scanline(priority: 0, camera: \"the_eye\", scene: \"the_box\")",
    );
    let renamed: Vec<String> = ids.iter().map(|id| format!("the_{id}")).collect();
    let renamed: Vec<&str> = renamed.iter().map(String::as_str).collect();
    let other = keys(&Run::new(), &text, scratch.path(), &renamed).unwrap();
    let changed: BTreeSet<&str> =
        ids.iter().filter(|id| base[**id] != other[&format!("the_{id}")]).copied().collect();
    // Lights name layers and faces after their nodes.
    let lit = ["lit", "foggy", "mirrored", "picture", "fine", "bright", "soft", "small", "few"];
    let lit = lit.into_iter().chain(["regions", "file", "shining"]);
    assert_eq!(changed, lit.collect());
}

#[test]
fn every_file_that_was_read_is_in_the_key() {
    let scratch = folder("keys-files");
    let folder = scratch.path();
    let readers = [
        ("box.obj", "box"),
        ("box.mtl", "box"),
        ("wood.png", "box"),
        ("own.ron", "own"),
        ("index.png", "own"),
        ("tri.obj", "own"),
        ("lamp.ies", "bulb"),
        ("photo.png", "photo"),
        ("photo.png", "dome"),
        ("kept.span", "stored"),
        ("grid.nrrd", "surface"),
    ];
    let ids: BTreeSet<&str> = readers.iter().map(|(_, id)| *id).collect();
    let ids: Vec<&str> = ids.into_iter().collect();
    // One run: what it keeps must not be taken for what it is not.
    let run = Run::new();
    let base = keys(&run, ALL, folder, &ids).unwrap();
    let mut contents: BTreeMap<&str, [Vec<u8>; 2]> = files().into_iter().collect();
    let kept = std::fs::read(folder.join("kept.span")).unwrap();
    let text = "Graph(nodes: {\"s\": Scanline(scene: \"tri.obj\", camera: \"e\"), \"e\": Camera(), \
                \"w\": WriteSpans(image: \"s\", path: \"other.span\", size: (24, 16), lines: Sloped(2))})";
    keys(&Run::new(), text, folder, &["w"]).unwrap();
    contents.insert("kept.span", [kept, std::fs::read(folder.join("other.span")).unwrap()]);
    for (file, id) in readers {
        let [own, other] = &contents[file];
        std::fs::write(folder.join(file), other).unwrap();
        let changed = keys(&run, ALL, folder, &[id]).unwrap();
        assert_ne!(changed[id], base[id], "{id} does not know that {file} is another one");
        std::fs::write(folder.join(file), own).unwrap();
        let back = keys(&run, ALL, folder, &[id]).unwrap();
        assert_eq!(back[id], base[id], "{id} is what it was, with {file}");
    }
    // What is not there counts too.
    std::fs::remove_file(folder.join("box.mtl")).unwrap();
    assert_ne!(keys(&run, ALL, folder, &["box"]).unwrap()["box"], base["box"]);
    // Times do not.
    std::fs::write(folder.join("box.mtl"), &contents["box.mtl"][0]).unwrap();
    assert_eq!(keys(&Run::new(), ALL, folder, &["box"]).unwrap()["box"], base["box"]);
}

#[test]
fn processes_and_folders_agree_on_keys() {
    let told = |name: &str| -> BTreeMap<String, String> {
        let scratch = folder(name);
        std::fs::write(scratch.path().join("g.ron"), ALL).unwrap();
        let ran =
            run(PROGRAM, &["render", "g.ron", "-w", "file", "--stats=json", "-q"], scratch.path());
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let all: serde_json::Value = serde_json::from_str(&ran.out).unwrap();
        let key = |node: &serde_json::Value| {
            let text = |name: &str| node[name].as_str().unwrap().to_owned();
            (text("node"), text("key"))
        };
        all["nodes"].as_array().unwrap().iter().map(key).collect()
    };
    let (here, there) = (told("keys-here"), told("keys-there-under-a-longer-name"));
    assert!(here.len() > 8, "{here:?}");
    assert_eq!(here, there);
    let scratch = folder("keys-within");
    let within = keys(&Run::new(), ALL, scratch.path(), &["picture"]).unwrap();
    assert_eq!(within["lit"].to_bytes().map(|b| format!("{b:02x}")).concat(), here["lit"]);
}
