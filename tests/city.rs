//! CityGML: what it says in closed form, against the same city as CityJSON by another program, and what is wrong in it.

use glam::DVec3;
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::read::{self, ReadOptions};
use spandrel_tests::data;
use spandrel_tests::program::Scratch;
use std::path::Path;

const HEAD: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:gml="http://www.opengis.net/gml"
  xmlns:bldg="http://www.opengis.net/citygml/building/2.0" xmlns:app="http://www.opengis.net/citygml/appearance/2.0"
  xmlns:gen="http://www.opengis.net/citygml/generics/2.0" xmlns:xlink="http://www.w3.org/1999/xlink">
"#;

/// A polygon whose ring is called as it with an `r` before.
fn polygon(id: &str, rings: &[&str]) -> String {
    let ring = |(number, positions): (usize, &&str)| {
        let side = if number == 0 { "exterior" } else { "interior" };
        let name = if number == 0 { format!("r{id}") } else { format!("r{id}{number}") };
        format!(
            "<gml:{side}><gml:LinearRing gml:id=\"{name}\"><gml:posList>{positions}</gml:posList>\
             </gml:LinearRing></gml:{side}>"
        )
    };
    let rings: String = rings.iter().enumerate().map(ring).collect();
    format!(
        "<gml:surfaceMember><gml:Polygon gml:id=\"{id}\">{rings}</gml:Polygon></gml:surfaceMember>"
    )
}

fn multi(lod: u32, members: &str) -> String {
    format!(
        "<bldg:lod{lod}MultiSurface><gml:MultiSurface>{members}</gml:MultiSurface></bldg:lod{lod}MultiSurface>"
    )
}

fn house() -> String {
    let wall = polygon("wall", &["0 0 0 4 0 0 4 0 3 0 0 3 0 0 0", "1 0 1 1 0 2 2 0 2 2 0 1 1 0 1"]);
    let window = polygon("window", &["1 0 1 2 0 1 2 0 2 1 0 2 1 0 1"]);
    let roof = polygon("roof", &["0 0 3 4 0 3 4 5 3 0 5 3 0 0 3"]);
    let floor = polygon("floor", &["0 0 0 4 0 0 4 5 0 0 5 0 0 0 0"]);
    let turned = format!(
        "<gml:surfaceMember><gml:OrientableSurface orientation=\"-\"><gml:baseSurface>{}</gml:baseSurface>\
         </gml:OrientableSurface></gml:surfaceMember>",
        floor.replace("<gml:surfaceMember>", "").replace("</gml:surfaceMember>", "")
    );
    let porch = polygon("porch", &["4 0 0 6 0 0 6 0 2 4 0 2 4 0 0"]);
    format!(
        "{HEAD}<cityObjectMember><bldg:Building gml:id=\"house\">
           <gml:name>Home</gml:name>
           <gen:stringAttribute name=\"colour\"><gen:value>red</gen:value></gen:stringAttribute>
           <bldg:lod1Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{coarse}
             </gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod1Solid>
           <bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>
             <gml:surfaceMember xlink:href=\"#roof\"/><gml:surfaceMember xlink:href=\"#wall\"/>
             <gml:surfaceMember xlink:href=\"#nothing\"/>{turned}
             </gml:CompositeSurface></gml:exterior></gml:Solid></bldg:lod2Solid>
           <bldg:boundedBy><bldg:WallSurface>{}<bldg:opening><bldg:Window>{}</bldg:Window></bldg:opening>
             </bldg:WallSurface></bldg:boundedBy>
           <bldg:boundedBy><bldg:RoofSurface>{}</bldg:RoofSurface></bldg:boundedBy>
           <bldg:consistsOfBuildingPart><bldg:BuildingPart gml:id=\"part\">{}</bldg:BuildingPart>
             </bldg:consistsOfBuildingPart>
         </bldg:Building></cityObjectMember>
         <app:appearanceMember><app:Appearance>
           <app:surfaceDataMember><app:ParameterizedTexture><app:imageURI>roof.png</app:imageURI>
             <app:wrapMode>mirror</app:wrapMode><app:target uri=\"#roof\"><app:TexCoordList>
             <app:textureCoordinates ring=\"#rroof\">0 0 1 0 1 0.5 0 0.5 0 0</app:textureCoordinates>
             </app:TexCoordList></app:target></app:ParameterizedTexture></app:surfaceDataMember>
           <app:surfaceDataMember><app:X3DMaterial><app:diffuseColor>0.1 0.2 0.3</app:diffuseColor>
             <app:target>#part</app:target></app:X3DMaterial></app:surfaceDataMember>
         </app:Appearance></app:appearanceMember></CityModel>",
        multi(2, &wall),
        multi(2, &window),
        multi(2, &roof),
        multi(2, &porch),
        coarse = polygon("coarse", &["0 0 0 9 0 0 9 9 9 0 0 0"]),
    )
}

