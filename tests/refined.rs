//! Local processing and shading rates: what is computed anew equals the whole computed anew, and the dial of
//! shading turns the way it says.

use glam::DVec2;
use spandrel_engine::color::Color;
use spandrel_engine::fragment::Optics;
use spandrel_engine::image::{Channel, Image, Window};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::point::{Beam, Point};
use spandrel_engine::render::scanline;
use spandrel_engine::resolve::{Framing, PixelFilter, Rate, Rule, Select, refine, resolve};
use spandrel_engine::scene::Scene;
use spandrel_engine::shade::{Illuminate, Shadows, Trace};
use spandrel_engine::span::SpanImage;
use spandrel_engine::trace::Accelerator;
use spandrel_tests::lights::illuminate;
use spandrel_tests::scenes::{front_view, polygons, random_faces, random_panes, scene};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const RULE: Rule = Rule::Sloped(4);

/// Three scenes, of which the first mirrors and the second is translucent.
fn image() -> SpanImage {
    let mirror = Some(Optics { reflect: Color::grey(0.6), fresnel: false, ..Optics::default() });
    let mut scenes =
        [random_faces(3, 8), random_panes(4, 8), random_faces(5, 20)].map(|mesh| scene("", mesh));
    for (at, label) in ["mirrors", "panes", "rest"].into_iter().enumerate() {
        let mut named = Scene::clone(&scenes[at]);
        named.label = label.to_owned();
        if at == 0 {
            named.materials.iter_mut().for_each(|m| m.finish.optics = mirror);
        }
        scenes[at] = Arc::new(named);
    }
    let view = front_view(90, 60);
    let plan = RULE.plan().unwrap();
    let parts = scenes.map(|scene| scanline::render(&[scene.into()], &view, plan, 0..60).unwrap());
    SpanImage::merge(&parts).unwrap()
}

fn bulb() -> Lamp {
    let light = Point { position: glam::dvec3(1.0, 3.0, 4.0), beam: Beam::All };
    Lamp::new("bulb", true, Color::grey(20.0), Arc::new(light))
}

fn lit(image: &SpanImage, shadows: Shadows) -> SpanImage {
    let light = illuminate(vec![bulb()], Color::grey(0.1), Color::grey(0.1));
    image.shaded(Arc::new(Illuminate { shadows, ..light })).unwrap()
}

fn traced(image: &SpanImage, rays: u32) -> SpanImage {
    let accelerator = Accelerator::Tree;
    let trace =
        Trace { rays, depth: 3, least: 1e-3, background: Color::WHITE, sky: None, accelerator };
    image.shaded(Arc::new(trace)).unwrap()
}

fn channels() -> BTreeSet<Channel> {
    BTreeSet::from([Channel::Color, Channel::Z, Channel::Id, Channel::Light])
}

fn framing(image: &SpanImage) -> Framing {
    Framing::scaled(image.view().raster(), DVec2::ONE).unwrap()
}

fn picture(image: &SpanImage) -> Image {
    resolve(image, RULE, &framing(image), &channels()).unwrap()
}

fn refined(over: &Image, image: &SpanImage, select: &Select) -> (Image, u64) {
    refine(over, image, RULE, &framing(image), &channels(), select).unwrap()
}

fn same(a: &Image, b: &Image) -> bool {
    a.channels().eq(b.channels())
}

#[test]
fn mirrors_refined_over_a_rough_picture_are_those_of_a_fine_one() {
    let lit = lit(&image(), Shadows::Rays(1));
    let (rough, fine) = (picture(&traced(&lit, 1)), picture(&traced(&lit, 9)));
    assert!(!same(&rough, &fine));
    // From an image that nobody has shaded before.
    let again = self::lit(&image(), Shadows::Rays(1));
    let (refined, pixels) = refined(&rough, &traced(&again, 9), &Select::Traced);
    assert!(same(&refined, &fine));
    assert!(pixels > 200 && pixels < 90 * 60 * 2 / 3, "{pixels}");
}

