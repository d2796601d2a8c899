//! Rows of the table of options: simulated vehicles.

use super::put;
use crate::config::address::AddressKind::Sim;
use crate::config::option_spec::OnChange::Reopen;
use crate::config::option_spec::OptionSpec;
use crate::config::shape::Shape;
use crate::config::value;
use crate::sim::{MAX_VEHICLES, VehicleKind};

pub(super) const SIM: &[OptionSpec] = &[
    OptionSpec {
        name: "count",
        value: "N",
        shape: Shape::Number,
        expects: "a whole number of 1 to 250",
        help: "how many vehicles to simulate",
        default: Some("1"),
        applies_to: &[Sim],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.sim.count, value::number(text, 1..=MAX_VEHICLES)),
        show: |options| Some(options.sim.count.to_string()),
    },
    OptionSpec {
        name: "system",
        value: "ID",
        shape: Shape::Number,
        expects: "a whole number of 1 to 255",
        help: "the system id of the first simulated vehicle; the next ones follow",
        default: Some("1"),
        applies_to: &[Sim],
        needs: None,
        on_change: Reopen,
        set: |to, text| put(&mut to.options.sim.system, value::number(text, 1..=u8::MAX)),
        show: |options| Some(options.sim.system.to_string()),
    },
    OptionSpec {
        name: "vehicle",
        value: "copter|plane|rover|boat",
        shape: Shape::Text,
        expects: "copter, plane, rover or boat",
        help: "what kind of vehicle to simulate",
        default: Some("copter"),
        applies_to: &[Sim],
        needs: None,
        on_change: Reopen,
        set: |to, text| {
            let kind = VehicleKind::ALL.iter().find(|kind| kind.to_string() == text);
            put(&mut to.options.sim.vehicle, kind.copied())
        },
        show: |options| Some(options.sim.vehicle.to_string()),
    },
];
