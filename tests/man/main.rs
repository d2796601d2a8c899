//! The manual page that ships: made of prose by hand, the command line's own declaration and the
//! table of endpoint options.
//!
//! `man/mavswitch.1.in` has the prose, with a line such as `@OPTIONS@` where something generated
//! stands. The test makes the page anew and compares; `MAVSWITCH_WRITE_MAN=1 cargo test --test man`
//! writes it.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs, io};

use clap::CommandFactory;
use clap_mangen::Man;
use mavswitch::cli::Cli;
use mavswitch::config::{AddressKind, OPTIONS, OptionSpec};

/// The variable with which the test writes the page.
const WRITE: &str = "MAVSWITCH_WRITE_MAN";

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("man").join(name)
}

/// The page as it has to be.
fn page() -> String {
    let mut page = String::new();
    for line in fs::read_to_string(file("mavswitch.1.in")).unwrap().lines() {
        let generated = match line {
            "@TITLE@" => title(),
            "@OPTIONS@" => options(),
            "@COMMANDS@" => commands(),
            "@ENDPOINT_OPTIONS@" => OPTIONS.iter().map(endpoint_option).collect(),
            _ => format!("{line}\n"),
        };
        page.push_str(&generated);
    }
    page
}

fn title() -> String {
    format!(".TH MAVSWITCH 1 \"\" \"mavswitch {}\" \"User Commands\"\n", env!("CARGO_PKG_VERSION"))
}

/// The options of the command line. What an endpoint is, the prose tells.
fn options() -> String {
    let mut roff = Vec::new();
    let command = Cli::command().mut_arg("endpoints", |arg| arg.hide(true));
    Man::new(command).render_options_section(&mut roff).unwrap();
    without_heading(&String::from_utf8(roff).unwrap())
}

/// The subcommands, each with what it takes.
fn commands() -> String {
    let command = Cli::command();
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    shown.map(one_command).collect()
}

fn one_command(command: &clap::Command) -> String {
    let mut heading = format!(".TP\n\\fB{}\\fR", escaped(command.get_name()));
    for value in command.get_positionals().flat_map(|arg| arg.get_value_names().unwrap_or_default())
    {
        heading.push_str(&format!(" \\fI{}\\fR", escaped(value)));
    }
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    format!("{heading}\n{}.\n", escaped(&about))
}

fn endpoint_option(option: &OptionSpec) -> String {
    let (name, value) = (escaped(option.name), escaped(option.value));
    let kinds: Vec<_> = option.applies_to.iter().map(|kind| kind.scheme()).collect();
    let mut text = format!(".TP\n\\fB{name}\\fR=\\fI{value}\\fR\n{}", escaped(option.help));
    if kinds.len() < AddressKind::ALL.len() {
        text.push_str(&format!("\n({})", kinds.join(", ")));
    }
    if let Some(default) = option.default {
        text.push_str(&format!("\n[default: {}]", escaped(default)));
    }
    text + "\n"
}

fn without_heading(section: &str) -> String {
    let lines = section.lines().skip_while(|line| *line != ".SH OPTIONS").skip(1);
    lines.map(|line| format!("{line}\n")).collect()
}

/// Text that roff prints as it stands.
fn escaped(text: &str) -> String {
    let text = text.replace('\\', "\\e").replace('-', "\\-").replace('\'', "\\(aq");
    if text.starts_with(['.', '\'']) { format!("\\&{text}") } else { text }
}

#[test]
fn the_page_says_what_the_program_says() {
    let page = page();
    let path = file("mavswitch.1");
    if env::var_os(WRITE).is_some() {
        fs::write(&path, &page).unwrap();
    }
    let shipped = fs::read_to_string(&path).unwrap_or_default();
    let differs = page.lines().zip(shipped.lines()).find(|(new, old)| new != old);
    assert!(
        page == shipped,
        "man/mavswitch.1 is not as generated; `{WRITE}=1 cargo test --test man` writes it: {differs:?}"
    );
}

#[test]
fn nothing_is_left_to_fill_in_and_no_line_is_an_unknown_request() {
    let page = page();
    for line in page.lines() {
        assert!(!line.starts_with('@') && !line.starts_with('\''), "{line}");
        let known = [
            ".TH ", ".SH ", ".SS ", ".TP", ".PP", ".nf", ".fi", ".RS", ".RE", ".br", ".\\\"",
            ".BR ", ".IP ", ".ie ", ".el ",
        ];
        assert!(!line.starts_with('.') || known.iter().any(|it| line.starts_with(it)), "{line}");
    }
}

#[test]
fn man_shows_it_without_complaint() {
    if !man(&["--version"]).is_ok_and(|output| output.stdout.starts_with(b"man ")) {
        return println!("SKIPPED: man(1) of man-db is not installed");
    }
    let path = file("mavswitch.1");
    let arguments = ["--warnings=all", "--encoding=UTF-8", "-l", path.to_str().unwrap()];
    let output = man(&arguments).unwrap();
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && complaints.is_empty(), "{complaints}");
    let text = String::from_utf8_lossy(&output.stdout);
    for word in [
        "EXIT STATUS",
        "NOTIFY_SOCKET",
        "--log-format",
        "queue_time",
        "completions SHELL",
        "system's links",
    ] {
        assert!(text.contains(word), "no {word} in {text}");
    }
}

fn man(arguments: &[&str]) -> io::Result<Output> {
    let surroundings = [("MANWIDTH", "200"), ("MANPAGER", "cat"), ("LC_ALL", "C.UTF-8")];
    Command::new("man").args(arguments).envs(surroundings).output()
}
