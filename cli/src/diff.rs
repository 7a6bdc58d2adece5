//! `spandrel diff`.

use spandrel_engine::Result;
use spandrel_engine::image::file;
use std::fmt::Write;

use crate::args::Diff;
use crate::{difference, exit, print};

pub(crate) fn run(args: &Diff) -> u8 {
    match diff(args) {
        Ok(true) => exit::DONE,
        Ok(false) => exit::FAILED,
        Err(error) => {
            print::error(&error);
            exit::of(&error)
        }
    }
}

/// Prints how far two pictures are apart; returns whether they are within the tolerance.
fn diff(args: &Diff) -> Result<bool> {
    let (a, b) = (file::read(&args.a)?, file::read(&args.b)?);
    let mut out = format!(
        "{:<10}  {:>10}  {:>10}  {:>10}  {:>8}\n",
        "channel", "rmse", "99.9 %", "greatest", "> 1/255"
    );
    let mut near = true;
    for (name, d) in difference::by_channel(&a, &b)? {
        let share = d.above_step * 100.0;
        let _ = writeln!(
            out,
            "{name:<10}  {:>10.6}  {:>10.6}  {:>10.6}  {share:>6.3} %",
            d.rmse, d.high, d.most
        );
        near &= d.most <= args.tolerance;
    }
    let names = |image: &spandrel_engine::image::Image| -> Vec<String> {
        image.channels().map(|(name, _)| name.to_owned()).collect()
    };
    for (here, there, file) in [(&a, &b, &args.a), (&b, &a, &args.b)] {
        let known = names(there);
        for name in names(here).iter().filter(|name| !known.contains(name)) {
            let _ = writeln!(out, "{name:<10}  only in {}", file.display());
            near = false;
        }
    }
    print::out(&out);
    Ok(near)
}
