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
    // The section where it must show, rows that it must turn red there, and rows that it must leave alone.
    for (wrong, section, hit, spared) in [
        (
            Wrong::Mirrors,
            "8.4",
            &["lamp of 0.1 m", "unbounded", "facing mirrors"][..],
            &["lamp of 0.3 m on 0 mirrors"][..],
        ),
        (
            Wrong::Fresnel,
            "8.6",
            &[
                "Fresnel, index 1.5, 60 degrees",
                "hemispherical, index 1.5, by quadrature",
                "under water, 4.322057 m off",
            ],
            &["hemispherical, index 1.5, external"],
        ),
        // Squares and triangles are sampled by solid angle, where this cosine does not come in.
        (Wrong::Cosine, "8.2", &["disk 1 2 0", "disk 1 1 1"], &["uniform", "square"]),
    ] {
        choose(Wrong::Nothing);
        let right = run(&[section], &mut |_| ());
        choose(wrong);
        let red: Vec<String> = run(&[section], &mut |_| ())
            .iter()
            .zip(&right)
            .filter(|(row, good)| !passes(row) && passes(good))
            .map(|(row, _)| row.case.clone())
            .collect();
        println!("{wrong:?}: {red:#?}");
        for case in hit {
            assert!(red.iter().any(|r| r == case), "{wrong:?} must turn {case} red: {red:?}");
        }
        for case in spared {
            assert!(
                right.iter().any(|r| r.case == *case && passes(r)),
                "{case} is there and green without it"
            );
            assert!(!red.iter().any(|r| r == case), "{wrong:?} must leave {case} alone: {red:?}");
        }
    }
}
