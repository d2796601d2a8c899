//! Several configuration files as one: later ones override earlier ones, key by key.
//!
//! - A general key of a later file replaces that of an earlier one.
//! - A table `[endpoint.X]` that an earlier file has too is the same endpoint: its keys replace
//!   those of the earlier file, and all others stay.
//! - An `address` replaces the whole earlier address, with the options in its query. An option is
//!   replaced wherever the earlier file wrote it, as a key or in the address; so are baud rates.

use std::iter;

use super::address::Address;
use super::endpoint::{self, EndpointConfig};
use super::error::AddressProblem;
use super::general::{General, GeneralSpec};
use super::layer::{ADDRESS, EndpointTable, Layer, PlacedAddress, Setting};
use super::option_spec::OptionSpec;
use super::options::EndpointOptions;
use super::place::{ConfigError, ConfigProblem, Place};

/// What the option is called that says the same as a part of the address.
const BAUDRATE: &str = "baudrate";

/// How many endpoints there can be: more than there can be links.
pub const MAX_ENDPOINTS: usize = 4_096;

/// What is configured: everything is complete and in range.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Config {
    /// For the program as a whole.
    pub general: General,
    /// What to join: at most [`MAX_ENDPOINTS`], and no two with the same `name`.
    pub endpoints: Vec<Endpoint>,
}

impl Config {
    /// Adds the endpoints of the command line.
    ///
    /// # Errors
    ///
    /// If one has the `name` of another, or if there are too many.
    pub fn add(&mut self, endpoints: &[EndpointConfig]) -> Result<(), ConfigError> {
        let mut problems = Vec::new();
        for added in endpoints {
            let name = &added.options.name;
            let mut named = self.endpoints.iter().filter(|it| it.config.options.name == *name);
            if let (Some(name), Some(other)) = (name, named.next()) {
                let text = name_is_taken(name, added, other);
                problems.push(ConfigProblem::of_command_line(text));
            }
            self.endpoints.push(added.clone().into());
        }
        problems.extend(too_many(&self.endpoints));
        ConfigError::unless_none((), problems)
    }
}

fn name_is_taken(name: &str, added: &EndpointConfig, other: &Endpoint) -> String {
    let address = &added.address;
    let other = match &other.place {
        Some(place) => place.to_string(),
        None => other.config.address.to_string(),
    };
    format!("{address} has the name `{name}` of {other}: give one of them another")
}

/// What is wrong if there are more endpoints than [`MAX_ENDPOINTS`].
pub(super) fn too_many(endpoints: &[Endpoint]) -> Option<ConfigProblem> {
    let extra = endpoints.get(MAX_ENDPOINTS)?;
    let text = format!("there are {} endpoints: {MAX_ENDPOINTS} is the most", endpoints.len());
    Some(match &extra.place {
        Some(place) => ConfigProblem::at(place, text),
        None => ConfigProblem::of_command_line(text),
    })
}

