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

use crate::config::{Config, Endpoint, EndpointConfig, General, Place};
use crate::mavlink::Dialect;

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

    /// It as a line of a log, which says by itself whether something is wrong.
    pub fn to_log_line(&self) -> String {
        self.line("")
    }

    fn line(&self, word: &str) -> String {
        let place = self.place.as_ref().map(|place| format!("{place}: "));
        format!("{}{word}{}", place.unwrap_or_default(), self.text)
    }
}

/// `mavswitch.toml:3:5: warning: gcs: ...`; what is wrong needs no such word.
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.line(if self.is_wrong { "" } else { "warning: " }))
    }
}

/// Everything there is to say, in the order of the files.
pub fn check(config: &Config) -> Vec<Finding> {
    let mut config = config.clone();
    let (_, mut findings) = load(&mut config);
    findings.extend(keys::spare(&config));
    findings.extend(effects::check(&config.endpoints));
    findings.extend(effects::of_own_component(&config.general.own));
    findings.extend(config.endpoints.iter().flat_map(surroundings::check));
    findings.sort_by(|a, b| a.place.cmp(&b.place));
    findings
}

/// A configuration with which the program can start: all files that it names were read.
#[derive(Debug)]
pub struct Ready {
    /// For the program as a whole.
    pub general: General,
    /// What to join.
    pub endpoints: Vec<EndpointConfig>,
    /// What messages are called and look like.
    pub dialect: Dialect,
    /// What is to be said of it all the same.
    pub warnings: Vec<Finding>,
}

/// Reads the files that a configuration names; looks at no device and asks for no names.
///
/// # Errors
///
/// All that keeps the program from using it, in the order of the files. Of this [`check`] tells too.
pub fn prepare(mut config: Config) -> Result<Ready, Vec<Finding>> {
    let (dialect, mut findings) = load(&mut config);
    findings.sort_by(|a, b| a.place.cmp(&b.place));
    if findings.iter().any(|finding| finding.is_wrong) {
        findings.retain(|finding| finding.is_wrong);
        return Err(findings);
    }
    let endpoints = config.endpoints.into_iter().map(|endpoint| endpoint.config).collect();
    Ok(Ready { general: config.general, endpoints, dialect, warnings: findings })
}

/// Reads what can be read, and tells what a start would have to tell.
fn load(config: &mut Config) -> (Dialect, Vec<Finding>) {
    let (dialect, mut findings) = messages::load(config);
    findings.extend(keys::load(config));
    findings.extend(overlaps::check(&config.endpoints));
    findings.extend(config.endpoints.iter().filter_map(surroundings::log));
    (dialect, findings)
}

#[cfg(test)]
mod tests;
