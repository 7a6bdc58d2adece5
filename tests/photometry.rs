//! Measured lamps: files of all types and symmetries, the flux that makers state, and damaged files.

use glam::{DVec3, dvec3 as v};
use spandrel_engine::error::Error;
use spandrel_engine::light::list::{LampFile, MakeLamp, PointLight};
use spandrel_engine::light::photometry::{Goniometer, Photometry};
use spandrel_tests::data;
use spandrel_tests::lights::close;
use std::f64::consts::PI;
use std::path::Path;

fn lamp_file(text: &str, is_eulumdat: bool) -> Photometry {
    Photometry::parse(text.as_bytes(), is_eulumdat).unwrap()
}

/// An IES file of type C with a head of the user's.
fn ies(numbers: &str) -> String {
    format!("IESNA:LM-63-2002\n[TEST] ours\nTILT=NONE\n{numbers}\n")
}

#[test]
fn photometry_is_read_in_all_types_and_symmetries() {
    // The same in all directions, by each symmetry; 2 lamps, a multiplier and a ballast factor.
    for horizontal in ["0", "0 90", "0 45 90", "0 90 180", "0 180 360", "90 180 270"] {
        let count = horizontal.split(' ').count();
        let candela = "50 50 50 ".repeat(count);
        let lamp = lamp_file(
            &ies(&format!(
                "2 1000 2 3 {count} 1 2 0.1 0.2 0 \n0.5 1 40\n 0 90 180\n{horizontal}\n{candela}"
            )),
            false,
        );
        close(lamp.flux(), 4.0 * PI * 50.0, 1e-4);
        assert_eq!((lamp.about.lamp_flux, lamp.about.watts), (Some(2000.0), 40.0));
        for d in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            close(lamp.intensity(d), 50.0, 1e-6);
        }
    }
    // Each quarter by itself: planes are where they belong. C0 is x, C90 is y, gamma 0 is z.
    let lamp = lamp_file(
        &ies(
            "1 -1 1 3 5 1 2 0 0 0 1 1 0\n0 45 90\n0 90 180 270 360\n9 9 1 9 9 2 9 9 3 9 9 4 9 9 1",
        ),
        false,
    );
    assert_eq!(lamp.about.lamp_flux, None);
    for (d, candela) in [
        (DVec3::X, 1.0),
        (DVec3::Y, 2.0),
        (DVec3::NEG_X, 3.0),
        (DVec3::NEG_Y, 4.0),
        (v(1.0, 1.0, 0.0).normalize(), 1.5),
        (v(1.0, -1.0, 0.0).normalize(), 2.5),
        (DVec3::Z, 9.0),
        (DVec3::NEG_Z, 0.0),
    ] {
        assert!((lamp.intensity(d) - candela).abs() < 1e-6, "{d}: {}", lamp.intensity(d));
    }
    // Type B: the vertical angle turns about the axis across, the horizontal one is towards it.
    let lamp =
        lamp_file(&ies("1 -1 1 3 3 2 2 0 0 0 1 1 0\n-90 0 90\n-90 0 90\n1 1 1 2 3 4 5 5 5"), false);
    assert_eq!(lamp.kind, Goniometer::B);
    for (d, candela) in [
        (DVec3::Z, 3.0),
        (DVec3::Y, 4.0),
        (DVec3::NEG_Y, 2.0),
        (DVec3::X, 5.0),
        (DVec3::NEG_X, 1.0),
    ] {
        assert!((lamp.intensity(d) - candela).abs() < 1e-6, "B {d}: {}", lamp.intensity(d));
    }
    // Type A: the horizontal angle turns about the vertical, the vertical one is the height; a half is
    // mirrored.
    let lamp = lamp_file(&ies("1 -1 1 3 2 3 2 0 0 0 1 1 0\n-90 0 90\n0 90\n1 3 5 1 2 5"), false);
    for (d, candela) in [
        (DVec3::Z, 3.0),
        (DVec3::Y, 5.0),
        (DVec3::NEG_Y, 1.0),
        (DVec3::X, 2.0),
        (DVec3::NEG_X, 2.0),
    ] {
        assert!((lamp.intensity(d) - candela).abs() < 1e-6, "A {d}: {}", lamp.intensity(d));
    }
    // A tilt table is passed over, words may stand anywhere, and there need be no first line.
    let old =
        "OLD LAMP\nTILT=INCLUDE\n1\n2\n0 90\n1 .9\n1 1000 1 2 1\n1 1 0 0 0 1 1,0 0\n90\n0 7\n7";
    close(lamp_file(old, false).intensity(DVec3::Z), 7.0, 1e-6);
}