/// An endpoint, and where it is configured.
#[derive(Clone, PartialEq, Debug)]
pub struct Endpoint {
    /// The endpoint itself.
    pub config: EndpointConfig,
    /// Where its name stands; `None` for one of the command line.
    pub place: Option<Place>,
    /// Where the values of its keys stand, by name: `address` and the options that are set. On the
    /// command line there are no such places.
    pub keys: Vec<(&'static str, Place)>,
}

impl Endpoint {
    /// Where the value of a key stands, or else the endpoint.
    pub fn place_of(&self, key: &str) -> Option<&Place> {
        let found = self.keys.iter().find(|(name, _)| *name == key);
        found.map(|(_, place)| place).or(self.place.as_ref())
    }
}

/// An endpoint of the command line.
impl From<EndpointConfig> for Endpoint {
    fn from(config: EndpointConfig) -> Self {
        Self { config, place: None, keys: Vec::new() }
    }
}

/// What the files say together.
pub(super) fn merge(layers: Vec<Layer>) -> Result<Config, ConfigError> {
    let mut general: Vec<Setting<GeneralSpec>> = Vec::new();
    let mut drafts: Vec<EndpointTable> = Vec::new();
    for layer in layers {
        general.extend(layer.general);
        for table in layer.endpoints {
            match drafts.iter_mut().find(|draft| draft.name == table.name) {
                Some(draft) => override_with(draft, table),
                None => drafts.push(table),
            }
        }
    }
    let mut config = Config::default();
    let mut problems = set_general(&mut config.general, &general);
    for draft in drafts {
        match build(draft) {
            Ok(endpoint) => config.endpoints.push(endpoint),
            Err(found) => problems.extend(found),
        }
    }
    problems.extend(too_many(&config.endpoints));
    ConfigError::unless_none(config, problems)
}

/// Takes the keys of a later file.
fn override_with(draft: &mut EndpointTable, later: EndpointTable) {
    if let Some(address) = later.address {
        let has_bauds =
            matches!(&address.address, Address::Serial { bauds, .. } if !bauds.is_empty());
        let is_replaced = |setting: &Setting<OptionSpec>| {
            setting.is_in_address || (has_bauds && setting.spec.name == BAUDRATE)
        };
        draft.settings.retain(|setting| !is_replaced(setting));
        draft.address = Some(address);
    } else if later.settings.iter().any(|setting| setting.spec.name == BAUDRATE)
        && let Some(PlacedAddress { address: Address::Serial { bauds, .. }, .. }) =
            &mut draft.address
    {
        bauds.clear();
    }
    for setting in later.settings {
        draft.settings.retain(|earlier| earlier.spec.name != setting.spec.name);
        draft.settings.push(setting);
    }
}

fn set_general(general: &mut General, settings: &[Setting<GeneralSpec>]) -> Vec<ConfigProblem> {
    let mut problems = Vec::new();
    for setting in settings {
        let (spec, words) = (setting.spec, setting.texts());
        if (spec.set)(general, &words).is_none() {
            let shown = words.join(",");
            let problem = AddressProblem::BadValue(shown, spec.name, spec.expects);
            problems.push(ConfigProblem::at(&setting.place, problem));
        }
    }
    problems
}

fn build(draft: EndpointTable) -> Result<Endpoint, Vec<ConfigProblem>> {
    let Some(placed) = draft.address else {
        let name = &draft.name;
        let text =
            format!("endpoint `{name}` has no address: add address = \"udpin:0.0.0.0:14550\"");
        return Err(vec![ConfigProblem::at(&draft.place, text)]);
    };
    let mut config =
        EndpointConfig { address: placed.address, options: EndpointOptions::default() };
    config.options.name = Some(draft.name);
    let mut problems = Vec::new();
    for setting in &draft.settings {
        let specs = draft.settings.iter().map(|setting| setting.spec);
        problems.extend(set(&mut config, setting).err());
        let needs = endpoint::check_needs(setting.spec, specs);
        problems.extend(needs.err().map(|problem| ConfigProblem::at(&setting.place, problem)));
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let config = config.complete();
    let config = config.map_err(|problem| vec![ConfigProblem::at(&placed.place, problem)])?;
    let settings = draft.settings.iter().map(|setting| (setting.spec.name, setting.place.clone()));
    let keys = iter::once((ADDRESS, placed.place)).chain(settings).collect();
    Ok(Endpoint { config, place: Some(draft.place), keys })
}

fn set(config: &mut EndpointConfig, setting: &Setting<OptionSpec>) -> Result<(), ConfigProblem> {
    let spec = setting.spec;
    let Err(problem) = spec.set(config, &setting.texts().join(",")) else { return Ok(()) };
    // Of a list, the first wrong word is enough.
    if setting.words.len() > 1 && matches!(problem, AddressProblem::BadValue(..)) {
        for (word, place) in &setting.words {
            if let Err(problem) = spec.set(&mut config.clone(), word) {
                return Err(ConfigProblem::at(place, problem));
            }
        }
    }
    Err(ConfigProblem::at(&setting.place, problem))
}
