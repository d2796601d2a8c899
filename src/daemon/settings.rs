//! What the words of the configuration mean for the router: message names, filters, paces.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::endpoint::Endpoint;
use super::error::StartError;
use crate::config::{
    Address, Device, EndpointConfig, EndpointOptions, FilterOptions, KeyRef, MAX_ENDPOINTS,
    MessageRef, message_hint,
};
use crate::mavlink::{Dialect, MessageId, Recipes, SystemMap, Version};
use crate::routing::{Capacity, FilterLists, GateOptions, LinkOptions, RateCap, Sign, Verify};

/// How many groups the router can tell apart.
const MAX_GROUPS: usize = 256;

/// An endpoint as the user wants it, with every word of it looked up.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Settings {
    pub(super) config: EndpointConfig,
    pub(super) filter_in: FilterLists,
    pub(super) filter_out: FilterLists,
    pub(super) caps: Vec<RateCap>,
    pub(super) gate: GateOptions,
}

/// Looks up what the user wrote.
///
/// # Errors
///
/// If a message has a name that no definition has, or if there are too many groups or endpoints.
pub(super) fn settle(
    configs: Vec<EndpointConfig>,
    dialect: &Dialect,
) -> Result<Vec<Settings>, StartError> {
    if configs.len() > MAX_ENDPOINTS {
        return Err(StartError::TooManyEndpoints);
    }
    let groups: HashSet<_> = configs.iter().filter_map(|it| it.options.group.as_ref()).collect();
    if groups.len() > MAX_GROUPS {
        return Err(StartError::TooManyGroups);
    }
    configs.into_iter().map(|config| Settings::new(config, dialect)).collect()
}

impl Settings {
    fn new(config: EndpointConfig, dialect: &Dialect) -> Result<Self, StartError> {
        let (name, options) = (config.name(), &config.options);
        let caps = rate_caps(&name, &options.rate, dialect)?;
        let filter_in = filter_lists(&name, &options.filter_in, dialect)?;
        let mut filter_out = filter_lists(&name, &options.filter_out, dialect)?;
        if !options.heartbeats {
            filter_out.block_messages.push(MessageId::HEARTBEAT);
        }
        let is_server = config.address.kind().is_server();
        let gate = gate_options(&name, options, is_server, dialect)?;
        Ok(Self { config, filter_in, filter_out, caps, gate })
    }
}

fn rate_caps(
    endpoint: &str,
    rates: &[(MessageRef, f32)],
    dialect: &Dialect,
) -> Result<Vec<RateCap>, StartError> {
    let cap = |(message, rate): &(MessageRef, f32)| {
        let id = resolve(endpoint, message, dialect)?;
        // The rate is 0.001..=1000 as the option was read.
        Ok(RateCap { id, interval: Duration::from_secs_f32(1.0 / rate) })
    };
    rates.iter().map(cap).collect()
}

/// Whoever comes to a server has to show the key before anything is sent there. A wire or an address
/// that the user chose has not: two gateways that both waited would wait for ever.
fn gate_options(
    endpoint: &str,
    options: &EndpointOptions,
    is_server: bool,
    dialect: &Dialect,
) -> Result<GateOptions, StartError> {
    let key = |named: &KeyRef| {
        let unread =
            || StartError::UnreadKey { endpoint: endpoint.to_owned(), name: named.name.clone() };
        named.key.clone().ok_or_else(unread)
    };
    let sign = |named: &KeyRef| Ok(Sign { key: key(named)?, v1: options.v1 });
    let verify = |named: &KeyRef| {
        let allowed = options.allow_unsigned.iter().map(|it| resolve(endpoint, it, dialect));
        let allow_unsigned = allowed.collect::<Result<_, _>>()?;
        let (key, strip, before_sending) = (key(named)?, options.strip, is_server);
        Ok(Verify { key, allow_unsigned, strip, before_sending })
    };
    // Both were read as they must be.
    let remap = SystemMap::new(&options.remap).filter(|_| !options.remap.is_empty()).map(Arc::new);
    let needs_recipes = remap.is_some() || options.version == Some(1);
    let recipes = needs_recipes.then(|| Arc::new(Recipes::new(dialect)));
    Ok(GateOptions {
        is_readonly: options.readonly,
        max_rate: options.max_rate,
        blocks_stream_requests: options.block_stream_requests,
        remap,
        version: options.version.map(|it| if it == 1 { Version::V1 } else { Version::V2 }),
        passes_unconverted: !options.version_strict,
        recipes,
        sign: options.sign.as_ref().map(sign).transpose()?,
        needs_belief: false,
        verify: options.verify.as_ref().map(verify).transpose()?,
    })
}

fn filter_lists(
    endpoint: &str,
    options: &FilterOptions,
    dialect: &Dialect,
) -> Result<FilterLists, StartError> {
    let messages = |list: &[MessageRef]| -> Result<Vec<MessageId>, StartError> {
        list.iter().map(|message| resolve(endpoint, message, dialect)).collect()
    };
    Ok(FilterLists {
        allow_messages: messages(&options.allow_messages)?,
        block_messages: messages(&options.block_messages)?,
        allow_systems: options.allow_systems.clone(),
        block_systems: options.block_systems.clone(),
        allow_components: options.allow_components.clone(),
        block_components: options.block_components.clone(),
        block_single: None,
    })
}

