//! Which TOML types a value may have, and how it goes from TOML to words and back.
//!
//! A word is the text of one value as it is written on the command line. What a word means is for
//! the tables of options to say.

use std::ops::Range;

use toml::de::{DeInteger, DeTable, DeValue};
use toml::{Spanned, Value};

use super::value::is_digits;

/// Which TOML types a value may have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A string.
    Text,
    /// A number.
    Number,
    /// `true` or `false`.
    Flag,
    /// A string with a unit, or a number.
    Time,
    /// An array of strings and numbers; or one of them, with commas between as on the command line.
    List,
    /// A table of numbers, or what a list may be.
    Rates,
    /// A table `{from = "1/*", to = "7/*"}`, which is `1:7`, an array of such, or what a list may be.
    Systems,
    /// An array of strings, or one string.
    Paths,
    /// A table of file names.
    Files,
    /// A string: one file or directory.
    Path,
}

/// The text of a value, and where it stands.
pub(super) type SpannedWord = (String, Range<usize>);

impl Shape {
    /// The words of a value, if it has the right type.
    pub(super) fn words(self, value: &Spanned<DeValue<'_>>) -> Option<Vec<SpannedWord>> {
        let span = value.span();
        let one = |text: String| Some(vec![(text, span)]);
        match (self, value.get_ref()) {
            (Self::Flag, DeValue::Boolean(flag)) => one(flag.to_string()),
            (Self::Rates, DeValue::Table(table)) => rate_words(table),
            (Self::Files, DeValue::Table(table)) => file_words(table),
            (Self::Files, _) => None,
            (Self::Systems, DeValue::Table(table)) => system_word(table).and_then(one),
            (Self::List | Self::Rates | Self::Systems | Self::Paths, DeValue::Array(array)) => {
                let words = array.iter().map(|element| self.element(element));
                // Nothing cannot be told from what is not there.
                words.collect::<Option<Vec<_>>>().filter(|words| !words.is_empty())
            }
            (Self::Flag, _) => None,
            (_, value) => self.scalar(value).and_then(one),
        }
    }

    fn element(self, element: &Spanned<DeValue<'_>>) -> Option<SpannedWord> {
        let text = match (self, element.get_ref()) {
            (Self::Systems, DeValue::Table(table)) => system_word(table)?,
            (_, value) => self.scalar(value)?,
        };
        let is_one = self == Self::Paths || !text.contains(',');
        is_one.then(|| (text, element.span()))
    }

    fn scalar(self, value: &DeValue<'_>) -> Option<String> {
        match (self, value) {
            (Self::Flag | Self::Number, DeValue::String(_)) => None,
            (_, DeValue::String(text)) => Some(text.clone().into_owned()),
            (Self::Text | Self::Paths | Self::Path, _) => None,
            (_, DeValue::Integer(_) | DeValue::Float(_)) => number(value),
            _ => None,
        }
    }

    /// What to add to what is expected, for a value of the wrong type.
    pub(super) fn hint(self, value: &DeValue<'_>) -> &'static str {
        match (self, value) {
            (Self::Flag | Self::Number, DeValue::String(_)) => ", without quotes",
            (
                Self::Text | Self::Paths | Self::Path,
                DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_),
            ) => ", in quotes",
            (Self::Systems, value) if is_or_has_table(value) => {
                "; in a table whole systems and nothing else, as {from = \"1/*\", to = \"7/*\"}: single \
                 components cannot change places"
            }
            (Self::List | Self::Rates | Self::Systems, DeValue::Array(array))
                if array.is_empty() =>
            {
                "; or leave the key out"
            }
            (Self::List | Self::Rates | Self::Systems, DeValue::Array(_)) => {
                "; in an array each by itself"
            }
            (Self::Rates, DeValue::Table(_)) => "; in a table MESSAGE = HZ",
            (Self::Files, _) => "; in a table NAME = \"FILE\"",
            _ => "",
        }
    }

