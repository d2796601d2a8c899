//! Rows of the table of options: what the program itself says to whoever is there.

use super::row::flag;
use super::{ANY, put};
use crate::config::option_spec::OnChange::InPlace;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;

pub(super) const OWN: &[OptionSpec] = &[
    flag!(
        "own_component",
        "true",
        "let the component of `system` be heard here, and measure the round trip",
        ANY,
        own_component
    ),
    OptionSpec {
        name: "request_streams",
        value: "HZ",
        shape: Shape::Number,
        expects: "a whole number of messages a second, 1 to 50",
        help: "ask ArduPilot vehicles that are heard here for their telemetry, so often",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.request_streams, value::number(text, 1..=50).map(Some)),
        show: |options| options.request_streams.as_ref().map(ToString::to_string),
    },
    flag!(
        "block_stream_requests",
        "false",
        "do not take REQUEST_DATA_STREAM, by which ground stations ask for telemetry",
        ANY,
        block_stream_requests
    ),
];
