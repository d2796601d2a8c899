//! Values as mavlink-router writes them: each function reads one kind, or gives `None` if it is none.

use std::ops::RangeInclusive;

use crate::config::host_port::{self, Host};
use crate::config::options::MessageRef;
use crate::config::value::{self, is_digits};

/// A whole number, in decimal or, behind `0x`, in hexadecimal.
///
/// mavlink-router takes one with a leading zero for octal, which nobody means: it is refused.
pub(super) fn number(text: &str, range: RangeInclusive<u64>) -> Option<u64> {
    let hex = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    let number = match hex {
        Some(hex) if !hex.starts_with('+') => u64::from_str_radix(hex, 16).ok()?,
        _ if text.len() > 1 && text.starts_with('0') => return None,
        _ => is_digits(text).then(|| text.parse().ok()).flatten()?,
    };
    range.contains(&number).then_some(number)
}

/// A port that can be sent to.
pub(super) fn port(text: &str) -> Option<u16> {
    number(text, 1..=65_535).map(|port| port as u16)
}

/// The id of a system that can speak.
pub(super) fn system(text: &str) -> Option<u8> {
    number(text, 1..=255).map(|system| system as u8)
}

/// Yes or no: `true` and `false` in any case, or a number.
pub(super) fn flag(text: &str) -> Option<bool> {
    match text.to_ascii_lowercase().as_str() {
        "true" => Some(true),
        "false" => Some(false),
        text => number(text, 0..=u64::MAX).map(|number| number != 0),
    }
}

/// One of several words, in any case; gives its place among them.
pub(super) fn word(text: &str, words: &[&str]) -> Option<usize> {
    words.iter().position(|word| word.eq_ignore_ascii_case(text))
}

/// A host without a port: an address or a name.
pub(super) fn host(text: &str) -> Option<Host> {
    match host_port::parse(text, "").ok()? {
        (Some(host), None) => settle_host(host),
        _ => None,
    }
}

/// A host as sockets take it; `None` for a link-local address that does not say on which interface.
///
/// An IPv4 address in the clothes of IPv6 is one of IPv4.
pub(super) fn settle_host(host: Host) -> Option<Host> {
    match host {
        host if host.without_zone().is_some() => None,
        Host::Ip(ip) => Some(Host::Ip(ip.to_canonical())),
        host => Some(host),
    }
}

/// The words of a list. mavlink-router does not mind a comma too many.
fn words(text: &str) -> Option<String> {
    let words: Vec<&str> = text.split(',').map(str::trim).filter(|word| !word.is_empty()).collect();
    (!words.is_empty()).then(|| words.join(","))
}

/// Messages by number, or by name as nowhere in mavlink-router.
pub(super) fn messages(text: &str) -> Option<Vec<MessageRef>> {
    value::messages(&words(text)?)
}

/// System or component ids.
pub(super) fn ids(text: &str) -> Option<Vec<u8>> {
    value::ids(&words(text)?)
}

/// Baud rates.
pub(super) fn bauds(text: &str) -> Option<Vec<u32>> {
    words(text)?.split(',').map(value::baud).collect()
}

/// What to say of a wrong value, if there is more to say than what would be right.
pub(super) fn hint(text: &str) -> &'static str {
    let is_list =
        |inner: &str| inner.bytes().all(|byte| byte.is_ascii_digit() || b", ".contains(&byte));
    match text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        Some(inner) if is_list(inner) => ", without brackets",
        _ if text.contains(" #") || text.contains(" ;") => " (a comment has its own line)",
        _ if text.len() > 1 && text.starts_with('0') && is_digits(text) => {
            ", without zeros before it"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_decimal_or_hexadecimal_and_never_octal() {
        assert_eq!(number("5760", 0..=65_535), Some(5760));
        assert_eq!(number("0x1680", 0..=65_535), Some(5760));
        assert_eq!(number("0", 0..=65_535), Some(0));
        for text in ["", "014550", "-1", "+1", "1.5", "0x", "0x+1", "70000", "5760 # default"] {
            assert_eq!(number(text, 0..=65_535), None, "{text}");
        }
    }

    #[test]
    fn a_flag_is_a_word_or_a_number() {
        for (text, expected) in [("TRUE", true), ("1", true), ("2", true), ("False", false)] {
            assert_eq!(flag(text), Some(expected), "{text}");
        }
        assert_eq!(flag("0"), Some(false));
        assert_eq!(flag("yes"), None);
    }

    #[test]
    fn a_host_has_no_port_and_an_interface_where_it_needs_one() {
        assert_eq!(host("10.0.0.2").unwrap().to_string(), "10.0.0.2");
        assert_eq!(host("[FE80::1%eth0]").unwrap().to_string(), "[fe80::1%eth0]");
        assert_eq!(host("[::ffff:1.2.3.4]").unwrap().to_string(), "1.2.3.4");
        assert_eq!(host("gcs.local").unwrap().to_string(), "gcs.local");
        for text in ["", "10.0.0.2:14550", "[fe80::1]", "::1", "14550", "10.0.0", ":1"] {
            assert_eq!(host(text), None, "{text}");
        }
    }

    #[test]
    fn a_list_bears_blanks_and_a_comma_too_many() {
        assert_eq!(ids(" 1, 255 ,"), Some(vec![1, 255]));
        assert_eq!(messages("0,raw_imu").unwrap().len(), 2);
        assert_eq!(bauds("57600,115200"), Some(vec![57_600, 115_200]));
        for text in ["", ",", "[21]", "256", "1 2", "1;2"] {
            assert_eq!(ids(text), None, "{text}");
        }
    }
}
