//! The layout of a message's payload, worked out from its fields as the XML file gives them.
//!
//! Owns the wire order (rule 13), CRC_EXTRA (rule 16) and which fields are targets (rules 27-30).
//! Knows nothing of XML: [`super`] reads the files.

use std::borrow::Cow;
use std::cmp::Reverse;

use crate::mavlink::crc::Crc;
use crate::mavlink::dialect::{Definition, Target};
use crate::mavlink::fields::{Element, FieldLayout, MessageLayout};
use crate::mavlink::id::MessageId;

/// The longest payload a frame can carry, in bytes.
pub(super) const MAX_PAYLOAD: usize = 255;

/// A message as its definition lists it, field by field.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) id: MessageId,
    pub(super) name: String,
    /// In the order of the file, extension fields last.
    fields: Vec<Field>,
    /// How many of `fields` came before `<extensions/>`, once that was seen.
    base_fields: Option<usize>,
}

#[derive(Debug)]
struct Field {
    name: String,
    kind: FieldType,
    /// What its values are called.
    names: Option<String>,
    /// Its place in the file.
    place: usize,
}

impl Layout {
    pub(super) fn new(id: MessageId, name: String) -> Self {
        Self { id, name, fields: Vec::new(), base_fields: None }
    }

    pub(super) fn add(&mut self, name: String, kind: FieldType, names: Option<String>) {
        let place = self.fields.len();
        self.fields.push(Field { name, kind, names, place });
    }

    /// All fields added from now on are extension fields.
    pub(super) fn start_extensions(&mut self) {
        self.base_fields.get_or_insert(self.fields.len());
    }

    /// The length of the payload with every field so far, in bytes.
    pub(super) fn len(&self) -> usize {
        len_of(&self.fields)
    }

    /// What a router must know of the message, and what a reader must.
    ///
    /// The caller has seen to it that the payload is at most [`MAX_PAYLOAD`] bytes long.
    pub(super) fn into_parts(mut self) -> (Definition, MessageLayout) {
        let base_fields = self.base_fields.unwrap_or(self.fields.len());
        // Rule 13: the sort is stable, and extension fields stay as they are.
        self.fields[..base_fields].sort_by_key(|field| Reverse(field.kind.element_size));
        let base = &self.fields[..base_fields];
        let definition = Definition {
            id: self.id,
            crc_extra: crc_extra(&self.name, base),
            base_len: len_of(base) as u16,
            max_len: self.len() as u16,
            target: self.target(),
            name: Cow::Owned(self.name.clone()),
        };
        let (id, crc_extra) = definition.key();
        let fields = in_order_of_file(self.fields);
        (definition, MessageLayout { id, crc_extra, name: self.name, fields })
    }

    /// Rules 27-30. Fields must be in wire order.
    fn target(&self) -> Target {
        // The one message with a target system of another name.
        let is_manual_control = self.id == MessageId(69) && self.name == "MANUAL_CONTROL";
        let system = self
            .offset_of("target_system")
            .or_else(|| self.offset_of("target").filter(|_| is_manual_control));
        match (system, self.offset_of("target_component")) {
            (None, _) => Target::None,
            (Some(system), None) => Target::System(system),
            (Some(system), Some(component)) => Target::SystemComponent(system, component),
        }
    }

    fn offset_of(&self, name: &str) -> Option<u8> {
        let at = self.fields.iter().position(|field| field.name == name)?;
        u8::try_from(len_of(&self.fields[..at])).ok()
    }
}

/// From wire order, with the place in the payload of each.
fn in_order_of_file(fields: Vec<Field>) -> Vec<FieldLayout> {
    let mut offset = 0;
    let with_offset = |field: Field| {
        let Field { name, kind, names, place } = field;
        // A payload has at most [`MAX_PAYLOAD`] bytes.
        let at = offset as u8;
        offset += kind.len();
        let FieldType { element, elements, .. } = kind;
        (place, FieldLayout { name, element: Element::of(element), elements, at, names })
    };
    let mut fields: Vec<(usize, FieldLayout)> = fields.into_iter().map(with_offset).collect();
    fields.sort_by_key(|(place, _)| *place);
    fields.into_iter().map(|(_, field)| field).collect()
}

fn len_of(fields: &[Field]) -> usize {
    fields.iter().map(|field| field.kind.len()).sum()
}

/// Rule 16, of base fields in wire order.
fn crc_extra(message: &str, base: &[Field]) -> u8 {
    let mut crc = Crc::new();
    crc.update(format!("{message} ").as_bytes());
    for Field { name, kind, .. } in base {
        crc.update(format!("{} {name} ", kind.element).as_bytes());
        if let Some(elements) = kind.elements {
            crc.update(&[elements]);
        }
    }
    let [low, high] = crc.value().to_le_bytes();
    low ^ high
}

/// The type of a field.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct FieldType {
    /// The type of one element, as it enters CRC_EXTRA.
    element: &'static str,
    /// The length of one element in bytes.
    element_size: u8,
    /// How many elements an array has, 1..=255; none if it is no array.
    elements: Option<u8>,
}

/// Why a text is no [`FieldType`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum TypeError {
    /// There is no such element type.
    Element,
    /// An array needs 1 to 255 elements.
    ArrayLength,
}

