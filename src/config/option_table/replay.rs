//! Rows of the table of options: how a log is played back.

use super::put;
use crate::config::address::AddressKind::Tlog;
use crate::config::option_spec::OnChange::Reopen;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;

pub(super) const REPLAY: &[OptionSpec] = &[
    OptionSpec {
        name: "speed",
        value: "FACTOR",
        shape: Shape::Number,
        expects: "a number of 0 to 1000",
        help: "how many times as fast as it was recorded; 0: as fast as the others take it",
        default: Some("1"),
        applies_to: &[Tlog],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.speed, value::speed(text)),
        show: |options| Some(options.speed.to_string()),
    },
    OptionSpec {
        name: "loop",
        value: "true|false",
        shape: Shape::Flag,
        expects: "true or false",
        help: "begin anew when the log has ended",
        default: Some("false"),
        applies_to: &[Tlog],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.looped, value::flag(text)),
        show: |options| Some(options.looped.to_string()),
    },
];
