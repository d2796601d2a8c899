//! Signing keys that cannot be had, that others may read, or that nobody uses.

use super::Finding;
use crate::config::{Config, EndpointConfig, KeyError, KeyFile, load_keys, read_keys, unused_keys};

/// Reads the key files, gives endpoints the keys that they name, and tells which cannot be had. One
/// that no endpoint names may yet be named, by request.
pub(super) fn load(config: &mut Config) -> Vec<Finding> {
    read_keys(&mut config.general.keys);
    let mut findings = Vec::new();
    for endpoint in &mut config.endpoints {
        let errors =
            load_keys(&mut endpoint.config, &config.general.keys).err().unwrap_or_default();
        let wrong = errors.into_iter();
        findings.extend(wrong.map(|(option, error)| Finding::wrong(endpoint, option, error)));
    }
    let unreadable = unused(config).into_iter().filter_map(|(_, error)| error);
    findings.extend(unreadable.map(|error| Finding::general(false, error)));
    findings
}

/// Keys that no endpoint names, although they could be had.
pub(super) fn spare(config: &Config) -> Vec<Finding> {
    let spare = unused(config).into_iter().filter(|(_, error)| error.is_none());
    let text = |file: &KeyFile| format!("key `{}` is used by no endpoint", file.name);
    spare.map(|(file, _)| Finding::general(false, text(file))).collect()
}

fn unused(config: &Config) -> Vec<(&KeyFile, Option<KeyError>)> {
    let endpoints: Vec<&EndpointConfig> = config.endpoints.iter().map(|it| &it.config).collect();
    unused_keys(&endpoints, &config.general.keys)
}