fn resolve(
    endpoint: &str,
    message: &MessageRef,
    dialect: &Dialect,
) -> Result<MessageId, StartError> {
    match message {
        MessageRef::Id(id) => Ok(MessageId(*id)),
        MessageRef::Name(name) => dialect.id_of(name).ok_or_else(|| StartError::UnknownMessage {
            endpoint: endpoint.to_owned(),
            name: name.clone(),
            hint: message_hint(name, dialect, "load its definition with --dialect"),
        }),
    }
}

impl Endpoint {
    /// What the router must know of a link of this endpoint.
    pub(super) fn link_options(&self) -> LinkOptions {
        let options = self.options();
        let queue_time = options.queue_time;
        let rate = options.bandwidth.or_else(|| self.line_rate());
        LinkOptions {
            capacity: match rate {
                Some(rate) => Capacity::Paced { rate, queue_time },
                None => LinkOptions::default().capacity,
            },
            forward_setup_signing: options.forward_setup_signing,
            filter_in: self.filter_in.clone(),
            filter_out: self.filter_out.clone(),
            is_sniffer: options.sniffer,
            caps: self.caps.clone(),
            membership: self.membership,
            dedup: options.dedup,
            repeats_nobody: self.config.address.kind().is_inside(),
            gate: self.gate.clone(),
        }
    }

    /// What the line itself carries, in bytes a second, if it is one that has a rate: eight bits,
    /// a start bit and a stop bit for each byte.
    fn line_rate(&self) -> Option<u32> {
        let Address::Serial { device, bauds } = &self.config.address else { return None };
        match device {
            Device::Path(path) if is_usb_serial(self.real_device.as_ref().unwrap_or(path)) => None,
            // The flight controllers that are found by themselves are on USB.
            Device::Auto => None,
            Device::Path(_) => Some(bauds.get(self.baud)? / 10),
        }
    }

    /// The pace that goes with the baud rate in use, unless the user has set another.
    pub(super) fn pace(&self) -> Option<u32> {
        self.options().bandwidth.or_else(|| self.line_rate())
    }
}

/// Whether a device is a USB one that only looks like a serial port, and takes bytes as fast as USB
/// does, whatever its baud rate.
fn is_usb_serial(device: &Path) -> bool {
    let name = device.file_name().unwrap_or_default().to_string_lossy();
    name.starts_with("ttyACM") || name.starts_with("ttyGS")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::routing::Time;

    fn settle_one(text: &str) -> Result<Endpoint, StartError> {
        let mut settled = settle(vec![text.parse().unwrap()], &Dialect::builtin())?;
        Ok(Endpoint::new(settled.remove(0), Time::ZERO))
    }

    #[test]
    fn a_uart_is_paced_at_a_tenth_of_its_baud_rate_and_usb_is_not() {
        let capacity = |text| settle_one(text).unwrap().link_options().capacity;
        let queue_time = Duration::from_millis(250);
        let paced = |rate| Capacity::Paced { rate, queue_time };
        assert_eq!(capacity("serial:/dev/ttyS9:57600"), paced(5_760));
        assert_eq!(capacity("serial:/dev/ttyACM7:57600"), Capacity::Bytes(32_768));
        assert_eq!(capacity("serial:/dev/ttyACM7:57600?bandwidth=9000"), paced(9_000));
        assert_eq!(capacity("udpin::14550"), Capacity::Bytes(32_768));
    }

    #[test]
    fn a_name_stands_for_the_device_that_the_opener_found_behind_it() {
        let mut endpoint = settle_one("serial:/dev/serial/by-id/usb-fc:57600").unwrap();
        assert_eq!(endpoint.pace(), Some(5_760));
        endpoint.real_device = Some("/dev/ttyACM0".into());
        assert_eq!(endpoint.pace(), None);
        endpoint.real_device = Some("/dev/ttyUSB0".into());
        assert_eq!(endpoint.pace(), Some(5_760));
    }

    #[test]
    fn messages_are_capped_by_name_and_by_number() {
        let endpoint = settle_one("udpin::1?rate=ATTITUDE:2,33:0.5").unwrap();
        let caps = endpoint.caps.iter().map(|cap| (cap.id.0, cap.interval.as_millis()));
        assert_eq!(caps.collect::<Vec<_>>(), [(30, 500), (33, 2_000)]);
        let unknown = settle_one("udpin::1?rate=ATTITUD:2").unwrap_err();
        let text = "udpin:0.0.0.0:1: no message is called ATTITUD: did you mean ATTITUDE?";
        assert_eq!(unknown.to_string(), text);
    }

    #[test]
    fn groups_and_endpoints_are_bounded() {
        let groups = (0..=256).map(|n| format!("udpin::1?group=g{n}").parse().unwrap());
        let settled = settle(groups.collect(), &Dialect::builtin());
        assert_eq!(settled.unwrap_err().to_string(), "there are more than 256 groups");
        let many = vec!["udpin::1".parse().unwrap(); MAX_ENDPOINTS + 1];
        let settled = settle(many, &Dialect::builtin());
        assert_eq!(settled.unwrap_err().to_string(), "there are more than 4096 endpoints");
    }
}
