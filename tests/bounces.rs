//! Light that surfaces send on: closed forms, and laws.

use spandrel_engine::image::Image;
use spandrel_tests::graphs::Nodes;
use spandrel_tests::program::Scratch;
use std::path::Path;
use std::sync::Arc;

/// A closed room of 6 x 3 x 4 m of one material, with things in it.
fn room(folder: &Path, material: &str, scale: f64, things: &str) {
    let s = |v: f64| v * scale;
    let scene = format!(
        "Scene(materials: {{ \"m\": ({material}), \"black\": (color: 0) }}, plans: [(name: \"p\", root: (material: \"m\", children: [
            (name: \"room\", shape: Box(size: ({}, {}, {}))),
            {things}
        ]))])",
        s(6.0),
        s(3.0),
        s(4.0)
    );
    std::fs::write(folder.join("room.ron"), scene).unwrap();
}

fn nodes(lights: &str, names: &str, how: &str, scale: f64) -> String {
    let s = |v: f64| v * scale;
    format!(
        "\"eye\": Camera(position: ({}, {}, {}), look_at: (0, {}, {}), field_of_view: 70),
         \"seen\": Scanline(scene: \"room.ron\", camera: \"eye\"), {lights}
         \"lit\": Illuminate(image: \"seen\", lights: [{names}], white: 1, {how}),
         \"picture\": Resolve(image: \"lit\", size: (48, 32), lines: Sloped(2)),",
        s(2.6),
        s(1.4),
        s(1.8),
        s(1.1),
        s(-0.4)
    )
}

fn picture(folder: &Path, nodes: &str) -> Arc<Image> {
    Nodes::new(folder, nodes).picture("picture", None).unwrap().image
}

fn greys(image: &Image) -> Vec<f32> {
    image.pixels().map(|[r, g, b, _]| (r + g + b) / 3.0).collect()
}

