//! Cities: which level of detail is shown, cities by lines, what is left out and told, and origins that can be pasted.

use glam::DVec3;
use spandrel_engine::Result;
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::read::{self, ReadOptions, Reading};
use spandrel_tests::program::{Scratch, run};

/// A block of 10 by 10 m and a height: its corners, and its faces over corners from `base` on.
fn block(height: f64, base: usize) -> (Vec<[f64; 3]>, String) {
    let corner = |i: usize| {
        let side = |bits: &[usize]| if bits.contains(&i) { 10.0 } else { 0.0 };
        [side(&[1, 2, 5, 6]), side(&[2, 3, 6, 7]), if i > 3 { height } else { 0.0 }]
    };
    let faces =
        [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
    let faces = faces.map(|face| format!("[{:?}]", face.map(|i: usize| i + base)));
    ((0..8).map(corner).collect(), format!("[{}]", faces.join(",")))
}

/// The geometry of a block, of height 8 in level 1, 5 in level 2, 3 in level 3 and so on.
fn solid(lod: &str) -> String {
    let at = ["1", "2", "2.2", "3"].iter().position(|known| *known == lod).unwrap();
    let (_, faces) = block(0.0, at * 8);
    format!("{{\"type\":\"Solid\",\"lod\":\"{lod}\",\"boundaries\":[{faces}]}}")
}

const HEIGHTS: [f64; 4] = [8.0, 5.0, 4.0, 3.0];

/// A city of objects: name, kind, levels, children.
fn city(objects: &[(&str, &str, &[&str], &[&str])]) -> String {
    let vertices: Vec<_> = HEIGHTS.iter().flat_map(|height| block(*height, 0).0).collect();
    let object = |(name, kind, lods, children): &(&str, &str, &[&str], &[&str])| {
        let geometry: Vec<String> = lods.iter().map(|lod| solid(lod)).collect();
        let parents: Vec<&str> =
            objects.iter().filter(|o| o.3.contains(name)).map(|o| o.0).collect();
        format!(
            "\"{name}\":{{\"type\":\"{kind}\",\"geometry\":[{}],\"children\":{children:?},\"parents\":{parents:?}}}",
            geometry.join(",")
        )
    };
    let objects: Vec<String> = objects.iter().map(object).collect();
    format!(
        "{{\"type\":\"CityJSON\",\"version\":\"1.1\",\"CityObjects\":{{{}}},\"vertices\":{vertices:?}}}",
        objects.join(",")
    )
}

fn reading(name: &str, text: &str, options: &ReadOptions) -> Result<(Scene, Reading)> {
    let scratch = Scratch::new(&format!("levels-{}", name.replace('/', "-")));
    let path = scratch.path().join(name);
    std::fs::write(&path, text).unwrap();
    let scene = read::scene(&path, None, "city", options)?;
    Ok((scene, read::examined(&path, options)?))
}

/// Each object that is shown, with its height.
fn shown(scene: &Scene) -> Vec<(String, f64)> {
    let height = |instance: &spandrel_engine::scene::Instance| {
        let points = instance.geometry.mesh().points.iter();
        let world = points.map(|p| instance.world_from_object.transform_point3(*p).y);
        (instance.path.clone(), world.fold(0.0, f64::max).round())
    };
    let faces = |i: &&spandrel_engine::scene::Instance| i.geometry.mesh().face_count() > 0;
    scene.instances.iter().filter(faces).map(height).collect()
}

fn with(lod: f64) -> ReadOptions {
    ReadOptions { lod: Some(lod), ..ReadOptions::default() }
}

/// What is shown, and what is told.
fn of(name: &str, text: &str, options: &ReadOptions) -> (Vec<(String, f64)>, String) {
    let (scene, _) = reading(name, text, options).unwrap();
    (shown(&scene), scene.notes.join("\n"))
}

#[test]
fn the_finest_level_of_a_building_is_that_of_its_parts_too() {
    let finest = |name: &str, objects: &[(&str, &str, &[&str], &[&str])]| {
        of(&format!("{name}.json"), &city(objects), &ReadOptions::default())
    };
    let hull: (&str, &str, &[&str], &[&str]) = ("b", "Building", &["1"], &["p", "q"]);
    let one = |name: &str, height: f64| vec![(name.to_owned(), height)];
    // In either order; a hull is not seen beside or around its parts; nothing of that is odd.
    for lods in [["1", "2"], ["2", "1"]] {
        assert_eq!(
            finest("order", &[("b", "Building", &lods, &[])]),
            (one("b", 5.0), String::new())
        );
    }
    let part = finest("hull", &[hull, ("p", "BuildingPart", &["2"], &[])]);
    assert_eq!(part.0, one("b/p", 5.0));
    let bridge =
        finest("bridge", &[("b", "Bridge", &["1"], &["p"]), ("p", "BridgePart", &["3"], &[])]);
    assert_eq!(bridge, (one("b/p", 3.0), String::new()));
    // A part that has only a coarser level is shown in it, and told, as nothing else is there of it.
    let mixed = finest(
        "mixed",
        &[hull, ("p", "BuildingPart", &["2"], &[]), ("q", "BuildingPart", &["1"], &[])],
    );
    assert_eq!(mixed.0, [("b/p".to_owned(), 5.0), ("b/q".to_owned(), 8.0)]);
    assert!(mixed.1.contains("\"q\", shown in 1 instead of 2"), "{}", mixed.1);
    // Where the whole has the level, a coarse part would hide it.
    let whole =
        finest("whole", &[("b", "Building", &["2"], &["p"]), ("p", "BuildingPart", &["1"], &[])]);
    assert_eq!(whole.0, one("b", 5.0));
    assert!(whole.1.contains("left out; the first: \"p\""), "{}", whole.1);
    // Parts of parts.
    let deep = finest(
        "deep",
        &[
            ("b", "Building", &["1"], &["p"]),
            ("p", "BuildingPart", &["2"], &["q"]),
            ("q", "BuildingPart", &["3"], &[]),
        ],
    );
    assert_eq!(deep, (one("b/p/q", 3.0), String::new()));
    // A finer balcony takes no house away, and members of a group are buildings of their own.
    let balcony = finest(
        "balcony",
        &[("b", "Building", &["2"], &["i"]), ("i", "BuildingInstallation", &["3"], &[])],
    );
    assert_eq!(balcony, (vec![("b".to_owned(), 5.0), ("b/i".to_owned(), 3.0)], String::new()));
    let group = finest(
        "group",
        &[
            ("g", "CityObjectGroup", &[], &["a", "b"]),
            ("a", "Building", &["1"], &[]),
            ("b", "Building", &["3"], &[]),
        ],
    );
    assert_eq!(group, (vec![("g/a".to_owned(), 8.0), ("g/b".to_owned(), 3.0)], String::new()));
    // Points and empty geometries have no level.
    let points = "{\"type\":\"MultiPoint\",\"lod\":\"3\",\"boundaries\":[0]},\
                  {\"type\":\"MultiSurface\",\"lod\":\"3\",\"boundaries\":[]},";
    let text = city(&[("b", "Building", &["2"], &[])])
        .replace("\"geometry\":[", &format!("\"geometry\":[{points}"));
    let (all, told) = of("points.json", &text, &ReadOptions::default());
    assert_eq!(all, one("b", 5.0));
    assert!(told.contains("points or lines"), "{told}");
}

#[test]
fn a_level_can_be_chosen() {
    let text = city(&[
        ("a", "Building", &["1", "2.2", "3"], &[]),
        ("b", "Building", &["1"], &["p"]),
        ("p", "BuildingPart", &["3"], &[]),
    ]);
    let heights = |lod: f64| of("chosen.json", &text, &with(lod));
    let pair = |a: f64, b: &str, c: f64| vec![("a".to_owned(), a), (b.to_owned(), c)];
    assert_eq!(heights(3.0), (pair(3.0, "b/p", 3.0), String::new()));
    let (all, told) = heights(2.0);
    assert_eq!(all, pair(4.0, "b", 8.0));
    assert!(told.contains("\"b\", shown in 1 instead of 2"), "{told}");
    assert_eq!(heights(1.0).0, pair(8.0, "b", 8.0));
    let (all, told) = heights(0.0);
    assert_eq!(all, pair(8.0, "b", 8.0));
    assert!(told.contains("\"a\", shown in 1 instead of 0"), "{told}");
    let (_, reading) = reading("levels.json", &text, &ReadOptions::default()).unwrap();
    let about = reading.about.join("\n");
    for line in
        ["detail 1: 12 faces, not shown", "detail 2.2: 6 faces, not", "detail 3: 12 faces, shown"]
    {
        assert!(about.contains(line), "{about}");
    }
    let wrong = read::document("nowhere.json".as_ref(), &with(f64::NAN)).unwrap_err().to_string();
    assert!(wrong.contains("`lod`"), "{wrong}");
}

const HEAD: &str = "<?xml version=\"1.0\"?>\n<!-- <no> -->\n<core:CityModel xmlns:core=\"http://www.opengis.net/citygml/2.0\" \
     xmlns:bldg=\"http://www.opengis.net/citygml/building/2.0\" xmlns:gml=\"http://www.opengis.net/gml\">\n";

fn gml_solid(lod: u32, height: f64) -> String {
    let (corners, faces) = block(height, 0);
    let faces: Vec<Vec<Vec<usize>>> = serde_json::from_str(&faces).unwrap();
    let face = |face: &Vec<Vec<usize>>| {
        let ring = face[0].iter().chain([&face[0][0]]).map(|i| corners[*i]);
        let places: Vec<String> = ring.map(|[x, y, z]| format!("{x} {y} {z}")).collect();
        format!(
            "<gml:surfaceMember><gml:Polygon><gml:exterior><gml:LinearRing><gml:posList>{}</gml:posList>\
             </gml:LinearRing></gml:exterior></gml:Polygon></gml:surfaceMember>\n",
            places.join(" ")
        )
    };
    let faces: String = faces.iter().map(face).collect();
    format!(
        "<bldg:lod{lod}Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{faces}</gml:CompositeSurface>\
         </gml:exterior></gml:Solid></bldg:lod{lod}Solid>"
    )
}

fn gml(inside: &str) -> String {
    format!(
        "{HEAD}<core:cityObjectMember><bldg:Building gml:id=\"b\">{inside}</bldg:Building></core:cityObjectMember>\
         </core:CityModel>"
    )
}

fn gml_part(id: &str, inside: &str) -> String {
    format!(
        "<bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id=\"{id}\">{inside}</bldg:BuildingPart>\
         </bldg:consistsOfBuildingPart>"
    )
}

#[test]
fn city_gml_has_the_same_levels() {
    let text = gml(&(gml_solid(1, 8.0) + &gml_part("p", &gml_solid(2, 5.0))));
    let plain = ReadOptions::default();
    assert_eq!(of("parts.gml", &text, &plain), (vec![("b/p".to_owned(), 5.0)], String::new()));
    assert_eq!(of("one.gml", &text, &with(1.0)).0, [("b".to_owned(), 8.0)]);
    let text = gml(&(gml_solid(2, 5.0) + &gml_solid(1, 8.0) + &gml_part("p", &gml_solid(1, 9.0))));
    let (all, told) = of("whole.gml", &text, &plain);
    assert_eq!(all, [("b".to_owned(), 5.0)]);
    assert!(told.contains("left out; the first: \"p\""), "{told}");
    let about = reading("about.gml", &text, &plain).unwrap().1.about.join("\n");
    assert!(
        about.contains("detail 1: 12 faces, not shown\nlevel of detail 2: 6 faces, shown"),
        "{about}"
    );
    assert!(about.contains("its solid is sound"), "{about}");
}

#[test]
fn undeclared_prefixes_and_degenerate_rings_are_told_and_the_rest_is_shown() {
    let plain = ReadOptions::default();
    // Two prefixes, of an element and of an attribute; also where all is in one line.
    let odd = "<uro:age>7</uro:age><bldg:roofType x:codeSpace=\"a\">1</bldg:roofType>";
    for text in [gml(&(odd.to_owned() + &gml_solid(1, 8.0)))]
        .into_iter()
        .flat_map(|text| [text.clone(), text.replace('\n', " ")])
    {
        let (all, told) = of("prefix.gml", &text, &plain);
        assert_eq!(all, [("b".to_owned(), 8.0)]);
        assert!(told.contains("prefix \"uro\"") && told.contains("prefix \"x\""), "{told}");
        // Places are those of the file.
        let place = |at: usize| {
            let line = text[..at].matches('\n').count() + 1;
            let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
            format!("line {line}, column {}", at - start + 1)
        };
        assert!(told.contains(&place(text.find("<uro:age").unwrap() + 1)), "{told}");
        let bad = text.replacen("0 0 8 ", "0 0 high ", 1);
        let error = reading("number.gml", &bad, &plain).map(|_| ()).unwrap_err().to_string();
        let list = bad[..bad.find("high").unwrap()].rfind("<gml:posList").unwrap();
        let [line, column] = {
            let said = place(list).replace("line ", "").replace("column ", "");
            let (line, column) = said.split_once(", ").unwrap();
            [line.to_owned(), column.to_owned()]
        };
        assert!(error.contains(&format!("number.gml:{line}:{column}:")), "{error}");
    }
    // A face with too few corners apart, a face without any, and a hole that is a line.
    let text = city(&[("b", "Building", &["1"], &[])]).replacen(
        "[[0, 3, 2, 1]]",
        "[[0, 3, 0]],[],[[]],[[0, 3, 2, 1],[4, 4, 5]]",
        1,
    );
    let (scene, _) = reading("ring.json", &text, &plain).unwrap();
    assert_eq!(scene.face_count(), 6);
    let told = scene.notes.join("\n");
    assert!(told.contains("3 surfaces with fewer than three corners"), "{told}");
    assert!(told.contains("1 holes") && told.contains("surface 3 of \"b\""), "{told}");
    let rings =
        gml_solid(1, 8.0).replacen("0 0 8 10 0 8 10 10 8 0 10 8 0 0 8", "0 0 8 10 0 8 0 0 8", 1);
    let (scene, _) = reading("ring.gml", &gml(&rings), &plain).unwrap();
    assert_eq!(scene.face_count(), 5);
    assert!(
        scene.notes.iter().any(|n| n.contains("fewer than three corners")),
        "{:?}",
        scene.notes
    );
}

#[test]
fn a_city_by_lines_is_the_city_in_one_piece() {
    let header = "{\"type\":\"CityJSON\",\"version\":\"2.0\",\"transform\":{\"scale\":[0.5,0.5,0.5],\
                  \"translate\":[100,200,10]},\"CityObjects\":{},\"vertices\":[]}";
    // Each feature counts its vertices and its materials from 0.
    let feature = |name: &str, height: f64, red: f64| {
        let (corners, faces) = block(height * 2.0, 0);
        format!(
            "{{\"type\":\"CityJSONFeature\",\"id\":\"{name}\",\"CityObjects\":{{\"{name}\":{{\"type\":\"Building\",\
             \"geometry\":[{{\"type\":\"Solid\",\"lod\":\"1\",\"boundaries\":[{faces}],\"material\":{{\"t\":{{\"value\":0}}}}}}]}}}},\
             \"appearance\":{{\"materials\":[{{\"name\":\"paint\",\"diffuseColor\":[{red},0,0]}}]}},\
             \"vertices\":{corners:?}}}"
        )
    };
    let text = [header.to_owned(), feature("a", 8.0, 1.0), String::new(), feature("b", 5.0, 0.5)];
    for end in ["\n", "\r\n"] {
        let (scene, _) = reading("city.jsonl", &text.join(end), &ReadOptions::default()).unwrap();
        assert_eq!(shown(&scene), [("a".to_owned(), 18.0), ("b".to_owned(), 15.0)]);
        let first = scene.instances[0].geometry.mesh().points[0];
        assert_eq!(first, DVec3::new(100.0, 200.0, 10.0));
        // Two materials of one name stay two.
        let reds: Vec<f32> = scene
            .instances
            .iter()
            .map(|instance| {
                let sides = instance.geometry.mesh().sides(0);
                scene.materials[instance.material_of(sides, true) as usize].color.to_array()[0]
            })
            .collect();
        assert_eq!(reds, [1.0, 0.5]);
        assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    }
    let error = |lines: &[String]| {
        reading("city.jsonl", &lines.join("\n"), &ReadOptions::default())
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    let cut = error(&[text[0].clone(), text[1].clone(), text[3][..90].to_owned()]);
    assert!(cut.contains("city.jsonl:3:"), "{cut}");
    assert!(error(&text[1..]).contains("first line must be the CityJSON object"));
    assert!(
        error(&[text[0].clone(), text[0].clone()]).contains("object 2 is of type \"CityJSON\"")
    );
    // A feature that comes twice is taken once.
    let (scene, _) = reading(
        "twice.city.jsonl",
        &[text[0].clone(), text[1].clone(), text[1].clone()].join("\n"),
        &ReadOptions::default(),
    )
    .unwrap();
    assert_eq!(shown(&scene).len(), 1);
    assert!(scene.notes[0].contains("left out; the first: \"a\""), "{:?}", scene.notes);
}

/// The lowest and highest corner of a scene.
fn bounds(scene: &Scene) -> [DVec3; 2] {
    let points = scene.instances.iter().flat_map(|instance| {
        let points = instance.geometry.mesh().points.iter();
        points.map(|p| instance.world_from_object.transform_point3(*p))
    });
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

#[test]
fn what_info_says_of_the_origin_can_be_pasted() {
    let scratch = Scratch::new("levels-paste");
    let far = city(&[("b", "Building", &["1"], &[])]).replacen(
        "{",
        "{\"transform\":{\"scale\":[1,1,1],\"translate\":[684000.5,5405000.25,310.125]},",
        1,
    );
    // A building over a thousandth of a degree of latitude and of longitude.
    let place = |list: &str| {
        let numbers: Vec<f64> = list.split(' ').map(|word| word.parse().unwrap()).collect();
        let place = |p: &[f64]| format!("{} {} {}", 35.0 + p[0] / 1e4, 139.0 + p[1] / 1e4, p[2]);
        numbers.chunks(3).map(place).collect::<Vec<_>>().join(" ")
    };
    let solid = gml_solid(1, 8.0).replace("<gml:Solid>", "<gml:Solid srsName=\"EPSG:6697\">");
    let lists = solid.split("<gml:posList>").map(|part| match part.split_once("</gml:posList>") {
        Some((list, rest)) => format!("{}</gml:posList>{rest}", place(list)),
        None => part.to_owned(),
    });
    let degrees = gml(&lists.collect::<Vec<_>>().join("<gml:posList>"));
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 5000 6000 7000\nvertex 5400 6000 7000\n\
               vertex 5000 6200 7100\nendloop\nendfacet\nendsolid s\n";
    for (name, text) in [("far.json", far.as_str()), ("degrees.gml", &degrees), ("part.stl", stl)] {
        std::fs::write(scratch.path().join(name), text).unwrap();
        let said = run(env!("CARGO_BIN_EXE_spandrel-under-test"), &["info", name], scratch.path());
        assert_eq!(said.code, Some(0), "{said:?}");
        let start = said.out.find("origin: (").unwrap_or_else(|| panic!("{said:?}"));
        let origin = &said.out[start..start + said.out[start..].find(')').unwrap() + 1];
        let graph = format!("Graph(nodes: {{\"m\": ReadScene(file: {name:?}, {origin})}})");
        std::fs::write(scratch.path().join("g.ron"), graph).unwrap();
        let check =
            run(env!("CARGO_BIN_EXE_spandrel-under-test"), &["check", "g.ron"], scratch.path());
        assert_eq!(check.code, Some(0), "{check:?}");
        let numbers = origin["origin: (".len()..origin.len() - 1].split(", ");
        let numbers: Vec<f64> = numbers.map(|word| word.parse().unwrap()).collect();
        let options = ReadOptions { origin: numbers.try_into().ok(), ..ReadOptions::default() };
        let scene = read::scene(&scratch.path().join(name), None, "m", &options).unwrap();
        let [low, high] = bounds(&scene);
        let middle = (low + high) / 2.0;
        // Degrees are rounded to ten metres.
        let near = if name == "degrees.gml" { 10.0 } else { 1e-3 };
        assert!(middle.x.abs() < near && middle.z.abs() < near, "{name}: {low} {high} by {origin}");
        assert!(low.y.abs() < 1e-3, "{name}: {low} {high} by {origin}");
    }
}
