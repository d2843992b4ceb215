//! The validation page: its rows, and that mistakes turn the right ones red.

use hemilux::validate::{Row, Verdict, run};

fn passes(row: &Row) -> bool {
    row.verdict == Verdict::Pass
}

/// One section as a sample; the whole takes minutes (`hemilux validate`), and its cases are tests of their own.
#[test]
#[cfg(not(feature = "wrong-physics"))]
fn a_section_is_green() {
    let mut told = 0;
    let rows = run(&["8.7"], &mut |_| told += 1);
    assert!(rows.len() >= 10 && told == rows.len());
    for row in &rows {
        println!("{} {} {} ± {} {:?}", row.case, row.reference, row.value, row.half_width, row.verdict);
        assert!(passes(row), "{row:?}");
    }
    assert!(run(&["no such section"], &mut |_| ()).is_empty());
}

/// Each mistake turns rows red that depend on it, and leaves others green.
/// `cargo test -p hemilux --release --features wrong-physics --test validate`
#[test]
#[cfg(feature = "wrong-physics")]
fn mistakes_turn_the_right_rows_red() {
    use hemilux::wrong::{Wrong, choose};
    let sections = ["8.2", "8.3", "8.4", "8.6"];
    let rows = |wrong: Wrong| {
        choose(wrong);
        run(&sections, &mut |_| ())
    };
    let right = rows(Wrong::Nothing);
    for (name, wrong) in Wrong::ALL {
        let red: Vec<String> = rows(wrong)
            .iter()
            .zip(&right)
            .filter(|(r, good)| !passes(r) && passes(good))
            .map(|(r, _)| format!("{} {}", r.section.split(' ').next().unwrap_or_default(), r.case))
            .collect();
        println!("{name}: {red:#?}");
        let has = |case: &str| red.iter().any(|r| r.contains(case));
        let (hit, spared): (&[&str], &[&str]) = match wrong {
            Wrong::Cosine => (
                &["8.2 square", "8.2 triangle", "8.2 centred", "8.4 unbounded"],
                &["8.2 uniform", "8.6 Fresnel"],
            ),
            Wrong::Mirrors => (
                &["8.3 mirror", "8.3 metal", "8.4 lamp of 0.1 m", "8.4 unbounded", "8.4 facing"],
                &["8.2", "8.6"],
            ),
            Wrong::Fresnel => (
                &[
                    "8.6 Fresnel, index 1.5, 60",
                    "8.6 hemispherical, index 1.5, by quadrature",
                    "8.6 under water, 4.3",
                ],
                &["8.2", "8.4"],
            ),
            Wrong::Nothing => (&[], &["8."]),
        };
        hit.iter().for_each(|case| assert!(has(case), "{name} must turn {case} red: {red:?}"));
        spared.iter().for_each(|case| assert!(!has(case), "{name} must leave {case} alone: {red:?}"));
    }
}