fn open(folder: &Path, text: &str, options: &ReadOptions) -> Result<Scene, String> {
    let path = folder.join("city.gml");
    std::fs::write(&path, text).unwrap();
    read::scene(&path, None, "city", options).map_err(|e| e.to_string())
}

/// Of each face: its object, the material of its front, its normal with z up, and its area.
fn faces(scene: &Scene) -> Vec<(String, String, DVec3, f64)> {
    let mut faces = Vec::new();
    for instance in &scene.instances {
        let mesh = instance.geometry.mesh();
        for face in 0..mesh.face_count() {
            let area = |ring: &[u32]| {
                let point = |i: usize| mesh.points[ring[i % ring.len()] as usize];
                let sum: DVec3 = (0..ring.len()).map(|i| point(i).cross(point(i + 1))).sum();
                sum.length() / 2.0
            };
            let holes: f64 = mesh.holes(face).iter().map(|hole| area(hole)).sum();
            let number = instance.material_of(mesh.sides(face), true);
            let material = scene.material_names[number as usize].clone();
            let normal = instance.geometry.normal(face);
            faces.push((instance.path.clone(), material, normal, area(mesh.outline(face)) - holes));
        }
    }
    faces
}

#[test]
fn a_house_has_its_surfaces_once_each_with_kinds_pictures_and_parts() {
    let scratch = Scratch::new("citygml");
    let scene = open(scratch.path(), &house(), &ReadOptions::default()).unwrap();
    let mut found = faces(&scene);
    found.sort_by(|a, b| a.3.total_cmp(&b.3));
    let said: Vec<(&str, &str, [i32; 3], f64)> = found
        .iter()
        .map(|(object, material, normal, area)| {
            let normal = normal.to_array().map(|v| v.round() as i32);
            (object.as_str(), material.as_str(), normal, *area)
        })
        .collect();
    // The floor is turned by its orientation, and what is referred to is not there twice.
    let expected = [
        ("house", "Window", [0, -1, 0], 1.0),
        ("house/part", "material 0", [0, -1, 0], 4.0),
        ("house", "WallSurface", [0, -1, 0], 11.0),
        ("house", "picture 0", [0, 0, 1], 20.0),
        ("house", "", [0, 0, -1], 20.0),
    ];
    for face in expected {
        assert!(said.contains(&face), "{face:?} of {said:?}");
    }
    assert_eq!(said.len(), 5, "{said:?}");
    let path = scratch.path().join("city.gml");
    let reading = read::document(&path, &ReadOptions::default()).unwrap();
    let user = &reading.document.plans[0].root.children[0].user;
    assert_eq!((user["name"].as_str(), user["colour"].as_str()), ("Home", "red"));
    assert!(scene.notes.iter().any(|note| note.contains("\"#nothing\"")), "{:?}", scene.notes);
    // A window that is finer than its wall leaves the wall; comments, empty rings and flat positions change nothing.
    let finer = house()
        .replace("<bldg:Window><bldg:lod2", "<bldg:Window><bldg:lod3")
        .replace("</bldg:lod2MultiSurface></bldg:Window>", "</bldg:lod3MultiSurface></bldg:Window>")
        .replace("4 5 3 0 5 3", "4 5 3<!-- here --> 0 5 3")
        .replace(
            "</gml:interior>",
            "</gml:interior><gml:interior><gml:LinearRing/></gml:interior>",
        );
    let mut same = faces(&open(scratch.path(), &finer, &ReadOptions::default()).unwrap());
    same.sort_by(|a, b| a.3.total_cmp(&b.3));
    assert_eq!(same, found);
    let flat = house().replace("<bldg:lod1Solid>", "<bldg:lod1Solid srsDimension=\"2\">");
    let flat = flat.replace("0 0 0 9 0 0 9 9 9 0 0 0", "0 0 9 0 9 9 0 0");
    open(scratch.path(), &flat, &ReadOptions::default()).unwrap();
    let mesh = scene.instances.iter().find(|i| i.path == "house").unwrap().geometry.mesh();
    let corner = mesh.points.iter().position(|p| *p == DVec3::new(4.0, 5.0, 3.0)).unwrap();
    assert_eq!(mesh.uvs[corner].to_array(), [1.0, 0.5]);
}

