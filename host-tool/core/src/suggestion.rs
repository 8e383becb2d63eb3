//! The known name that a misspelt one was probably meant to be.

/// Length from which a text is not compared with names, bytes: nobody mistypes a name into so long
/// a text.
const LONGEST: usize = 100;

/// Jaro–Winkler similarity that a typed text must exceed to count as a misspelt name.
const LEAST_SIMILARITY: f64 = 0.8;

/// Returns the name that is most similar to `typed`, ignoring case; `None` if none is similar
/// enough. If several are equally similar, returns the last of them.
#[must_use]
pub fn nearest<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> Option<&'n str> {
    if typed.len() >= LONGEST {
        return None;
    }
    let typed = typed.to_lowercase();
    names
        .into_iter()
        .map(|name| (similarity(&typed, &name.to_lowercase()), name))
        .filter(|(similarity, _)| *similarity > LEAST_SIMILARITY)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, name)| name)
}

/// Returns ``: did you mean `NAME`?``, to be appended to an error message; an empty text if none of
/// `names` is similar to `typed`.
#[must_use]
pub fn did_you_mean<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    let nearest = nearest(typed, names);
    nearest.map_or_else(String::new, |name| format!(": did you mean `{name}`?"))
}

/// Returns the Jaro–Winkler similarity of two lower-case names, 0 to 1. That measure rates short
/// words with one typing error too low. A text of three letters or more that differs from `name` by
/// one edit therefore always counts as similar enough.
fn similarity(typed: &str, name: &str) -> f64 {
    let similarity = strsim::jaro_winkler(typed, name);
    let is_slip = typed.len() >= 3 && strsim::damerau_levenshtein(typed, name) <= 1;
    if is_slip {
        similarity.max(LEAST_SIMILARITY.next_up())
    } else {
        similarity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspelt_names_find_what_was_meant() {
        let names = ["harris-wall", "hamana-1", "native", "run"];
        for (typed, meant) in [
            ("haris-wall", Some("harris-wall")),
            ("HAMANA-1", Some("hamana-1")),
            ("nativ", Some("native")),
            ("rnu", Some("run")),
            ("x", None),
            ("", None),
            ("something-else", None),
        ] {
            assert_eq!(nearest(typed, names), meant, "{typed}");
        }
        assert_eq!(nearest(&"run".repeat(40), ["run"]), None);
        assert_eq!(did_you_mean("rnu", names), ": did you mean `run`?");
        assert_eq!(did_you_mean("x", names), "");
    }
}
