//! How time, memory and bytes grow: with triangles, lines, rows and clusters; and [N]'s own example.
//!
//! `cargo run --release -p spandrel-tests --example growth -- [OUT.svg]`
//!
//! Every point is measured by a process of its own, so that its peak memory is its own; of three runs the one
//! with the median time counts. "Every pixel" is what a buffer of face and depth for every pixel of every line
//! takes: 8 bytes each.

use serde_json::Value;
use spandrel_engine::image::Channel;
use spandrel_engine::render::scanline::{self, Cluster};
use spandrel_engine::resolve::{Framing, Rule, Weighting, resolve};
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::{self, Options};
use spandrel_tests::town;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::time::Instant;

const RUNS: usize = 3;

/// A number of a measurement by its name.
type Field<'f> = &'f dyn Fn(&str) -> f64;

/// What is measured.
#[derive(Clone, Copy)]
struct Case {
    triangles: usize,
    n: u32,
    height: u32,
    clusters: usize,
}

const USUAL: Case = Case { triangles: 100_000, n: 8, height: 1080, clusters: 1 };

/// What came out, in seconds and bytes.
struct Point {
    x: f64,
    polygons: f64,
    visible: f64,
    visibility: f64,
    merge: f64,
    resolve: f64,
    spans: f64,
    file: f64,
    peak: f64,
    every_pixel: f64,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [mode, rest @ ..] = &arguments[..]
        && mode == "one"
    {
        let number = |i: usize| rest[i].parse::<usize>().expect("a number");
        let case = Case {
            triangles: number(0),
            n: number(1) as u32,
            height: number(2) as u32,
            clusters: number(3),
        };
        println!("{}", one(case, Rule::Sloped(case.n)));
        return;
    }
    if let [mode, triangles] = &arguments[..]
        && mode == "nakamae"
    {
        let case = nakamae(triangles.parse().expect("a number"));
        println!("{}", one(case, Rule::Sampled(case.n, Weighting::Trapezoid)));
        return;
    }
    let triangles = [10_000, 31_600, 100_000, 316_000, 1_000_000];
    let panels = [
        ("triangles", triangles.map(|triangles| (triangles, Case { triangles, ..USUAL })).to_vec()),
        (
            "lines per row",
            [1, 2, 4, 8, 16, 32].map(|n| (n, Case { n: n as u32, ..USUAL })).to_vec(),
        ),
        (
            "rows",
            [135, 270, 540, 1080, 2160].map(|h| (h, Case { height: h as u32, ..USUAL })).to_vec(),
        ),
        (
            "clusters",
            [1, 2, 4, 8, 16].map(|clusters| (clusters, Case { clusters, ..USUAL })).to_vec(),
        ),
    ];
    let mut all = Vec::new();
    for (name, cases) in panels {
        println!(
            "\n| {name} | polygons | seen | visibility | merge | resolve | spans in memory | file | every pixel | peak |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|");
        let points: Vec<Point> = cases.iter().map(|(x, case)| point(*x, *case)).collect();
        for p in &points {
            let [visibility, merge, resolve] = [p.visibility, p.merge, p.resolve].map(|t| t * 1e3);
            let [spans, file, every, peak] =
                [p.spans, p.file, p.every_pixel, p.peak].map(|b| b / 1e6);
            println!(
                "| {} | {} | {} | {visibility:.0} ms | {merge:.0} ms | {resolve:.0} ms | {spans:.1} MB | {file:.2} MB | {every:.0} MB | {peak:.0} MB |",
                p.x, p.polygons, p.visible
            );
        }
        all.push((name, points));
    }
    let [few, many] =
        NAKAMAE.map(|triangles| child(&["nakamae".to_owned(), triangles.to_string()]));
    println!("\n| | [N], 1989 | as many polygons | as many faces seen |\n|---|---|---|---|");
    let row = |name: &str, theirs: &str, text: &dyn Fn(Field<'_>) -> String| {
        let [few, many] =
            [&few, &many].map(|run| text(&|name| run[name].as_f64().unwrap_or_default()));
        println!("| {name} | {theirs} | {few} | {many} |");
    };
    row("polygons, faces seen", "870, 2359", &|v| format!("{}, {}", v("polygons"), v("visible")));
    row("spans of a cluster", "353 kB", &|v| {
        format!("{:.1} kB as a file, {:.0} kB in memory", v("file") / 4e3, v("spans") / 4e3)
    });
    row("time of a cluster", "2.8 min", &|v| format!("{:.2} ms", v("visibility") / 4.0 * 1e3));
    row("merge and resolve", "26.8 min, with ray tracing", &|v| {
        format!("{:.2} ms", (v("merge") + v("resolve")) * 1e3)
    });
    if let Some(path) = arguments.first() {
        std::fs::write(path, plots(&all)).expect("the file can be written");
    }
}

