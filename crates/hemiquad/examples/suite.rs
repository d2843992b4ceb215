//! The one table: every method on every problem.
//!
//! `cargo run --release -p hemiquad --example suite -- [--runs 400] [--only PART] [--problem PART] [--threads 2] [--full]`
//!
//! `--only` takes the methods, `--problem` the problems, whose names hold PART.
//!
//! Relative RMSE at 64, 256, 1024 and 4096 evaluations (a quarter of the runs at 4096), the bias z-score over all runs at 1024,
//! the coverage of the 95 % interval at 1024, and the worst run at 1024 (relative error). Problems sit at a new random place in
//! every run. z is "rare" where fewer than 20 runs carry the variance, so that no z-test would mean anything.
//!
//! The bound of 4 is passed by chance once in 16,000 normal means. Errors with a heavy tail have means that are not normal after a few
//! hundred runs: too few large errors make mean and spread small together, and z falls below -4 far more often. So an unbiased method
//! beyond 4 is looked at again, with other keys and sixteen times the runs, under the same bound: a bias that gave 4 gives 16 there,
//! chance does not come twice.

use hemiquad::map::Concentric;
use hemiquad::method::*;
use hemiquad::suite::{Class, Instance, Problem, problems};
use hemiquad::{Criterion, Estimate, Key, Workspace};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

const BUDGETS: [u32; 4] = [64, 256, 1024, 4096];

/// One method as the suite runs it: may need features, may be trained beforehand on other samples.
struct Entry {
    name: &'static str,
    biased: bool,
    needs_features: bool,
    run: fn(&Instance, u32, Key, &mut Workspace<f64>) -> Estimate<f64>,
}

/// Luminaires as a predictor might see them: twice as wide, and off by anything that still covers them.
fn inflated(i: &Instance, key: Key) -> Vec<Region> {
    i.features
        .iter()
        .enumerate()
        .map(|(j, r)| Region { shape: r.shape.misplaced(2.0, key.with(j as u64)), ..*r })
        .collect()
}

/// A partition trained on eight times as many samples from elsewhere (their cost is not counted): half of them half broad and
/// half over luminaires predicted twice too wide, the others where the first ones led.
fn trained(i: &Instance, n: u32, key: Key, work: &mut Workspace<f64>) -> Trained<f64> {
    let mut t = Trained::new();
    t.start(3);
    let wide = inflated(i, key);
    let mut seen = Vec::new();
    let first = {
        let mut record = |p: &hemiquad::Probe| {
            let v = (i.function)(p);
            seen.push((p.uv, v));
            v
        };
        Predicted { broad: 0.5, ..Predicted::from_regions(&wide) }.integrate(
            &mut record,
            8 * n,
            key.with(99),
            work,
        )
    };
    for (uv, v) in seen {
        t.add(uv, v);
    }
    t.witness(first.value, first.std_error.unwrap_or_default());
    t.refine(n, 4);
    t.finish(Default::default());
    for round in 0..2 {
        t.learn(&mut { i }, 2 * n, 2 * n, key.with(100 + round), Default::default());
    }
    t
}

