use super::*;
use crate::mavlink::{Component, Dialect, FrameSpec, Version, encode};

fn frame(id: u32, crc_extra: u8, payload: &[u8]) -> Vec<u8> {
    let (source, id) = (Component::new(1, 1), MessageId(id));
    let spec =
        FrameSpec { version: Version::V2, seq: 0, source, id, crc_extra, payload, signature: None };
    let mut bytes = Vec::new();
    encode(&spec, &mut bytes);
    bytes
}

/// `name=value`, field by field.
fn said(layouts: &Layouts, bytes: &[u8]) -> String {
    let frame = Frame::parse(bytes).unwrap();
    let layout = layouts.find(&frame).expect("the message is known");
    let fields = layout.fields.iter();
    let shown = fields.map(|field| format!("{}={}", field.name, layouts.read(&frame, field)));
    shown.collect::<Vec<_>>().join(" ")
}

#[test]
fn every_message_that_is_built_in_is_one_that_was_published() {
    let definitions = parse_definitions(COMMON).unwrap();
    assert!(definitions.messages.len() >= 60, "{}", definitions.messages.len());
    let published = Dialect::builtin();
    for (message, layout) in definitions.messages.iter().zip(&definitions.layouts) {
        // The checksum covers the names and types of all fields but the extensions.
        let known = published.by_pair(message.id, message.crc_extra);
        let known = known.unwrap_or_else(|| panic!("{}: wrong CRC_EXTRA", message.name));
        assert_eq!((&known.name, known.base_len), (&message.name, message.base_len));
        assert_eq!(known.max_len, message.max_len, "{}: the extensions", message.name);
        assert_eq!(known.target, message.target, "{}", message.name);
        let names = layout.fields.iter().filter_map(|field| field.names.as_ref());
        for name in names {
            let is_there = definitions.enums.iter().any(|known| known.name == *name);
            assert!(is_there, "{}: {name}", message.name);
        }
    }
}

#[test]
fn a_heartbeat_is_read_with_the_names_of_its_values() {
    let layouts = Layouts::builtin();
    // A copter of ArduPilot, armed, in mode 5, active.
    let heartbeat = frame(0, 50, &[5, 0, 0, 0, 2, 3, 209, 4, 3]);
    assert_eq!(
        said(&layouts, &heartbeat),
        "type=QUADROTOR autopilot=ARDUPILOTMEGA base_mode=209 custom_mode=5 system_status=ACTIVE \
         mavlink_version=3"
    );
}

#[test]
fn what_was_cut_from_the_end_is_zero_and_extensions_are_read() {
    let layouts = Layouts::builtin();
    let ack = frame(77, 143, &[144, 1]);
    assert_eq!(
        said(&layouts, &ack),
        "command=400 result=ACCEPTED progress=0 result_param2=0 target_system=0 target_component=0"
            .replace("400", "COMPONENT_ARM_DISARM")
    );
    let ack = frame(77, 143, &[144, 1, 4, 50, 255, 255, 255, 255, 255, 190]);
    assert!(said(&layouts, &ack).ends_with(
        "result=FAILED progress=50 result_param2=-1 target_system=255 target_component=190"
    ));
}

#[test]
fn fractions_texts_and_lists_are_readable() {
    let shown = |value: Value| value.to_string();
    assert_eq!(shown(Value::Float(0.1)), "0.1");
    assert_eq!(shown(Value::Float(-2.345_678_9)), "-2.345679");
    assert_eq!(shown(Value::Float(1.5e20)), "1.50000e20");
    assert_eq!(shown(Value::Float(0.0)), "0");
    assert_eq!(shown(Value::Float(12_345.0)), "12345");
    assert_eq!(shown(Value::Float(f32::NAN)), "NaN");
    assert_eq!(shown(Value::Double(47.397_742)), "47.397742");
    assert_eq!(shown(Value::Text("a\n\"b".to_owned())), r#""a\n\"b""#);
    let list =
        |numbers: &[u64]| Value::List(numbers.iter().copied().map(Value::Unsigned).collect());
    assert_eq!(shown(list(&[1, 2, 3])), "[1 2 3]");
    assert_eq!(shown(list(&[7, 0, 0, 0, 0])), "[7 0 x4]");
}

#[test]
fn a_dialect_of_the_users_own_is_read_by_its_file() {
    let xml = r#"<mavlink><enums><enum name="GRIP"><entry value="1" name="GRIP_OPEN"/></enum>
        <enum name="BITS" bitmask="true"><entry value="0x1" name="BITS_A"/></enum></enums>
        <messages><message id="12345" name="GRIPPER">
        <field type="uint8_t" name="state" enum="GRIP"/><field type="uint8_t" name="bits" enum="BITS"/>
        <field type="int16_t[2]" name="force"/><field type="char[4]" name="label"/>
        </message></messages></mavlink>"#;
    let definitions = parse_definitions(xml).unwrap();
    let crc_extra = definitions.messages[0].crc_extra;
    let mut layouts = Layouts::builtin();
    layouts.add(definitions);
    let bytes = frame(12_345, crc_extra, &[0xfe, 0xff, 2, 0, 1, 1, b'o', b'k']);
    assert_eq!(said(&layouts, &bytes), r#"state=OPEN bits=1 force=[-2 2] label="ok""#);
}

#[test]
fn exercise_fuzz_fields() {
    let layouts = Layouts::builtin();
    let mut state = 3_u32;
    let messages: Vec<(u32, u8)> = layouts.messages.keys().map(|key| (key.0.0, key.1)).collect();
    for (id, crc_extra) in messages {
        for len in [1, 9, 40, 255] {
            let next = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            };
            let payload: Vec<u8> = std::iter::repeat_with(next).take(len).collect();
            fuzz_fields(&frame(id, crc_extra, &payload));
        }
    }
}
