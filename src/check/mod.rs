//! What can be said of a configuration before it is used: `mavswitch check`.
//!
//! Looks at this computer and asks for names, but opens no endpoint. What is wrong keeps the program
//! from starting; a warning tells of what may be on its way (a device, a name server) or of what
//! was probably not meant.

mod effects;
mod explain;
mod keys;
mod messages;
mod overlaps;
mod surroundings;

use std::fmt;

use crate::config::{Config, Endpoint, Place};

pub use explain::explain;

/// Something to tell the user.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Finding {
    /// Where in the files, if it is there.
    pub place: Option<Place>,
    /// Whether the program cannot start with it.
    pub is_wrong: bool,
    /// What it is, and what to do about it.
    pub text: String,
}

impl Finding {
    /// A warning about an option, or about the endpoint if there is no such option.
    fn warning(endpoint: &Endpoint, option: &str, text: impl fmt::Display) -> Self {
        let place = endpoint.place_of(option).cloned();
        Self { place, is_wrong: false, text: format!("{}: {text}", endpoint.config.name()) }
    }

    /// An option with which the program cannot start.
    fn wrong(endpoint: &Endpoint, option: &str, text: impl fmt::Display) -> Self {
        Self { is_wrong: true, ..Self::warning(endpoint, option, text) }
    }

    /// About the configuration as a whole.
    fn general(is_wrong: bool, text: impl fmt::Display) -> Self {
        Self { place: None, is_wrong, text: text.to_string() }
    }
}

/// `mavswitch.toml:3:5: warning: gcs: ...`; what is wrong needs no such word.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        let word = if self.is_wrong { "" } else { "warning: " };
        write!(f, "{word}{}", self.text)
    }
}

/// Everything there is to say, in the order of the files.
pub fn check(config: &Config) -> Vec<Finding> {
    let mut findings = messages::check(config);
    findings.extend(keys::check(config));
    findings.extend(overlaps::check(&config.endpoints));
    findings.extend(effects::check(&config.endpoints));
    findings.extend(effects::of_own_component(&config.general.own));
    findings.extend(config.endpoints.iter().flat_map(surroundings::check));
    findings.sort_by(|a, b| a.place.cmp(&b.place));
    findings
}

/// What keeps the program from using a configuration; looks at no device and asks for no names.
pub fn wrong(config: &Config) -> Vec<Finding> {
    let mut findings = messages::check(config);
    findings.extend(keys::check(config));
    findings.extend(overlaps::check(&config.endpoints));
    findings.retain(|finding| finding.is_wrong);
    findings.sort_by(|a, b| a.place.cmp(&b.place));
    findings
}

#[cfg(test)]
mod tests;