fn entries() -> Vec<Entry> {
    macro_rules! plain {
        ($biased:expr, $m:expr) => {
            Entry {
                name: Method::<f64>::name(&$m),
                biased: $biased,
                needs_features: false,
                run: |i, n, k, w| $m.integrate(&mut { i }, n, k, w),
            }
        };
    }
    macro_rules! known {
        ($name:expr, $biased:expr, $run:expr) => {
            Entry { name: $name, biased: $biased, needs_features: true, run: $run }
        };
    }
    vec![
        plain!(false, Jittered),
        plain!(false, Sobol),
        plain!(false, Interlaced),
        plain!(true, ProductGauss { rule: ProductRule::Square }),
        plain!(true, ProductGauss { rule: ProductRule::Hemisphere }),
        known!("DirectIndirect", false, |i, n, k, w| DirectIndirect::new(&i.features).integrate(
            &mut { i },
            n,
            k,
            w
        )),
        known!("WardShadows", true, |i, n, k, w| {
            let h = History::new(i.features.len());
            WardShadows { luminaires: &i.features, tolerance: 0.2, history: &h }.integrate(
                &mut { i },
                n,
                k,
                w,
            )
        }),
        known!("ShirleyWang", false, |i, n, k, w| ShirleyWang::new(&i.features).integrate(
            &mut { i },
            n,
            k,
            w
        )),
        known!("KirkArvo (twice too wide)", false, |i, n, k, w| KirkArvo::new(&inflated(i, k)).integrate(
            &mut { i },
            n,
            k,
            w
        )),
        plain!(
            true,
            PainterSloan { criterion: Criterion::Contrast.into(), parent: hemiquad::partition::Parent::Keep }
        ),
        plain!(
            true,
            PainterSloan { criterion: Criterion::Contrast.into(), parent: hemiquad::partition::Parent::Drop }
        ),
        plain!(
            true,
            PainterSloan { criterion: Criterion::Value.into(), parent: hemiquad::partition::Parent::Keep }
        ),
        plain!(
            true,
            PainterSloan { criterion: Criterion::Value.into(), parent: hemiquad::partition::Parent::Drop }
        ),
        plain!(true, Glassner::default()),
        plain!(true, BeyerLange::default()),
        plain!(true, DelaunayAdaptive::default()),
        known!("Enlarged (sure) jittered", true, |i, n, k, w| {
            // As large as the jittered samples cannot miss.
            let sure = 2.0 * std::f64::consts::PI / n as f64;
            let least = i.features.iter().map(|r| r.shape.area()).fold(1.0, f64::min);
            Enlarged { k: (sure / least).max(1.0), inner: Jittered }.integrate(&mut { i }, n, k, w)
        }),
        known!("Shrinking quadtree", true, |i, n, k, w| Shrinking::default().integrate(&mut { i }, n, k, w)),
        known!("Shrinking Delaunay", true, |i, n, k, w| {
            Shrinking { on: ShrinkingOn::Delaunay, ..Default::default() }.integrate(&mut { i }, n, k, w)
        }),
        plain!(false, TwoStage::blind()),
        known!("TwoStage", false, |i, n, k, w| TwoStage::default().integrate(&mut { i }, n, k, w)),
        plain!(false, Sequential::default()),
        known!("Predicted regions (twice too wide)", false, |i, n, k, w| {
            Predicted::from_regions(&inflated(i, k)).integrate(&mut { i }, n, k, w)
        }),
        Entry {
            name: "Predicted partition (trained elsewhere)",
            biased: false,
            needs_features: false,
            run: |i, n, k, w| {
                let t = trained(i, n, k, w);
                Predicted::from_partition(&t).integrate(&mut { i }, n, k, w)
            },
        },
        plain!(false, LinearControl::default()),
        plain!(false, GenzMalik::default()),
    ]
}

#[derive(Clone, Copy, Default)]
struct Cell {
    rmse: [f64; 4],
    z: f64,
    z_valid: bool,
    /// z of the second look, if there was one.
    again: Option<f64>,
    cover: f64,
    asked: f64,
    worst: f64,
    unexplored: f64,
    overspent: bool,
}

/// Beyond this many standard errors a mean is taken to be off.
const FOUND_OUT: f64 = 4.0;

/// How many times the runs of the first look the second one has.
const SECOND_LOOK: u64 = 16;

/// Relative error of one run, with what came of it.
fn one(
    e: &Entry,
    p: &Problem,
    n: u32,
    key: Key,
    work: &mut Workspace<f64>,
) -> (f64, Estimate<f64>, Instance) {
    let i = p.instance(key.with(1));
    let est = (e.run)(&i, n, key.with(2), work);
    ((est.value - i.exact) / i.exact, est, i)
}

