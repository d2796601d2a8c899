//! What ships and is made of the program's own declarations: the manual pages, with prose by hand
//! around the options and keys, and the completions for shells.
//!
//! `man/NAME.in` has the prose of a page, with a line such as `@OPTIONS@` where something generated
//! stands. Tests make the files anew and compare; `MAVSWITCH_WRITE_MAN=1 cargo test --test man`
//! writes them.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs, io};

mod completions;
mod sections;

/// The variable with which the tests write the files.
const WRITE: &str = "MAVSWITCH_WRITE_MAN";

/// Each page, and words that it has to show.
const PAGES: [(&str, &[&str]); 2] = [
    (
        "mavswitch.1",
        &[
            "EXIT STATUS",
            "NOTIFY_SOCKET",
            "--log-format",
            "queue_time",
            "completions SHELL",
            "check [OPTION]... [FILE]",
            "config [OPTION]... [ENDPOINT]...",
            "system's links",
            "STATE_DIRECTORY",
            "--block-messages MESSAGE[,MESSAGE...]",
            "explained above, under Endpoint options",
        ],
    ),
    (
        "mavswitch.toml.5",
        &["GENERAL KEYS", "[endpoint.gcs]", "queue_time (", "log_format (", "default: \"250ms\""],
    ),
];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("man").join(name)
}

/// A page as it has to be.
fn page(name: &str) -> String {
    let prose = fs::read_to_string(file(&format!("{name}.in"))).unwrap();
    let filled = |line| sections::section(line).unwrap_or_else(|| format!("{line}\n"));
    prose.lines().map(filled).collect()
}

/// Asserts that the file that ships is `text`, or writes it.
#[track_caller]
fn assert_shipped(path: &Path, text: &str) {
    if env::var_os(WRITE).is_some() {
        fs::write(path, text).unwrap();
    }
    let shipped = fs::read_to_string(path).unwrap_or_default();
    let differs = text.lines().zip(shipped.lines()).find(|(new, old)| new != old);
    assert!(
        text == shipped,
        "{} is not as generated; `{WRITE}=1 cargo test --test man` writes it: {differs:?}",
        path.display()
    );
}

#[test]
fn the_pages_say_what_the_program_says() {
    for (name, _) in PAGES {
        assert_shipped(&file(name), &page(name));
    }
}

#[test]
fn nothing_is_left_to_fill_in_and_no_line_is_an_unknown_request() {
    let known = [
        ".TH ", ".SH ", ".SS ", ".TP", ".PP", ".nf", ".fi", ".RS", ".RE", ".br", ".\\\"", ".BR ",
        ".IP ", ".ie ", ".el ",
    ];
    for (name, _) in PAGES {
        for line in page(name).lines() {
            assert!(!line.starts_with('@') && !line.starts_with('\''), "{name}: {line}");
            let is_known = known.iter().any(|it| line.starts_with(it));
            assert!(!line.starts_with('.') || is_known, "{name}: {line}");
        }
    }
}

#[test]
fn man_shows_them_without_complaint() {
    if !man(&["--version"]).is_ok_and(|output| output.stdout.starts_with(b"man ")) {
        return println!("SKIPPED: man(1) of man-db is not installed");
    }
    // These are prose alone.
    let by_hand: [(&str, &[&str]); 2] = [
        ("mavlink-routerd.1", &["mavswitch import"]),
        ("mavswitch-control.5", &["endpoint_add", "interval_ms", "garbage_bytes"]),
    ];
    for (name, words) in PAGES.into_iter().chain(by_hand) {
        let path = file(name);
        let arguments = ["--warnings=all", "--encoding=UTF-8", "-l", path.to_str().unwrap()];
        let output = man(&arguments).unwrap();
        let complaints = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && complaints.is_empty(), "{name}: {complaints}");
        let text = String::from_utf8_lossy(&output.stdout);
        for word in words {
            assert!(text.contains(word), "{name}: no {word} in {text}");
        }
    }
}

fn man(arguments: &[&str]) -> io::Result<Output> {
    let surroundings = [("MANWIDTH", "200"), ("MANPAGER", "cat"), ("LC_ALL", "C.UTF-8")];
    Command::new("man").args(arguments).envs(surroundings).output()
}
