//! Every (id, CRC_EXTRA) pair ever published: verified, read with its target, cut short.

use crate::frames::{Receiver, Taken, frame};
use mavswitch::mavlink::{Component, Definition, Dialect, Input, Target, Version};

const SOURCE: Component = Component::new(42, 43);
const TARGET: Component = Component::new(7, 9);

/// A payload of full length (as far as a frame holds it) that names [`TARGET`].
fn payload(definition: &Definition) -> Vec<u8> {
    let mut payload = vec![0x55; usize::from(definition.max_len).min(255)];
    let mut put = |offset: u8, id| payload[usize::from(offset)] = id;
    match definition.target {
        Target::None => {}
        Target::System(system) => put(system, TARGET.system),
        Target::SystemComponent(system, component) => {
            put(system, TARGET.system);
            put(component, TARGET.component);
        }
    }
    payload
}

fn expected_target(definition: &Definition) -> Component {
    match definition.target {
        Target::None => Component::new(0, 0),
        Target::System(_) => Component::new(TARGET.system, 0),
        Target::SystemComponent(..) => TARGET,
    }
}

fn read(definition: &Definition, version: Version, payload: &[u8]) -> Taken {
    let key = (definition.id.0, definition.crc_extra);
    let bytes = frame(version, 1, SOURCE, key, payload);
    let mut taken = Receiver::new().receive(&bytes, Input::Paused);
    assert_eq!(taken.len(), 1, "{definition:?}");
    let taken = taken.remove(0);
    assert_eq!(taken.bytes, bytes, "{definition:?}");
    assert!(taken.verified, "{definition:?}");
    taken
}

#[test]
fn every_pair_is_verified_and_read_with_its_target() {
    let dialect = Dialect::builtin();
    assert_eq!(dialect.definitions().len(), 765);
    for definition in dialect.definitions() {
        let taken = read(definition, Version::V2, &payload(definition));
        assert_eq!(taken.target, expected_target(definition), "{definition:?}");
        if definition.id.0 < 256 {
            let taken = read(definition, Version::V1, &payload(definition));
            assert_eq!(taken.target, expected_target(definition), "{definition:?}");
        }
    }
}

#[test]
fn rule_10_a_target_that_was_cut_off_is_everybody() {
    let dialect = Dialect::builtin();
    let mut targeted = 0;
    for definition in dialect.definitions() {
        let (Target::System(system) | Target::SystemComponent(system, _)) = definition.target
        else {
            continue;
        };
        targeted += 1;
        let payload = payload(definition);
        let cut = &payload[..usize::from(system)];
        assert_eq!(read(definition, Version::V2, cut).target.system, 0, "{definition:?}");
    }
    assert!(targeted > 119, "today's 119 targeted messages and the retired ones");
}

#[test]
fn rule_12_a_longer_payload_than_the_definition_has_is_legal() {
    for definition in Dialect::builtin().definitions() {
        let mut payload = payload(definition);
        payload.resize(255, 0xaa);
        let taken = read(definition, Version::V2, &payload);
        assert_eq!(taken.target, expected_target(definition), "{definition:?}");
    }
}