/// Triangles of towns with as many polygons as [N]'s example has, and with as many faces that are seen.
const NAKAMAE: [usize; 2] = [1_850, 56_000];

/// [N]'s example; the size of its picture is not said.
fn nakamae(triangles: usize) -> Case {
    Case { triangles, n: 3, height: 480, clusters: 4 }
}

/// Measures a case in this process.
fn one(case: Case, rule: Rule) -> Value {
    let width = if case.height == 480 { 640 } else { case.height * 16 / 9 };
    let view = town::view(width, case.height);
    let plan = rule.plan().expect("n is in range");
    let scenes = town::clusters(case.triangles, case.clusters);
    let polygons: usize = scenes.iter().map(|scene| scene.face_count()).sum();
    let clock = Instant::now();
    let render = |scene| {
        scanline::render(&[Cluster::from(scene)], &view, plan, 0..case.height)
            .expect("towns render")
    };
    let images: Vec<SpanImage> = scenes.into_iter().map(render).collect();
    let visibility = clock.elapsed().as_secs_f64();
    let spans: usize =
        images.iter().map(|image| image.lines().bytes() + image.layers().bytes()).sum();
    let folder = std::env::temp_dir().join(format!("spandrel-growth-{}", std::process::id()));
    let mut file = 0;
    for (i, image) in images.iter().enumerate() {
        let path = folder.join(format!("{i}.span"));
        file +=
            span_file::write(image, &path, Options::default()).expect("files can be written").bytes;
    }
    let _ = std::fs::remove_dir_all(&folder);
    let clock = Instant::now();
    let merged = SpanImage::merge(&images).expect("clusters of one view merge");
    let merge = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let framing = Framing::whole(view.raster());
    resolve(&merged, rule, &framing, &BTreeSet::from([Channel::Color])).expect("towns resolve");
    let resolve = clock.elapsed().as_secs_f64();
    let lines = plan.lines(&(0..case.height)).len();
    serde_json::json!({
        "polygons": polygons,
        "visible": merged.pruned().expect("an image can be pruned").face_count(),
        "visibility": visibility,
        "merge": merge,
        "resolve": resolve,
        "spans": spans,
        "file": file,
        "peak": peak(),
        "every_pixel": lines as u64 * u64::from(width) * 8,
    })
}

/// The most memory that this process has held, where the system tells.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    let kilobytes =
        line.and_then(|line| line.split_whitespace().nth(1)).and_then(|n| n.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}

fn child(arguments: &[String]) -> Value {
    let program = std::env::current_exe().expect("this program is a file");
    let mut runs: Vec<Value> = (0..RUNS)
        .map(|_| {
            let output = std::process::Command::new(&program).args(arguments).output();
            let output = output.expect("this program can be run");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            serde_json::from_slice(&output.stdout).expect("it prints JSON")
        })
        .collect();
    let time = |run: &Value| {
        ["visibility", "merge", "resolve"].iter().filter_map(|part| run[part].as_f64()).sum::<f64>()
    };
    runs.sort_by(|a, b| time(a).total_cmp(&time(b)));
    runs.swap_remove(RUNS / 2)
}

fn point(x: usize, case: Case) -> Point {
    let numbers = [case.triangles, case.n as usize, case.height as usize, case.clusters];
    let arguments: Vec<String> =
        std::iter::once("one".to_owned()).chain(numbers.map(|n| n.to_string())).collect();
    let run = child(&arguments);
    let number = |name: &str| run[name].as_f64().unwrap_or_default();
    Point {
        x: x as f64,
        polygons: number("polygons"),
        visible: number("visible"),
        visibility: number("visibility"),
        merge: number("merge"),
        resolve: number("resolve"),
        spans: number("spans"),
        file: number("file"),
        peak: number("peak"),
        every_pixel: number("every_pixel"),
    }
}

type Series = (&'static str, &'static str, fn(&Point) -> f64);

