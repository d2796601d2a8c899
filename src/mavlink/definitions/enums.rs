//! Enums of a definition file: what the values of fields are called. They are for people alone, so
//! nothing that is wrong with them is worth refusing a file for: it is passed over.

use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;

use super::MAX_NAME;
use crate::mavlink::fields::EnumNames;

/// The enum that a tag opens; `None` for one whose values are bits.
pub(super) fn open(tag: &BytesStart<'_>) -> Option<EnumNames> {
    let is_of_bits = attribute(tag, "bitmask").is_some_and(|value| value.trim() == "true");
    let name = name(tag, "name").filter(|_| !is_of_bits)?;
    Some(EnumNames { name, entries: Vec::new() })
}

/// Takes in an entry.
pub(super) fn add(names: &mut EnumNames, tag: &BytesStart<'_>) {
    let value = attribute(tag, "value").and_then(|text| number(&text));
    if let (Some(value), Some(name)) = (value, name(tag, "name")) {
        // Every entry begins with the name of its enum, which says nothing more.
        let own = name.strip_prefix(&format!("{}_", names.name));
        names.entries.push((value, own.unwrap_or(&name).to_owned()));
    }
}

/// The enum of a field.
pub(super) fn of_field(tag: &BytesStart<'_>) -> Option<String> {
    name(tag, "enum")
}

fn name(tag: &BytesStart<'_>, key: &str) -> Option<String> {
    let is_identifier = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let fits =
        |name: &String| (1..=MAX_NAME).contains(&name.len()) && name.bytes().all(is_identifier);
    attribute(tag, key).filter(fits)
}

fn attribute(tag: &BytesStart<'_>, key: &str) -> Option<String> {
    let found = tag.try_get_attribute(key).ok()??;
    let value = found.normalized_value(XmlVersion::Implicit1_0).ok()?;
    Some(value.into_owned())
}

/// `17`, `0x11` and `0b10001`.
fn number(text: &str) -> Option<u64> {
    let text = text.trim();
    match text.get(..2) {
        Some("0x" | "0X") => u64::from_str_radix(&text[2..], 16).ok(),
        Some("0b" | "0B") => u64::from_str_radix(&text[2..], 2).ok(),
        _ => text.parse().ok(),
    }
}
