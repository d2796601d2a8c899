//! One row of the table of options: what an option is called, what it takes and what it does.

use super::address::AddressKind;
use super::endpoint::EndpointConfig;
use super::error::{AddressProblem, printable};
use super::options::EndpointOptions;
use super::shape::Shape;
use super::suggest;

/// One option.
#[derive(Clone, Copy, Debug)]
pub struct OptionSpec {
    /// The name, on the command line and in the file: `bind`.
    pub name: &'static str,
    /// The syntax of the value, for help: `HOST:PORT`.
    pub value: &'static str,
    /// Which TOML types the value may have.
    pub shape: Shape,
    /// What the value has to be, for errors: "expected " goes before it.
    pub expects: &'static str,
    /// What the option does, in one line.
    pub help: &'static str,
    /// The value that holds where nothing is written, if there is one.
    pub default: Option<&'static str>,
    /// The kinds of address that the option has a meaning for.
    pub applies_to: &'static [AddressKind],
    /// The option without which this one has no meaning.
    pub needs: Option<&'static str>,
    /// Reads a value; `None` if it is not right.
    pub(super) set: fn(&mut EndpointConfig, &str) -> Option<()>,
    /// The value as text, if there is one.
    pub(super) show: fn(&EndpointOptions) -> Option<String>,
}

impl OptionSpec {
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
