//! What the payload of a message says, field by field: for people who look, not for the router.
//!
//! A message's layout comes from a definition file. The commonest messages are built in, and read
//! from their text only when somebody looks. Any payload can be read: what was cut from its end is
//! zero (rule 10).

use std::collections::HashMap;
use std::fmt;
use std::sync::LazyLock;

use super::crc::{Crc, implied_extra};
use super::definitions::{COMMON, Definitions, parse_definitions};
use super::frame::Frame;
use super::id::MessageId;

/// The fields of a message.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MessageLayout {
    /// The message id.
    pub id: MessageId,
    /// With the id, what tells this definition from all others (rule 16).
    pub crc_extra: u8,
    /// The name: `HEARTBEAT`.
    pub name: String,
    /// In the order of the file, extension fields last.
    pub fields: Vec<FieldLayout>,
}

/// A field, and where it stands.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FieldLayout {
    /// Its name: `custom_mode`.
    pub name: String,
    /// The type of it, or of each of its elements.
    pub element: Element,
    /// How many elements an array has, 1..=255; `None`: it is no array.
    pub elements: Option<u8>,
    /// Where it begins in the payload, in bytes.
    pub at: u8,
    /// The enum that its values are from: `MAV_TYPE`.
    pub names: Option<String>,
}

/// A type that the protocol has (rule 13).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs)]
pub enum Element {
    Char,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    Float,
    Double,
}

impl Element {
    /// The type of this name; a byte if there is none.
    pub(super) fn of(name: &str) -> Self {
        match name {
            "char" => Self::Char,
            "int8_t" => Self::I8,
            "int16_t" => Self::I16,
            "uint16_t" => Self::U16,
            "int32_t" => Self::I32,
            "uint32_t" => Self::U32,
            "int64_t" => Self::I64,
            "uint64_t" => Self::U64,
            "float" => Self::Float,
            "double" => Self::Double,
            _ => Self::U8,
        }
    }

    /// Its length in bytes.
    fn size(self) -> u8 {
        match self {
            Self::Char | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::Float => 4,
            Self::I64 | Self::U64 | Self::Double => 8,
        }
    }

    fn read(self, bytes: [u8; 8]) -> Value {
        let unsigned = u64::from_le_bytes(bytes);
        match self {
            Self::Char | Self::U8 | Self::U16 | Self::U32 | Self::U64 => Value::Unsigned(unsigned),
            // The bytes behind the value are zero: shifting there and back brings the sign.
            Self::I8 | Self::I16 | Self::I32 | Self::I64 => {
                let unused = 64 - u32::from(self.size()) * 8;
                Value::Signed((unsigned << unused) as i64 >> unused)
            }
            Self::Float => Value::Float(f32::from_bits(unsigned as u32)),
            Self::Double => Value::Double(f64::from_bits(unsigned)),
        }
    }
}

/// What the values of an enum are called, without the enum's own name before it.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct EnumNames {
    /// The name of the enum: `MAV_TYPE`.
    pub name: String,
    /// `(2, "QUADROTOR")`, in the order of the file.
    pub entries: Vec<(u64, String)>,
}

/// What a field says.
#[derive(Clone, PartialEq, Debug)]
pub enum Value {
    /// A whole number.
    Unsigned(u64),
    /// A whole number.
    Signed(i64),
    /// A fraction.
    Float(f32),
    /// A fraction.
    Double(f64),
    /// A number that has a name.
    Named(u64, String),
    /// Text up to its first zero; what is no UTF-8 is replaced.
    Text(String),
    /// Numbers, all of one kind.
    List(Vec<Self>),
}

/// Layouts to read payloads by.
#[derive(Clone, Default, Debug)]
pub struct Layouts {
    messages: HashMap<(MessageId, u8), MessageLayout>,
    enums: HashMap<String, EnumNames>,
}

impl Layouts {
    /// The commonest messages.
    pub fn builtin() -> Self {
        let mut layouts = Self::default();
        // It can be read: a test does.
        layouts.add(parse_definitions(COMMON).unwrap_or_default());
        layouts
    }

    /// Takes in the messages of a definition file. Where two definitions have the same id and
    /// CRC_EXTRA, the one with more fields is kept: it reads the frames of both (rule 10).
    pub fn add(&mut self, definitions: Definitions) {
        for layout in definitions.layouts {
            let key = (layout.id, layout.crc_extra);
            let is_longer = |old: &MessageLayout| old.fields.len() > layout.fields.len();
            if !self.messages.get(&key).is_some_and(is_longer) {
                self.messages.insert(key, layout);
            }
        }
        for names in definitions.enums {
            let known = self.enums.entry(names.name.clone()).or_default();
            known.entries.extend(names.entries);
        }
    }

