//! What can be wrong with a definition file, in words for whoever wrote it.
//!
//! Text from the file goes into a message only through [`excerpt`], so that no file can make a
//! message long or send control characters to a terminal.

use super::layout::MAX_PAYLOAD;
use super::{MAX_DEPTH, MAX_ID, MAX_MESSAGES, MAX_NAME};
use crate::mavlink::id::MessageId;

/// Why a text is no usable definition file, and where.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct DefinitionError {
    /// The line of the text, from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: DefinitionProblem,
}

/// What is wrong with a definition file.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum DefinitionProblem {
    /// Not XML at all, or broken XML.
    #[error("not well-formed XML: {0}")]
    Xml(String),
    /// XML, but not of this kind.
    #[error("no <mavlink> root element (is this a MAVLink definition file?)")]
    NoRoot,
    /// No definition file is nested like this.
    #[error("elements are nested more than {MAX_DEPTH} deep (is this a MAVLink definition file?)")]
    TooDeep,
    /// A message or field lacks an attribute that it needs; `element` tells which one it is.
    #[error("{element} has no {attribute} (add {attribute}=\"...\")")]
    NoAttribute {
        /// `a message`, `message FOO`, `a field of message FOO`.
        element: String,
        /// The name of the attribute.
        attribute: &'static str,
    },
    /// A name that is no identifier.
    #[error(
        "{element} has the name \"{name}\" (use 1 to {MAX_NAME} letters, digits and underscores)"
    )]
    BadName {
        /// `a message`, `a field of message FOO`.
        element: String,
        /// The name.
        name: String,
    },
    /// An id that is no number, or too large a one.
    #[error("message {message} has the id \"{id}\" (use a number from 0 to {MAX_ID})")]
    BadId {
        /// The name of the message.
        message: String,
        /// The id as written.
        id: String,
    },
    /// Two messages of one file with one id.
    #[error("message {message} has the id {id} of message {other} (give one of them another id)")]
    DuplicateId {
        /// The name of the later message.
        message: String,
        /// Their id.
        id: MessageId,
        /// The name of the earlier message.
        other: String,
    },
    /// A field of a type that there is not.
    #[error(
        "field {field} of message {message} has the unknown type \"{kind}\" (use char, float, \
         double, int8_t, uint8_t and so on up to uint64_t, or an array of these, as char[16])"
    )]
    UnknownType {
        /// The name of the message.
        message: String,
        /// The name of the field.
        field: String,
        /// The type as written.
        kind: String,
    },
    /// An array without a usable number of elements.
    #[error(
        "field {field} of message {message} has the type \"{kind}\" (an array has 1 to 255 \
         elements, as char[16])"
    )]
    ArrayLength {
        /// The name of the message.
        message: String,
        /// The name of the field.
        field: String,
        /// The type as written.
        kind: String,
    },
    /// No frame can carry this message.
    #[error(
        "message {message} is {len} bytes long with field {field}, and a frame carries \
         {MAX_PAYLOAD} (shorten an array, or split the message)"
    )]
    TooLong {
        /// The name of the message.
        message: String,
        /// The name of the first field that is too much, in the order of the file.
        field: String,
        /// The length with this field, in bytes.
        len: usize,
    },
    /// More messages than this program takes from one file.
    #[error("more than {MAX_MESSAGES} messages (give only the ones that are in use)")]
    TooManyMessages,
}

/// The start of a text from outside, fit for a message.
pub(super) fn excerpt(text: &str) -> String {
    const MOST: usize = 100;
    let printable = |c: char| if c.is_control() { '?' } else { c };
    let mut excerpt: String = text.chars().take(MOST).map(printable).collect();
    if text.chars().nth(MOST).is_some() {
        excerpt.push_str("...");
    }
    excerpt
}

#[cfg(test)]
mod tests {
    use super::super::parse_definitions;
    use super::*;

    /// A file with nothing but messages; they start in line 1.
    fn file(messages: &str) -> String {
        format!("<mavlink><messages>{messages}</messages></mavlink>")
    }

    fn error(xml: &str) -> String {
        parse_definitions(xml).unwrap_err().to_string()
    }

    #[test]
    fn a_text_from_outside_is_cut_and_cannot_control_a_terminal() {
        assert_eq!(excerpt("a\u{1b}[31mred\n"), "a?[31mred?");
        assert_eq!(excerpt(&"x".repeat(100)), "x".repeat(100));
        assert_eq!(excerpt(&"x".repeat(101)), format!("{}...", "x".repeat(100)));
    }

