//! The rooms of the house and who may enter which: reads the sources and holds the design.
//!
//! `mavlink` and `routing` are pure; layers use only those below them; `unsafe` lives in one room;
//! every file says what it is for and stays short.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

/// One source file, without its tests and comments.
struct Source {
    /// Relative to `src`.
    path: PathBuf,
    text: String,
    /// Line by line, comments and test modules removed.
    code: Vec<String>,
}

impl Source {
    fn is_in(&self, room: &str) -> bool {
        self.path.starts_with(room) || self.path == Path::new(&format!("{room}.rs"))
    }

    /// Fails if a line of code contains any of `words`, each bounded by other characters.
    fn assert_free_of(&self, words: &[&str], why: &str) {
        for (line, word) in self.code.iter().flat_map(|line| words.iter().map(move |w| (line, w))) {
            let path = self.path.display();
            assert!(!contains_word(line, word), "src/{path} has `{word}`: {why}:\n{line}");
        }
    }
}

/// Whether `word` stands in `line` and is not the end or the beginning of a longer name.
fn contains_word(line: &str, word: &str) -> bool {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    line.match_indices(word).any(|(start, _)| {
        let before = line[..start].chars().next_back();
        let after = line[start + word.len()..].chars().next();
        !before.is_some_and(is_name) && !after.is_some_and(is_name)
    })
}

/// Every file below `src` but those that are tests.
fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    let texts = files.iter().map(|path| fs::read_to_string(path).unwrap());
    let files: Vec<(PathBuf, String)> = files.iter().cloned().zip(texts).collect();
    let tests: HashSet<PathBuf> = files.iter().flat_map(|it| test_files(&it.0, &it.1)).collect();
    let product = files.into_iter().filter(|(path, _)| !tests.contains(path));
    product
        .map(|(path, text)| {
            let code = code_of(&text);
            Source { path: path.strip_prefix(&root).unwrap().to_owned(), text, code }
        })
        .collect()
}

fn collect(dir: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

/// The files that `text` declares as test modules.
fn test_files(path: &Path, text: &str) -> Vec<PathBuf> {
    let is_root = ["mod.rs", "lib.rs", "main.rs"].iter().any(|name| path.ends_with(name));
    let dir = if is_root { path.parent().unwrap().to_owned() } else { path.with_extension("") };
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let declared = lines.windows(2).filter(|pair| pair[0] == "#[cfg(test)]");
    let names = declared.filter_map(|pair| pair[1].strip_prefix("mod ")?.strip_suffix(';'));
    names.map(|name| dir.join(format!("{name}.rs"))).collect()
}

/// The code up to the test module at the end, without comments.
fn code_of(text: &str) -> Vec<String> {
    let lines: Vec<&str> = text.lines().collect();
    let begins_tests = |at: &usize| {
        lines[*at].trim() == "#[cfg(test)]"
            && lines.get(at + 1).is_some_and(|next| next.trim_start().starts_with("mod "))
    };
    let end = (0..lines.len()).find(begins_tests).unwrap_or(lines.len());
    lines[..end].iter().map(|line| without_comment(line).to_owned()).collect()
}

/// `//` ends the code of a line, unless it is part of an address such as `udpin://`.
fn without_comment(line: &str) -> &str {
    let comment = line.match_indices("//").find(|(at, _)| !line[..*at].ends_with(':'));
    &line[..comment.map_or(line.len(), |(at, _)| at)]
}

#[test]
fn the_protocol_and_the_routing_touch_no_system() {
    let words = [
        "std::net",
        "std::io",
        "std::fs",
        "std::os",
        "std::thread",
        "std::process",
        "std::env",
        "mio",
        "libc",
        "socket2",
        "serialport",
        "Instant::now",
        "SystemTime::now",
        "tracing",
    ];
    let is_pure =
        |it: &Source| ["mavlink", "routing", "sim", "own"].iter().any(|room| it.is_in(room));
    let pure = sources().into_iter().filter(is_pure);
    for source in pure {
        source.assert_free_of(&words, "this layer is pure, and time is an argument");
        let lines = source.code.iter().filter(|line| line.contains("std::{"));
        for line in lines {
            for word in ["net", "io", "fs", "os", "thread", "process", "env"] {
                assert!(!contains_word(line, word), "src/{}: {line}", source.path.display());
            }
        }
    }
}

#[test]
fn each_layer_uses_only_those_below_it() {
    let rooms = [
        "mavlink", "routing", "sim", "own", "config", "link", "record", "status", "listen",
        "control", "check", "daemon", "cli",
    ];
    let allowed: [(&str, &[&str]); 11] = [
        ("mavlink", &["mavlink"]),
        ("listen", &["mavlink", "listen"]),
        ("routing", &["mavlink", "routing"]),
        ("sim", &["mavlink", "routing", "sim"]),
        ("own", &["mavlink", "routing", "own"]),
        ("config", &["mavlink", "routing", "sim", "config"]),
        ("link", &["mavlink", "routing", "config", "link"]),
        ("check", &["mavlink", "routing", "config", "link", "record", "check"]),
        ("record", &["mavlink", "routing", "config", "record"]),
        ("status", &["mavlink", "routing", "config", "status"]),
        ("control", &["mavlink", "routing", "config", "status", "listen", "control"]),
    ];
    for source in sources() {
        let Some((room, may_use)) = allowed.iter().find(|(room, _)| source.is_in(room)) else {
            continue;
        };
        for other in rooms.iter().filter(|other| !may_use.contains(other)) {
            let why = format!("{room} may not use {other}");
            source.assert_free_of(&[&format!("crate::{other}")], &why);
        }
    }
}

#[test]
fn nothing_uses_the_daemon_but_the_program_itself() {
    for source in sources() {
        let may = source.is_in("daemon") || source.is_in("main") || source.is_in("lib");
        if !may {
            source.assert_free_of(&["crate::daemon", "mavswitch::daemon"], "the top layer");
        }
    }
}

#[test]
fn unsafe_code_lives_with_the_links_alone() {
    let sources = sources();
    for source in sources.iter().filter(|source| !source.is_in("link")) {
        source.assert_free_of(&["unsafe"], "only src/link may");
    }
}

#[test]
fn every_file_says_what_it_is_for_and_stays_short() {
    let sources = sources();
    assert!(sources.len() > 5, "the sources were not found");
    for source in &sources {
        let path = source.path.display();
        assert!(source.text.starts_with("//! "), "src/{path} does not open with `//! `");
        let lines = source.code.len();
        assert!(lines < 400, "src/{path} has {lines} lines without its tests");
    }
}

#[test]
fn the_reader_of_sources_reads_them_right() {
    let text =
        "//! A.\nuse a; // std::io\nlet x = \"udpin://\"; // c\n#[cfg(test)]\nmod tests {\n}\n";
    assert_eq!(code_of(text), ["", "use a; ", "let x = \"udpin://\"; "]);
    assert!(contains_word("use crate::daemon;", "crate::daemon"));
    assert!(!contains_word("use crate::daemonic;", "crate::daemon"));
    assert!(!contains_word("#![deny(unsafe_code)]", "unsafe"));
    let declared = test_files(Path::new("src/a.rs"), "#[cfg(test)]\nmod tests;\n");
    assert_eq!(declared, [Path::new("src/a/tests.rs")]);
}
