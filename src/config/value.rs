//! Values of options: each function reads one kind of value, or gives `None` if it is none.

use std::ops::RangeInclusive;
use std::str::FromStr;

/// Baud rates that some hardware has; the highest are those of USB converters.
pub(super) const BAUDS: RangeInclusive<u32> = 50..=20_000_000;

/// Whether `text` is one decimal digit or more, and nothing else.
pub(super) fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// A whole number, without a sign.
pub(super) fn number<T: FromStr + PartialOrd>(text: &str, range: RangeInclusive<T>) -> Option<T> {
    let number = is_digits(text).then(|| text.parse().ok()).flatten()?;
    range.contains(&number).then_some(number)
}

/// A baud rate, in bits a second.
pub(super) fn baud(text: &str) -> Option<u32> {
    number(text, BAUDS)
}

/// A name of the user's own: something that fits on a line.
pub(super) fn name(text: &str) -> Option<String> {
    let fits = (1..=64).contains(&text.chars().count()) && !text.contains(char::is_control);
    fits.then(|| text.to_owned())
}

/// A network interface, by the rules of the Linux kernel: 1 to 15 bytes, no slash, colon or blank.
pub(super) fn interface(text: &str) -> Option<String> {
    let is_allowed = |c: char| !c.is_control() && !c.is_whitespace() && !"/:]".contains(c);
    let is_name = (1..=15).contains(&text.len()) && text.chars().all(is_allowed);
    (is_name && text != "." && text != "..").then(|| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_digits_and_a_range() {
        assert_eq!(number("007", 0..=255_u8), Some(7));
        for text in ["", "+7", "-7", "7.0", " 7", "256", "99999999999999999999"] {
            assert_eq!(number(text, 0..=255_u8), None, "{text}");
        }
    }

    #[test]
    fn an_interface_is_named_as_the_kernel_names_it() {
        assert_eq!(interface("enp3s0f1").as_deref(), Some("enp3s0f1"));
        assert_eq!(interface("15").as_deref(), Some("15"));
        for text in ["", ".", "..", "a/b", "a:b", "a b", "sixteen-bytes---"] {
            assert_eq!(interface(text), None, "{text}");
        }
    }
}
