//! The effective configuration as text in TOML, which reads back as the same.

use std::collections::HashSet;
use std::fmt;
use std::iter;

use super::endpoint::EndpointConfig;
use super::file::parse_config;
use super::general::GENERAL;
use super::merge::Config;
use super::option_table::OPTIONS;
use super::shape::quoted;
use super::value;

/// Every general key, and of the endpoints what is not default. An endpoint without a name gets
/// its address for one, which is what it is called in the log as well.
impl fmt::Display for Config {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for spec in GENERAL {
            if let Some(value) = self.general.show(spec) {
                writeln!(f, "{} = {value}", spec.name)?;
            }
        }
        let mut names = HashSet::new();
        for endpoint in &self.endpoints {
            let name = unused_name(&endpoint.config, &mut names);
            write_endpoint(f, &name, &endpoint.config)?;
        }
        Ok(())
    }
}

fn write_endpoint(f: &mut fmt::Formatter<'_>, name: &str, config: &EndpointConfig) -> fmt::Result {
    writeln!(f, "\n[endpoint.{}]", key(name))?;
    writeln!(f, "address = {}", quoted(&config.address.to_string()))?;
    for spec in OPTIONS.iter().filter(|spec| spec.name != "name") {
        let value = spec.show(&config.options);
        if let Some(value) = value.filter(|value| Some(value.as_str()) != spec.default) {
            let words = spec.shape.split(&value);
            writeln!(f, "{} = {}", spec.name, spec.shape.to_toml(&words))?;
        }
    }
    Ok(())
}

/// The endpoint's own name; if it is no name or another has it, one like it.
pub(super) fn unused_name(config: &EndpointConfig, names: &mut HashSet<String>) -> String {
    let own = config.name();
    let own = value::name(&own).unwrap_or_else(|| config.address.kind().scheme().to_owned());
    let numbered = (2_usize..).map(|number| format!("{own} {number}"));
    let mut candidates = iter::once(own.clone()).chain(numbered);
    candidates.find(|name| names.insert(name.clone())).unwrap_or(own)
}

fn key(name: &str) -> String {
    let is_bare = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
    if is_bare { name.to_owned() } else { quoted(name) }
}

/// Holds that a configuration from one file reads back as the same.
///
/// # Panics
///
/// If it does not.
pub(super) fn assert_reads_back(config: &Config) {
    let text = config.to_string();
    let back = parse_config("back.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(back.general, config.general, "{text}");
    let endpoints = |config: &Config| -> Vec<EndpointConfig> {
        config.endpoints.iter().map(|endpoint| endpoint.config.clone()).collect()
    };
    assert_eq!(endpoints(&back), endpoints(config), "{text}");
}
