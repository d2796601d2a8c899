//! The table of options: everything that reads, prints or explains an option goes through it.

use super::address::AddressKind::{self, Multicast, TcpOut, UdpBroadcast, UdpOut};
use super::endpoint::EndpointConfig;
use super::error::{AddressProblem, printable};
use super::host_port::{self, Host, HostPort};
use super::options::EndpointOptions;
use super::suggest;
use super::value;

/// All options, in the order in which they are printed and explained.
pub const OPTIONS: &[OptionSpec] = &[
    OptionSpec {
        name: "name",
        value: "NAME",
        expects: "1 to 64 printable characters",
        help: "what the endpoint is called in log and status",
        default: None,
        applies_to: ANY,
        set: |endpoint, text| {
            endpoint.options.name = Some(value::name(text)?);
            Some(())
        },
        show: |options| options.name.clone(),
    },
    OptionSpec {
        name: "bind",
        value: "HOST:PORT",
        expects: "a local HOST:PORT, HOST or :PORT, IPv6 in brackets",
        help: "send from this local address and port",
        default: None,
        applies_to: SENDERS,
        set: |endpoint, text| {
            endpoint.options.bind = Some(local(text)?);
            Some(())
        },
        show: |options| options.bind.as_ref().map(ToString::to_string),
    },
];

const ANY: &[AddressKind] = AddressKind::ALL;
const SENDERS: &[AddressKind] = &[UdpOut, UdpBroadcast, Multicast, TcpOut];

/// One option: what it is called, what it takes and what it does.
#[derive(Clone, Copy, Debug)]
pub struct OptionSpec {
    /// The name, on the command line and in the file: `bind`.
    pub name: &'static str,
    /// The syntax of the value, for help: `HOST:PORT`.
    pub value: &'static str,
    /// What the value has to be, for errors: "expected " goes before it.
    pub expects: &'static str,
    /// What the option does, in one line.
    pub help: &'static str,
    /// The value that holds where nothing is written, if there is one.
    pub default: Option<&'static str>,
    /// The kinds of address that the option has a meaning for.
    pub applies_to: &'static [AddressKind],
    set: fn(&mut EndpointConfig, &str) -> Option<()>,
    show: fn(&EndpointOptions) -> Option<String>,
}

impl OptionSpec {
    /// The option called `name`; what an endpoint of this kind takes is suggested for any other.
    pub(super) fn find(name: &str, kind: AddressKind) -> Result<&'static Self, AddressProblem> {
        if let Some(spec) = OPTIONS.iter().find(|spec| spec.name == name) {
            return Ok(spec);
        }
        let taken = || OPTIONS.iter().filter(|spec| spec.is_for(kind));
        let known = || taken().map(|spec| spec.name);
        let hint = match suggest::nearest(name, known()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("{} takes {}", kind.scheme(), suggest::list(known(), "and")),
        };
        Err(AddressProblem::UnknownOption(name.to_owned(), hint))
    }

    /// Gives the option of `endpoint` this value.
    ///
    /// # Errors
    ///
    /// If the option means nothing for this kind of address, or the value is not right.
    pub fn set(&self, endpoint: &mut EndpointConfig, value: &str) -> Result<(), AddressProblem> {
        let kind = endpoint.address.kind();
        if !self.is_for(kind) {
            let kinds = suggest::list(self.applies_to.iter().map(|kind| kind.scheme()), "and");
            let scheme = kind.scheme();
            return Err(AddressProblem::NotApplicable(self.name, scheme, kinds));
        }
        (self.set)(endpoint, value)
            .ok_or_else(|| AddressProblem::BadValue(printable(value), self.name, self.expects))
    }

    /// The value as text that [`set`](Self::set) reads, if the option has one.
    pub fn show(&self, options: &EndpointOptions) -> Option<String> {
        (self.show)(options)
    }

    /// Whether the option has a meaning for this kind of address.
    pub fn is_for(&self, kind: AddressKind) -> bool {
        self.applies_to.contains(&kind)
    }
}

/// A local address: any of the computer's where no host is written, any free port likewise.
fn local(text: &str) -> Option<HostPort> {
    let (host, port) = host_port::parse(text, "").ok()?;
    if host.is_none() && port.is_none() {
        return None;
    }
    Some(HostPort {
        host: host.unwrap_or(Host::UNSPECIFIED),
        port: port.unwrap_or(0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_default_text_is_the_default_value() {
        for spec in OPTIONS {
            let default = spec.show(&EndpointOptions::default());
            assert_eq!(default.as_deref(), spec.default, "{}", spec.name);
        }
    }

    #[test]
    fn each_default_text_can_be_written() {
        for spec in OPTIONS {
            for kind in spec.applies_to {
                let text = format!("{}:{}", kind.scheme(), example(*kind));
                let endpoint: EndpointConfig = text.parse().unwrap();
                let mut written = endpoint.clone();
                if let Some(default) = spec.default {
                    spec.set(&mut written, default).unwrap();
                }
                assert_eq!(written, endpoint, "{}", spec.name);
            }
        }
    }

    #[test]
    fn names_are_unique_and_fit_a_file() {
        for (number, spec) in OPTIONS.iter().enumerate() {
            let is_allowed = |c: char| c.is_ascii_lowercase() || c == '_';
            assert!(spec.name.chars().all(is_allowed), "{}", spec.name);
            let others = &OPTIONS[number + 1..];
            assert!(others.iter().all(|other| other.name != spec.name));
        }
    }

    fn example(kind: AddressKind) -> &'static str {
        match kind {
            Multicast => "239.0.0.1",
            AddressKind::Serial => "auto",
            _ => "10.0.0.2",
        }
    }
}