const THINGS: &str = "
    (name: \"block\", transform: [TurnY(20), Move(-1, 0, -0.5)], shape: Box(size: (1, 1.2, 0.8))),
    (name: \"ball\", transform: [Move(0.6, 0.5, 0)], shape: Sphere(radius: 0.5, segments: 12)),
    (name: \"rug\", transform: [Move(0.5, 0.004, 0.5)], shape: Polygon(outline: [(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)])),";

/// In an enclosure of one material that glows, everything is as bright: L (1 + r + .. + r^n), and L / (1 - r) in the end.
/// Whatever stands in it.
#[test]
fn the_white_furnace_is_white() {
    let scratch = Scratch::new("bounces-furnace");
    let reflects = 0.6f32;
    let glow = 1.0 / std::f32::consts::PI;
    let material = format!("color: ({reflects}, {reflects}, {reflects}), finish: (glow: {glow})");
    room(scratch.path(), &material, 1.0, THINGS);
    for times in [0, 1, 2, 16] {
        let expected: f32 = (0..=times).map(|k| reflects.powi(k)).sum();
        for gather in ["Records(64)", "Rays(3)"] {
            let how = format!("ambient: 0, bounces: {times}, gather: {gather}");
            let image = picture(scratch.path(), &nodes("", "", &how, 1.0));
            for (i, grey) in greys(&image).into_iter().enumerate() {
                // How light changes as a smooth normal turns is found by samples.
                let off = grey / expected - 1.0;
                let within = if gather == "Rays(3)" { 1e-4 } else { 0.02 };
                assert!(off.abs() < within, "{how}: pixel {i} is {grey}, not {expected}");
            }
        }
    }
}

/// On the floor of a room a window with a uniform sky behind it gives the light of a panel as bright, which has a closed
/// form: however small a part of the sky is seen.
#[test]
fn a_sky_through_a_window_is_a_panel() {
    let scratch = Scratch::new("bounces-window");
    // From above: a room of 6 x 3 x 5 m, open at its top to the camera alone, as the ceiling has no back.
    let wall = |name: &str, outline: &str| {
        format!("(name: \"{name}\", shape: Polygon(outline: [{outline}])),")
    };
    let pieces = [
        wall("floor", "(-3, 0, 0), (3, 0, 0), (3, 0, -5), (-3, 0, -5)"),
        wall("ceiling", "(-3, 3, 0), (-3, 3, -5), (3, 3, -5), (3, 3, 0)"),
        wall("right", "(3, 0, 0), (3, 3, 0), (3, 3, -5), (3, 0, -5)"),
        wall("back", "(-3, 0, -5), (3, 0, -5), (3, 3, -5), (-3, 3, -5)"),
        wall("front", "(-3, 0, 0), (-3, 3, 0), (3, 3, 0), (3, 0, 0)"),
        wall("under", "(-3, 0, 0), (-3, 0, -5), (-3, 1, -5), (-3, 1, 0)"),
        wall("over", "(-3, 2, 0), (-3, 2, -5), (-3, 3, -5), (-3, 3, 0)"),
        wall("before", "(-3, 1, 0), (-3, 1, -2), (-3, 2, -2), (-3, 2, 0)"),
        wall("behind", "(-3, 1, -3), (-3, 1, -5), (-3, 2, -5), (-3, 2, -3)"),
    ];
    let scene = format!(
        "Scene(materials: {{ \"m\": (color: 1, one_sided: true) }}, plans: [(name: \"p\", root: (material: \"m\", children: [{}]))])",
        pieces.concat()
    );
    std::fs::write(scratch.path().join("room.ron"), scene).unwrap();
    let graph = |light: &str, how: &str| {
        format!(
            "\"eye\": Camera(position: (0, 9, -2.5), look_at: (0, 0, -2.5), up: (0, 0, -1), parallel_height: 4.9),
             \"seen\": Scanline(scene: \"room.ron\", camera: \"eye\"), \"light\": {light},
             \"lit\": Illuminate(image: \"seen\", lights: [\"light\"], white: 1, ambient: 0, {how}),
             \"picture\": Resolve(image: \"lit\", size: (144, 120), lines: Sampled(1, Box)),"
        )
    };
    let panel =
        "AreaLight(outline: [(-3, 1, -2), (-3, 1, -3), (-3, 2, -3), (-3, 2, -2)], luminance: 1)";
    let sky = format!("SkyLight(model: Uniform, illuminance: {})", std::f64::consts::PI);
    let expected = greys(&picture(scratch.path(), &graph(panel, "shadows: Off")));
    // Twenty squares of three by three pixels, half a metre from the walls and more.
    let square = |greys: &[f32], x: usize, y: usize| -> f32 {
        let places = (y - 1..y + 2).flat_map(|y| (x - 1..x + 2).map(move |x| y * 144 + x));
        places.map(|i| greys[i]).sum()
    };
    for (rays, [mean_within, worst_within]) in [(64, [0.02, 0.08]), (256, [0.015, 0.05])] {
        let how = format!("shadows: Volumes, gather: Records({rays})");
        let found = greys(&picture(scratch.path(), &graph(&sky, &how)));
        let (mut sum, mut worst) = (0.0f32, 0.0f32);
        for (x, y) in (0..20).map(|k| (16 + 25 * (k % 5), 16 + 28 * (k / 5))) {
            let off = (square(&found, x, y) / square(&expected, x, y) - 1.0).abs();
            (sum, worst) = (sum + off, worst.max(off));
        }
        let mean = sum / 20.0;
        let is_right = mean < mean_within && worst < worst_within;
        assert!(is_right, "{how}: {mean} in the mean, {worst} at worst");
    }
}

/// What a wall receives of a floor that is lit evenly is what it receives of a panel as bright, which has a closed form;
/// and light goes on no further than it is told to.
#[test]
fn a_wall_receives_of_a_floor_what_it_does_of_a_panel() {
    let scratch = Scratch::new("bounces-panel");
    let scene = "Scene(materials: { \"floor\": (color: (0.8, 0.5, 0.2)), \"wall\": (color: 1) }, plans: [(name: \"p\", root: (children: [
        (name: \"floor\", material: \"floor\", shape: Polygon(outline: [(-1, 0, 0.5), (-1, 0, 3), (1, 0, 3), (1, 0, 0.5)])),
        (name: \"wall\", material: \"wall\", shape: Polygon(outline: [(-1, 0.2, 0), (1, 0.2, 0), (1, 2, 0), (-1, 2, 0)])),
    ]))])";
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    // The light comes straight down, so that the wall has none of its own.
    let graph = |lights: &str, scene: &str, how: &str, rows: u32| {
        let columns = rows / 9 * 10;
        format!(
            "\"eye\": Camera(position: (0, 1.1, 8), look_at: (0, 1.1, 0), parallel_height: 1.8),
             \"both\": ReadScene(file: \"s.ron\", objects: [{scene}]), \"seen\": Scanline(scene: \"both\", camera: \"eye\"),
             {lights}
             \"lit\": Illuminate(image: \"seen\", lights: [\"light\"], white: 1, ambient: 0, {how}),
             \"picture\": Resolve(image: \"lit\", size: ({columns}, {rows}), lines: Sampled(1, Box)),"
        )
    };
    // Of the floor: albedo times illuminance, divided by pi, is its luminance.
    let panel = "\"light\": AreaLight(outline: [(-1, 0, 0.5), (-1, 0, 3), (1, 0, 3), (1, 0, 0.5)], luminance: 0.31830988618),";
    let sun = "\"light\": ParallelLight(direction: (0, -1, 0), illuminance: 1),";
    // Records are as fine as pixels ask for.
    for (gather, rms, worst, rows) in
        [("Rays(1024)", 0.02, 0.12, 36), ("Records(4096)", 0.02, 0.05, 72)]
    {
        let expected = graph(panel, "\"wall\"", "shadows: Off", rows);
        let expected = picture(scratch.path(), &expected);
        let columns = rows / 9 * 10;
        for times in [1, 3] {
            let how = format!("bounces: {times}, gather: {gather}");
            let image = picture(scratch.path(), &graph(sun, "\"floor\", \"wall\"", &how, rows));
            let (mut squares, mut count) = (0.0f64, 0.0);
            for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
                let (found, known) = (image.rgba(x, y), expected.rgba(x, y));
                for (channel, albedo) in [0.8, 0.5, 0.2].into_iter().enumerate() {
                    // What goes back to the floor and to the wall again is little, and more than none.
                    let off = f64::from(found[channel] / (known[channel] * albedo) - 1.0);
                    let more = if times == 3 { 0.1 * f64::from(albedo) } else { 0.0 };
                    assert!(off > -worst && off < worst + more, "{how}: {x}, {y}: {off}");
                    squares += off * off;
                    count += 1.0;
                }
            }
            let off = (squares / count).sqrt();
            assert!(times == 3 || off < rms, "{how}: {off}");
        }
    }
}

