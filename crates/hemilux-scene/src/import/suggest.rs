//! "Did you mean": the known name closest to a misspelt one, by restricted Damerau–Levenshtein distance.

/// Longest name considered; longer ones are not misspelt, they are noise.
const MAX_NAME: usize = 64;

/// Insertions, deletions, substitutions and transpositions of neighbours that turn `a` into `b`; case counts half.
fn distance_halves(a: &[char], b: &[char]) -> usize {
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).map(|j| 2 * j).collect();
    for i in 1..=a.len() {
        let mut row = vec![2 * i; b.len() + 1];
        for j in 1..=b.len() {
            let (x, y) = (a[i - 1], b[j - 1]);
            let cost = match x == y {
                true => 0,
                false if x.eq_ignore_ascii_case(&y) => 1,
                false => 2,
            };
            row[j] = (last[j - 1] + cost).min(last[j] + 2).min(row[j - 1] + 2);
            if i > 1 && j > 1 && x == b[j - 2] && a[i - 2] == y {
                row[j] = row[j].min(before[j - 2] + 2);
            }
        }
        before = last;
        last = row;
    }
    last[b.len()]
}

/// The name among `known` that `got` probably meant: at most a third of its letters wrong (one in short names).
pub fn closest<'a>(got: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let a: Vec<char> = got.chars().take(MAX_NAME + 1).collect();
    if a.is_empty() || a.len() > MAX_NAME {
        return None;
    }
    known
        .into_iter()
        .filter(|k| !k.is_empty() && k.len() <= MAX_NAME && *k != got)
        .filter_map(|k| {
            let b: Vec<char> = k.chars().collect();
            let allowed = (2 * a.len().max(b.len()) / 3).max(2);
            let d = distance_halves(&a, &b);
            (d <= allowed).then_some((d, k))
        })
        .min()
        .map(|(_, k)| k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_slip_of_a_finger() {
        let names = ["uroughness", "vroughness", "roughness", "remaproughness", "eta", "k"];
        assert_eq!(closest("uroughnes", names), Some("uroughness"));
        assert_eq!(closest("roughnses", names), Some("roughness"));
        assert_eq!(closest("Eta", names), Some("eta"));
        assert_eq!(closest("xylophone", names), None);
        assert_eq!(closest("", names), None);
    }

    #[test]
    fn case_is_cheaper_than_letters() {
        assert_eq!(closest("shape", ["Shape", "shade"]), Some("Shape"));
        assert_eq!(distance_halves(&['a', 'b'], &['b', 'a']), 2);
        assert_eq!(distance_halves(&[], &['b', 'a']), 4);
    }
}
