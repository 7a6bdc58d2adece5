//! A measurement as a table, as csv and as a page.

use std::fmt::Write;

use super::{Measured, Measurement, plot};
use crate::print::{self, escape};

/// A table for people.
pub(crate) fn table(measurement: &Measurement) -> String {
    let mut head: Vec<String> = measurement.parameters.clone();
    head.extend(
        ["rmse", "99.9 %", "greatest", "> 1/255", "time", "peak", "spans", ""].map(str::to_owned),
    );
    let rows = measurement.rows.iter().map(|row| {
        let mut cells = row.values.clone();
        cells.extend(figures(row));
        cells.push(if row.is_best { "best".to_owned() } else { String::new() });
        cells
    });
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |i: usize| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut out = String::new();
    for row in &rows {
        for (i, (cell, width)) in row.iter().zip(&widths).enumerate() {
            let _ = match i < measurement.parameters.len() {
                true => write!(out, "{cell:<width$}  "),
                false => write!(out, "{cell:>width$}  "),
            };
        }
        out.truncate(out.trim_end().len());
        out.push('\n');
    }
    let _ = writeln!(
        out,
        "against {}; median of {} runs; best: on the Pareto front, nothing is both faster and better",
        measurement.reference, measurement.runs
    );
    out
}

/// What was measured of a setting, for people.
fn figures(row: &Measured) -> [String; 7] {
    [
        format!("{:.6}", row.error.rmse),
        format!("{:.6}", row.error.high),
        format!("{:.6}", row.error.most),
        format!("{:.3} %", row.error.above_step * 100.0),
        print::seconds(row.seconds),
        row.peak_bytes.map_or_else(String::new, print::bytes),
        print::bytes(row.span_bytes),
    ]
}

/// Comma-separated values: seconds and bytes as they are, one row for each setting.
pub(crate) fn csv(measurement: &Measurement) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut out = measurement.parameters.iter().map(|p| quoted(p) + ",").collect::<String>();
    out.push_str("rmse,p99_9,max,share_above_1_255,seconds,peak_bytes,span_bytes,best\n");
    for row in &measurement.rows {
        for value in &row.values {
            out.push_str(&quoted(value));
            out.push(',');
        }
        let peak = row.peak_bytes.map_or_else(String::new, |bytes| bytes.to_string());
        let e = &row.error;
        let _ = writeln!(
            out,
            "{},{},{},{},{},{peak},{},{}",
            e.rmse, e.high, e.most, e.above_step, row.seconds, row.span_bytes, row.is_best
        );
    }
    out
}

/// A page with the plot and the table, in one file.
pub(crate) fn html(measurement: &Measurement) -> String {
    let mut head: String = measurement.parameters.iter().map(|p| cell("th", p)).collect();
    for name in ["RMSE", "99.9 %", "greatest", "&gt; 1/255", "time", "peak memory", "spans"] {
        let _ = write!(head, "<th>{name}</th>");
    }
    let mut body = String::new();
    for row in &measurement.rows {
        let _ = write!(body, "<tr{}>", if row.is_best { " class=\"best\"" } else { "" });
        row.values.iter().for_each(|value| body.push_str(&cell("td", value)));
        for text in figures(row) {
            body.push_str(&cell("td", &text));
        }
        body.push_str("</tr>\n");
    }
    let title = format!("{}: what accuracy costs", escape(&measurement.graph));
    format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>{title}</title>\n\
         <style>body{{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;\
         color:#222}}svg{{max-width:100%;height:auto}}table{{border-collapse:collapse}}\
         th,td{{padding:.2rem .7rem;text-align:right;border-bottom:1px solid #ddd;\
         font-variant-numeric:tabular-nums}}.best{{background:#eef6ee}}</style>\n\
         <h1>{title}</h1>\n{}\n<table><tr>{head}</tr>\n{body}</table>\n\
         <p>Against {}; time is the median of {} runs; shaded rows are the Pareto front: \
         those than which no other is both faster and better.</p></html>\n",
        plot::svg(measurement),
        escape(&measurement.reference),
        measurement.runs
    )
}

fn cell(kind: &str, text: &str) -> String {
    format!("<{kind}>{}</{kind}>", escape(text))
}