/// A EULUMDAT file, symmetric as asked, with the planes from 0 to 330 degrees.
fn ldt(symmetry: u32, planes: &[&str]) -> String {
    let head = format!("Maker\n1\n{symmetry}\n4\n90\n3\n45\nreport\nname\nnumber\nfile\ndate\n");
    let sizes = "100\n100\n50\n80\n80\n0\n0\n0\n0\n100\n80\n1\n0\n1\n1\nLED\n2000\n3000\n80\n25\n";
    let ratios = "0\n".repeat(10);
    let angles = "0\n90\n180\n270\n0\n45\n90\n";
    format!(
        "{head}{sizes}{ratios}{angles}{}",
        planes.iter().map(|p| p.replace(' ', "\n") + "\n").collect::<String>()
    )
}

#[test]
fn eulumdat_symmetries_show_every_side() {
    let all = |text: &str| {
        let lamp = lamp_file(text, true);
        [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y].map(|d| lamp.intensity(d).round())
    };
    // In candela per kilolumen of 2000 lumen.
    assert_eq!(all(&ldt(0, &["9 9 1", "9 9 2", "9 9 3", "9 9 4"])), [2.0, 4.0, 6.0, 8.0]);
    assert_eq!(all(&ldt(1, &["9 9 1"])), [2.0; 4]);
    // About the plane C0 to C180.
    assert_eq!(all(&ldt(2, &["9 9 1", "9 9 2", "9 9 3"])), [2.0, 4.0, 6.0, 4.0]);
    // About the plane C90 to C270; the planes are C270, C0, C90.
    assert_eq!(all(&ldt(3, &["9 9 4", "9 9 1", "9 9 2"])), [2.0, 4.0, 2.0, 8.0]);
    assert_eq!(all(&ldt(4, &["9 9 1", "9 9 2"])), [2.0, 4.0, 2.0, 4.0]);
    let lamp = lamp_file(&ldt(1, &["9 9 1"]), true);
    assert_eq!((lamp.about.lamp_flux, lamp.about.stated_flux), (Some(2000.0), Some(1600.0)));
}

#[test]
fn lamps_of_makers_have_the_flux_that_they_state() {
    let Some(folder) = data::find("photometry") else { return };
    // Lumens that leave the luminaire: by LM-79 for absolute photometry (what the file says of its lamp),
    // by the light output ratio in EULUMDAT; and a reference of somebody else's integration.
    let stated = [("rab_flood_2.1.IES", Some(10_601.0)), ("rab_1.IES", Some(9_217.18))];
    let mut checked = 0;
    for file in data::files(&folder, &[".ies", ".ldt"]) {
        let name = file.file_name().unwrap().to_string_lossy().into_owned();
        let lamp = Photometry::read(&file).unwrap_or_else(|e| panic!("{name}: {e}"));
        let flux = lamp.flux();
        assert!(flux > 0.0 && lamp.peak() > 0.0, "{name}");
        let known = stated.iter().find(|(known, _)| *known == name).and_then(|(_, flux)| *flux);
        let Some(known) = known.or(lamp.about.stated_flux) else { continue };
        assert!((flux / known - 1.0).abs() < 0.01, "{name}: {flux}, stated {known}");
        checked += 1;
    }
    assert!(checked >= 4, "{checked}");
}

#[test]
fn a_damaged_lamp_file_is_an_error_that_says_where() {
    let good = ies("1 1000 1 3 2 1 2 0 0 0 1 1 10\n0 45 90\n0 90\n1 2 3\n4 5 6");
    lamp_file(&good, false);
    let words: Vec<&str> = good.split_whitespace().collect();
    let first = words.iter().position(|word| *word == "TILT=NONE").unwrap() + 1;
    for at in first..words.len() {
        for nonsense in ["x", "NaN", "inf", "-7", "1e400", "99999"] {
            let mut damaged = words.clone();
            damaged[at] = nonsense;
            let text = format!(
                "{}\nTILT=NONE\n{}",
                damaged[..first - 1].join(" "),
                damaged[first..].join(" ")
            );
            match Photometry::parse(text.as_bytes(), false) {
                // Numbers that may be anything: lumens, sizes, watts, candela.
                Ok(lamp) => assert!(lamp.flux().is_finite(), "{text}"),
                Err(error) => {
                    assert!(error.to_string().contains("line "), "{error}");
                    continue;
                }
            }
            assert!(nonsense == "99999" || nonsense == "-7", "{nonsense} at {at}");
        }
    }
    let good = ldt(0, &["9 9 1", "9 9 2", "9 9 3", "9 9 4"]);
    let lines: Vec<&str> = good.lines().collect();
    for at in 0..lines.len() {
        let mut damaged = lines.clone();
        damaged[at] = "x";
        if let Err(error) = Photometry::parse(damaged.join("\n").as_bytes(), true) {
            assert!(error.to_string().contains(&format!("line {}", at + 1)), "{at}: {error}");
        }
        let cut = lines[..at].join("\n");
        assert!(Photometry::parse(cut.as_bytes(), true).is_err());
    }
    for text in ["", "TILT=", "IESNA91\n", "TILT=NONE\n1 1 1 4096 4096 1 1 0 0 0 1 1 1 0"] {
        assert!(Photometry::parse(text.as_bytes(), false).is_err(), "{text}");
    }
    let missing =
        PointLight { lamp: Some(LampFile("no such lamp.ies".into())), ..PointLight::default() };
    let error = missing.lamp("", Path::new("somewhere")).unwrap_err();
    let error = Error::from(error);
    assert!(
        matches!(&error, Error::File { path, .. } if path.ends_with("no such lamp.ies")),
        "{error}"
    );
}