    /// A value in TOML; `words` is what [`words`](Self::words) made of it.
    pub(super) fn to_toml(self, words: &[String]) -> String {
        let first = words.first().map_or("", String::as_str);
        match self {
            Self::Text | Self::Time | Self::Path => quoted(first),
            Self::Number | Self::Flag => first.to_owned(),
            Self::List | Self::Systems => {
                array(words, |word| if is_digits(word) { word.into() } else { quoted(word) })
            }
            Self::Paths => array(words, quoted),
            Self::Files => {
                let files = words.iter().filter_map(|word| word.split_once('='));
                let files: Vec<String> = files
                    .map(|(name, file)| format!("{} = {}", quoted(name), quoted(file)))
                    .collect();
                format!("{{ {} }}", files.join(", "))
            }
            // A rate of no message in particular.
            Self::Rates if is_digits(first) => first.to_owned(),
            Self::Rates => {
                let rates = words.iter().filter_map(|word| word.split_once(':'));
                let rates: Vec<String> =
                    rates.map(|(message, hz)| format!("{message} = {hz}")).collect();
                format!("{{ {} }}", rates.join(", "))
            }
        }
    }

    /// The words of a value in the spelling of the command line.
    pub(super) fn split(self, text: &str) -> Vec<String> {
        match self {
            Self::List | Self::Rates | Self::Systems => {
                text.split(',').map(str::to_owned).collect()
            }
            _ => vec![text.to_owned()],
        }
    }
}

/// A string in TOML.
pub(super) fn quoted(text: &str) -> String {
    Value::String(text.to_owned()).to_string()
}

fn array(words: &[String], show: impl Fn(&str) -> String) -> String {
    let words: Vec<String> = words.iter().map(|word| show(word)).collect();
    format!("[{}]", words.join(", "))
}

/// `ATTITUDE = 2` is `ATTITUDE:2`.
fn rate_words(table: &DeTable<'_>) -> Option<Vec<SpannedWord>> {
    let mut rates: Vec<_> = table.iter().collect();
    rates.sort_by_key(|(message, _)| message.span().start);
    let word = |(message, hz): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let text = format!("{}:{}", message.get_ref(), number(hz.get_ref())?);
        (!text.contains(',')).then(|| (text, message.span()))
    };
    rates.into_iter().map(word).collect::<Option<Vec<_>>>().filter(|words| !words.is_empty())
}

/// `radio = "radio.key"` is `radio=radio.key`.
fn file_words(table: &DeTable<'_>) -> Option<Vec<SpannedWord>> {
    let mut files: Vec<_> = table.iter().collect();
    files.sort_by_key(|(name, _)| name.span().start);
    let word = |(name, file): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        Some((format!("{}={}", name.get_ref(), file.get_ref().as_str()?), name.span()))
    };
    files.into_iter().map(word).collect::<Option<Vec<_>>>().filter(|words| !words.is_empty())
}

/// `{from = "1/*", to = "7/*"}` is `1:7`.
fn system_word(table: &DeTable<'_>) -> Option<String> {
    let system = |key: &str| table.get(key)?.get_ref().as_str()?.strip_suffix("/*");
    (table.len() == 2).then_some(())?;
    Some(format!("{}:{}", system("from")?, system("to")?))
}

fn is_or_has_table(value: &DeValue<'_>) -> bool {
    let is_table = |element: &Spanned<DeValue<'_>>| element.get_ref().is_table();
    value.is_table() || value.as_array().is_some_and(|array| array.iter().any(is_table))
}

/// A number in decimal.
fn number(value: &DeValue<'_>) -> Option<String> {
    match value {
        DeValue::Integer(integer) => Some(decimal(integer)),
        DeValue::Float(float) => Some(float.as_str().to_owned()),
        _ => None,
    }
}

fn decimal(integer: &DeInteger<'_>) -> String {
    match i64::from_str_radix(integer.as_str(), integer.radix()) {
        Ok(number) => number.to_string(),
        // It is out of range, whatever the range is.
        Err(_) => integer.to_string(),
    }
}
