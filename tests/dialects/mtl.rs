//! What MTL says of surfaces: shown or told.

use super::*;

/// The material of a library's text, and what is told of it.
fn material(folder: &Folder, text: &str) -> (Material, Vec<String>) {
    folder.put("m.mtl", format!("newmtl m\n{text}"));
    let reading = folder
        .take(
            "m.obj",
            format!("mtllib m.mtl\nusemtl m\nvt 0 0\n{}", OBJ.replace("f 1 2 3", "f 1/1 2/1 3/1")),
        )
        .unwrap();
    (reading.document.materials["m"].clone(), reading.notes)
}

#[test]
fn pictures_of_mtl_keep_their_files_and_options() {
    let folder = Folder::new("mtl-maps");
    folder.put("green wall.png", "").put("sub/deep.png", "");
    for (line, file) in [
        ("map_Kd -s 1 a.png", "a.png"),
        ("map_Kd -o 1 1 -t 0 0 -s 1 1 1 a b.png", "a b.png"),
        ("MAP_KD -blendu on -blendv on -cc off -clamp off -mm 0 1 a.png", "a.png"),
        ("map_Kd C:\\work\\green wall.png", "green wall.png"),
        ("map_Kd ./a.png", "./a.png"),
    ] {
        let (material, notes) = material(&folder, line);
        assert_eq!(material.maps["color"].picture.file(), Some(file), "{line}");
        assert_eq!(notes, NOTHING, "{line}");
    }
    let (one, notes) =
        material(&folder, "map_Kd -s 2 -o .5 .25 -mm 0 2 -t 1 a.png\nmap_Bump -bm 3 h.png");
    let mapping = &one.maps["color"].mapping;
    assert_eq!((mapping.scale, mapping.offset), (DVec2::new(2.0, 1.0), DVec2::new(0.5, 0.25)));
    assert_eq!(one.maps["bump"].strength, 0.03);
    assert!(notes[0].contains("-mm of map_Kd (\"m\"), -t of map_Kd (\"m\")"), "{notes:?}");
    // A library in a folder of its own names its pictures from there.
    folder.put("sub/m.mtl", "newmtl m\nmap_Kd deep.png\n");
    let reading = folder
        .take(
            "s.obj",
            format!(
                "mtllib sub/m.mtl\nusemtl m\nvt 0 0\n{}",
                OBJ.replace("f 1 2 3", "f 1/1 2/1 3/1")
            ),
        )
        .unwrap();
    assert_eq!(reading.document.materials["m"].maps["color"].picture.file(), Some("sub/deep.png"));
    // The alpha of the picture itself, or of another.
    let (same, _) = material(&folder, "map_Kd a.png\nmap_d a.png");
    assert_eq!((same.alpha_mode, same.maps.len()), (AlphaMode::Blend, 1));
    let (other, _) = material(&folder, "map_Kd a.png\nmap_d b.png");
    assert_eq!((other.alpha_mode, other.maps.len()), (AlphaMode::Blend, 2));
    let reading = folder.take("u.obj", format!("mtllib sub/m.mtl\nusemtl m\n{OBJ}")).unwrap();
    told(&reading, &["1 faces have a material with pictures, and no texture coordinates"]);
}

