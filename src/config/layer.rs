//! One configuration file, read by itself: which keys it sets, and where each of them stands.
//!
//! Here keys are known or refused, and values have the right TOML type or are refused. What the
//! files mean together is for `merge` to say.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::address::Address;
use super::endpoint::{self, EndpointConfig};
use super::error::AddressProblem;
use super::general::{GENERAL, GeneralSpec};
use super::option_spec::OptionSpec;
use super::option_table::OPTIONS;
use super::place::{ConfigProblem, Place};
use super::shape::Shape;
use super::source::Source;
use super::suggest;
use super::value;

/// The key of an endpoint's address.
pub(super) const ADDRESS: &str = "address";
/// The table of endpoints.
const ENDPOINT: &str = "endpoint";

/// What one file says.
#[derive(Default)]
pub(super) struct Layer {
    pub(super) general: Vec<Setting<GeneralSpec>>,
    /// In the order in which they stand in the file.
    pub(super) endpoints: Vec<EndpointTable>,
}

/// One key with its value, or one option of an address.
#[derive(Clone)]
pub(super) struct Setting<S: 'static> {
    pub(super) spec: &'static S,
    /// One or more.
    pub(super) words: Vec<(String, Place)>,
    /// Where the value begins.
    pub(super) place: Place,
    /// Whether it stands in the query of the address.
    pub(super) is_in_address: bool,
}

impl<S> Setting<S> {
    pub(super) fn texts(&self) -> Vec<String> {
        self.words.iter().map(|(text, _)| text.clone()).collect()
    }
}

/// A table `[endpoint.NAME]`.
pub(super) struct EndpointTable {
    pub(super) name: String,
    pub(super) place: Place,
    pub(super) address: Option<PlacedAddress>,
    /// Each option at most once.
    pub(super) settings: Vec<Setting<OptionSpec>>,
}

/// An address as it is written: the options of its query are settings.
#[derive(Clone)]
pub(super) struct PlacedAddress {
    pub(super) address: Address,
    pub(super) place: Place,
}

/// Reads one file.
pub(super) fn read(source: &Source) -> Result<Layer, Vec<ConfigProblem>> {
    let table = source.table().map_err(|problem| vec![problem])?;
    let mut reader = Reader { source, problems: Vec::new() };
    let layer = reader.layer(table.get_ref());
    if reader.problems.is_empty() { Ok(layer) } else { Err(reader.problems) }
}

type Key<'a> = Spanned<std::borrow::Cow<'a, str>>;
type Entry<'a, 'b> = (&'b Key<'a>, &'b Spanned<DeValue<'a>>);

/// The entries of a table in the order in which they stand in the file.
fn entries<'a, 'b>(table: &'b DeTable<'a>) -> Vec<Entry<'a, 'b>> {
    let mut entries: Vec<_> = table.iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    entries
}

struct Reader<'s> {
    source: &'s Source,
    problems: Vec<ConfigProblem>,
}

