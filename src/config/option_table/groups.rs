//! Rows of the table of options: paths that several endpoints share.

use super::{ANY, put};
use crate::config::option_spec::OnChange::InPlace;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value::{self, WINDOW};

pub(super) const GROUPS: &[OptionSpec] = &[
    OptionSpec {
        name: "group",
        value: "NAME",
        shape: Shape::Text,
        expects: "1 to 64 printable characters",
        help: "endpoints of one group are one path: nothing is forwarded between them",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.group, value::name(text).map(Some)),
        show: |options| options.group.clone(),
    },
    OptionSpec {
        name: "path",
        value: "all|best",
        shape: Shape::Text,
        expects: "all or best",
        help: "send over every link of the group, or over the best",
        default: Some("all"),
        applies_to: ANY,
        needs: Some("group"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.path, value::path(text)),
        show: |options| Some(options.path.to_string()),
    },
    OptionSpec {
        name: "prefer",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 0 to 255",
        help: "the rank within the group: the highest is preferred",
        default: Some("0"),
        applies_to: ANY,
        needs: Some("group"),
        on_change: InPlace,
        set: |to, text| put(&mut to.options.prefer, value::number(text, 0..=255)),
        show: |options| Some(options.prefer.to_string()),
    },
    OptionSpec {
        name: "dedup",
        value: "MS",
        shape: Shape::Time,
        expects: "a time of 1 to 1000 milliseconds",
        help: "drop the second copy of a frame within this time; within 500 ms where a group has none",
        default: None,
        applies_to: ANY,
        needs: None,
        on_change: InPlace,
        set: |to, text| put(&mut to.options.dedup, value::millis(text, WINDOW).map(Some)),
        show: |options| options.dedup.map(value::show_time),
    },
];
