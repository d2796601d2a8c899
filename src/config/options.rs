//! The options of an endpoint as values, and their defaults.

use super::host_port::HostPort;

/// The options of an endpoint; the default is what holds where nothing is written.
#[derive(Clone, PartialEq, Default, Debug)]
pub struct EndpointOptions {
    /// What the user calls the endpoint: 1 to 64 characters. Without it, its address is its name.
    pub name: Option<String>,
    /// The local address and port of a sender; port 0 is any free one. Without it, the system
    /// chooses both.
    pub bind: Option<HostPort>,
}