#[test]
fn pictures_may_be_filtered_and_moved_before_they_are_refined() {
    let lit = lit(&image(), Shadows::Rays(1));
    let framings = [PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::Lanczos].map(|filter| {
        let moved = DVec2::new(2.25, -1.5);
        Framing { filter, pan: moved, ..framing(&lit) }
    });
    for framing in framings {
        let [rough, fine] =
            [1, 9].map(|rays| resolve(&traced(&lit, rays), RULE, &framing, &channels()).unwrap());
        let image = traced(&lit, 9);
        let (made, _) =
            refine(&rough, &image, RULE, &framing, &channels(), &Select::Traced).unwrap();
        assert!(!same(&rough, &fine));
        assert!(same(&made, &fine), "{:?}", framing.filter);
    }
}

#[test]
fn what_is_selected_changes_and_nothing_else() {
    let (rough, fine) = (lit(&image(), Shadows::Off), lit(&image(), Shadows::Volumes));
    let (over, whole) = (picture(&rough), picture(&fine));
    let numbers = (0..4).collect();
    let selections = [
        Select::Objects(vec!["panes*".into()]),
        Select::Objects(vec!["*irrors/*".into(), "none".into()]),
        Select::Faces(BTreeMap::from([("rest".to_owned(), numbers)])),
        Select::Region(20, 10, 31, 22),
        Select::Objects(vec!["*".into()]),
        Select::Objects(vec![]),
    ];
    let ids = |image: &Image| match image.channel("id") {
        Some(spandrel_engine::image::Samples::Id(ids)) => ids.clone(),
        _ => Vec::new(),
    };
    for select in &selections {
        let (made, pixels) = refined(&over, &fine, select);
        let (old, new) = (over.float("R").unwrap(), whole.float("R").unwrap());
        let mut changed = 0;
        for (at, value) in made.float("R").unwrap().iter().enumerate() {
            let (x, y) = (at as u32 % 90, at as u32 / 90);
            assert!(*value == old[at] || *value == new[at], "{select:?} at {x}, {y}");
            changed += u64::from(*value != old[at]);
            let is_selected = match select {
                Select::Region(..) => (20..51).contains(&x) && (10..32).contains(&y),
                Select::Objects(names) if names == &["*"] => true,
                Select::Objects(names) if names.is_empty() => false,
                _ => continue,
            };
            assert_eq!(*value, if is_selected { new[at] } else { old[at] }, "{select:?}");
        }
        assert!(changed <= pixels);
        assert_eq!(changed == 0, *select == Select::Objects(vec![]), "{select:?}");
        // Where the object covers most of a pixel, the pixel is new.
        if let Select::Objects(names) = select
            && names.len() == 1
            && names[0] == "panes*"
        {
            let of_panes = |id: &u32| made.names.get(id).is_some_and(|n| n.starts_with("panes"));
            for (at, id) in ids(&whole).iter().enumerate().filter(|(_, id)| of_panes(id)) {
                assert_eq!(made.float("R").unwrap()[at], new[at], "{id}");
            }
        }
        assert_eq!(ids(&made), ids(&whole));
    }
}

#[test]
fn layers_sum_to_the_refined_picture_whatever_lights_it_has() {
    let image = image();
    let named = |names: &[&str]| {
        let lamps =
            names.iter().map(|name| Lamp::new(*name, true, Color::grey(20.0), bulb().light));
        let light = illuminate(lamps.collect(), Color::BLACK, Color::BLACK);
        image.shaded(Arc::new(light)).unwrap()
    };
    for [old, new] in [[&["a", "b"][..], &["a"]], [&["a"], &["a", "c"]], [&[], &["a"]]] {
        let over = picture(&named(old));
        let (made, _) = refined(&over, &named(new), &Select::Region(20, 10, 31, 22));
        let red = made.float("R").unwrap();
        let of_layers = |name: &&str| {
            name.ends_with(".R") && (name.starts_with("light_") || name.starts_with("rest"))
        };
        let names: Vec<&str> = made.channels().map(|(name, _)| name).filter(of_layers).collect();
        for (at, red) in red.iter().enumerate() {
            let sum: f32 = names.iter().map(|name| made.float(name).unwrap()[at]).sum();
            assert!((sum - red).abs() < 1e-5, "{old:?} {new:?} {at}: {sum} {red} of {names:?}");
        }
    }
}