#[test]
fn positions_in_degrees_are_metres_on_the_ground() {
    let scratch = Scratch::new("citygml-degrees");
    let head = HEAD.replace(
        "xmlns:xlink",
        "srsName=\"http://www.opengis.net/def/crs/EPSG/0/6697\" xmlns:xlink",
    );
    let at = |north: f64, east: f64, up: f64| format!("{north} {east} {up} ");
    let (north, east) = (35.26, 139.74);
    let ring = at(north, east, 5.0)
        + &at(north, east + 0.001, 5.0)
        + &at(north + 0.001, east + 0.001, 8.0)
        + &at(north, east, 5.0);
    let text = format!(
        "{head}<cityObjectMember><bldg:Building>{}</bldg:Building></cityObjectMember></CityModel>",
        multi(2, &polygon("p", &[&ring]))
    );
    let options = ReadOptions { origin: Some([north, east, 1.0]), ..ReadOptions::default() };
    let scene = open(scratch.path(), &text, &options).unwrap();
    let mesh = scene.instances[0].geometry.mesh();
    // A thousandth of a degree of the meridian and of the parallel on the ellipsoid of GRS 80, by the usual series in
    // the latitude's cosines.
    let angle = north.to_radians();
    let cosine = |k: f64| {
        let turn = k * angle;
        spandrel_engine::math::cos(turn)
    };
    let meridian = (111_132.954 - 559.822 * cosine(2.0) + 1.175 * cosine(4.0)) / 1e3;
    let parallel = (111_412.84 * cosine(1.0) - 93.5 * cosine(3.0) + 0.118 * cosine(5.0)) / 1e3;
    let expected = [
        DVec3::new(0.0, 0.0, 4.0),
        DVec3::new(parallel, 0.0, 4.0),
        DVec3::new(parallel, meridian, 7.0),
    ];
    for (found, expected) in mesh.points.iter().zip(expected) {
        assert!(found.distance(expected) < 2e-3, "{found} instead of {expected}");
    }
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
    let scene = open(scratch.path(), &text, &ReadOptions::default()).unwrap();
    assert!(scene.notes.iter().any(|note| note.contains("origin: (35.2605, 139.7405, 0)")));
    let wrong = text.replace("139.74", "239.74");
    let error = open(scratch.path(), &wrong, &ReadOptions::default()).unwrap_err();
    assert!(error.contains("in degrees"), "{error}");
}

