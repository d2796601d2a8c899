//! In which keys two configurations of an endpoint differ, and what that means while it is open.

use super::address::Address;
use super::endpoint::EndpointConfig;
use super::option_spec::{OnChange, OptionSpec};
use super::option_table::OPTIONS;

/// A key whose value is another one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Difference {
    /// The key: `address`, or the name of an option.
    pub key: &'static str,
    /// What an endpoint that is open needs in order to have the other value.
    pub needs: OnChange,
}

impl EndpointConfig {
    /// All keys in which `other` is not the same.
    pub fn differences(&self, other: &Self) -> Vec<Difference> {
        let options = OPTIONS.iter().filter(|spec| {
            let is_baud = spec.name == "baudrate" && self.has_other_bauds(other);
            is_baud || spec.show(&self.options) != spec.show(&other.options)
        });
        let options =
            options.map(|spec| Difference { key: spec.name, needs: self.on_change(spec) });
        let address = Difference { key: "address", needs: OnChange::Reopen };
        let address = (!self.is_at_same_place(other)).then_some(address);
        address.into_iter().chain(options).collect()
    }

    /// What cannot change while the endpoint is open: if another configuration has the same, an open
    /// endpoint can become as that one.
    pub fn fixed(&self) -> String {
        let mut fixed = match &self.address {
            Address::Serial { device, .. } => device.to_string(),
            address => address.to_string(),
        };
        for spec in OPTIONS.iter().filter(|spec| self.on_change(spec) == OnChange::Reopen) {
            // No value has a line feed.
            fixed.push('\n');
            fixed += &spec.show(&self.options).unwrap_or_default();
        }
        fixed
    }

    /// Whether an endpoint that is open can become `other` as it is.
    pub fn can_become(&self, other: &Self) -> bool {
        self.fixed() == other.fixed()
    }

    /// What this endpoint needs in order to have another value of an option.
    fn on_change(&self, spec: &OptionSpec) -> OnChange {
        match self.address {
            // Vehicles are made with their rate.
            Address::Sim if spec.name == "rate" => OnChange::Reopen,
            _ => spec.on_change,
        }
    }

    /// Whether both have the same address, apart from baud rates, which are an option.
    fn is_at_same_place(&self, other: &Self) -> bool {
        match (&self.address, &other.address) {
            (Address::Serial { device: a, .. }, Address::Serial { device: b, .. }) => a == b,
            (a, b) => a == b,
        }
    }

    fn has_other_bauds(&self, other: &Self) -> bool {
        match (&self.address, &other.address) {
            (Address::Serial { bauds: a, .. }, Address::Serial { bauds: b, .. }) => a != b,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn differences(a: &str, b: &str) -> Vec<(&'static str, OnChange)> {
        let (a, b): (EndpointConfig, EndpointConfig) = (a.parse().unwrap(), b.parse().unwrap());
        let differences = a.differences(&b);
        assert_eq!(differences.is_empty(), a == b);
        let reopens = differences.iter().any(|it| it.needs == OnChange::Reopen);
        assert_eq!(a.can_become(&b), !reopens);
        differences.into_iter().map(|it| (it.key, it.needs)).collect()
    }

    #[test]
    fn options_say_whether_the_endpoint_has_to_be_opened_again() {
        let old = "udpout:10.0.0.2?name=gcs&rate=ATTITUDE:4";
        assert_eq!(differences(old, old), []);
        let new = "udpout:10.0.0.2?name=laptop&rate=ATTITUDE:5";
        assert_eq!(
            differences(old, new),
            [("name", OnChange::InPlace), ("rate", OnChange::InPlace)]
        );
        let new = "udpout:10.0.0.2?name=gcs&bind=:1";
        assert_eq!(
            differences(old, new),
            [("bind", OnChange::Reopen), ("rate", OnChange::InPlace)]
        );
        let new = "udpout:10.0.0.3?name=gcs&rate=ATTITUDE:4";
        assert_eq!(differences(old, new), [("address", OnChange::Reopen)]);
    }

    #[test]
    fn vehicles_are_made_with_their_rate() {
        let reopens = [("rate", OnChange::Reopen), ("count", OnChange::Reopen)];
        assert_eq!(differences("sim:", "sim:?rate=10&count=2"), reopens);
        assert_eq!(differences("sim:", "sim:?name=a"), [("name", OnChange::InPlace)]);
    }

    #[test]
    fn baud_rates_are_an_option_and_the_device_is_the_address() {
        let old = "serial:/dev/ttyS1:57600";
        let bauds = [("baudrate", OnChange::InPlace)];
        assert_eq!(differences(old, "serial:/dev/ttyS1:115200,57600"), bauds);
        let both = [("address", OnChange::Reopen), bauds[0]];
        assert_eq!(differences(old, "serial:/dev/ttyS2:115200"), both);
        assert_eq!(differences(old, "udpin::1"), [("address", OnChange::Reopen)]);
    }
}