fn moment(errors: &[f64], about: f64, power: i32) -> f64 {
    errors.iter().map(|d| (d - about).powi(power)).sum::<f64>() / errors.len() as f64
}

/// z-score of the mean, and whether enough of the errors carry the variance for it to mean anything.
fn z_score(errors: &[f64]) -> (f64, bool) {
    if moment(errors, 0.0, 2).sqrt() < 1e-12 {
        return (0.0, true);
    }
    let runs = errors.len() as f64;
    let mean = moment(errors, 0.0, 1);
    let (m2, m4) = (moment(errors, mean, 2), moment(errors, mean, 4));
    // Effective number of runs that carry the variance; none at all where every run saw the same.
    (mean / (m2 / runs).sqrt(), m2 > 1e-24 && m2 * m2 * runs >= 20.0 * m4)
}

fn measure(e: &Entry, p: &Problem, runs: u64, work: &mut Workspace<f64>) -> Cell {
    let mut cell = Cell::default();
    for (b, &n) in BUDGETS.iter().enumerate() {
        let runs = if n == 4096 { (runs / 4).max(2) } else { runs };
        let mut errors = Vec::with_capacity(runs as usize);
        for r in 0..runs {
            let (d, est, i) = one(e, p, n, Key::new(r).with(n as u64), work);
            errors.push(d);
            if est.evaluations.total() as f64 > 1.1 * n as f64 + 8.0 {
                cell.overspent = true;
            }
            if n == 1024 {
                cell.worst = cell.worst.max(d.abs());
                cell.unexplored = cell.unexplored.max(est.unexplored);
                if let Some(h) = est.half_width_95() {
                    cell.asked += 1.0;
                    // Rounding is allowed for: a constant is integrated to the last digits with no spread at all.
                    cell.cover += (((est.value - i.exact).abs() <= h + 1e-12 * i.exact.abs()) as u32) as f64;
                }
            }
        }
        cell.rmse[b] = moment(&errors, 0.0, 2).sqrt();
        if n == 1024 {
            (cell.z, cell.z_valid) = z_score(&errors);
            if !e.biased && cell.z_valid && cell.z.abs() > FOUND_OUT {
                let fresh = |r: u64| Key::new(r).with(n as u64).with(2);
                let errors: Vec<f64> =
                    (0..SECOND_LOOK * runs).map(|r| one(e, p, n, fresh(r), work).0).collect();
                cell.again = Some(z_score(&errors).0);
            }
        }
    }
    cell
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |flag: &str| args.iter().position(|a| a == flag).and_then(|i| args.get(i + 1)).cloned();
    let runs: u64 = value("--runs").and_then(|v| v.parse().ok()).unwrap_or(400);
    let only = value("--only");
    let full = args.iter().any(|a| a == "--full");
    let threads: usize = value("--threads").and_then(|v| v.parse().ok()).unwrap_or(2);
    let entries: Vec<Entry> =
        entries().into_iter().filter(|e| only.as_ref().is_none_or(|o| e.name.contains(o.as_str()))).collect();
    let part = value("--problem").unwrap_or_default();
    let problems: Vec<Problem> = problems().into_iter().filter(|p| p.name.contains(&part)).collect();
    let jobs: Vec<(usize, usize)> =
        (0..problems.len()).flat_map(|p| (0..entries.len()).map(move |e| (p, e))).collect();
    let next = AtomicUsize::new(0);
    let cells: Mutex<Vec<Option<Cell>>> = Mutex::new(vec![None; jobs.len()]);
    std::thread::scope(|s| {
        for _ in 0..threads.max(1) {
            s.spawn(|| {
                let mut work = Workspace::new();
                loop {
                    let j = next.fetch_add(1, Ordering::Relaxed);
                    let Some(&(p, e)) = jobs.get(j) else { break };
                    if entries[e].needs_features && problems[p].instance(Key::new(0)).features.is_empty() {
                        continue;
                    }
                    let cell = measure(&entries[e], &problems[p], runs, &mut work);
                    eprint!("\r{:>5} of {} ", j + 1, jobs.len());
                    if let Ok(mut all) = cells.lock() {
                        all[j] = Some(cell);
                    }
                }
            });
        }
    });
    let cells = cells.into_inner().unwrap_or_default();
    let get = |p: usize, e: usize| cells[p * entries.len() + e];
    let percent =
        |x: f64| if x >= 0.1 { format!("{:.0} %", 100.0 * x) } else { format!("{:.2} %", 100.0 * x) };
    println!("## Per method, pooled ({runs} runs per problem)\n");
    println!(
        "Median over the problems of a class of the relative RMSE at 1024 evaluations; coverage of the 95 % interval at 1024, pooled; problems with |z| > 4 of those where a z-test means something, and, for unbiased methods, how many of them are beyond 4 again with other keys and sixteen times the runs.\n"
    );
    println!(
        "| method | smooth | rough | edge | compact | ragged | coverage | … on compact | \\|z\\| > 4 | biased |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (e, entry) in entries.iter().enumerate() {
        let column = |class: Class| {
            let mut v: Vec<f64> = (0..problems.len())
                .filter(|p| problems[*p].class == class)
                .filter_map(|p| get(p, e))
                .map(|c| c.rmse[2])
                .collect();
            v.sort_by(f64::total_cmp);
            v.get(v.len() / 2).map_or("–".into(), |x| format!("{x:.1e}"))
        };
        let cover = |keep: &dyn Fn(Class) -> bool| {
            let (mut c, mut a) = (0.0, 0.0);
            for cell in (0..problems.len()).filter(|p| keep(problems[*p].class)).filter_map(|p| get(p, e)) {
                c += cell.cover;
                a += cell.asked;
            }
            if a > 0.0 { format!("{:.1} %", 100.0 * c / a) } else { "none given".into() }
        };
        let tested: Vec<Cell> = (0..problems.len()).filter_map(|p| get(p, e)).filter(|c| c.z_valid).collect();
        let bad = tested.iter().filter(|c| c.z.abs() > FOUND_OUT).count();
        let again = tested.iter().filter(|c| c.again.is_some_and(|z| z.abs() > FOUND_OUT)).count();
        let again = if entry.biased || bad == 0 { String::new() } else { format!(", again {again}") };
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {bad} of {}{again} | {} |",
            entry.name,
            column(Class::Smooth),
            column(Class::Rough),
            column(Class::Edge),
            column(Class::Compact),
            column(Class::Ragged),
            cover(&|_| true),
            cover(&|c| c == Class::Compact),
            tested.len(),
            if entry.biased { "yes" } else { "no" }
        );
    }
    if !full {
        return;
    }
    println!("\n## Every method on every problem\n");
    println!(
        "Relative RMSE at 64, 256, 1024, 4096 evaluations; bias z-score, coverage, worst run and unexplored cap (degrees, largest of the runs) at 1024. \"+\" marks methods that had to exceed the budget.\n"
    );
    for (p, problem) in problems.iter().enumerate() {
        println!("### {} ({})\n", problem.name, problem.class.name());
        println!("| method | 64 | 256 | 1024 | 4096 | z | coverage | worst | unexplored |");
        println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
        for (e, entry) in entries.iter().enumerate() {
            let Some(c) = get(p, e) else { continue };
            let mut z = if c.z_valid { format!("{:+.1}", c.z) } else { "rare".into() };
            if let Some(again) = c.again {
                z += &format!(", again {again:+.1}");
            }
            let cover = if c.asked > 0.0 { percent(c.cover / c.asked) } else { "–".into() };
            println!(
                "| {}{} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {z} | {cover} | {:.1e} | {:.1}° |",
                entry.name,
                if c.overspent { " +" } else { "" },
                c.rmse[0],
                c.rmse[1],
                c.rmse[2],
                c.rmse[3],
                c.worst,
                (c.unexplored * Concentric::LARGEST_STRETCH).to_degrees()
            );
        }
        println!();
    }
}
