//! Texts that command no terminal and no other program, whoever made them.

/// A text of one line that moves no cursor and turns no order of what is behind it: names, peers and
/// reasons are what somebody made them.
pub(crate) fn printable(text: &str) -> String {
    text.replace(|c: char| c.is_control() || is_odd(c), "?")
}

/// JSON that a terminal can be shown: what would command one is written as `\u009b`. It can stand
/// in texts alone.
pub(crate) fn escape_json(json: &str) -> String {
    let mut escaped = String::with_capacity(json.len());
    for c in json.chars() {
        if is_odd(c) {
            escaped += &format!("\\u{:04x}", u32::from(c));
        } else {
            escaped.push(c);
        }
    }
    escaped
}

/// Whether it commands a terminal, or turns the order of what is behind it, and JSON lets it stand.
fn is_odd(c: char) -> bool {
    matches!(c, '\u{7f}'..='\u{9f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_breaks_no_line_moves_no_cursor_and_turns_no_order() {
        assert_eq!(printable("a\nb\x1b[2Jc\u{9b}d\u{202e}e\u{2066}f ä/ö"), "a?b?[2Jc?d?e?f ä/ö");
    }

    #[test]
    fn what_json_lets_stand_is_escaped_and_means_the_same() {
        let odd = "a\u{7f}\u{9b}\u{202e}\u{2069}ä";
        let json = escape_json(&serde_json::to_string(odd).unwrap());
        assert_eq!(json, r#""a\u007f\u009b\u202e\u2069ä""#);
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), odd);
    }
}
