//! Rows of the table of options: how much is sent, and how fast.

use super::{ANY, put};
use crate::config::option_spec::OnChange::InPlace;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value::{self, QUEUE_TIME};

pub(super) const PACE: &[OptionSpec] = &[
    OptionSpec {
        name: "bandwidth",
        value: "BYTES_PER_S",
        shape: Shape::Number,
        expects: "a whole number of bytes a second, 10 to 1000000000",
        help: "pace what is sent at this rate; serial ports are paced at their line rate",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| {
            let rate = value::number(text, 10..=1_000_000_000);
            put(&mut to.options.bandwidth, rate.map(Some))
        },
        show: |options| options.bandwidth.as_ref().map(ToString::to_string),
    },
    OptionSpec {
        name: "queue_time",
        value: "TIME",
        shape: Shape::Time,
        expects: "a time of 10ms to 60s",
        help: "how long a frame may wait for a paced link",
        default: Some("250ms"),
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.queue_time, value::seconds(text, QUEUE_TIME)),
        show: |options| Some(value::show_time(options.queue_time)),
    },
    OptionSpec {
        name: "rate",
        value: "MESSAGE:HZ[,MESSAGE:HZ...]",
        shape: Shape::Rates,
        expects: "MESSAGE:HZ with commas between, each message once, 0.001 to 1000 Hz",
        help: "send these messages, by name or number, at most so often",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.rate, value::rates(text)),
        show: |options| value::show_rates(&options.rate),
    },
];