#[test]
fn what_mtl_says_is_shown_or_told() {
    let folder = Folder::new("mtl");
    let shown = |text: &str| {
        let (material, notes) = material(&folder, text);
        assert_eq!(notes, NOTHING, "{text}");
        material
    };
    assert!(shown("Kd 1 .5 .25\nillum 0").unlit);
    assert_eq!(shown("kd .5").color, Color::grey(0.5));
    assert_eq!(shown("d .25\nTr .75").alpha, 0.25);
    assert_eq!(shown("Tr .75").alpha, 0.25);
    assert_eq!(shown("Ks 1 1 1\nNs 100\nillum 1").finish.gloss, Gloss::None);
    let optics = |text: &str| shown(text).finish.optics.unwrap();
    let mirror = Optics {
        reflect: Color::grey(0.25),
        refract: Color::BLACK,
        index: 1.5,
        fresnel: false,
        absorb: Color::BLACK,
    };
    assert_eq!(optics("Ks .25 .25 .25\nillum 3"), mirror);
    assert_eq!(
        optics("Ks .25 .25 .25\nillum 5\nNi 1.33"),
        Optics { fresnel: true, index: 1.33, ..mirror }
    );
    let glass = optics("Tf .5 1 .5\nillum 7\nNi 1.33");
    assert_eq!(
        (glass.reflect, glass.refract, glass.index),
        (Color::WHITE, Color::new(0.5, 1.0, 0.5), 1.33)
    );
    let clear = optics("Ks .25 .25 .25\nillum 6\nNi 1.1");
    assert_eq!(
        (clear.reflect, clear.refract, clear.fresnel),
        (Color::grey(0.25), Color::grey(0.75), false)
    );
    let facets =
        |reflectance, roughness, metal| Gloss::Microfacets { reflectance, roughness, metal };
    assert_eq!(shown("Pr .3\nPm 1").finish.gloss, facets(0.04, 0.3, 1.0));
    let rough = shown("map_Pr r.png");
    assert_eq!(
        (rough.finish.gloss, rough.maps["metallic_roughness"].picture.file()),
        (facets(0.04, 1.0, 0.0), Some("r.png"))
    );
    assert_eq!(shown("map_Pr r.png\nmap_Pm r.png").finish.gloss, facets(0.04, 1.0, 1.0));
    assert_eq!(shown("norm n.png").maps["normal"].picture.file(), Some("n.png"));
    assert_eq!(shown("Ka 1 1 1\nKs 0 0 0\nPs 0\nTf 1 1 1\nNi 1\nillum 2"), shown(""));
    // Exporters write an index for what has no use of it.
    assert_eq!(shown("Ni 1.45\nillum 2"), shown(""));
    for (line, said) in [
        ("Ka .1 0 0", "Ka (\"m\")"),
        ("Ni 1.5", "Ni (\"m\")"),
        ("Tf 1 0 0", "Tf (\"m\")"),
        ("Ks .5 .5 .5", "Ks without Ns"),
        ("Ks .5 0 0\nNs 9", "the colour of Ks"),
        ("illum 10", "illum 10"),
        ("refl -type sphere sky.png", "refl (\"m\")"),
        ("map_Ks s.png", "map_Ks"),
        ("map_Ns s.png", "map_Ns"),
        ("map_Ka s.png", "map_Ka"),
        ("map_Pm s.png", "map_Pm without the same map_Pr"),
        ("disp d.png", "disp"),
        ("decal d.png", "decal"),
        ("Pc .5", "Pc"),
        ("sharpness 60", "sharpness"),
        ("map_Kd", "map_Kd without a file"),
        ("Kd spectral a.rfl 1", "Kd spectral"),
        ("d -halo .5", "d -halo"),
        ("d 1\nTr 1", "Tr, which contradicts d"),
        ("Kd 1 1 1\nd 0", "with a d of 0"),
        ("newmtl m", "an earlier material of the same name"),
    ] {
        let (_, notes) = material(&folder, line);
        assert!(notes.len() == 1 && notes[0].contains(said), "{line}: {notes:?}");
    }
    folder.put("m.mtl", "Kd 1 0 0\nnewmtl m\nNi 2\nnewmtl n\nNi 3\nrefl x\n");
    let reading = folder.take("m.obj", format!("mtllib m.mtl\n{OBJ}")).unwrap();
    told(
        &reading,
        &["Kd before the first newmtl, Ni (2 materials, the first \"m\"), refl (\"n\")"],
    );
}

#[test]
fn the_highlight_of_mtl_is_ks_in_its_middle_and_half_as_bright_where_the_format_says() {
    let folder = Folder::new("mtl-highlight");
    folder.put("m.mtl", "newmtl m\nKd .25 .25 .25\nKs .5 .5 .5\nNs 80\nillum 2\n");
    // Seen from far in front, so that the eye is straight ahead.
    folder.put("m.obj", format!("mtllib m.mtl\nusemtl m\n{OBJ}"));
    let lit = |degrees: f64| {
        let angle = degrees.to_radians();
        let toward = v(spandrel_engine::math::sin(angle), 0.0, spandrel_engine::math::cos(angle));
        // As much light falls on the face from everywhere.
        let lamp = sun(-toward, Color::grey(1.0 / toward.z as f32));
        let shader = illuminate(vec![lamp], Color::BLACK, Color::BLACK);
        let image =
            folder.image("m.obj").shaded(Arc::new(Illuminate { white: 1.0, ..shader })).unwrap();
        f64::from(middle(&image)[0])
    };
    assert!((lit(0.0) - 0.75).abs() < 0.01, "{}", lit(0.0));
    // cos^80 of half the angle is a half at 2 acos(0.5^(1/80)), 15.1 degrees.
    let half = lit(15.076) - 0.25;
    assert!((half - 0.25).abs() < 0.02, "{half}");
}
