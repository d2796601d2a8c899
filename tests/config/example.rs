//! The shipped example explains every key, with its default, and every line of it may be used.

use mavswitch::config::{Config, GENERAL, OPTIONS, Shape, parse_config};

const EXAMPLE: &str = include_str!("../../packaging/mavswitch.toml");

fn parse(text: &str) -> Config {
    parse_config("mavswitch.toml", text).unwrap_or_else(|error| panic!("{error}"))
}

/// The example with all its keys and tables in force.
fn uncommented() -> String {
    let lines = EXAMPLE.lines().map(|line| match line.strip_prefix('#') {
        Some(key) if key.starts_with(|c: char| c == '[' || c.is_ascii_lowercase()) => key,
        _ => line,
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The general keys, and the rest.
fn parts() -> (&'static str, &'static str) {
    EXAMPLE.split_once("\n# ---- Endpoints").unwrap()
}

/// Holds that `help` stands in a comment just above the key, and the default behind it.
fn assert_explained(part: &str, (name, help): (&str, &str), default: Option<&str>) {
    if let Some(default) = default {
        let line = format!("\n#{name} = {default}\n");
        assert!(part.contains(&line), "no line{line}");
    }
    let (above, _) = part
        .split_once(&format!("\n#{name} = "))
        .unwrap_or_else(|| panic!("packaging/mavswitch.toml does not have {name}"));
    let comment = above.rsplit("\n\n").next().unwrap();
    // A sentence there begins with a capital letter.
    assert!(comment.contains(&help[1..]), "{name} is explained as\n{comment}\nbut not as\n{help}");
}

#[test]
fn as_shipped_it_changes_nothing() {
    assert_eq!(parse(EXAMPLE), Config::default());
}

#[test]
fn every_general_key_is_explained_with_its_default() {
    for spec in GENERAL {
        assert_explained(parts().0, (spec.name, spec.help), spec.default);
    }
}

#[test]
fn every_option_is_explained_with_its_default() {
    for spec in OPTIONS.iter().filter(|spec| spec.name != "name") {
        let is_bare = matches!(spec.shape, Shape::Flag | Shape::Number);
        let default = spec.default.map(|it| if is_bare { it.into() } else { format!("{it:?}") });
        assert_explained(parts().1, (spec.name, spec.help), default.as_deref());
    }
}

#[test]
fn every_line_of_it_may_be_used() {
    let config = parse(&uncommented());
    for spec in OPTIONS.iter().filter(|spec| spec.name != "name") {
        let mut keys = config.endpoints.iter().flat_map(|endpoint| &endpoint.keys);
        assert!(keys.any(|(name, _)| *name == spec.name), "{}", spec.name);
    }
    assert_eq!(parse(&config.to_string()).to_string(), config.to_string());
}
