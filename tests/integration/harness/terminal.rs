//! A terminal of its own for a program, by tmux: keys in, the screen out.

use std::process::{Command, Output};

use super::dir::TempDir;
use super::process::eventually;

/// A terminal with one program in it, gone with the test.
pub(crate) struct Terminal {
    /// Where its server has its socket: nobody else's sessions are touched.
    dir: TempDir,
}

impl Terminal {
    /// Runs a command line of the shell in a terminal of that size.
    pub(crate) fn start(columns: u16, rows: u16, line: &str) -> Self {
        let terminal = Self { dir: TempDir::new() };
        let (columns, rows) = (columns.to_string(), rows.to_string());
        // The shell stays when the command has ended, or was interrupted, so that what it left behind
        // can be seen.
        let line = format!("trap : INT; {line}; exec cat");
        terminal.tmux(&["new-session", "-d", "-x", &columns, "-y", &rows, &line]);
        terminal
    }

    /// Types keys, by the names that tmux has for them: `q`, `C-c`, `Down`.
    pub(crate) fn press(&self, keys: &[&str]) {
        self.tmux(&[&["send-keys"], keys].concat());
    }

    /// What is to be seen, without colours.
    pub(crate) fn screen(&self) -> String {
        let output = self.tmux(&["capture-pane", "-p"]);
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// Waits until this is to be seen; says what else is.
    pub(crate) fn wait_for(&self, text: &str) -> String {
        let mut screen = String::new();
        eventually(&format!("`{text}` on the screen"), || {
            screen = self.screen();
            screen.contains(text)
        });
        screen
    }

    fn tmux(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new("tmux");
        command.arg("-S").arg(self.dir.path("socket")).args(["-f", "/dev/null"]);
        command.env("SHELL", "/bin/sh").env_remove("TMUX");
        command.args(arguments).output().expect("tmux runs")
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.tmux(&["kill-server"]);
    }
}

/// As one word of the shell.
pub(crate) fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}
