//! The completions that ship: what `mavswitch completions SHELL` prints.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;
use mavswitch::cli::Cli;

use super::assert_shipped;

/// Each shell, and the file for it.
const FILES: [(Shell, &str); 3] =
    [(Shell::Bash, "mavswitch.bash"), (Shell::Zsh, "_mavswitch"), (Shell::Fish, "mavswitch.fish")];

#[test]
fn the_completions_complete_what_the_program_takes() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/completions");
    for (shell, name) in FILES {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "mavswitch", &mut script);
        assert_shipped(&dir.join(name), &String::from_utf8(script).unwrap());
    }
}
