//! The generated sections: options, commands and keys, from the declarations of the program.

use clap::CommandFactory;
use clap_mangen::Man;
use mavswitch::cli::Cli;
use mavswitch::config::{AddressKind, GENERAL, GeneralSpec, OPTIONS, OptionSpec, Shape};

/// The text that stands for a line such as `@OPTIONS@`, if it is one.
pub(crate) fn section(mark: &str) -> Option<String> {
    Some(match mark {
        "@TITLE 1@" => title("MAVSWITCH", "1", "User Commands"),
        "@TITLE 5@" => title("MAVSWITCH.TOML", "5", "File Formats"),
        "@OPTIONS@" => options(),
        "@COMMANDS@" => commands(),
        "@ENDPOINT_OPTIONS@" => OPTIONS.iter().map(endpoint_option).collect(),
        "@GENERAL_KEYS@" => GENERAL.iter().map(general_key).collect(),
        "@ENDPOINT_KEYS@" => {
            // The name of an endpoint is that of its table.
            OPTIONS.iter().filter(|option| option.name != "name").map(endpoint_key).collect()
        }
        _ => return None,
    })
}

fn title(name: &str, number: &str, manual: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!(".TH {name} {number} \"\" \"mavswitch {version}\" \"{manual}\"\n")
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
    commands_of(&Cli::command(), "")
}

/// Those of a command that has others, each behind its name.
fn commands_of(command: &clap::Command, before: &str) -> String {
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    shown.map(|command| one_command(command, before)).collect()
}

fn one_command(command: &clap::Command, before: &str) -> String {
    let name = format!("{before}{}", command.get_name());
    if command.has_subcommands() {
        return commands_of(command, &format!("{name} "));
    }
    let mut heading = format!(".TP\n\\fB{}\\fR", escaped(&name));
    if command.get_opts().next().is_some() {
        heading.push_str(" [\\fIOPTION\\fR]...");
    }
    for value in command.get_positionals() {
        heading.push_str(&positional(value));
    }
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    format!("{heading}\n{}.\n{}", escaped(&about), own_options(command))
}

/// The options of a subcommand, indented below it.
fn own_options(command: &clap::Command) -> String {
    // Those of `config` are the options above.
    let is_shown = |it: &&clap::Arg| !it.is_hide_set() && command.get_name() != "config";
    let options: String = command.get_opts().filter(is_shown).map(own_option).collect();
    if options.is_empty() { options } else { format!(".RS\n{options}.RE\n") }
}

/// `-o, --output FILE`, and what it does.
fn own_option(option: &clap::Arg) -> String {
    let bold = |word: String| format!("\\fB{}\\fR", escaped(&word));
    let short = option.get_short().map(|it| bold(format!("-{it}")));
    let long = option.get_long().map(|it| bold(format!("--{it}")));
    let names: Vec<String> = short.into_iter().chain(long).collect();
    let value = match option.get_action() {
        clap::ArgAction::SetTrue => String::new(),
        _ => option.get_value_names().unwrap_or_default().join(" "),
    };
    let value = if value.is_empty() { value } else { format!(" \\fI{}\\fR", escaped(&value)) };
    let help = option.get_help().map(ToString::to_string).unwrap_or_default();
    format!(".TP\n{}{value}\n{}.\n", names.join(", "), escaped(&help))
}

/// ` FILE`, ` [FILE]`, ` [FILE]...`
fn positional(value: &clap::Arg) -> String {
    let names = value.get_value_names().unwrap_or_default().join(" ");
    let name = format!("\\fI{}\\fR", escaped(&names));
    let is_many = matches!(value.get_action(), clap::ArgAction::Append);
    let dots = if is_many { "..." } else { "" };
    if value.is_required_set() { format!(" {name}{dots}") } else { format!(" [{name}]{dots}") }
}

fn endpoint_option(option: &OptionSpec) -> String {
    let (name, value) = (escaped(option.name), escaped(option.value));
    let mut text = format!(".TP\n\\fB{name}\\fR=\\fI{value}\\fR\n{}", escaped(option.help));
    if let Some(kinds) = kinds(option) {
        text.push_str(&format!("\n({kinds})"));
    }
    if let Some(default) = option.default {
        text.push_str(&format!("\n[default: {}]", escaped(default)));
    }
    text + "\n"
}

/// Which endpoints take an option, unless all do.
fn kinds(option: &OptionSpec) -> Option<String> {
    let kinds: Vec<_> = option.applies_to.iter().map(|kind| kind.scheme()).collect();
    (kinds.len() < AddressKind::ALL.len()).then(|| kinds.join(", "))
}

fn general_key(key: &GeneralSpec) -> String {
    described_key((key.name, key.shape, key.default), key.help, key.expects)
}

fn endpoint_key(key: &OptionSpec) -> String {
    let is_bare = matches!(key.shape, Shape::Flag | Shape::Number);
    let quoted = key.default.map(|it| if is_bare { it.to_owned() } else { format!("\"{it}\"") });
    let mut text = described_key((key.name, key.shape, quoted.as_deref()), key.help, key.expects);
    if let Some(kinds) = kinds(key) {
        text.push_str(&format!("For {kinds} only.\n"));
    }
    text
}

/// A key with the type of its value, its default, what it does and what it takes.
fn described_key(
    (name, shape, default): (&str, Shape, Option<&str>),
    help: &str,
    expects: &str,
) -> String {
    let kind = match shape {
        Shape::Text | Shape::Path => "string",
        Shape::Number => "number",
        Shape::Flag => "boolean",
        Shape::Time => "time",
        Shape::List => "array",
        Shape::Systems => "array or table",
        Shape::Rates => "table",
        Shape::Paths => "array of strings",
        Shape::Files => "table of strings",
    };
    let default = default.map(|it| format!("; default: {}", escaped(it))).unwrap_or_default();
    let (name, help) = (escaped(name), sentence(help));
    let mut text = format!(".TP\n\\fB{name}\\fR ({kind}{default})\n{help}\n");
    if shape != Shape::Flag && !help.contains(expects) {
        // An array needs no commas of ours.
        let value = escaped(&expects.replace(" with commas between", ""));
        text.push_str(&format!("Value: {value}.\n"));
    }
    if shape == Shape::Systems {
        text.push_str("The table { from = \"1/*\", to = \"7/*\" } is the same as \"1:7\".\n");
        text.push_str("Single components cannot change places.\n");
    }
    text
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    escaped(&format!("{}{}.", first.collect::<String>(), letters.as_str()))
}

fn without_heading(section: &str) -> String {
    let lines: Vec<&str> = section.lines().skip_while(|line| *line != ".SH OPTIONS").collect();
    let is_space = |at: usize| lines.get(at).is_some_and(|line| line.is_empty() || *line == ".sp");
    // A break beside an empty line breaks nothing.
    let is_idle = |at: &usize| lines[*at] == ".br" && (is_space(at - 1) || is_space(at + 1));
    (1..lines.len()).filter(|at| !is_idle(at)).map(|at| format!("{}\n", lines[at])).collect()
}

/// Text that roff prints as it stands.
fn escaped(text: &str) -> String {
    let text = text.replace('\\', "\\e").replace('-', "\\-").replace('\'', "\\(aq");
    if text.starts_with(['.', '\'']) { format!("\\&{text}") } else { text }
}
