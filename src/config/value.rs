//! Values of options: each function reads one kind of value, or gives `None` if it is none.

use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;

use super::key_files::KeyRef;
use super::options::{FlowControl, MessageRef, PathChoice};
use crate::routing::OldFrames;

/// Baud rates that some hardware has; the highest are those of USB converters.
pub(super) const BAUDS: RangeInclusive<u32> = 50..=20_000_000;

/// How long a frame may wait in a queue.
pub(super) const QUEUE_TIME: RangeInclusive<Duration> =
    Duration::from_millis(10)..=Duration::from_secs(60);

/// How long a peer may be silent or stuck.
pub(super) const TIMEOUT: RangeInclusive<Duration> =
    Duration::from_millis(100)..=Duration::from_secs(3600);

/// For how long copies of a frame may be dropped; any longer, real frames would be (rule 49c).
pub(super) const WINDOW: RangeInclusive<Duration> =
    Duration::from_millis(1)..=Duration::from_secs(1);

/// A hundred years: longer than anything runs, and short enough to be added to any time.
pub(super) const FOREVER: Duration = Duration::from_secs(100 * 365 * 86_400);

/// How often a message may be sent, in frames a second; bounded so that a pause is a `Duration`.
const HZ: RangeInclusive<f32> = 0.001..=1000.0;

/// An empty list, in words.
const NONE: &str = "none";

/// Message ids have 24 bits.
const MESSAGE_IDS: RangeInclusive<u32> = 0..=0xff_ffff;

/// Whether `text` is one decimal digit or more, and nothing else.
pub(super) fn is_digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit())
}

/// A whole number, without a sign.
pub(super) fn number<T: FromStr + PartialOrd>(text: &str, range: RangeInclusive<T>) -> Option<T> {
    let number = is_digits(text).then(|| text.parse().ok()).flatten()?;
    range.contains(&number).then_some(number)
}

/// A number with or without decimals, without a sign.
fn decimal<T: FromStr>(text: &str) -> Option<T> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, "0"));
    let is_decimal = is_digits(whole) && is_digits(decimals);
    is_decimal.then(|| text.parse().ok()).flatten()
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

/// Yes or no.
pub(super) fn flag(text: &str) -> Option<bool> {
    text.parse().ok()
}

/// Flow control of a serial port.
pub(super) fn flow(text: &str) -> Option<FlowControl> {
    [FlowControl::None, FlowControl::RtsCts].into_iter().find(|flow| flow.to_string() == text)
}

/// Which endpoints of a group send.
pub(super) fn path(text: &str) -> Option<PathChoice> {
    [PathChoice::All, PathChoice::Best].into_iter().find(|path| path.to_string() == text)
}

/// A time: `250ms`, `1.5s`, `2m`, or a bare number of seconds; rounded to milliseconds.
pub(super) fn seconds(text: &str, range: RangeInclusive<Duration>) -> Option<Duration> {
    time(text, 1000.0, &range)
}

/// A time: as [`seconds`], or none at all.
pub(super) fn seconds_or_zero(text: &str, range: RangeInclusive<Duration>) -> Option<Duration> {
    let zero = || seconds(text, Duration::ZERO..=Duration::ZERO);
    seconds(text, range).or_else(zero)
}

/// A time: as [`seconds`], but a bare number is one of milliseconds.
pub(super) fn millis(text: &str, range: RangeInclusive<Duration>) -> Option<Duration> {
    time(text, 1.0, &range)
}

fn time(text: &str, bare_unit: f64, range: &RangeInclusive<Duration>) -> Option<Duration> {
    let end = text.find(|c: char| c.is_ascii_alphabetic());
    let (number, unit) = text.split_at(end.unwrap_or(text.len()));
    let unit = match unit {
        "" => bare_unit,
        "ms" => 1.0,
        "s" => 1000.0,
        "m" => 60_000.0,
        _ => return None,
    };
    // Never negative, and saturating: what is too long is out of range in any case.
    let millis = (decimal::<f64>(number)? * unit).round() as u64;
    let time = Duration::from_millis(millis);
    range.contains(&time).then_some(time)
}

/// A time as text: `250ms`, `60s`.
pub(super) fn show_time(time: Duration) -> String {
    match time.as_millis() {
        millis if millis % 1000 == 0 => format!("{}s", millis / 1000),
        millis => format!("{millis}ms"),
    }
}

/// Messages and how often each may be sent: `ATTITUDE:4,30:0.5`.
pub(super) fn rates(text: &str) -> Option<Vec<(MessageRef, f32)>> {
    let mut rates = Vec::new();
    for rate in text.split(',') {
        let (message, hz) = rate.split_once(':')?;
        let message = message_ref(message)?;
        if rates.iter().any(|(other, _)| *other == message) {
            return None;
        }
        let hz = decimal(hz).filter(|hz| HZ.contains(hz))?;
        rates.push((message, hz));
    }
    Some(rates)
}