#[test]
fn a_lamp_with_its_up_swings_through_straight_down_without_a_turn() {
    use spandrel_engine::light::Receiver;
    use spandrel_engine::light::list::SpotLight;
    let folder = spandrel_tests::program::Scratch::new("a_lamp_swings");
    let path = folder.path().join("quarters.ies");
    // Four quarters of 100, 200, 300 and 400 cd, C0 to C270, alike from nadir to zenith.
    let text = ies(
        "1 -1 1 2 5 1 2 0 0 0 1 1 0\n0 180\n0 90 180 270 360\n100 100 200 200 300 300 400 400 100 100",
    );
    std::fs::write(&path, text).unwrap();
    let file = Some(LampFile(path.to_string_lossy().into_owned()));
    // What lies below and to a side of it receives.
    let lux = |lamp: &dyn MakeLamp, side: DVec3| {
        let lamp = lamp.lamp("", Path::new("")).unwrap();
        let position = v(0.0, -1.0, 0.0) + 0.2 * side;
        let at = Receiver { position, normal: -position.normalize() };
        lamp.light.irradiance(&at).luminance() * lamp.strength.luminance()
    };
    let point = |swing: f64, up: Option<DVec3>| PointLight {
        lamp: file.clone(),
        aim: Some(v(swing, -1.0, 0.0)),
        up,
        ..PointLight::default()
    };
    // Down, C0 to +x and C90 to -z; with `up` to -z it stays so through the swing.
    let up = Some(DVec3::NEG_Z);
    let close_to = |a: f32, b: f32| (a - b).abs() < 1e-3 * b;
    for swing in [-0.02, -1e-7, 0.0, 1e-7, 0.02] {
        let [x, z] = [DVec3::X, DVec3::NEG_Z].map(|side| lux(&point(swing, up), side));
        // A swing turns the side seen at 0.2 by its own part of it: 100 cd to a quarter, less what tilts away.
        let most = 100.0 * (swing.abs() as f32 / 0.2) / std::f32::consts::FRAC_PI_2 / 1.04;
        for (seen, still) in [(x, 100.0 / 1.04f32), (z, 200.0 / 1.04)] {
            assert!((seen - still).abs() < 1.1 * most + 1e-3 * still, "{swing}: {x} {z}");
        }
    }
    // Without it there is a turn, which is why there is an `up`.
    assert!(!close_to(lux(&point(-0.02, None), DVec3::X), lux(&point(0.0, None), DVec3::X)));
    let along = PointLight { up: Some(DVec3::Y), ..point(0.0, None) };
    assert_eq!(along.lamp("", Path::new("")).unwrap_err().field, "up");
    // A spot of 180 degrees is that lamp; a narrow one cuts it.
    let spot = |angle: f64, intensity: f64| SpotLight {
        lamp: file.clone(),
        direction: DVec3::NEG_Y,
        angle,
        inner_angle: Some(angle),
        intensity,
        ..SpotLight::default()
    };
    let whole = lux(&point(0.0, None), DVec3::X);
    let open = lux(&spot(180.0, 2.0), DVec3::X);
    assert!(close_to(open, 2.0 * whole), "{open} {whole}");
    assert!(close_to(lux(&spot(20.0, 1.0), DVec3::X), whole), "0.2 to a side is 11 degrees");
    assert_eq!(lux(&spot(5.0, 1.0), DVec3::X), 0.0);
}