/// Two rows of panels, time above bytes, both axes by powers.
fn plots(all: &[(&str, Vec<Point>)]) -> String {
    let times: [Series; 3] = [
        ("visibility", "#0072b2", |p| p.visibility * 1e3),
        ("merge", "#009e73", |p| p.merge * 1e3),
        ("resolve", "#d55e00", |p| p.resolve * 1e3),
    ];
    let bytes: [Series; 4] = [
        ("every pixel", "#999999", |p| p.every_pixel / 1e6),
        ("peak memory", "#cc79a7", |p| p.peak / 1e6),
        ("spans in memory", "#0072b2", |p| p.spans / 1e6),
        ("span file", "#d55e00", |p| p.file / 1e6),
    ];
    let (panel, gap, left, top) = (210.0, 42.0, 56.0, 30.0);
    let width = left + all.len() as f64 * (panel + gap) + 90.0;
    let height = top + 2.0 * (panel + 60.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"system-ui, sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    for (row, (unit, series)) in [("ms", &times[..]), ("MB", &bytes[..])].into_iter().enumerate() {
        let y0 = top + row as f64 * (panel + 60.0);
        let values = all
            .iter()
            .flat_map(|(_, points)| points.iter().flat_map(|p| series.iter().map(|s| s.2(p))));
        let (low, high) = values
            .filter(|v| *v > 0.1)
            .fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = (low.log10().floor(), high.log10().ceil());
        let y = |v: f64| {
            y0 + panel * (1.0 - (v.max(1e-3).log10() - low) / (high - low)).clamp(0.0, 1.0)
        };
        for (column, (name, points)) in all.iter().enumerate() {
            let x0 = left + column as f64 * (panel + gap);
            let (first, last) = (points[0].x.log10(), points[points.len() - 1].x.log10());
            let x = |v: f64| x0 + panel * (v.log10() - first) / (last - first);
            let _ = writeln!(
                svg,
                "<rect x=\"{x0}\" y=\"{y0}\" width=\"{panel}\" height=\"{panel}\" fill=\"none\" stroke=\"#ccc\"/>"
            );
            for power in low as i32..=high as i32 {
                let at = y(10f64.powi(power));
                let _ = writeln!(
                    svg,
                    "<line x1=\"{x0}\" x2=\"{}\" y1=\"{at}\" y2=\"{at}\" stroke=\"#eee\"/>",
                    x0 + panel
                );
                if column == 0 {
                    let text = 10f64.powi(power);
                    let _ = writeln!(
                        svg,
                        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\" fill=\"#555\">{text} {unit}</text>",
                        x0 - 5.0,
                        at + 4.0
                    );
                }
            }
            for point in points {
                let text = if point.x >= 10_000.0 {
                    format!("{:.0}k", point.x / 1e3)
                } else {
                    point.x.to_string()
                };
                let _ = writeln!(
                    svg,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#555\">{text}</text>",
                    x(point.x),
                    y0 + panel + 14.0
                );
            }
            let _ = writeln!(
                svg,
                "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#222\">{name}</text>",
                x0 + panel / 2.0,
                y0 + panel + 30.0
            );
            // What grows as x does, as far as it stays in the panel.
            let (first, last) = (&points[0], &points[points.len() - 1]);
            let from = series[0].2(first);
            let raw = |v: f64| panel * (1.0 - (v.log10() - low) / (high - low));
            let to = raw(from * last.x / first.x);
            let _ = writeln!(
                svg,
                "<svg x=\"{x0}\" y=\"{y0}\" width=\"{panel}\" height=\"{panel}\"><line x1=\"0\" y1=\"{}\" x2=\"{panel}\" y2=\"{to}\" stroke=\"#bbb\" stroke-dasharray=\"3 3\"/></svg>",
                raw(from)
            );
            let mut labels: Vec<(f64, f64, &str, &str)> = Vec::new();
            for (label, color, value) in series {
                let seen: Vec<&Point> = points.iter().filter(|p| value(p) > 0.1).collect();
                let steps: String =
                    seen.iter().map(|p| format!("{:.1},{:.1} ", x(p.x), y(value(p)))).collect();
                let _ = writeln!(
                    svg,
                    "<polyline points=\"{steps}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>"
                );
                for p in &seen {
                    let _ = writeln!(
                        svg,
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.5\" fill=\"{color}\"/>",
                        x(p.x),
                        y(value(p))
                    );
                }
                if column + 1 == all.len()
                    && let Some(end) = seen.last()
                {
                    labels.push((y(value(end)) + 4.0, x(end.x) + 7.0, label, color));
                }
            }
            labels.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut above = f64::NEG_INFINITY;
            for (at, x, label, color) in labels {
                above = at.max(above + 12.0);
                let _ =
                    writeln!(svg, "<text x=\"{x}\" y=\"{above}\" fill=\"{color}\">{label}</text>");
            }
        }
    }
    let _ = writeln!(
        svg,
        "<text x=\"{left}\" y=\"18\" fill=\"#555\">dashed: in proportion</text>\n</svg>"
    );
    svg
}