/// What [`rates`] reads, unless there are none.
pub(super) fn show_rates(rates: &[(MessageRef, f32)]) -> Option<String> {
    let rates = rates.iter().map(|(message, hz)| format!("{message}:{hz}"));
    let rates: Vec<String> = rates.collect();
    (!rates.is_empty()).then(|| rates.join(","))
}

/// How many times as fast: a number of 0 to 1000, with or without decimals.
pub(super) fn speed(text: &str) -> Option<f32> {
    decimal(text).filter(|speed| (0.0..=1000.0).contains(speed))
}

/// Messages by name or number: `RAW_IMU,27`.
pub fn messages(text: &str) -> Option<Vec<MessageRef>> {
    text.split(',').map(message_ref).collect()
}

/// Messages, or the word `none`.
pub(super) fn messages_or_none(text: &str) -> Option<Vec<MessageRef>> {
    if text == NONE { Some(Vec::new()) } else { messages(text) }
}

/// What [`messages_or_none`] reads.
pub(super) fn show_messages_or_none(list: &[MessageRef]) -> Option<String> {
    show_list(list).or_else(|| Some(NONE.to_owned()))
}

/// The name of a key, which is not read yet.
pub(super) fn key(text: &str) -> Option<KeyRef> {
    key_name(text).map(|name| KeyRef { name, key: None })
}

/// What a key may be called.
pub(super) fn key_name(text: &str) -> Option<String> {
    name(text).filter(|name| !name.contains('='))
}

/// What becomes of MAVLink 1 where frames are signed.
pub(super) fn old_frames(text: &str) -> Option<OldFrames> {
    let all = [OldFrames::Pass, OldFrames::Upgrade, OldFrames::Drop];
    all.into_iter().find(|it| show_old_frames(*it) == text)
}

/// What [`old_frames`] reads.
pub(super) fn show_old_frames(old_frames: OldFrames) -> &'static str {
    match old_frames {
        OldFrames::Pass => "pass",
        OldFrames::Upgrade => "upgrade",
        OldFrames::Drop => "drop",
    }
}

/// System or component ids: `1,255`.
pub fn ids(text: &str) -> Option<Vec<u8>> {
    text.split(',').map(|id| number(id, 0..=255)).collect()
}

/// What [`messages`] and [`ids`] read, unless there are none.
pub(super) fn show_list<T: ToString>(list: &[T]) -> Option<String> {
    let words: Vec<String> = list.iter().map(ToString::to_string).collect();
    (!words.is_empty()).then(|| words.join(","))
}

/// A message by number, or by name in any case.
fn message_ref(text: &str) -> Option<MessageRef> {
    if is_digits(text) {
        return number(text, MESSAGE_IDS).map(MessageRef::Id);
    }
    let is_allowed = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let is_name =
        text.starts_with(|c: char| c.is_ascii_alphabetic()) && text.bytes().all(is_allowed);
    is_name.then(|| MessageRef::Name(text.to_ascii_uppercase()))
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

    #[test]
    fn a_time_has_a_unit_or_the_one_that_goes_without_saying() {
        let long = || Duration::ZERO..=Duration::from_secs(100_000);
        for (text, millis, shown) in [
            ("250ms", 250, "250ms"),
            ("30s", 30_000, "30s"),
            ("1.5s", 1500, "1500ms"),
            ("2m", 120_000, "120s"),
            ("0.5m", 30_000, "30s"),
            ("1.0004", 1000, "1s"),
            ("60", 60_000, "60s"),
        ] {
            let time = Duration::from_millis(millis);
            assert_eq!(seconds(text, long()), Some(time), "{text}");
            assert_eq!(show_time(time), shown);
        }
        assert_eq!(millis("60", long()), seconds("60ms", long()));
        for text in
            ["", "s", "-1s", "1,5s", ".5s", "5.", "1 s", "1S", "1us", "1.5.1", "1e3", "9e9m"]
        {
            assert_eq!(seconds(text, long()), None, "{text}");
        }
        assert_eq!(seconds(&"9".repeat(400), long()), None);
    }

    #[test]
    fn messages_are_named_or_numbered() {
        let rates = rates("Attitude:4,30:0.5").unwrap();
        let attitude = MessageRef::Name("ATTITUDE".to_owned());
        assert_eq!(rates, [(attitude, 4.0), (MessageRef::Id(30), 0.5)]);
        assert_eq!(show_rates(&rates).as_deref(), Some("ATTITUDE:4,30:0.5"));
        assert_eq!(show_rates(&[]), None);
    }
}
