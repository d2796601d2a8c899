//! Signing keys that cannot be had, or that others may read.

use super::Finding;
use crate::config::{Config, load_keys};

pub(super) fn check(config: &Config) -> Vec<Finding> {
    let mut findings = Vec::new();
    for endpoint in &config.endpoints {
        let files = &config.general.keys;
        let errors = load_keys(&mut endpoint.config.clone(), files).err().unwrap_or_default();
        let wrong =
            errors.into_iter().map(|(option, error)| Finding::wrong(endpoint, option, error));
        findings.extend(wrong);
    }
    findings
}