    #[test]
    fn what_is_wrong_with_the_xml_is_told_with_its_line() {
        let cases = [
            ("", "line 1: no <mavlink> root element (is this a MAVLink definition file?)"),
            ("\n<html/>", "line 2: no <mavlink> root element (is this a MAVLink definition file?)"),
            (
                "<mavlink>\n</messages>",
                "line 2: not well-formed XML: expected `</mavlink>`, but `</messages>` was found",
            ),
            (
                "\u{feff}\n<mavlink>\n<messages >\n",
                "line 3: not well-formed XML: <messages> is not closed",
            ),
            (
                "<mavlink/>\n<mavlink/>",
                "line 2: not well-formed XML: there is a second root element",
            ),
            (
                "<mavlink>\n<!-- ",
                "line 2: not well-formed XML: comment not closed: `-->` not found before end of input",
            ),
            (
                "<mavlink>\n<include>&who;</include>",
                "line 2: not well-formed XML: nothing is known as &who;",
            ),
        ];
        for (xml, message) in cases {
            assert_eq!(error(xml), message);
        }
        let deep = format!("<mavlink>{}", "<a>".repeat(64));
        let message =
            "line 1: elements are nested more than 64 deep (is this a MAVLink definition file?)";
        assert_eq!(error(&deep), message);
    }

    #[test]
    fn what_is_wrong_with_a_message_is_told_with_its_name_and_what_to_do() {
        let cases = [
            (r#"<message id="1"/>"#, r#"a message has no name (add name="...")"#),
            (r#"<message name="M"/>"#, r#"message M has no id (add id="...")"#),
            (
                r#"<message name="A B"/>"#,
                r#"a message has the name "A B" (use 1 to 80 letters, digits and underscores)"#,
            ),
            (
                r#"<message name="M" id="0x7"/>"#,
                r#"message M has the id "0x7" (use a number from 0 to 16777215)"#,
            ),
            (
                r#"<message name="M" id="16777216"/>"#,
                r#"message M has the id "16777216" (use a number from 0 to 16777215)"#,
            ),
            (
                r#"<message name="M" id="&x;"/>"#,
                "not well-formed XML: message M has an unknown &...; in its id",
            ),
            (
                r#"<message name=M/>"#,
                r#"not well-formed XML: a message has attributes that are not written name="value""#,
            ),
            (
                r#"<message name="A" id="7"/><message name="B" id="7"/>"#,
                "message B has the id 7 of message A (give one of them another id)",
            ),
        ];
        for (messages, problem) in cases {
            assert_eq!(error(&file(messages)), format!("line 1: {problem}"));
        }
        let many: String =
            (0..=MAX_MESSAGES).map(|id| format!("<message name=\"M\" id=\"{id}\"/>\n")).collect();
        let message = "line 4097: more than 4096 messages (give only the ones that are in use)";
        assert_eq!(error(&file(&many)), message);
    }

    #[test]
    fn what_is_wrong_with_a_field_is_told_with_its_name_and_what_to_do() {
        let cases = [
            (r#"<field type="char"/>"#, r#"a field of message M has no name (add name="...")"#),
            (r#"<field name="f"/>"#, r#"field f of message M has no type (add type="...")"#),
            (
                r#"<field name="f[2]"/>"#,
                r#"a field of message M has the name "f[2]" (use 1 to 80 letters, digits and underscores)"#,
            ),
            (
                r#"<field name="f" type="uint12_t"/>"#,
                r#"field f of message M has the unknown type "uint12_t" (use char, float, double, int8_t, uint8_t and so on up to uint64_t, or an array of these, as char[16])"#,
            ),
            (
                r#"<field name="f" type="char[256]"/>"#,
                r#"field f of message M has the type "char[256]" (an array has 1 to 255 elements, as char[16])"#,
            ),
            (
                r#"<field name="f" type="char[255]"/><extensions/><field name="g" type="uint16_t"/>"#,
                "message M is 257 bytes long with field g, and a frame carries 255 (shorten an array, or split the message)",
            ),
        ];
        for (fields, problem) in cases {
            let message = format!("<message id=\"1\" name=\"M\">\n{fields}</message>");
            assert_eq!(error(&file(&message)), format!("line 2: {problem}"));
        }
    }
}
