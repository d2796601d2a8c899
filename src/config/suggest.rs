//! Help with misspelt words: the nearest known one, and lists of what there is.

use strsim::normalized_damerau_levenshtein as likeness;

use crate::mavlink::Dialect;

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

/// What to do about a message that nobody knows by this name: the one that was meant, or `else_do`.
pub fn message_hint(name: &str, dialect: &Dialect, else_do: &str) -> String {
    let names = dialect.definitions().iter().map(|definition| definition.name.to_ascii_lowercase());
    let names: Vec<String> = names.collect();
    match nearest(name, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean {}?", near.to_ascii_uppercase()),
        None => else_do.to_owned(),
    }
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