/// Lights add up, each with what of it is reflected: their layers are the picture, and a light dimmed and coloured
/// afterwards is its layer dimmed and coloured.
#[test]
fn each_light_keeps_what_is_reflected_of_it() {
    let scratch = Scratch::new("bounces-layers");
    room(scratch.path(), "color: (0.7, 0.5, 0.4)", 1.0, THINGS);
    let lights = |strength: &str| {
        format!(
            "\"lamp\": PointLight(position: (-0.5, 2.5, 0.6), intensity: 2 {strength}),
             \"panel\": AreaLight(outline: [(1, 2.9, -1), (2, 2.9, -1), (2, 2.9, 0), (1, 2.9, 0)], luminance: 1.5),"
        )
    };
    let names = "\"lamp\", \"panel\"";
    let graph = |strength: &str| {
        let how = "bounces: 3, gather: Records(64), samples: 4";
        nodes(&lights(strength), names, how, 1.0)
    };
    let write =
        "\"file\": Write(image: \"picture\", path: \"p.exr\", channels: [Color, Light], bits: 32),";
    let text = format!("Graph(nodes: {{ {} {write} }})", graph(""));
    std::fs::write(scratch.path().join("g.ron"), text).unwrap();
    let program = env!("CARGO_BIN_EXE_spandrel-under-test");
    let ran = spandrel_tests::program::run(program, &["render", "g.ron"], scratch.path());
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let image = spandrel_engine::image::file::read(&scratch.path().join("p.exr")).unwrap();
    let layer =
        |name: &str, channel: &str| image.float(&format!("{name}.{channel}")).unwrap().to_vec();
    let dimmed = picture(scratch.path(), &graph(", color: (0.25, 0.5, 2)"));
    let whole: Vec<[f32; 4]> = image.pixels().collect();
    for (at, channel) in ["R", "G", "B"].into_iter().enumerate() {
        let [lamp, panel, rest] =
            ["light_lamp", "light_panel", "rest"].map(|name| layer(name, channel));
        for (i, pixel) in dimmed.pixels().enumerate() {
            let sum = lamp[i] + panel[i] + rest[i];
            assert!((sum - whole[i][at]).abs() < 1e-5 * sum.max(1.0), "{channel}, {i}");
            let expected = lamp[i] * [0.25, 0.5, 2.0][at] + panel[i] + rest[i];
            assert!(
                (pixel[at] - expected).abs() < 1e-4 * expected.max(1.0),
                "{channel}, {i}: {pixel:?}"
            );
        }
        // No corner of a closed room is dark.
        assert!(lamp.iter().all(|lamp| *lamp > 0.0));
    }
}

