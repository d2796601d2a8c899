//! Rows that are alike but for a few words.

/// A row for a list of messages that are allowed or blocked in one direction.
macro_rules! message_filter {
    ($name:literal, $help:literal, $direction:ident, $list:ident) => {
        $crate::config::option_spec::OptionSpec {
            name: $name,
            value: "MESSAGE[,MESSAGE...]",
            shape: $crate::config::shape::Shape::List,
            expects: "messages by name or number with commas between",
            help: $help,
            default: None,
            applies_to: $crate::config::option_table::ANY,
            needs: None,
            on_change: $crate::config::option_spec::OnChange::InPlace,
            set: |to, text| {
                $crate::config::option_table::put(
                    &mut to.options.$direction.$list,
                    $crate::config::value::messages(text),
                )
            },
            show: |options| $crate::config::value::show_list(&options.$direction.$list),
        }
    };
}

/// A row for a list of system or component ids that are allowed or blocked in one direction.
macro_rules! id_filter {
    ($name:literal, $help:literal, $direction:ident, $list:ident) => {
        $crate::config::option_spec::OptionSpec {
            name: $name,
            value: "ID[,ID...]",
            shape: $crate::config::shape::Shape::List,
            expects: "ids of 0 to 255 with commas between",
            help: $help,
            default: None,
            applies_to: $crate::config::option_table::ANY,
            needs: None,
            on_change: $crate::config::option_spec::OnChange::InPlace,
            set: |to, text| {
                $crate::config::option_table::put(
                    &mut to.options.$direction.$list,
                    $crate::config::value::ids(text),
                )
            },
            show: |options| $crate::config::value::show_list(&options.$direction.$list),
        }
    };
}

/// A row for an option that is there or not.
macro_rules! flag {
    ($name:literal, $default:literal, $help:literal, $kinds:expr, $field:ident) => {
        $crate::config::option_spec::OptionSpec {
            name: $name,
            value: "true|false",
            shape: $crate::config::shape::Shape::Flag,
            expects: "true or false",
            help: $help,
            default: Some($default),
            applies_to: $kinds,
            needs: None,
            on_change: $crate::config::option_spec::OnChange::InPlace,
            set: |to, text| {
                $crate::config::option_table::put(
                    &mut to.options.$field,
                    $crate::config::value::flag(text),
                )
            },
            show: |options| Some(options.$field.to_string()),
        }
    };
}

pub(super) use {flag, id_filter, message_filter};
