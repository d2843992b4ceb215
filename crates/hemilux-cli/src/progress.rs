//! How far a command is: a bar on a terminal, JSON lines for programs, or a few lines at the end.

use crate::args::ProgressForm;
use crate::machine;
use crate::plan::seconds;
use crate::talk::{self, Talk};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Bar,
    Json,
    Lines,
    Silent,
}

/// JSON lines come no more often than this; the last one of a stage always comes.
const JSON_INTERVAL: Duration = Duration::from_millis(100);

/// One look at the work.
#[derive(Clone, Copy, Debug, Default)]
pub struct Look {
    /// Part of the stage that is done, 0 to 1.
    pub done: f64,
    /// Passes done, and of how many.
    pub pass: Option<(u32, Option<u32>)>,
    /// Rays or particles so far.
    pub rays: u64,
    /// Relative standard error.
    pub error: Option<f32>,
}

/// Stages in a row, told while they run.
pub struct Progress {
    form: Form,
    begin: Instant,
    name: &'static str,
    since: Instant,
    remark: String,
    budget: String,
    lines: Vec<String>,
    times: Vec<(&'static str, Duration)>,
    bar: Option<ProgressBar>,
    last_json: Option<Instant>,
}

impl Progress {
    /// Begin to tell; `begin` is when the program started.
    pub fn new(form: ProgressForm, talk: &Talk, begin: Instant) -> Progress {
        let form = match form {
            ProgressForm::Json => Form::Json,
            ProgressForm::None => Form::Silent,
            _ if talk.quiet => Form::Silent,
            ProgressForm::Bar => Form::Bar,
            ProgressForm::Auto if std::io::stderr().is_terminal() => Form::Bar,
            ProgressForm::Auto => Form::Lines,
        };
        Progress {
            form,
            begin,
            name: "",
            since: begin,
            remark: String::new(),
            budget: String::new(),
            lines: Vec::new(),
            times: Vec::new(),
            bar: None,
            last_json: None,
        }
    }

    /// The next stage begins; the one before ends.
    pub fn stage(&mut self, name: &'static str) {
        self.end_stage();
        self.name = name;
        self.since = Instant::now();
        match self.form {
            Form::Bar => self.draw(0.0, String::new()),
            Form::Json => self.json(json!({"done": 0.0})),
            Form::Lines | Form::Silent => {}
        }
    }

    /// What this stage has to spend, named while it runs.
    pub fn budget(&mut self, words: String) {
        self.budget = words;
    }

    /// Something worth knowing about this stage, such as what it made.
    pub fn remark(&mut self, text: String) {
        self.remark = text;
    }

    /// The stages so far with what each took, the present one included.
    pub fn times(&self) -> Vec<(&'static str, Duration)> {
        self.times.iter().copied().chain([(self.name, self.since.elapsed())]).collect()
    }

    fn end_stage(&mut self) {
        if !self.name.is_empty() {
            self.times.push((self.name, self.since.elapsed()));
        }
        if !self.name.is_empty() && self.form == Form::Lines {
            let time = seconds(self.since.elapsed());
            self.lines.push(format!("{:8} {time:>8}  {}", self.name, self.remark).trim_end().to_owned());
        }
        self.remark.clear();
        self.budget.clear();
    }

    /// Tell how far the stage is.
    pub fn look(&mut self, look: Look) {
        let elapsed = self.since.elapsed().as_secs_f64();
        let eta = (look.done > 0.0).then(|| elapsed * (1.0 - look.done) / look.done);
        match self.form {
            Form::Lines | Form::Silent => {}
            Form::Json => {
                let now = Instant::now();
                if look.done < 1.0 && self.last_json.is_some_and(|t| now - t < JSON_INTERVAL) {
                    return;
                }
                self.last_json = Some(now);
                let mut line = json!({"done": round(look.done, 1e4)});
                // Without passes it is particles that are counted.
                line[if look.pass.is_some() { "rays" } else { "particles" }] = look.rays.into();
                let mut set = |key: &str, value: Option<Value>| {
                    if let Some(v) = value {
                        line[key] = v;
                    }
                };
                set("eta_s", eta.map(|v| round(v, 1e2).into()));
                set("err", look.error.map(|v| round(v as f64, 1e6).into()));
                set("pass", look.pass.map(|p| p.0.into()));
                set("passes", look.pass.and_then(|p| p.1).map(Into::into));
                self.json(line);
            }
            Form::Bar => {
                let mut words = Vec::new();
                if let Some((pass, of)) = look.pass {
                    words.push(of.map_or(format!("pass {pass}"), |n| format!("pass {pass}/{n}")));
                }
                if elapsed > 0.0 && look.rays > 0 {
                    let unit = if look.pass.is_some() { "rays/s" } else { "particles/s" };
                    words.push(format!("{} {unit}", machine::count(look.rays as f64 / elapsed)));
                }
                words.extend(look.error.map(|e| format!("error {}", percent(e))));
                words.extend(
                    eta.map(|s| format!("ETA {}", seconds(Duration::from_secs_f64(s.clamp(0.0, 1e9))))),
                );
                words.extend(Some(self.budget.clone()).filter(|b| !b.is_empty()));
                self.draw(look.done, words.join("  "));
            }
        }
    }

    fn draw(&mut self, done: f64, words: String) {
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(1000);
            if let Ok(style) = ProgressStyle::with_template("{prefix:8} [{bar:24}] {percent:>3}%  {msg}") {
                bar.set_style(style.progress_chars("=> "));
            }
            bar
        });
        bar.set_prefix(self.name);
        bar.set_position((done.clamp(0.0, 1.0) * 1000.0) as u64);
        bar.set_message(words);
    }

    fn json(&self, mut line: Value) {
        line["t"] = round(self.begin.elapsed().as_secs_f64(), 1e3).into();
        line["stage"] = self.name.into();
        talk::line(&line.to_string());
    }

    /// The end: the bar goes, the lines come, then `summary`; programs get `facts`.
    pub fn end(mut self, summary: &[String], facts: Value) {
        self.end_stage();
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
        match self.form {
            Form::Silent => {}
            Form::Json => {
                let mut line = facts;
                line["done"] = json!(1.0);
                self.name = "done";
                self.json(line);
            }
            Form::Bar | Form::Lines => self.lines.iter().chain(summary).for_each(|l| talk::line(l)),
        }
    }
}

fn round(v: f64, unit: f64) -> f64 {
    (v * unit).round() / unit
}

/// A relative error for people.
pub fn percent(e: f32) -> String {
    let p = e * 100.0;
    if p >= 10.0 { format!("{p:.0} %") } else { format!("{p:.2} %") }
}
