//! Definition files that cannot be loaded, and messages that have no definition.

use super::Finding;
use crate::config::{Config, Endpoint, MessageRef, load_dialect, message_hint};
use crate::mavlink::Dialect;

/// How many groups the router can tell apart.
const MAX_GROUPS: usize = 256;

/// Loads the definition files, as far as they can be, and tells what is wrong.
pub(super) fn load(config: &Config) -> (Dialect, Vec<Finding>) {
    let mut findings = Vec::new();
    let mut dialect = Dialect::builtin();
    for file in &config.general.dialect {
        match load_dialect(file).map(|definitions| dialect.add(definitions)) {
            Ok(Ok(())) => {}
            Ok(Err(error)) => findings.push(Finding::general(true, error)),
            Err(error) => findings.push(Finding::general(true, error)),
        }
    }
    // Their messages may be those that cannot be found.
    if findings.is_empty() {
        findings.extend(config.endpoints.iter().flat_map(|it| unknown(it, &dialect)));
    }
    findings.extend(too_many_groups(&config.endpoints));
    (dialect, findings)
}

/// Messages that an option names and no definition has.
fn unknown(endpoint: &Endpoint, dialect: &Dialect) -> Vec<Finding> {
    let options = &endpoint.config.options;
    let rates: Vec<MessageRef> = options.rate.iter().map(|(message, _)| message.clone()).collect();
    let lists = [
        ("rate", &rates),
        ("allow_unsigned", &options.allow_unsigned),
        ("allow_messages_in", &options.filter_in.allow_messages),
        ("block_messages_in", &options.filter_in.block_messages),
        ("allow_messages_out", &options.filter_out.allow_messages),
        ("block_messages_out", &options.filter_out.block_messages),
    ];
    let messages =
        lists.into_iter().flat_map(|(option, list)| list.iter().map(move |it| (option, it)));
    let unknown = messages.filter_map(|(option, message)| match message {
        MessageRef::Name(name) if !is_known(name, dialect) => Some((option, name)),
        _ => None,
    });
    unknown.map(|(option, name)| Finding::wrong(endpoint, option, hint(name, dialect))).collect()
}

fn is_known(name: &str, dialect: &Dialect) -> bool {
    dialect.definitions().iter().any(|definition| definition.name == name)
}

fn hint(name: &str, dialect: &Dialect) -> String {
    let hint = message_hint(name, dialect, "load its definition with `dialect`");
    format!("no message is called {name}: {hint}")
}

fn too_many_groups(endpoints: &[Endpoint]) -> Option<Finding> {
    let mut groups: Vec<&String> =
        endpoints.iter().filter_map(|endpoint| endpoint.config.options.group.as_ref()).collect();
    groups.sort();
    groups.dedup();
    let text = format!("there are {} groups: {MAX_GROUPS} is the most", groups.len());
    (groups.len() > MAX_GROUPS).then(|| Finding::general(true, text))
}
