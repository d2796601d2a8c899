//! Options that change nothing where they stand.

use super::Finding;
use crate::config::{AddressKind, Endpoint, EndpointOptions, OwnOptions, PathChoice};

pub(super) fn check(endpoints: &[Endpoint]) -> Vec<Finding> {
    let mut findings: Vec<Finding> = endpoints.iter().flat_map(of_one).collect();
    findings.extend(endpoints.iter().flat_map(|endpoint| of_group(endpoint, endpoints)));
    findings.extend(too_few(endpoints));
    findings
}

/// What can be seen from one endpoint alone.
fn of_one(endpoint: &Endpoint) -> Vec<Finding> {
    let options = &endpoint.config.options;
    let default = EndpointOptions::default();
    let is_serial = endpoint.config.address.kind() == AddressKind::Serial;
    let mut findings = Vec::new();
    let mut tell = |option: &str, text: &str| {
        let text = format!("option `{option}` has no effect {text}");
        findings.push(Finding::warning(endpoint, option, text));
    };
    if options.mtu != default.mtu && !options.pack {
        tell("mtu", "without pack = true: each frame is a datagram of its own");
    }
    if options.queue_time != default.queue_time && options.bandwidth.is_none() && !is_serial {
        tell("queue_time", "without bandwidth: the link is not paced");
    }
    for (allow, block) in useless_blocks(options) {
        tell(block, &format!("beside `{allow}`, which does not allow any of it"));
    }
    findings
}

/// Lists of what is blocked, of which nothing is allowed in any case.
fn useless_blocks(options: &EndpointOptions) -> Vec<(&'static str, &'static str)> {
    fn is_useless<T: PartialEq>(allow: &[T], block: &[T]) -> bool {
        !allow.is_empty() && !block.is_empty() && !block.iter().any(|it| allow.contains(it))
    }
    let (from, to) = (&options.filter_in, &options.filter_out);
    let useless = [
        (
            is_useless(&from.allow_systems, &from.block_systems),
            "allow_systems_in",
            "block_systems_in",
        ),
        (
            is_useless(&from.allow_components, &from.block_components),
            "allow_components_in",
            "block_components_in",
        ),
        (
            is_useless(&to.allow_systems, &to.block_systems),
            "allow_systems_out",
            "block_systems_out",
        ),
        (
            is_useless(&to.allow_components, &to.block_components),
            "allow_components_out",
            "block_components_out",
        ),
    ];
    useless.into_iter().filter(|it| it.0).map(|(_, allow, block)| (allow, block)).collect()
}

/// What can be seen from the group of an endpoint.
fn of_group(endpoint: &Endpoint, all: &[Endpoint]) -> Vec<Finding> {
    let options = &endpoint.config.options;
    let Some(group) = &options.group else { return Vec::new() };
    let members = || all.iter().filter(|it| it.config.options.group.as_ref() == Some(group));
    let chooses = members().any(|it| it.config.options.path == PathChoice::Best);
    let mut findings = Vec::new();
    if members().count() == 1 && !is_listener(endpoint) {
        let text = format!("group `{group}` has no other member, so it has no effect");
        findings.push(Finding::warning(endpoint, "group", text));
    }
    if options.prefer != 0 && !chooses {
        let text = format!("option `prefer` has no effect without path = \"best\" in `{group}`");
        findings.push(Finding::warning(endpoint, "prefer", text));
    }
    findings
}

/// A component id of nobody.
pub(super) fn of_own_component(own: &OwnOptions) -> Option<Finding> {
    let has_effect = own.system.is_some() || *own == OwnOptions::default();
    let text = "`component` has no effect without `system`: the program is no component of its own";
    (!has_effect).then(|| Finding::general(false, text))
}

/// A router with less than two places to route between.
fn too_few(endpoints: &[Endpoint]) -> Option<Finding> {
    match endpoints {
        [] => Some(Finding::general(false, "there are no endpoints: nothing to join")),
        [only] if !is_listener(only) => {
            let text = "this is the only endpoint: there is nothing to route between";
            Some(Finding::warning(only, "address", text))
        }
        _ => None,
    }
}

/// Whether an endpoint can have several links.
fn is_listener(endpoint: &Endpoint) -> bool {
    endpoint.config.address.kind().is_server()
}
