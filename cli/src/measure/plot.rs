//! Error against time, as svg: both axes logarithmic, the best settings joined.

use std::fmt::Write;

use super::{Measured, Measurement};
use crate::print::{self, escape};

const SIZE: (f64, f64) = (860.0, 520.0);
/// Left, top, right and bottom borders.
const BORDER: [f64; 4] = [74.0, 46.0, 26.0, 56.0];
const COLORS: [&str; 6] = ["#3367a3", "#c06a2c", "#4d8a4a", "#8a4d83", "#a33b3b", "#5b6470"];

/// A logarithmic axis.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64> + Clone, from: f64, to: f64) -> Axis {
        let low = values.clone().fold(f64::INFINITY, f64::min).log10();
        let high = values.fold(f64::NEG_INFINITY, f64::max).log10();
        // Without rows any axis will do.
        let (low, high) = if low.is_finite() { (low, high) } else { (-3.0, 0.0) };
        Axis { low: low - 0.12, high: high + 0.12, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let t = (value.log10() - self.low) / (self.high - self.low);
        self.from + (self.to - self.from) * t
    }

    /// 1, 2 and 5 times powers of ten.
    fn ticks(&self) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let all = decades.flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)));
        all.filter(|v| (self.low..=self.high).contains(&v.log10())).collect()
    }
}

/// The plot of a measurement. Settings without any error have no place on it.
pub(crate) fn svg(measurement: &Measurement) -> String {
    let rows: Vec<&Measured> =
        measurement.rows.iter().filter(|row| row.error.rmse > 0.0 && row.seconds > 0.0).collect();
    let [left, top, right, bottom] = BORDER;
    let (width, height) = SIZE;
    let x = Axis::new(rows.iter().map(|row| row.seconds), left, width - right);
    let y = Axis::new(rows.iter().map(|row| row.error.rmse), height - bottom, top);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <text x=\"{left}\" y=\"24\" font-size=\"15\" fill=\"#222\">{}: error against time</text>\n",
        escape(&measurement.graph)
    );
    for tick in x.ticks() {
        let (at, low) = (x.at(tick), height - bottom);
        let _ = writeln!(
            out,
            "<path d=\"M{at:.1} {top}V{low}\" stroke=\"#e4e4e4\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\" fill=\"#555\">{}</text>",
            low + 18.0,
            print::seconds(tick).replace(".00 ", " ").replace(".0 ", " ")
        );
    }
    for tick in y.ticks() {
        let (at, far) = (y.at(tick), width - right);
        let _ = writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{far}\" stroke=\"#e4e4e4\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\" fill=\"#555\">{}</text>",
            left - 8.0,
            at + 4.0,
            number(tick)
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#222\">time</text>\n\
         <text transform=\"translate(18 {:.1}) rotate(-90)\" text-anchor=\"middle\" fill=\"#222\">RMSE \
         against {}</text>",
        (left + width - right) / 2.0,
        height - 14.0,
        (top + height - bottom) / 2.0,
        escape(&measurement.reference)
    );
    draw_front(&mut out, &rows, &x, &y);
    draw_points(&mut out, &rows, &x, &y);
    out.push_str("</svg>\n");
    out
}

/// Joins the settings than which no other is both faster and better, the Pareto front, and says so.
fn draw_front(out: &mut String, rows: &[&Measured], x: &Axis, y: &Axis) {
    let mut best: Vec<&&Measured> = rows.iter().filter(|row| row.is_best).collect();
    best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let points: Vec<String> = best
        .iter()
        .map(|row| format!("{:.1},{:.1}", x.at(row.seconds), y.at(row.error.rmse)))
        .collect();
    let _ = writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#b9d3b9\" stroke-width=\"7\" \
         stroke-linecap=\"round\" stroke-linejoin=\"round\"/>",
        points.join(" ")
    );
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#7d9d7d\">broad line: the Pareto front; nothing \
         is both faster and better</text>",
        SIZE.0 - BORDER[2],
        SIZE.1 - 14.0
    );
}

/// Points with their labels; a series, settings that differ in numbers only, has a colour and a line.
fn draw_points(out: &mut String, rows: &[&Measured], x: &Axis, y: &Axis) {
    let mut series: Vec<(String, Vec<&Measured>)> = Vec::new();
    for row in rows {
        let name = series_of(row);
        match series.iter_mut().find(|(known, _)| *known == name) {
            Some((_, members)) => members.push(row),
            None => series.push((name, vec![row])),
        }
    }
    for (i, (name, members)) in series.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        let at = |row: &&Measured| (x.at(row.seconds), y.at(row.error.rmse));
        let line: Vec<String> =
            members.iter().map(at).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let _ = writeln!(
            out,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>",
            line.join(" ")
        );
        for row in members {
            let (px, py) = at(row);
            let _ = writeln!(
                out,
                "<circle cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"4\" fill=\"{color}\"><title>{}</title></circle>\
                 <text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}</text>",
                escape(&row.values.join(", ")),
                px + 7.0,
                py - 6.0,
                escape(&numbers_of(row))
            );
        }
        let (right, top) = (SIZE.0 - BORDER[2] - 8.0, BORDER[1] + 16.0 * (i as f64 + 1.0));
        let _ = writeln!(
            out,
            "<text x=\"{right}\" y=\"{top}\" text-anchor=\"end\" fill=\"{color}\">{}</text>",
            escape(name)
        );
    }
}

/// A setting with `n` for its numbers.
fn series_of(row: &Measured) -> String {
    let mut name = String::new();
    for c in row.values.join(", ").chars() {
        if !(c.is_ascii_digit() || c == '.') {
            name.push(c);
        } else if !name.ends_with('n') || name.ends_with("in") {
            name.push('n');
        }
    }
    name
}

/// The numbers of a setting; all of it if there are none.
fn numbers_of(row: &Measured) -> String {
    let text = row.values.join(", ");
    let numbers: Vec<&str> = text
        .split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter(|part| !part.is_empty())
        .collect();
    if numbers.is_empty() { text } else { numbers.join(", ") }
}

/// A tick's number without needless digits.
fn number(value: f64) -> String {
    let digits = (-value.log10()).ceil().max(0.0) as usize;
    format!("{value:.digits$}")
}