#[test]
fn pictures_that_are_not_alike_are_refused() {
    let image = lit(&image(), Shadows::Off);
    let whole = framing(&image);
    let moved = Framing { pan: DVec2::new(1.0, 0.0), ..whole.clone() };
    let over = resolve(&image, RULE, &moved, &channels()).unwrap();
    let error = refine(&over, &image, RULE, &whole, &channels(), &Select::Traced).unwrap_err();
    let error = error.to_string();
    assert!(error.contains("pan (1, 0)") && error.contains("pan (0, 0)"), "{error}");
    let part = whole.clone().cut(Window { x: 3, y: 4, width: 20, height: 10 }).unwrap();
    let over = picture(&image);
    let select = Select::Traced;
    let error = refine(&over, &image, RULE, &part, &channels(), &select).unwrap_err().to_string();
    assert!(error.contains("20 by 10 at 3, 4") && error.contains("90 by 60 at 0, 0"), "{error}");
    let color = BTreeSet::from([Channel::Color]);
    let over = resolve(&image, RULE, &whole, &color).unwrap();
    let error = refine(&over, &image, RULE, &whole, &channels(), &select).unwrap_err().to_string();
    assert!(error.contains("has no channel"), "{error}");
}

#[test]
fn faces_shaded_more_often_are_nearer_to_the_truth() {
    // A floor under a lamp that hangs low, seen along it: light differs within pixels.
    let floor = glam::dvec3(0.0, -1.0, 0.0);
    let at = |x: f64, z: f64| floor + glam::dvec3(x, 0.0, z);
    let quads: Vec<_> = (-3..3)
        .flat_map(|i| (-3..3).map(move |j| (2.0 * f64::from(i), 2.0 * f64::from(j))))
        .map(|(x, z)| vec![at(x, z + 2.0), at(x + 2.0, z + 2.0), at(x + 2.0, z), at(x, z)])
        .collect();
    let light = Point { position: glam::dvec3(0.2, -0.4, 0.3), beam: Beam::All };
    let lamp = Lamp::new("low", true, Color::grey(1.0), Arc::new(light));
    let light = illuminate(vec![lamp], Color::BLACK, Color::BLACK);
    let shown = |factor: u32, shading: Rate| {
        let view = front_view(40 * factor, 30 * factor);
        let plan = RULE.plan().unwrap();
        let floor = scene("floor", polygons(&quads));
        let image = scanline::render(&[floor.into()], &view, plan, 0..30 * factor).unwrap();
        let image = image.shaded(Arc::new(light.clone())).unwrap();
        let framing = Framing { shading, ..framing(&image) };
        let color = BTreeSet::from([Channel::Color]);
        resolve(&image, RULE, &framing, &color).unwrap().float("R").unwrap().to_vec()
    };
    // The mean of 32 by 32 pixels for each.
    let fine = shown(32, Rate::Pixel);
    let truth = |x: usize, y: usize| {
        let rows = (0..32).map(|i| &fine[(y * 32 + i) * 40 * 32 + x * 32..][..32]);
        rows.map(|row| row.iter().map(|v| f64::from(*v)).sum::<f64>()).sum::<f64>() / 1024.0
    };
    let error = |rate: Rate| {
        let values = shown(1, rate);
        let squares = (0..1200).map(|at| {
            let d = f64::from(values[at]) - truth(at % 40, at / 40);
            d * d
        });
        (squares.sum::<f64>() / 1200.0).sqrt()
    };
    let [face, pixel, line] = [Rate::Face, Rate::Pixel, Rate::Line].map(error);
    assert!(face > 1.5 * pixel && pixel > 2.0 * line, "{face} {pixel} {line}");
    assert!(line < 0.002, "{line}");
}