/// Nothing comes through a wall, at any scale: a dark room beside a bright one, with records on both sides of a thin wall
/// and on a floor that goes through below it.
#[test]
fn nothing_comes_through_a_closed_wall() {
    for scale in [1e-3, 1.0, 1e3] {
        let scratch = Scratch::new("bounces-wall");
        let s = |v: f64| v * scale;
        let wall = format!(
            "(name: \"wall\", transform: [Move({}, 0, 0)], shape: Box(size: ({}, {}, {}))),",
            s(0.4),
            s(0.02),
            s(3.0),
            s(4.0)
        );
        room(scratch.path(), "color: 0.8", scale, &wall);
        let lamp = format!(
            "\"lamp\": PointLight(position: ({}, {}, 0), intensity: {}),",
            s(-1.5),
            s(1.5),
            10.0 * scale * scale
        );
        for gather in ["Records(64)", "Rays(16)"] {
            let how = format!("ambient: 0, bounces: 3, gather: {gather}");
            let image = picture(scratch.path(), &nodes(&lamp, "\"lamp\"", &how, scale));
            // What is left of sharp shadows by rounding.
            assert!(greys(&image).iter().all(|grey| *grey < 1e-6), "{how} at {scale}");
        }
        let lamp = lamp
            .replace(&format!("{}, {}, 0", s(-1.5), s(1.5)), &format!("{}, {}, 0", s(1.5), s(1.5)));
        let how = "ambient: 0, bounces: 3, gather: Records(64)";
        let image = picture(scratch.path(), &nodes(&lamp, "\"lamp\"", how, scale));
        assert!(greys(&image).iter().all(|grey| *grey > 0.05), "at {scale}");
    }
}

/// The same bits on any number of threads, and whoever is asked first.
#[test]
fn records_are_the_same_whoever_asks_first() {
    let scratch = Scratch::new("bounces-threads");
    room(scratch.path(), "color: (0.7, 0.5, 0.4)", 1.0, THINGS);
    let lights = "\"lamp\": PointLight(position: (-0.5, 2.5, 0.6), intensity: 2), \"sky\": SkyLight(illuminance: 1),";
    let graph = nodes(lights, "\"lamp\", \"sky\"", "bounces: 2, gather: Records(32)", 1.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| picture(scratch.path(), &graph))
    };
    let expected: Vec<[f32; 4]> = on(1).pixels().collect();
    assert!(on(4).pixels().eq(expected.iter().copied()));
    // A part of the picture alone.
    let window = spandrel_engine::image::Window { x: 20, y: 12, width: 9, height: 7 };
    let part = Nodes::new(scratch.path(), &graph).picture("picture", Some(window)).unwrap().image;
    let places = (12..19).flat_map(|y| (20..29).map(move |x| y * 48 + x));
    assert!(part.pixels().eq(places.map(|at| expected[at])));
}

