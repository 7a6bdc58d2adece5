//! Prints how far coverage is from closed forms, for every rule and number of lines:
//! `cargo run --release -p spandrel-tests --example accuracy`.

use spandrel_engine::resolve::{Rule, Weighting};
use spandrel_tests::known::{self, Known};

type Make = fn(u32) -> Rule;
type Shape = Box<dyn Fn((f64, f64)) -> Known>;

fn main() {
    let slopes = [0.0, 0.1, 0.37, 1.0, 2.0, 5.0, 13.0, 50.0, -0.6, f64::INFINITY];
    let half = |slope: f64| -> Shape { Box::new(move |offset| known::half_plane(slope, offset)) };
    let mut shapes: Vec<Shape> = slopes.into_iter().map(half).collect();
    shapes.push(Box::new(known::rotated_square));
    shapes.push(Box::new(known::hole));
    shapes.push(Box::new(known::seal));
    shapes.push(Box::new(known::crossing_planes));
    shapes.push(Box::new(known::three_bars));
    let rules: [(&str, Make); 4] = [
        ("trapezoid", |n| Rule::Sampled(n, Weighting::Trapezoid)),
        ("box", |n| Rule::Sampled(n, Weighting::Box)),
        ("sloped", Rule::Sloped),
        ("adaptive .01,", |n| Rule::Adaptive(n, 0.01)),
    ];
    let lines = [1, 4, 8, 16];
    println!("Coverage against closed forms: RMSE over the pixels of edges, 16 offsets each.\n");
    let columns = rules.iter().flat_map(|(name, _)| lines.map(|n| format!("{name} {n}")));
    println!("| shape | {} | exact |", columns.collect::<Vec<_>>().join(" | "));
    println!("|---|{}", "---|".repeat(rules.len() * lines.len() + 1));
    for shape in shapes {
        let shapes: Vec<Known> = known::offsets().into_iter().map(&shape).collect();
        let cell = |rule: Rule| number(known::errors(&shapes, rule).rmse);
        let row = rules.iter().flat_map(|(_, rule)| lines.map(|n| cell(rule(n))));
        let exact = format!("{:.1e}", known::errors(&shapes, Rule::Exact).rmse);
        let row = row.chain([exact]).collect::<Vec<_>>();
        println!("| {} | {} |", shapes[0].name, row.join(" | "));
    }
}

fn number(value: f64) -> String {
    match value {
        v if v < 1e-6 => "0".to_owned(),
        v if v < 5e-5 => "<.0001".to_owned(),
        v => format!("{v:.4}").replacen("0.", ".", 1),
    }
}
