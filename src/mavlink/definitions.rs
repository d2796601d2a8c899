//! Reads the text of a MAVLink definition file, as everybody writes them for their dialect.
//!
//! Owns the XML: which elements matter and what may be wrong with them. What follows from a
//! message's fields is the business of `layout`; where files lie and which of them a file
//! includes is that of the config room. Descriptions and all unknown elements are skipped.
//!
//! The text may be anything: memory and time are bounded by its length, and nothing recurses.

use std::collections::HashMap;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use self::error::excerpt;
use self::layout::{FieldType, Layout, MAX_PAYLOAD, TypeError};
use super::dialect::{Definition, Target};
use super::fields::{EnumNames, MessageLayout};
use super::id::MessageId;

pub use self::error::{DefinitionError, DefinitionProblem};

mod enums;
mod error;
mod layout;
mod xml;

/// The commonest messages, with the names of their fields.
pub(super) const COMMON: &str = include_str!("definitions/common.xml");

/// How many messages one dialect may have: ten times what all published ones have together.
pub const MAX_MESSAGES: usize = 4096;
/// How deep elements may be nested; definition files need 6.
const MAX_DEPTH: usize = 64;
/// How long a name may be, in bytes; published ones have up to 40.
const MAX_NAME: usize = 80;
/// The largest message id, 24 bits.
const MAX_ID: u32 = 0xff_ffff;

/// What a definition file says.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Definitions {
    /// The files it includes, as written, in the order of the text.
    pub includes: Vec<String>,
    /// The messages it defines itself, in the order of the text; no id is there twice.
    pub messages: Vec<Definition>,
    /// The fields of the same messages, one for one.
    pub layouts: Vec<MessageLayout>,
    /// What the values of fields are called, of the enums that the file has; those whose values are
    /// bits of one number are left out.
    pub enums: Vec<EnumNames>,
}

/// Reads the text of a definition file.
///
/// # Errors
///
/// The first thing that is wrong with it, with its line; see [`DefinitionProblem`].
pub fn parse_definitions(xml: &str) -> Result<Definitions, DefinitionError> {
    // The reader would skip a byte order mark without counting it, and offsets would be off.
    let text = xml.trim_start_matches('\u{feff}');
    let mut parser = Parser::default();
    parser
        .read(text)
        .map_err(|problem| DefinitionError { line: xml::line_at(text, parser.at), problem })?;
    Ok(parser.found)
}

/// An element that is not closed yet.
#[derive(Clone, Copy, Debug)]
struct Open {
    place: Place,
    /// Where its tag starts, in bytes.
    at: usize,
}

/// Where in a definition file we are: the elements that matter, each in its place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Place {
    Mavlink,
    Include,
    Messages,
    Message,
    Field,
    Extensions,
    Enums,
    Enum,
    Entry,
    /// Of no interest, with all that is in it.
    Other,
}

impl Place {
    fn of(parent: Self, element: &str) -> Self {
        match (parent, element) {
            (Self::Mavlink, "include") => Self::Include,
            (Self::Mavlink, "messages") => Self::Messages,
            (Self::Mavlink, "enums") => Self::Enums,
            (Self::Enums, "enum") => Self::Enum,
            (Self::Enum, "entry") => Self::Entry,
            (Self::Messages, "message") => Self::Message,
            (Self::Message, "field") => Self::Field,
            (Self::Message, "extensions") => Self::Extensions,
            _ => Self::Other,
        }
    }
}

#[derive(Default)]
struct Parser {
    /// Where the event being handled starts, in bytes; on an error, where the error is.
    at: usize,
    /// The elements we are in, outermost first.
    open: Vec<Open>,
    /// Whether there was a root element.
    rooted: bool,
    /// The text of the `<include>` being read.
    include: String,
    /// The `<message>` being read.
    message: Option<Layout>,
    /// The `<enum>` being read.
    names: Option<EnumNames>,
    /// Which of the messages found has an id.
    by_id: HashMap<MessageId, usize>,
    found: Definitions,
}

type Step = Result<(), DefinitionProblem>;

impl Parser {
    fn read(&mut self, text: &str) -> Step {
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        loop {
            self.at = xml::offset(reader.buffer_position());
            match reader.read_event() {
                Ok(Event::Eof) => return self.end(text),
                Ok(event) => self.handle(event)?,
                Err(error) => {
                    self.at = xml::offset(reader.error_position());
                    return Err(xml::problem(&error));
                }
            }
        }
    }

