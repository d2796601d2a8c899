//! Signing keys that cannot be had, that others may read, or that nobody uses.

use super::Finding;
use crate::config::{Config, EndpointConfig, load_keys, unused_keys};

pub(super) fn check(config: &Config) -> Vec<Finding> {
    let mut findings = Vec::new();
    for endpoint in &config.endpoints {
        let files = &config.general.keys;
        let errors = load_keys(&mut endpoint.config.clone(), files).err().unwrap_or_default();
        let wrong =
            errors.into_iter().map(|(option, error)| Finding::wrong(endpoint, option, error));
        findings.extend(wrong);
    }
    findings.extend(spare(config));
    findings
}

/// What is to be said of keys that no endpoint names. One may yet name them, by request.
fn spare(config: &Config) -> Vec<Finding> {
    let endpoints: Vec<&EndpointConfig> = config.endpoints.iter().map(|it| &it.config).collect();
    let told = unused_keys(&endpoints, &config.general.keys).into_iter().map(|(file, error)| {
        let text = match error {
            Some(error) => error.to_string(),
            None => format!("key `{}` is used by no endpoint", file.name),
        };
        Finding::general(false, text)
    });
    told.collect()
}
