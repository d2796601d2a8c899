//! Where the user wants the control socket.

use std::path::{Path, PathBuf};

/// Where the control socket is to be.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum ControlPlace {
    /// In the directory that the system has for such things, if it has one.
    #[default]
    Default,
    /// Nowhere.
    Off,
    /// At this absolute path.
    At(PathBuf),
}

/// What is written for none.
const OFF: &str = "off";

impl ControlPlace {
    /// Reads what the user wrote: an absolute path, or `off`.
    pub fn parse(text: &str) -> Option<Self> {
        match Path::new(text) {
            _ if text == OFF => Some(Self::Off),
            path if path.is_absolute() && !text.ends_with('/') => Some(Self::At(path.to_owned())),
            _ => None,
        }
    }

    /// What the user would write, if that is not nothing.
    pub(super) fn show(&self) -> Option<String> {
        match self {
            Self::Default => None,
            Self::Off => Some(OFF.to_owned()),
            Self::At(path) => Some(path.display().to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_an_absolute_path_or_off() {
        for text in ["off", "/run/mavswitch/control"] {
            assert_eq!(ControlPlace::parse(text).unwrap().show().as_deref(), Some(text));
        }
        for text in ["", "on", "control", "./control", "/run/"] {
            assert_eq!(ControlPlace::parse(text), None, "{text}");
        }
        assert_eq!(ControlPlace::default().show(), None);
    }
}