    /// How the payload of a frame is laid out, by the definition that its checksum tells.
    pub fn find(&self, frame: &Frame<'_>) -> Option<&MessageLayout> {
        let crc = Crc::of(frame.checked_bytes());
        let crc_extra = implied_extra(crc, frame.checksum())?;
        self.messages.get(&(frame.header().id, crc_extra))
    }

    /// What a field of a frame says.
    pub fn read(&self, frame: &Frame<'_>, field: &FieldLayout) -> Value {
        let Some(elements) = field.elements else { return self.read_one(frame, field) };
        if field.element == Element::Char {
            let bytes = (0..elements).map(|n| frame.payload_byte(field.at.saturating_add(n)));
            let text: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
            return Value::Text(String::from_utf8_lossy(&text).into_owned());
        }
        let one = |n| field.element.read(bytes(frame, field, n));
        Value::List((0..elements).map(one).collect())
    }

    fn read_one(&self, frame: &Frame<'_>, field: &FieldLayout) -> Value {
        let value = field.element.read(bytes(frame, field, 0));
        let (Value::Unsigned(number), Some(names)) = (&value, &field.names) else { return value };
        let mut entries = self.enums.get(names).into_iter().flat_map(|names| &names.entries);
        match entries.find(|(known, _)| known == number) {
            Some((_, name)) => Value::Named(*number, name.clone()),
            None => value,
        }
    }
}

/// The bytes of an element, the lowest first, and zeros behind them.
fn bytes(frame: &Frame<'_>, field: &FieldLayout, n: u8) -> [u8; 8] {
    let size = field.element.size();
    let start = usize::from(field.at) + usize::from(n) * usize::from(size);
    let mut bytes = [0; 8];
    for (byte, at) in bytes.iter_mut().zip(start..start + usize::from(size)) {
        // A layout has at most 255 bytes.
        *byte = u8::try_from(at).map_or(0, |at| frame.payload_byte(at));
    }
    bytes
}

/// So many equal numbers at the end of a list are shown as one.
const MANY: usize = 4;

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsigned(number) => number.fmt(f),
            Self::Signed(number) => number.fmt(f),
            Self::Float(number) => write_fraction(f, f64::from(*number), 7),
            Self::Double(number) => write_fraction(f, *number, 12),
            Self::Named(_, name) => f.write_str(name),
            Self::Text(text) => write!(f, "{text:?}"),
            Self::List(values) => write_list(f, values),
        }
    }
}

/// With so many digits at most, and none that say nothing.
fn write_fraction(f: &mut fmt::Formatter<'_>, number: f64, digits: i32) -> fmt::Result {
    let size = number.abs();
    if number == 0.0 || !number.is_finite() {
        return write!(f, "{number}");
    }
    if !(1e-5..1e9).contains(&size) {
        return write!(f, "{number:.5e}");
    }
    let before = size.log10().floor() as i32 + 1;
    let after = usize::try_from(digits - before).unwrap_or(0).min(9);
    let text = format!("{number:.after$}");
    let short =
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    f.write_str(short)
}

fn write_list(f: &mut fmt::Formatter<'_>, values: &[Value]) -> fmt::Result {
    let last = values.last();
    let equal = values.iter().rev().take_while(|value| Some(*value) == last).count();
    let shown = if equal >= MANY { values.len() - equal + 1 } else { values.len() };
    f.write_str("[")?;
    for (n, value) in values[..shown].iter().enumerate() {
        let comma = if n > 0 { " " } else { "" };
        write!(f, "{comma}{value}")?;
    }
    if shown < values.len() {
        write!(f, " x{equal}")?;
    }
    f.write_str("]")
}

/// Reads every field of whatever frame stands in `data`, by all layouts there are.
///
/// # Fuzzing
///
/// Asserts that what is shown is one line.
pub fn fuzz_fields(data: &[u8]) {
    static LAYOUTS: LazyLock<Layouts> = LazyLock::new(Layouts::builtin);
    let layouts = &*LAYOUTS;
    let Ok(frame) = Frame::parse(data) else { return };
    let own = layouts.find(&frame);
    let of_id = layouts.messages.values().filter(|layout| layout.id == frame.header().id);
    for layout in of_id.chain(own) {
        for field in &layout.fields {
            let shown = layouts.read(&frame, field).to_string();
            assert!(!shown.contains('\n') && !shown.is_empty());
        }
    }
}

#[cfg(test)]
mod tests;
