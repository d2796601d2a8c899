//! Words of the command line that are no endpoint: what was probably meant.

use clap::CommandFactory;

use super::Cli;
use crate::config::{AddressKind, EndpointConfig, nearest};

/// Reads an endpoint; for what is none, says what to write instead.
pub(super) fn endpoint(text: &str) -> Result<EndpointConfig, String> {
    text.parse().map_err(|error| meant(text).unwrap_or_else(|| format!("{error}")))
}

/// What a word was probably meant to be, if it is no endpoint at all.
fn meant(word: &str) -> Option<String> {
    if matches!(word, "true" | "false") {
        return Some(format!("an option has its value behind `=`: --strict={word}"));
    }
    if word.ends_with(".toml") {
        return Some(format!("a configuration file is named by -c: mavswitch -c {word}"));
    }
    let cli = Cli::command();
    let commands = || cli.get_subcommands().map(clap::Command::get_name);
    if commands().any(|command| command == word) {
        return Some(format!(
            "a command goes first, and its options behind it: mavswitch {word} ..."
        ));
    }
    let mut known: Vec<&str> = AddressKind::spellings().collect();
    known.extend(commands());
    let near = nearest(word, known.into_iter())?;
    let is_command = commands().any(|command| command == near);
    is_command.then(|| format!("no endpoint, and no command: did you mean `mavswitch {near}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_endpoint_is_told_what_it_was_meant_to_be() {
        for (word, told) in [
            ("status", "a command goes first, and its options behind it: mavswitch status ..."),
            ("stauts", "no endpoint, and no command: did you mean `mavswitch status`?"),
            ("false", "an option has its value behind `=`: --strict=false"),
            ("my.toml", "a configuration file is named by -c: mavswitch -c my.toml"),
            ("ttyACM0", "endpoint `ttyACM0`: unknown scheme `ttyACM0`: write /dev/ttyACM0"),
            ("upd:14550", "endpoint `upd:14550`: unknown scheme `upd`: did you mean `udp`?"),
            ("udpn", "endpoint `udpn`: unknown scheme `udpn`: did you mean `udpin`?"),
        ] {
            assert_eq!(endpoint(word).unwrap_err(), told);
        }
        assert!(endpoint("udpin:14550").is_ok());
    }
}
