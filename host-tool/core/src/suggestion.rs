//! The known name that a misspelt one was probably meant to be.

/// Longer texts are not misspelt names.
const LONGEST: usize = 100;

/// Least Jaro–Winkler similarity of a misspelt name.
const LEAST_SIMILARITY: f64 = 0.8;

/// The most similar of `names` if it is similar enough to be what was meant, upper and lower case
/// alike; the last of equally similar names.
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

/// `: did you mean NAME?` in backticks for a misspelt name; empty if none of `names` is similar.
#[must_use]
pub fn did_you_mean<'n>(typed: &str, names: impl IntoIterator<Item = &'n str>) -> String {
    let nearest = nearest(typed, names);
    nearest.map_or_else(String::new, |name| format!(": did you mean `{name}`?"))
}

/// Jaro–Winkler similarity, 0 to 1; a single slip in a word of three letters or more, which that
/// measure judges harshly in short words, is always similar enough.
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