#[test]
fn what_is_wrong_in_a_city_is_told_with_its_place() {
    let scratch = Scratch::new("citygml-wrong");
    let error =
        |text: &str| open(scratch.path(), text, &ReadOptions::default()).map(|_| ()).unwrap_err();
    let good = house();
    let line = good.lines().position(|line| line.contains("0 0 3 4 0 3")).unwrap() + 1;
    let number = error(&good.replace("0 0 3 4 0 3 4 5 3 0 5 3 0 0 3", "0 0 3 4 0 nan 4"));
    assert!(
        number.contains(&format!("city.gml:{line}:")) && number.contains("\"nan\""),
        "{number}"
    );
    let odd = error(&good.replace("0 0 3 4 0 3 4 5 3 0 5 3 0 0 3", "0 0 3 4"));
    assert!(odd.contains("4 numbers"), "{odd}");
    let broken = error(&good[..good.len() - 30]);
    assert!(broken.contains("not CityGML") && broken.contains("city.gml:"), "{broken}");
    let other = error("<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
    assert!(other.contains("\"svg\""), "{other}");
    // Surfaces that refer to each other, and many levels of them.
    let ring = (0..300)
        .map(|k| {
            let next = (k + 1) % 300;
            format!(
                "<gml:surfaceMember><gml:MultiSurface gml:id=\"s{k}\"><gml:surfaceMember xlink:href=\"#s{next}\"/>\
                 <gml:surfaceMember xlink:href=\"#s{next}\"/></gml:MultiSurface></gml:surfaceMember>"
            )
        })
        .collect::<String>();
    let text = format!(
        "{HEAD}<cityObjectMember><bldg:Building>{}</bldg:Building></cityObjectMember></CityModel>",
        multi(2, &ring)
    );
    assert!(error(&text).contains("without an end"));
    // Objects that share all of their surfaces with all others.
    let shared: String =
        (0..300).map(|k| polygon(&format!("p{k}"), &["0 0 0 1 0 0 1 1 0 0 0 0"])).collect();
    let objects: String = (0..300)
        .map(|_| {
            "<cityObjectMember><bldg:Building><bldg:lod2Solid xlink:href=\"#all\"/></bldg:Building></cityObjectMember>"
        })
        .collect();
    let text = format!(
        "{HEAD}<cityObjectMember><bldg:Building><bldg:lod2Solid><gml:Solid gml:id=\"all\">{shared}</gml:Solid>\
         </bldg:lod2Solid></bldg:Building></cityObjectMember>{objects}</CityModel>"
    );
    assert!(error(&text).contains("without an end"));
    let deep = format!(
        "{HEAD}<cityObjectMember>{}{}</cityObjectMember></CityModel>",
        "<bldg:Building><bldg:part>".repeat(50_000),
        "</bldg:part></bldg:Building>".repeat(50_000)
    );
    let _ = open(scratch.path(), &deep, &ReadOptions::default());
}

#[test]
fn cities_are_what_other_programs_make_of_them() {
    let pairs = [
        ("city/ingolstadt_4018128/4018128.xml", "city/ingolstadt_4018128/4018128.city.json"),
        ("city/ingolstadt_4018257/4018257.xml", "city/ingolstadt_4018257/4018257.city.json"),
        ("city/ingolstadt_4018302/4018302.xml", "city/ingolstadt_4018302/4018302.city.json"),
        ("city/plateau_yokosuka_52397519.gml", "city/plateau_yokosuka.city.json"),
    ];
    for (gml, json) in pairs {
        let (Some(gml), Some(json)) = (data::find(gml), data::find(json)) else { continue };
        let of = |path: &Path| {
            let options = ReadOptions { pictures: Some(false), ..ReadOptions::default() };
            let scene = read::scene(path, None, "city", &options).unwrap();
            let mut areas: Vec<f64> = faces(&scene).into_iter().map(|face| face.3).collect();
            areas.sort_by(f64::total_cmp);
            areas
        };
        let (own, other) = (of(&gml), of(&json));
        // Texture coordinates that are not affine divide a face or two.
        assert!(own.len().abs_diff(other.len()) <= 1, "{gml:?}: {} {}", own.len(), other.len());
        let sum = |areas: &[f64]| areas.iter().sum::<f64>();
        let off = sum(&own) / sum(&other) - 1.0;
        assert!(off.abs() < 1e-5, "{gml:?}: {off}");
        let tenth = own.len() / 10;
        for k in 1..10 {
            let (a, b) = (own[k * tenth], other[k * tenth]);
            assert!((a - b).abs() < 1e-3 * a + 1e-3, "{gml:?}: {a} {b}");
        }
    }
}

#[test]
fn the_buildings_of_yokosuka_wear_their_photographs() {
    let Some(path) = data::find("city/plateau_yokosuka_52397519.gml") else { return };
    let scene = read::scene(&path, None, "yokosuka", &ReadOptions::default()).unwrap();
    let worn = faces(&scene).iter().filter(|face| face.1.starts_with("picture ")).count();
    assert_eq!(worn, 335, "faces with a photograph");
}
