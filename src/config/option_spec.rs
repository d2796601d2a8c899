//! One row of the table of options: what an option is called, what it takes and what it does.

use super::address::AddressKind;
use super::endpoint::EndpointConfig;
use super::error::{AddressProblem, printable};
use super::option_table::OPTIONS;
use super::options::EndpointOptions;
use super::shape::Shape;
use super::suggest;

/// What an endpoint that is open needs in order to have another value of an option.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum OnChange {
    /// Nothing: the value changes under its links, and no frame is lost.
    InPlace,
    /// To be closed and opened again.
    Reopen,
}

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
    /// What an endpoint that is open needs in order to have another value.
    pub on_change: OnChange,
    /// Reads a value; `None` if it is not right.
    pub(super) set: fn(&mut EndpointConfig, &str) -> Option<()>,
    /// The value as text, if there is one.
    pub(super) show: fn(&EndpointOptions) -> Option<String>,
}

impl OptionSpec {
    /// The option called `name`; for any other, one that `kind` takes is suggested.
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
