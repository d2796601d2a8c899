//! Configurations of mavlink-router: what each one means as one of ours, and what is said of wrong ones.
//!
//! `routerd/wrong/*.conf` are refused with the lines of the `.txt` beside them, `routerd/right/*.conf`
//! mean what the `.out` beside them says. MAVSWITCH_BLESS=1 writes these files anew.

use std::path::Path;

use clap::CommandFactory;
use mavswitch::check::check;
use mavswitch::cli::RouterdCli;
use mavswitch::config::{
    ConfigError, ENDPOINT_KEYS, GENERAL_KEYS, Imported, RouterdArguments, RouterdFiles,
    SectionKind, import_routerd, parse_config,
};

use super::{cases, is_as_written};

const SAMPLE: &str = include_str!("routerd/right/sample.conf");

fn import(path: &Path) -> Result<Imported, ConfigError> {
    import_routerd(&RouterdFiles::at(path)?, &RouterdArguments::default())
}

/// `text` with the names of files, but without those of directories.
fn without_dir(path: &Path, text: &str) -> String {
    text.replace(&format!("{}/", path.parent().unwrap().display()), "")
}

fn to_toml(path: &Path, imported: &Imported) -> String {
    without_dir(path, &imported.to_toml(path.to_str().unwrap()))
}

#[test]
fn wrong_files_of_mavlink_router_are_told_in_plain_words() {
    let cases = cases("routerd/wrong", "conf");
    assert!(cases.len() >= 40, "only {}", cases.len());
    let good = cases.iter().filter(|path| match import(path) {
        Ok(it) => panic!("{} is right:\n{}", path.display(), it.config),
        Err(error) => is_as_written(path, "txt", &without_dir(path, &format!("{error}\n"))),
    });
    assert_eq!(good.count(), cases.len());
}

#[test]
fn right_files_of_mavlink_router_mean_what_they_say() {
    let cases = cases("routerd/right", "conf");
    let good = cases.iter().filter(|path| {
        let imported = import(path).unwrap_or_else(|error| panic!("{error}"));
        is_as_written(path, "out", &to_toml(path, &imported))
    });
    assert_eq!(good.count(), cases.len());
}

#[test]
fn what_is_imported_passes_the_check() {
    for path in cases("routerd/right", "conf") {
        let imported = import(&path).unwrap_or_else(|error| panic!("{error}"));
        let text = to_toml(&path, &imported);
        let config = parse_config("out.toml", &text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(config.to_string(), imported.config.to_string());
        let wrong: Vec<_> = check(&config).into_iter().filter(|it| it.is_wrong).collect();
        assert_eq!(wrong, [], "{text}");
    }
}

/// The sections of the sample whose titles begin with `word`.
fn sections(word: &str) -> Vec<&'static str> {
    let sections = SAMPLE.split("\n[").filter(|section| section.starts_with(word));
    sections.collect()
}

fn assert_has(sections: &[&str], key: &str) {
    let line = format!("\n{key} = ");
    assert!(sections.iter().any(|it| it.contains(&line)), "no {key} in {sections:?}");
}

#[test]
fn the_manual_explains_every_flag_and_every_key() {
    let manual = include_str!("../../man/mavlink-routerd.1").replace("\\-", "-");
    let general = GENERAL_KEYS.iter().map(|spec| spec.name);
    for key in general.chain(ENDPOINT_KEYS.iter().map(|spec| spec.name)) {
        assert!(manual.contains(&format!("\\fB{key}\\fR")), "{key}");
    }
    let mut command = RouterdCli::command();
    command.build();
    for flag in command.get_arguments().filter(|it| !it.is_positional()) {
        let (short, long) = (flag.get_short().unwrap(), flag.get_long().unwrap());
        assert!(
            manual.contains(&format!("\\fB-{short}\\fR, \\fB--{long}\\fR")),
            "-{short}, --{long}"
        );
    }
}

#[test]
fn the_sample_has_every_key_in_every_section() {
    for spec in GENERAL_KEYS {
        assert_has(&sections("General"), spec.name);
    }
    for spec in ENDPOINT_KEYS {
        for kind in spec.sections {
            assert_has(&sections(kind.word()), spec.name);
        }
    }
    assert_eq!(SectionKind::ALL.len(), 3);
}
