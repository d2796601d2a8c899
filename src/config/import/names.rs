//! The names of sections and keys, and what was probably meant by one that does not exist.

use super::endpoint_keys::{ENDPOINT_KEYS, EndpointKey, SectionKind};
use super::general_keys::GENERAL_KEYS;
use super::ini::Section;
use crate::config::place::ConfigProblem;
use crate::config::{suggest, value};

/// The section for the program as a whole.
const GENERAL: &str = "General";

/// What a section configures: `None` for the program as a whole.
pub(super) fn kind_of(section: &Section) -> Result<Option<(SectionKind, String)>, ConfigProblem> {
    let refuse = |text: String| Err(ConfigProblem::at(&section.place, text));
    let mut words = section.title.split_whitespace();
    let word = words.next().unwrap_or_default();
    let name: Vec<&str> = words.collect();
    let kind = SectionKind::ALL.iter().find(|kind| kind.word().eq_ignore_ascii_case(word));
    match (kind, &name[..]) {
        (None, []) if word.eq_ignore_ascii_case(GENERAL) => Ok(None),
        (None, _) if word.eq_ignore_ascii_case(GENERAL) => {
            refuse("General has no name: write [General]".to_owned())
        }
        (None, _) => refuse(unknown_section(word)),
        (Some(kind), []) => {
            let word = kind.word();
            refuse(format!("[{word}] has no name: write [{word} NAME]"))
        }
        (Some(kind), [name]) => match value::name(&name.chars().take(64).collect::<String>()) {
            Some(name) => Ok(Some((*kind, name))),
            None => refuse("bad name of an endpoint: expected printable characters".to_owned()),
        },
        (Some(kind), names) => {
            let (word, name) = (kind.word(), names.join("-"));
            refuse(format!("blanks in the name of an endpoint: write [{word} {name}]"))
        }
    }
}

fn unknown_section(word: &str) -> String {
    let known = || [GENERAL].into_iter().chain(SectionKind::ALL.iter().map(|kind| kind.word()));
    match nearest(word, known()) {
        Some(near) => format!("unknown section `{word}`: did you mean `{near}`?"),
        None => format!("unknown section `{word}`: write {}", suggest::list(known(), "or")),
    }
}

/// The key of an endpoint with this name, in any case.
pub(super) fn find(key: &str) -> Option<&'static EndpointKey> {
    ENDPOINT_KEYS.iter().find(|spec| spec.name.eq_ignore_ascii_case(key))
}

/// What is wrong with a key that the section does not have; without `kind`, the section is General.
pub(super) fn unknown_key(key: &str, kind: Option<SectionKind>) -> String {
    let section = kind.map_or(GENERAL, SectionKind::word);
    let own = || match kind {
        None => GENERAL_KEYS.iter().map(|spec| spec.name).collect::<Vec<_>>(),
        Some(kind) => {
            let its = ENDPOINT_KEYS.iter().filter(|spec| spec.sections.contains(&kind));
            its.map(|spec| spec.name).collect()
        }
    };
    let is_general = GENERAL_KEYS.iter().any(|spec| spec.name.eq_ignore_ascii_case(key));
    let hint = match find(key) {
        Some(spec) => {
            let sections = spec.sections.iter().map(|kind| kind.word());
            format!("only {} has it", suggest::list(sections, "or"))
        }
        None if is_general => format!("only {GENERAL} has it"),
        None => match nearest(key, own().into_iter()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("it has {}", suggest::list(own().into_iter(), "and")),
        },
    };
    format!("unknown key `{key}` in {section}: {hint}")
}

/// The known word that was probably meant, as it is spelt.
fn nearest(word: &str, known: impl Iterator<Item = &'static str>) -> Option<&'static str> {
    let known: Vec<(String, &str)> = known.map(|it| (it.to_ascii_lowercase(), it)).collect();
    let near = suggest::nearest(word, known.iter().map(|(lower, _)| lower.as_str()))?;
    known.iter().find(|(lower, _)| lower == near).map(|(_, it)| *it)
}