impl FieldType {
    /// Reads `uint8_t`, `char[16]` and the like.
    pub(super) fn parse(text: &str) -> Result<Self, TypeError> {
        let (element, elements) = match text.split_once('[') {
            Some((element, rest)) => (element, Some(rest)),
            None => (text, None),
        };
        let (element, element_size) = match element {
            // A byte that senders fill with the version of the protocol.
            "uint8_t_mavlink_version" => ("uint8_t", 1),
            _ => element_type(element).ok_or(TypeError::Element)?,
        };
        let elements = elements.map(array_length).transpose()?;
        Ok(Self { element, element_size, elements })
    }

    /// Its length in a payload, in bytes.
    pub(super) fn len(self) -> usize {
        usize::from(self.element_size) * usize::from(self.elements.unwrap_or(1))
    }
}

/// `rest` is what follows the opening bracket.
fn array_length(rest: &str) -> Result<u8, TypeError> {
    rest.strip_suffix(']')
        .and_then(|digits| digits.parse().ok())
        .filter(|length| *length > 0)
        .ok_or(TypeError::ArrayLength)
}

fn element_type(name: &str) -> Option<(&'static str, u8)> {
    const TYPES: [(&str, u8); 11] = [
        ("char", 1),
        ("int8_t", 1),
        ("uint8_t", 1),
        ("int16_t", 2),
        ("uint16_t", 2),
        ("int32_t", 4),
        ("uint32_t", 4),
        ("float", 4),
        ("int64_t", 8),
        ("uint64_t", 8),
        ("double", 8),
    ];
    // The official generator takes `uint8` for `uint8_t`, and so some dialects are written.
    let is_it = |known: &str| known == name || known.strip_suffix("_t") == Some(name);
    TYPES.into_iter().find(|(known, _)| is_it(known))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(id: u32, name: &str, fields: &[(&str, &str)]) -> Layout {
        let mut layout = Layout::new(MessageId(id), name.to_owned());
        for (kind, name) in fields {
            layout.add((*name).to_owned(), FieldType::parse(kind).unwrap(), None);
        }
        layout
    }

    #[test]
    fn rule_16_the_version_byte_counts_as_any_other() {
        let fields = [
            ("uint8_t", "type"),
            ("uint8_t", "autopilot"),
            ("uint8_t", "base_mode"),
            ("uint32_t", "custom_mode"),
            ("uint8_t", "system_status"),
            ("uint8_t_mavlink_version", "mavlink_version"),
        ];
        let heartbeat = layout(0, "HEARTBEAT", &fields).into_parts().0;
        assert_eq!((heartbeat.crc_extra, heartbeat.base_len), (50, 9));
    }

    #[test]
    fn rule_13_arrays_are_sorted_by_the_size_of_their_elements() {
        let fields = [
            ("uint8_t", "target_system"),
            ("uint8_t", "target_component"),
            ("char[16]", "param_id"),
            ("int16_t", "param_index"),
        ];
        // PARAM_REQUEST_READ: the index first, then the bytes in the order of the file.
        let read = layout(20, "PARAM_REQUEST_READ", &fields).into_parts().0;
        assert_eq!((read.crc_extra, read.base_len), (214, 20));
        assert_eq!(read.target, Target::SystemComponent(2, 3));
    }

    #[test]
    fn rule_29_extension_fields_stay_unsorted_and_out_of_crc_extra() {
        let base = [("uint16_t", "command"), ("uint8_t", "result")];
        let mut ack = layout(77, "COMMAND_ACK", &base);
        ack.start_extensions();
        let extensions = [
            ("uint8_t", "progress"),
            ("int32_t", "result_param2"),
            ("uint8_t", "target_system"),
            ("uint8_t", "target_component"),
        ];
        for (kind, name) in extensions {
            ack.add(name.to_owned(), FieldType::parse(kind).unwrap(), None);
        }
        let ack = ack.into_parts().0;
        assert_eq!((ack.crc_extra, ack.base_len, ack.max_len), (143, 3, 10));
        assert_eq!(ack.target, Target::SystemComponent(8, 9));
    }

    #[test]
    fn rule_27_only_manual_control_has_a_target_of_another_name() {
        let fields = [("uint8_t", "target"), ("int16_t", "x")];
        let target = |id, name| layout(id, name, &fields).into_parts().0.target;
        assert_eq!(target(69, "MANUAL_CONTROL"), Target::System(2));
        assert_eq!(target(70, "MANUAL_CONTROL"), Target::None);
        assert_eq!(target(69, "OTHER"), Target::None);
        let lonely = layout(7, "LONELY", &[("uint8_t", "target_component")]);
        assert_eq!(lonely.into_parts().0.target, Target::None);
    }

    #[test]
    fn types_are_those_of_the_official_generator() {
        for (element, size) in [("char", 1), ("uint16_t", 2), ("float", 4), ("double", 8)] {
            assert_eq!(FieldType::parse(element).unwrap().len(), size);
            let array = FieldType::parse(&format!("{element}[7]")).unwrap();
            assert_eq!(array.len(), 7 * size);
        }
        assert_eq!(FieldType::parse("uint8[3]"), FieldType::parse("uint8_t[3]"));
        for text in ["", "_t", "UINT8_T", "uint8_t ", "string[4]"] {
            assert_eq!(FieldType::parse(text), Err(TypeError::Element), "{text}");
        }
        for text in ["char[", "char[]", "char[0]", "char[256]", "char[4]x"] {
            assert_eq!(FieldType::parse(text), Err(TypeError::ArrayLength), "{text}");
        }
    }
}