/// Light that comes back never exceeds what was sent: of a closed room with a lamp, what all surfaces receive in the end
/// is the lamp's flux divided by what they take away.
#[test]
fn energy_is_kept_in_a_ball() {
    let scratch = Scratch::new("bounces-ball");
    let reflects = 0.5;
    let scene = format!(
        "Scene(materials: {{ \"m\": (color: ({reflects}, {reflects}, {reflects})) }}, plans: [(name: \"p\", root: (material: \"m\",
            shape: Sphere(radius: 1, segments: 48)))])"
    );
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    let graph = "\"eye\": Camera(position: (0, 0, 0.5), look_at: (0, 0, -1), field_of_view: 90),
        \"seen\": Scanline(scene: \"s.ron\", camera: \"eye\"), \"lamp\": PointLight(position: (0, 0, 0), intensity: 1),
        \"lit\": Illuminate(image: \"seen\", lights: [\"lamp\"], white: 1, ambient: 0, bounces: 24, gather: Records(64)),
        \"picture\": Resolve(image: \"lit\", size: (24, 16), lines: Sampled(2, Box)),";
    let image = picture(scratch.path(), graph);
    let mean = greys(&image).iter().map(|v| f64::from(*v)).sum::<f64>() / (24.0 * 16.0);
    // E0 / (1 - r) with E0 = 1 lx, shown by the reflectance; facets lie a little nearer.
    let expected = reflects / (1.0 - reflects);
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean}, not {expected}");
}

/// Two parts of one file have one name, and faces of the same numbers: each is lit where it stands.
#[test]
fn parts_of_one_scene_are_lit_where_they_stand() {
    let scratch = Scratch::new("bounces-parts");
    let scene = "Scene(materials: { \"m\": (color: 0.8), \"glow\": (color: 0, finish: (glow: 2)) }, plans: [(name: \"p\", root: (material: \"m\", children: [
        (name: \"near\", transform: [Move(-1.5, 0, 0)], shape: Sphere(radius: 0.6, segments: 32)),
        (name: \"far\", transform: [Move(1.5, 0, 0)], shape: Sphere(radius: 0.6, segments: 32)),
        (name: \"panel\", material: \"glow\", shape: Polygon(outline: [(-3, -1, -1), (-3, 1, -1), (-3, 1, 1), (-3, -1, 1)])),
    ]))])";
    std::fs::write(scratch.path().join("s.ron"), scene).unwrap();
    let after = "\"lit\": Illuminate(image: \"all\", lights: [], white: 1, ambient: 0, bounces: 1, gather: Records(256)),
         \"picture\": Resolve(image: \"lit\", size: (96, 48)),";
    let eye = "\"eye\": Camera(position: (0, 0, 9), look_at: (0, 0, 0), parallel_height: 2.4),";
    let whole = format!("{eye} \"all\": Scanline(scene: \"s.ron\", camera: \"eye\"), {after}");
    let parted = format!(
        "{eye} \"a\": ReadScene(file: \"s.ron\", objects: [\"near\", \"panel\"]), \"b\": ReadScene(file: \"s.ron\", objects: [\"far\"]),
         \"first\": Scanline(scene: \"a\", camera: \"eye\"), \"second\": Scanline(scene: \"b\", camera: \"eye\"),
         \"all\": DepthMerge(inputs: [\"first\", \"second\"]), {after}"
    );
    let [whole, parted] = [whole, parted].map(|nodes| greys(&picture(scratch.path(), &nodes)));
    let of = |all: &[f32], side: usize| {
        let on_side = all.iter().enumerate().filter(|(i, _)| i % 96 / 48 == side);
        on_side.map(|(_, grey)| *grey).sum::<f32>()
    };
    for side in [0, 1] {
        let [expected, found] = [&whole, &parted].map(|all| of(all, side));
        assert!(expected > 0.1, "side {side} is dark");
        assert!((found / expected - 1.0).abs() < 0.02, "side {side}: {found}, not {expected}");
    }
}
