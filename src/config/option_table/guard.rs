//! Rows of the table of options: who may send here, what is signed, and what is made other.

use super::row::flag;
use super::{ANY, put};
use crate::config::option_spec::OnChange::InPlace;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;

const KEY: &str = "the name of one of the `keys`";

pub(super) const GUARD: &[OptionSpec] = &[
    flag!("readonly", "false", "take nothing that comes from here", ANY, readonly),
    OptionSpec {
        name: "max_rate",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of frames a second, 1 to 1000000",
        help: "take so many frames a second of each peer at most",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.max_rate, value::number(text, 1..=1_000_000).map(Some)),
        show: |options| options.max_rate.as_ref().map(ToString::to_string),
    },
    OptionSpec {
        name: "remap",
        value: "ID:ID[,ID:ID...]",
        shape: Shape::Systems,
        expects: "pairs of system ids of 1 to 255 with commas between, no id twice",
        help: "system ids that change places on the way: behind 1:7, system 1 is known here as 7",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.remap, value::system_pairs(text)),
        show: |options| value::show_system_pairs(&options.remap),
    },
    OptionSpec {
        name: "version",
        value: "1|2",
        shape: Shape::Number,
        expects: "1 or 2",
        help: "send in this version of MAVLink, as far as that can be",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.version, value::number(text, 1..=2).map(Some)),
        show: |options| options.version.as_ref().map(ToString::to_string),
    },
    OptionSpec {
        needs: Some("version"),
        ..flag!(
            "version_strict",
            "true",
            "do not send what cannot be had in that version",
            ANY,
            version_strict
        )
    },
    flag!(
        "heartbeats",
        "true",
        "send HEARTBEAT; false is for links that are slow and dear",
        ANY,
        heartbeats
    ),
    OptionSpec {
        name: "sign",
        value: "KEY",
        shape: Shape::Text,
        expects: KEY,
        help: "sign what is sent and has no signature, with this key",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.sign, value::key(text).map(Some)),
        show: |options| options.sign.as_ref().map(|key| key.name.clone()),
    },
    OptionSpec {
        name: "v1",
        value: "pass|upgrade|drop",
        shape: Shape::Text,
        expects: "pass, upgrade or drop",
        help: "what becomes of MAVLink 1, which cannot be signed: made MAVLink 2, or dropped",
        default: Some("pass"),
        applies_to: ANY,
        needs: Some("sign"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.v1, value::old_frames(text)),
        show: |options| Some(value::show_old_frames(options.v1).to_owned()),
    },
    OptionSpec {
        name: "verify",
        value: "KEY",
        shape: Shape::Text,
        expects: KEY,
        help: "take only what was signed with this key, each frame once",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.verify, value::key(text).map(Some)),
        show: |options| options.verify.as_ref().map(|key| key.name.clone()),
    },
    OptionSpec {
        name: "allow_unsigned",
        value: "MESSAGE[,MESSAGE...]",
        shape: Shape::List,
        expects: "messages by name or number with commas between, or none",
        help: "take these messages without a signature too",
        default: Some("RADIO_STATUS,RADIO"),
        applies_to: ANY,
        needs: Some("verify"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.allow_unsigned, value::messages_or_none(text)),
        show: |options| value::show_messages_or_none(&options.allow_unsigned),
    },
    OptionSpec {
        needs: Some("verify"),
        ..flag!(
            "strip",
            "false",
            "take the signature off, for those who cannot read it",
            ANY,
            strip
        )
    },
];
