//! `hemilux validate`: the closed forms, case by case, as a page in HTML and in Markdown.

use crate::args::ValidateArgs;
use crate::failure::{Failure, Kind};
use crate::output;
use crate::plan::seconds;
use crate::render::set_threads;
use crate::talk;
use hemilux::validate::{self, LIMIT, Row, Verdict};
use hemilux_image::atomic;
use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Compute and write.
pub fn run(args: ValidateArgs, begin: Instant) -> Result<(), Failure> {
    set_threads(args.threads)?;
    #[cfg(feature = "wrong-physics")]
    hemilux::wrong::choose(args.wrong.unwrap_or(hemilux::wrong::Wrong::Nothing));
    std::fs::create_dir_all(&args.output).map_err(|e| Failure::write(&args.output, &e))?;
    let [html, markdown] = ["index.html", "validation.md"].map(|name| args.output.join(name));
    [&html, &markdown].into_iter().try_for_each(|p| output::check_writable(p))?;
    let only: Vec<&str> = args.only.iter().map(String::as_str).collect();
    let quiet = args.talk.quiet;
    let rows = validate::run(&only, &mut |row| {
        if !quiet {
            talk::line(&in_a_line(row));
        }
    });
    if rows.is_empty() {
        return Err(Failure::usage(format!("no section is called {}", only.join(" or "))));
    }
    let time = begin.elapsed();
    write(&html, &as_html(&rows, time))?;
    write(&markdown, &as_markdown(&rows, time))?;
    let summary = summary(&rows, time);
    if !quiet {
        talk::line(&format!("{summary}; wrote {}, {}", html.display(), markdown.display()));
    }
    if rows.iter().all(|r| r.verdict == Verdict::Pass) {
        Ok(())
    } else {
        Err(Failure::new(Kind::Tolerance, summary))
    }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    atomic::write(path, |out: &mut io::BufWriter<std::fs::File>| out.write_all(text.as_bytes()))
        .map_err(|e: io::Error| Failure::write(path, &e))
}

fn summary(rows: &[Row], time: Duration) -> String {
    let count = |which: fn(&Verdict) -> bool| rows.iter().filter(|r| which(&r.verdict)).count();
    format!(
        "{} cases: {} pass, {} fail, {} not computed; {}",
        rows.len(),
        count(|v| *v == Verdict::Pass),
        count(|v| matches!(v, Verdict::Fail(_))),
        count(|v| matches!(v, Verdict::Missing(_))),
        seconds(time)
    )
}

fn verdict(row: &Row) -> String {
    match &row.verdict {
        Verdict::Pass => "pass".into(),
        Verdict::Fail(why) => format!("FAIL: {why}"),
        Verdict::Missing(why) => format!("NOT COMPUTED: {why}"),
    }
}

/// Seven significant digits.
fn number(v: f64) -> String {
    match v {
        v if v.is_nan() => "-".into(),
        v if v != 0.0 && !(1e-4..1e6).contains(&v.abs()) => format!("{v:.4e}"),
        v => {
            let digits = if v == 0.0 { 1 } else { (6 - v.abs().log10().floor() as i32).clamp(1, 9) };
            format!("{v:.*}", digits as usize)
        }
    }
}

fn z(row: &Row) -> String {
    match (&row.verdict, row.z) {
        (Verdict::Missing(_), _) => "-".into(),
        (_, Some(z)) => format!("{z:+.2}"),
        (_, None) => "exact".into(),
    }
}

fn in_a_line(row: &Row) -> String {
    format!(
        "{:4} {:62} {:>12} {:>12} ± {:<11} {:>7} {:>8}  {}",
        row.section.split(' ').next().unwrap_or_default(),
        row.case,
        number(row.reference),
        number(row.value),
        number(row.half_width),
        z(row),
        seconds(row.time),
        verdict(row)
    )
}

const MEANING: &str = "Value and 95 % interval (for exact cases the tolerance) beside the reference, a closed form or a bound. \
                       z is the distance in standard errors of the value";

fn as_markdown(rows: &[Row], time: Duration) -> String {
    let mut out = format!("# Validation of hemilux {}\n\n", env!("CARGO_PKG_VERSION"));
    out += &format!(
        "{}.\n\n{MEANING}; a case passes below {LIMIT}, and only if it can tell the reference from a\nplausible wrong answer.\n",
        summary(rows, time)
    );
    let mut section = "";
    for row in rows {
        if row.section != section {
            section = row.section;
            out += &format!(
                "\n## {section}\n\n| case | reference | value | ± | z | time | verdict |\n|---|---:|---:|---:|---:|---:|---|\n"
            );
        }
        out += &format!(
            "| {} | {} | {} | {} | {} | {} | {} |\n",
            row.case,
            number(row.reference),
            number(row.value),
            number(row.half_width),
            z(row),
            seconds(row.time),
            verdict(row)
        );
    }
    out
}

fn as_html(rows: &[Row], time: Duration) -> String {
    let escape = |s: &str| s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Validation of hemilux</title>\n<style>\n\
         body {{ font: 15px/1.4 sans-serif; margin: 2em auto; max-width: 72em; color: #222 }}\n\
         table {{ border-collapse: collapse; width: 100% }}\n\
         td, th {{ padding: .2em .6em; text-align: right; border-bottom: 1px solid #ddd; font-variant-numeric: tabular-nums }}\n\
         td:first-child, th:first-child, td:last-child, th:last-child {{ text-align: left }}\n\
         td {{ white-space: nowrap }} td:first-child, td:last-child {{ white-space: normal }}\n\
         .pass td:last-child {{ background: #d8f0d8 }} .fail td {{ background: #f8c8c8 }} .missing td {{ background: #f8c8c8 }}\n\
         </style>\n<h1>Validation of hemilux {}</h1>\n<p><b>{}.</b></p>\n<p>{MEANING}; a case passes below {LIMIT}, and only if \
         it can tell the reference from a plausible wrong answer.</p>\n",
        env!("CARGO_PKG_VERSION"),
        escape(&summary(rows, time))
    );
    let mut section = "";
    for row in rows {
        if row.section != section {
            if !section.is_empty() {
                out += "</table>\n";
            }
            section = row.section;
            out += &format!(
                "<h2>{}</h2>\n<table><tr><th>case<th>reference<th>value<th>±<th>z<th>time<th>verdict</tr>\n",
                escape(section)
            );
        }
        let class = match row.verdict {
            Verdict::Pass => "pass",
            Verdict::Fail(_) => "fail",
            Verdict::Missing(_) => "missing",
        };
        out += &format!(
            "<tr class=\"{class}\"><td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}</tr>\n",
            escape(&row.case),
            number(row.reference),
            number(row.value),
            number(row.half_width),
            z(row),
            seconds(row.time),
            escape(&verdict(row))
        );
    }
    out += "</table>\n</html>\n";
    out
}