    fn handle(&mut self, event: Event<'_>) -> Step {
        match event {
            Event::Start(tag) => return self.open(&tag),
            Event::End(_) => self.close(),
            Event::Text(text) if self.is_in(Place::Include) => self.include.push_str(&text),
            Event::CData(text) if self.is_in(Place::Include) => self.include.push_str(&text),
            Event::GeneralRef(name) if self.is_in(Place::Include) => {
                self.include.push(xml::character(&name)?);
            }
            _ => {}
        }
        Ok(())
    }

    fn is_in(&self, place: Place) -> bool {
        self.open.last().is_some_and(|open| open.place == place)
    }

    fn open(&mut self, tag: &BytesStart<'_>) -> Step {
        if self.open.len() == MAX_DEPTH {
            return Err(DefinitionProblem::TooDeep);
        }
        let name = tag.name();
        let place = match self.open.last() {
            Some(parent) => Place::of(parent.place, name.as_ref()),
            None => self.root(name.as_ref())?,
        };
        let at = self.at;
        self.open.push(Open { place, at });
        match place {
            Place::Message => self.open_message(tag),
            Place::Field => self.add_field(tag),
            Place::Extensions => {
                self.start_extensions();
                Ok(())
            }
            Place::Enum => {
                self.names = enums::open(tag);
                Ok(())
            }
            Place::Entry => {
                self.names.iter_mut().for_each(|names| enums::add(names, tag));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn root(&mut self, name: &str) -> Result<Place, DefinitionProblem> {
        if self.rooted {
            let text = "there is a second root element".to_owned();
            return Err(DefinitionProblem::Xml(text));
        }
        self.rooted = true;
        if name == "mavlink" { Ok(Place::Mavlink) } else { Err(DefinitionProblem::NoRoot) }
    }

    fn open_message(&mut self, tag: &BytesStart<'_>) -> Step {
        if self.found.messages.len() == MAX_MESSAGES {
            return Err(DefinitionProblem::TooManyMessages);
        }
        let name = xml::name_of(tag, "a message")?;
        let id = xml::required(tag, "id", || format!("message {name}"))?;
        let Some(id) = id.trim().parse().ok().filter(|id| *id <= MAX_ID) else {
            let id = excerpt(&id);
            return Err(DefinitionProblem::BadId { message: name, id });
        };
        let id = MessageId(id);
        if let Some(other) = self.by_id.get(&id) {
            let other = self.found.messages[*other].name.to_string();
            let message = name;
            return Err(DefinitionProblem::DuplicateId { message, id, other });
        }
        self.message = Some(Layout::new(id, name));
        Ok(())
    }

    fn add_field(&mut self, tag: &BytesStart<'_>) -> Step {
        let Some(message) = &mut self.message else {
            return Ok(());
        };
        let field = xml::name_of(tag, &format!("a field of message {}", message.name))?;
        let of_message = || format!("field {field} of message {}", message.name);
        let kind = xml::required(tag, "type", of_message)?;
        let kind = FieldType::parse(&kind)
            .map_err(|error| type_problem(error, &message.name, &field, &kind))?;
        let len = message.len() + kind.len();
        if len > MAX_PAYLOAD {
            let message = message.name.clone();
            return Err(DefinitionProblem::TooLong { message, field, len });
        }
        message.add(field, kind, enums::of_field(tag));
        Ok(())
    }

    fn start_extensions(&mut self) {
        if let Some(message) = &mut self.message {
            message.start_extensions();
        }
    }

    fn close(&mut self) {
        match self.open.pop().map(|open| open.place) {
            Some(Place::Include) => {
                let name = std::mem::take(&mut self.include);
                self.found.includes.push(name.trim().to_owned());
            }
            Some(Place::Message) => {
                let Some(message) = self.message.take() else {
                    return;
                };
                self.by_id.insert(message.id, self.found.messages.len());
                let (definition, layout) = message.into_parts();
                self.found.messages.push(definition);
                self.found.layouts.push(layout);
            }
            Some(Place::Enum) => self.found.enums.extend(self.names.take()),
            _ => {}
        }
    }

    fn end(&mut self, text: &str) -> Step {
        if let Some(open) = self.open.last() {
            self.at = open.at;
            let name = xml::tag_name(&text[open.at..]);
            let problem = format!("<{}> is not closed", excerpt(name));
            return Err(DefinitionProblem::Xml(problem));
        }
        if self.rooted { Ok(()) } else { Err(DefinitionProblem::NoRoot) }
    }
}

fn type_problem(error: TypeError, message: &str, field: &str, kind: &str) -> DefinitionProblem {
    let (message, field, kind) = (message.to_owned(), field.to_owned(), excerpt(kind));
    match error {
        TypeError::Element => DefinitionProblem::UnknownType { message, field, kind },
        TypeError::ArrayLength => DefinitionProblem::ArrayLength { message, field, kind },
    }
}

/// Parses anything; what comes out must be something a frame can carry.
///
/// # Panics
///
/// If it is not: a mistake in this file or in its neighbours.
pub fn fuzz_definitions(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match parse_definitions(&text) {
        Ok(found) => found.messages.iter().for_each(check),
        Err(error) => {
            let lines = 1 + data.iter().filter(|byte| **byte == b'\n').count();
            assert!((1..=lines).contains(&error.line));
            let message = error.to_string();
            assert!(message.len() < 2000 && !message.contains(char::is_control));
        }
    }
}

fn check(message: &Definition) {
    assert!(message.id.0 <= MAX_ID);
    assert!(message.base_len <= message.max_len);
    assert!(usize::from(message.max_len) <= MAX_PAYLOAD);
    let last = match message.target {
        Target::None => return,
        Target::System(system) => system,
        Target::SystemComponent(system, component) => system.max(component),
    };
    assert!(u16::from(last) < message.max_len);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with nothing but messages; they start in line 1.
    fn file(messages: &str) -> String {
        format!("<mavlink><messages>{messages}</messages></mavlink>")
    }

    #[test]
    fn a_file_with_all_that_matters_and_much_that_does_not() {
        let xml = r#"<?xml version="1.0"?>
            <!DOCTYPE mavlink>
            <mavlink xmlns:x="urn:x">
              <!-- <include>not.xml</include> -->
              <include> ../common.xml
              </include><include><![CDATA[a&b]]>&amp;&#99;.xml</include>
              <version>3</version>
              <enums><enum name="E"><entry value="1" name="A"><message name="NOT" id="1"/>
              <description>a &lt; b &other;</description></entry></enum></enums>
              <messages>
                <message id="12345" name="GRIP">
                  <wip/><description>see <field type="x" name="x"/></description>
                  <field type="uint8_t" name="target_component" enum="C">who</field>
                  <field type='uint16_t' name='force' units="N">how &amp; why</field>
                  <field type="uint8_t" name="target_system" />
                  <extensions/>
                  <field type="uint8_t" name="hand">which</field>
                  <field type="float[3]" name="at">where</field>
                </message>
                <message name="EMPTY" id=" 16777215 "/>
              </messages>
            </mavlink>"#;
        let found = parse_definitions(xml).unwrap();
        assert_eq!(found.includes, ["../common.xml", "a&b&c.xml"]);
        let [grip, empty] = &found.messages[..] else {
            panic!("two messages expected: {found:?}");
        };
        assert_eq!((grip.id, grip.name.as_ref()), (MessageId(12_345), "GRIP"));
        assert_eq!((grip.base_len, grip.max_len), (4, 17));
        assert_eq!(grip.target, Target::SystemComponent(3, 2));
        assert_eq!((empty.id.0, empty.base_len, empty.max_len), (MAX_ID, 0, 0));
        assert_eq!(empty.target, Target::None);
    }

    #[test]
    fn targets_may_be_extension_fields() {
        let xml = file(
            r#"<message id="300" name="M"><field type="int32_t" name="x"/><extensions/>
            <field type="uint8_t" name="y"/><field type="uint8_t" name="target_system"/></message>"#,
        );
        let message = &parse_definitions(&xml).unwrap().messages[0];
        assert_eq!((message.base_len, message.max_len), (4, 6));
        assert_eq!(message.target, Target::System(5));
    }

    #[test]
    fn exercise_fuzz_definitions() {
        let whole = file(
            r#"<message id="1" name="M"><field type="char[9]" name="target_system"/><extensions/></message>"#,
        );
        // Whatever it is cut to, and whatever stands in the place of one of its bytes.
        for at in 0..whole.len() {
            fuzz_definitions(&whole.as_bytes()[..at]);
            for byte in [0, b'<', b'>', b'&', b'"', b'/', b'\n', b'[', 0xff] {
                let mut bytes = whole.clone().into_bytes();
                bytes[at] = byte;
                fuzz_definitions(&bytes);
            }
        }
        for nasty in [
            "<",
            "</",
            "<>",
            "<!",
            "<?",
            "<![CDATA[",
            "&",
            "&#0;",
            "&#xffffffffff;",
            "<a b",
            "\u{feff}",
        ] {
            fuzz_definitions(nasty.as_bytes());
            fuzz_definitions(format!("<mavlink><include>{nasty}").as_bytes());
            fuzz_definitions(nasty.repeat(10_000).as_bytes());
            fuzz_definitions(format!("{nasty}{nasty}é<mavlink>\u{e9}").as_bytes());
        }
        fuzz_definitions(format!("<mavlink a='{}'", "x".repeat(100_000)).as_bytes());
        fuzz_definitions(format!("<mavlink></{}>", "x\u{1b}".repeat(100_000)).as_bytes());
    }
}
