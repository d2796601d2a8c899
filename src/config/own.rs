//! Who the program itself is, if anybody: the values, and the general keys that say them.

use super::general::{GeneralSpec, put};
use super::shape::Shape;
use super::value;
use crate::mavlink::Component;

/// Who the program itself is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OwnOptions {
    /// Its system id, 1..=255; without it, it is nobody.
    pub system: Option<u8>,
    /// Its component id, 1..=255.
    pub component: u8,
}

impl Default for OwnOptions {
    fn default() -> Self {
        Self { system: None, component: Component::ONBOARD_COMPUTER }
    }
}

impl OwnOptions {
    /// Its id, if it is somebody.
    pub fn id(self) -> Option<Component> {
        self.system.map(|system| Component::new(system, self.component))
    }
}

pub(super) const SYSTEM: GeneralSpec = GeneralSpec {
    name: "system",
    shape: Shape::Number,
    expects: "a system id of 1 to 255",
    help: "be a component of this system: send HEARTBEAT, answer TIMESYNC and PING, measure links",
    default: None,
    is_reloaded: true,
    set: |to, words| {
        let system = words.first().and_then(|word| value::number(word, 1..=255));
        put(&mut to.own.system, system.map(Some))
    },
    show: |general| general.own.system.iter().map(ToString::to_string).collect(),
};

pub(super) const COMPONENT: GeneralSpec = GeneralSpec {
    name: "component",
    shape: Shape::Number,
    expects: "a component id of 1 to 255",
    help: "the component id of that component",
    default: Some("191"),
    is_reloaded: true,
    set: |to, words| {
        put(&mut to.own.component, words.first().and_then(|word| value::number(word, 1..=255)))
    },
    show: |general| vec![general.own.component.to_string()],
};
