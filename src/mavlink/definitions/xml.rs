//! The little of XML that definition files need, over the reader of quick-xml: attributes,
//! character references, and what is wrong in words.

use std::borrow::Cow;

use quick_xml::escape::resolve_xml_entity;
use quick_xml::events::{BytesRef, BytesStart};
use quick_xml::{Error, XmlVersion};

use super::MAX_NAME;
use super::error::{DefinitionProblem, excerpt};

/// The line, from 1, that the byte at offset `at` stands in.
pub(super) fn line_at(text: &str, at: usize) -> usize {
    let before = &text.as_bytes()[..at.min(text.len())];
    1 + before.iter().filter(|byte| **byte == b'\n').count()
}

/// A position of the reader as an offset into the text.
pub(super) fn offset(position: u64) -> usize {
    // The text lies in memory, so no position in it is larger than this.
    usize::try_from(position).unwrap_or(usize::MAX)
}

/// The name in the tag that `text` starts with.
pub(super) fn tag_name(text: &str) -> &str {
    let name = text.strip_prefix('<').unwrap_or(text);
    let end = name.find(|c: char| c.is_whitespace() || c == '>');
    &name[..end.unwrap_or(name.len())]
}

/// The name of a message or field; `element` says which, should it have none.
pub(super) fn name_of(tag: &BytesStart<'_>, element: &str) -> Result<String, DefinitionProblem> {
    let name = required(tag, "name", || element.to_owned())?;
    let is_identifier = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    if (1..=MAX_NAME).contains(&name.len()) && name.bytes().all(is_identifier) {
        return Ok(name.into_owned());
    }
    let (element, name) = (element.to_owned(), excerpt(&name));
    Err(DefinitionProblem::BadName { element, name })
}

/// The value of an attribute that `element` must have.
pub(super) fn required<'a>(
    tag: &'a BytesStart<'_>,
    attribute: &'static str,
    element: impl Fn() -> String,
) -> Result<Cow<'a, str>, DefinitionProblem> {
    let broken = |what: &str| DefinitionProblem::Xml(format!("{} has {what}", element()));
    let found = tag
        .try_get_attribute(attribute)
        .map_err(|_| broken("attributes that are not written name=\"value\""))?;
    let Some(found) = found else {
        let element = element();
        return Err(DefinitionProblem::NoAttribute { element, attribute });
    };
    found
        .normalized_value(XmlVersion::Implicit1_0)
        .map_err(|_| broken(&format!("an unknown &...; in its {attribute}")))
}

/// The character that `&name;` stands for.
pub(super) fn character(name: &BytesRef<'_>) -> Result<char, DefinitionProblem> {
    let known = match name.resolve_char_ref() {
        Ok(None) => resolve_xml_entity(name).and_then(|text| text.chars().next()),
        Ok(character) => character,
        Err(_) => None,
    };
    known.ok_or_else(|| {
        let text = format!("nothing is known as &{};", excerpt(name));
        DefinitionProblem::Xml(text)
    })
}

/// What the reader says, without the words it puts before it.
pub(super) fn problem(error: &Error) -> DefinitionProblem {
    let text = match error {
        Error::Syntax(error) => error.to_string(),
        Error::IllFormed(error) => error.to_string(),
        other => other.to_string(),
    };
    DefinitionProblem::Xml(excerpt(&text))
}