impl Reader<'_> {
    fn refuse(&mut self, span: &Range<usize>, text: impl std::fmt::Display) {
        self.problems.push(ConfigProblem::at(&self.source.place(span), text));
    }

    fn layer(&mut self, table: &DeTable<'_>) -> Layer {
        let mut layer = Layer::default();
        for (key, value) in entries(table) {
            if key.get_ref() == ENDPOINT {
                layer.endpoints = self.endpoints(key, value);
            } else if let Some(spec) = GENERAL.iter().find(|spec| spec.name == key.get_ref()) {
                layer.general.extend(self.general(spec, value));
            } else {
                self.refuse(&key.span(), unknown_general(key.get_ref(), value.get_ref()));
            }
        }
        layer
    }

    fn general(
        &mut self,
        spec: &'static GeneralSpec,
        value: &Spanned<DeValue<'_>>,
    ) -> Option<Setting<GeneralSpec>> {
        let mut setting = self.setting(spec, spec.shape, (spec.name, spec.expects), value)?;
        let resolve = |path: &str| self.source.resolve(Path::new(path)).display().to_string();
        for (word, _) in &mut setting.words {
            match (spec.shape, word.split_once('=')) {
                (Shape::Paths | Shape::Path, _) => *word = resolve(word),
                (Shape::Files, Some((name, path))) => *word = format!("{name}={}", resolve(path)),
                _ => {}
            }
        }
        Some(setting)
    }

    /// A value of the right type.
    fn setting<S>(
        &mut self,
        spec: &'static S,
        shape: Shape,
        (name, expects): (&'static str, &'static str),
        value: &Spanned<DeValue<'_>>,
    ) -> Option<Setting<S>> {
        let Some(words) = shape.words(value) else {
            let shown = self.source.excerpt(&value.span());
            let problem = AddressProblem::BadValue(shown, name, expects);
            let hint = shape.hint(value.get_ref());
            self.refuse(&value.span(), format!("{problem}{hint}"));
            return None;
        };
        let words = words.into_iter().map(|(text, span)| (text, self.source.place(&span)));
        let place = self.source.place(&value.span());
        Some(Setting { spec, words: words.collect(), place, is_in_address: false })
    }

    fn endpoints(&mut self, key: &Key<'_>, value: &Spanned<DeValue<'_>>) -> Vec<EndpointTable> {
        let DeValue::Table(table) = value.get_ref() else {
            self.refuse(&key.span(), "give each endpoint a table with a name: [endpoint.gcs]");
            return Vec::new();
        };
        entries(table).into_iter().filter_map(|(key, value)| self.endpoint(key, value)).collect()
    }

    fn endpoint(&mut self, key: &Key<'_>, value: &Spanned<DeValue<'_>>) -> Option<EndpointTable> {
        let DeValue::Table(table) = value.get_ref() else {
            let text = "give each endpoint a table with a name, and write this below it: \
                        [endpoint.gcs]";
            self.refuse(&key.span(), text);
            return None;
        };
        let Some(name) = value::name(key.get_ref()) else {
            let text = "bad name of an endpoint: expected 1 to 64 printable characters";
            self.refuse(&key.span(), text);
            return None;
        };
        let place = self.source.place(&key.span());
        let mut read = EndpointTable { name, place, address: None, settings: Vec::new() };
        // The address first: its options are settings too.
        let entries = entries(table);
        for (_, value) in entries.iter().filter(|(key, _)| key.get_ref() == ADDRESS) {
            self.address(value, &mut read);
        }
        for (key, value) in entries.iter().filter(|(key, _)| key.get_ref() != ADDRESS) {
            self.option(key, value, &mut read);
        }
        Some(read)
    }

    fn address(&mut self, value: &Spanned<DeValue<'_>>, to: &mut EndpointTable) {
        let Some(text) = value.get_ref().as_str() else {
            let shown = self.source.excerpt(&value.span());
            let text = format!(
                "bad address `{shown}`: expected a text in quotes, as \"udpin:0.0.0.0:14550\""
            );
            return self.refuse(&value.span(), text);
        };
        let place = self.source.place(&value.span());
        match read_address(text, &place) {
            Ok((mut address, settings)) => {
                if let Address::Tlog(file) = &mut address {
                    *file = self.source.resolve(file);
                }
                to.address = Some(PlacedAddress { address, place });
                to.settings = settings;
            }
            Err(problem) => self.refuse(&value.span(), format!("address `{text}`: {problem}")),
        }
        if to.settings.iter().any(|setting| setting.spec.name == "name") {
            let text = "the name of an endpoint is that of its table: leave out `name`";
            self.refuse(&value.span(), text);
        }
    }

    fn option(&mut self, key: &Key<'_>, value: &Spanned<DeValue<'_>>, to: &mut EndpointTable) {
        let name = key.get_ref();
        let known = OPTIONS.iter().find(|spec| spec.name == name && name != "name");
        let Some(spec) = known else {
            return self.refuse(&key.span(), unknown_option(name));
        };
        if to.settings.iter().any(|setting| setting.spec.name == spec.name) {
            let text = format!("option `{name}` is in the address too: keep one");
            return self.refuse(&key.span(), text);
        }
        to.settings.extend(self.setting(spec, spec.shape, (spec.name, spec.expects), value));
    }
}

type AddressWithOptions = (Address, Vec<Setting<OptionSpec>>);

fn read_address(text: &str, place: &Place) -> Result<AddressWithOptions, AddressProblem> {
    let (address, query) = endpoint::split(text)?;
    let address = EndpointConfig::bare(address)?.address;
    let options = endpoint::read_query(query, address.kind())?;
    let setting = |(spec, text): (&'static OptionSpec, String)| {
        let words = spec.shape.split(&text).into_iter().map(|word| (word, place.clone()));
        Setting { spec, words: words.collect(), place: place.clone(), is_in_address: true }
    };
    Ok((address, options.into_iter().map(setting).collect()))
}

fn unknown_general(name: &str, value: &DeValue<'_>) -> String {
    let general = || GENERAL.iter().map(|spec| spec.name);
    let is_option = name == ADDRESS || OPTIONS.iter().any(|spec| spec.name == name);
    let known = suggest::nearest(name, general().chain([ENDPOINT]));
    let hint = match known {
        _ if is_option => "write it below the table of an endpoint, such as [endpoint.gcs]".into(),
        Some(near) => format!("did you mean `{near}`?"),
        None if value.is_table() => format!("write [endpoint.{name}] for an endpoint"),
        None => format!("general keys are {}", suggest::list(general(), "and")),
    };
    format!("unknown key `{name}`: {hint}")
}

fn unknown_option(name: &str) -> String {
    if name == "name" {
        return "the name of an endpoint is that of its table: leave out `name`".to_owned();
    }
    let options = || OPTIONS.iter().map(|spec| spec.name).filter(|known| *known != "name");
    let known = || [ADDRESS].into_iter().chain(options());
    let hint = match suggest::nearest(name, known()) {
        _ if GENERAL.iter().any(|spec| spec.name == name) => {
            "it is a general key: write it before the first table".to_owned()
        }
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("an endpoint takes {}", suggest::list(known(), "and")),
    };
    format!("unknown key `{name}`: {hint}")
}
