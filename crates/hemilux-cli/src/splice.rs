//! `@FILE` among the arguments stands for the words in that file.

use crate::failure::Failure;
use std::ffi::OsString;

/// Files inside files; deeper is taken for a circle.
const DEEPEST: usize = 8;
/// Words that all files together may bring.
const MOST_WORDS: usize = 100_000;

/// Replace every argument `@FILE` by the words of the file: split at white space, `'…'` and `"…"` keep it, `#` begins a
/// comment. `@@x` is the argument `@x`.
pub fn splice(args: Vec<OsString>) -> Result<Vec<OsString>, Failure> {
    let mut out = Vec::new();
    insert(args, 0, &mut out)?;
    Ok(out)
}

fn insert(args: Vec<OsString>, depth: usize, out: &mut Vec<OsString>) -> Result<(), Failure> {
    for arg in args {
        if out.len() > MOST_WORDS {
            return Err(Failure::usage("too many arguments"));
        }
        let name = arg.to_str().and_then(|a| a.strip_prefix('@'));
        match name {
            Some(literal) if literal.starts_with('@') => out.push(literal.into()),
            Some(path) if !path.is_empty() => {
                if depth >= DEEPEST {
                    return Err(Failure::usage(format!(
                        "@{path}: argument files within one another too deeply"
                    )));
                }
                let text =
                    std::fs::read_to_string(path).map_err(|e| Failure::usage(format!("@{path}: {e}")))?;
                let words = words(&text).map_err(|what| Failure::usage(format!("@{path}: {what}")))?;
                insert(words.into_iter().map(OsString::from).collect(), depth + 1, out)?;
            }
            _ => out.push(arg),
        }
    }
    Ok(())
}

/// The words of a text, as a shell would see them but for its substitutions.
fn words(text: &str) -> Result<Vec<String>, String> {
    let mut out = Vec::new();
    let mut word: Option<String> = None;
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match c {
            '\'' | '"' => {
                let word = word.get_or_insert_default();
                loop {
                    match chars.next() {
                        Some(end) if end == c => break,
                        Some(inner) => word.push(inner),
                        None => return Err(format!("a {c} is not closed")),
                    }
                }
            }
            '#' if word.is_none() => {
                chars.by_ref().find(|c| *c == '\n');
            }
            c if c.is_whitespace() => out.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    out.extend(word);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_as_a_shell_would() {
        let text = "--spp 4 # samples\n -o 'a b.exr' \"\" x#y";
        assert_eq!(words(text).unwrap(), ["--spp", "4", "-o", "a b.exr", "", "x#y"]);
        assert!(words("'open").is_err());
    }
}
