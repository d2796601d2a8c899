//! Help with misspelt words: the nearest known one, and lists of what there is.

use strsim::normalized_damerau_levenshtein as likeness;

/// The known word that `word` was probably meant to be.
///
/// Near is what differs in two letters of five or less, or where one is a part of the other: `baud`
/// is near to `baudrate`.
pub(crate) fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_ascii_lowercase();
    let is_part = |known: &str| {
        word.len().min(known.len()) >= 3 && (known.contains(&word) || word.contains(known))
    };
    let is_near = |known: &str| likeness(&word, known) >= 0.6 || is_part(known);
    known
        .filter(|known| is_near(known))
        .max_by(|a, b| likeness(&word, a).total_cmp(&likeness(&word, b)))
}

/// `a`, `a and b`, `a, b and c`, with `last` in place of `and`.
pub(super) fn list<'a>(words: impl Iterator<Item = &'a str>, last: &str) -> String {
    let words: Vec<&str> = words.collect();
    match words.split_last() {
        None => String::new(),
        Some((word, [])) => (*word).to_owned(),
        Some((word, others)) => format!("{} {last} {word}", others.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_finger_is_seen_through() {
        let known = || ["name", "bind", "baudrate", "udp", "peer_timeout"].into_iter();
        for (word, meant) in [
            ("bnd", Some("bind")),
            ("BIND", Some("bind")),
            ("nmae", Some("name")),
            ("upd", Some("udp")),
            ("baud", Some("baudrate")),
            ("udp_bind", Some("bind")),
            ("timeout", Some("peer_timeout")),
            ("peer-timeout", Some("peer_timeout")),
            ("colour", None),
            ("e", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, known()), meant, "{word}");
        }
    }

    #[test]
    fn a_list_reads_like_a_sentence() {
        let list = |words: &[&'static str]| list(words.iter().copied(), "and");
        assert_eq!(list(&[]), "");
        assert_eq!(list(&["a"]), "a");
        assert_eq!(list(&["a", "b"]), "a and b");
        assert_eq!(list(&["a", "b", "c"]), "a, b and c");
    }
}
