//! Endpoints come, go and change by request, in the same way as by a reload: what is wanted from now
//! on is laid beside what there is. The next reload leads back to what the files say.

use tracing::info;

use super::super::endpoint::{Endpoint, State};
use super::super::endpoint_table::EndpointId;
use super::super::event_loop::Daemon;
use super::super::plan::is_internal;
use super::super::settings::settle;
use crate::config::EndpointConfig;
use crate::control::Answer;
use crate::mavlink::Key;

/// What was done, or why it was not.
type Outcome = Result<String, String>;

impl Daemon {
    pub(super) fn request_add(&mut self, text: &str) -> Answer {
        answer(self.add_by_request(text))
    }

    pub(super) fn request_change(&mut self, text: &str) -> Answer {
        answer(self.change_by_request(text))
    }

    pub(super) fn request_remove(&mut self, name: &str) -> Answer {
        answer(self.remove_by_request(name))
    }

    pub(super) fn request_enabled(&mut self, name: &str, is_enabled: bool) -> Answer {
        answer(self.switch_by_request(name, is_enabled))
    }

    fn add_by_request(&mut self, text: &str) -> Outcome {
        let config = self.read_endpoint(text)?;
        let name = config.name();
        if self.named(&name).next().is_some() {
            return Err(format!(
                "there is an endpoint {name} already: give this one a name of its own \
                 (?name=NAME), or change that one (`mavswitch endpoint change`)"
            ));
        }
        let before: Vec<_> = self.configured().map(|(_, config)| config.clone()).collect();
        let mut wanted = before.clone();
        wanted.push(config);
        self.want(wanted)?;
        let shortcoming = self.shortcoming(&name);
        match &shortcoming {
            Some((_, false)) => info!("{name}: not added by request: it cannot be opened"),
            _ => info!("{name}: added by request"),
        }
        match shortcoming {
            None => Ok(format!("{name}: added, until the next reload or start")),
            Some((reason, true)) => Ok(format!("{name}: added; {reason}; waiting for it")),
            Some((reason, false)) => {
                self.want(before)?;
                Err(format!("{name}: not added: {reason}"))
            }
        }
    }

    fn change_by_request(&mut self, text: &str) -> Outcome {
        let config = self.read_endpoint(text)?;
        let name = config.name();
        let index = self.one_configured(&name)?;
        if self.io.endpoints[index].config == config {
            return Ok(format!("{name}: is so already"));
        }
        self.want_instead(index, Some(config))?;
        info!("{name}: changed by request");
        match self.shortcoming(&name) {
            None => Ok(format!("{name}: changed, until the next reload or start")),
            Some((reason, _)) => Ok(format!("{name}: changed; {reason}; waiting for it")),
        }
    }

    fn remove_by_request(&mut self, name: &str) -> Outcome {
        let index = self.one_named(name)?;
        self.want_instead(index, None)?;
        info!("{name}: removed by request");
        Ok(format!("{name}: removed, until the next reload or start"))
    }

    fn switch_by_request(&mut self, name: &str, is_enabled: bool) -> Outcome {
        let index = self.one_named(name)?;
        let mut config = self.io.endpoints[index].config.clone();
        let word = if is_enabled { "on" } else { "off" };
        if std::mem::replace(&mut config.options.enabled, is_enabled) == is_enabled {
            return Ok(format!("{name}: is switched {word} already"));
        }
        self.want_instead(index, Some(config))?;
        info!("{name}: switched {word} by request");
        match self.shortcoming(name) {
            Some((reason, _)) => Ok(format!("{name}: switched {word}; {reason}; waiting for it")),
            None => Ok(format!("{name}: switched {word}, until the next reload or start")),
        }
    }

    /// An endpoint as on the command line, with its keys: those that were read at the last start or
    /// reload. A request reads no files.
    fn read_endpoint(&self, text: &str) -> Result<EndpointConfig, String> {
        let mut config: EndpointConfig = text.parse().map_err(|error| format!("{error}"))?;
        let name = config.name();
        let options = &mut config.options;
        for named in [&mut options.sign, &mut options.verify].into_iter().flatten() {
            named.key = self.loaded_key(&named.name);
            if named.key.is_none() {
                let hint = self.key_hint(&named.name);
                return Err(format!("{name}: key `{}` is not loaded: {hint}", named.name));
            }
        }
        Ok(config)
    }

    /// The key of this name, if it was read, for whatever endpoint.
    fn loaded_key(&self, name: &str) -> Option<Key> {
        let mut configured = self.general.keys.iter().filter(|file| file.name == name);
        let options = self.io.endpoints.iter().map(Endpoint::options);
        let mut used = options.flat_map(|it| [&it.sign, &it.verify]).flatten();
        let used = || used.find(|used| used.name == name)?.key.clone();
        configured.find_map(|file| file.key.clone()).or_else(used)
    }

    /// What to do about a key that was not read.
    fn key_hint(&self, name: &str) -> String {
        if let Some(file) = self.general.keys.iter().find(|file| file.name == name) {
            let path = file.path.display();
            return format!(
                "{path} could not be read at the last start or reload: it must have a key, and be \
                 closed to others (`chmod 600`); then reload"
            );
        }
        let names: Vec<&str> = self.general.keys.iter().map(|file| file.name.as_str()).collect();
        match &names[..] {
            [] => "say under `keys` in the configuration file where it is, and reload".to_owned(),
            names => format!(
                "there are: {}. Say under `keys` in the configuration file where it is, and reload",
                names.join(", ")
            ),
        }
    }

    /// What is configured: not what belongs to the program itself.
    fn configured(&self) -> impl Iterator<Item = (EndpointId, &EndpointConfig)> {
        let ids = self.io.endpoints.ids().into_iter();
        let configs = ids.map(|id| (id, &self.io.endpoints[id].config));
        configs.filter(|(_, config)| !is_internal(config))
    }

    /// Puts another one in the place of an endpoint, or none.
    fn want_instead(
        &mut self,
        index: EndpointId,
        instead: Option<EndpointConfig>,
    ) -> Result<(), String> {
        let mut instead = Some(instead);
        let wanted = self.configured().filter_map(|(id, config)| match id {
            id if id == index => instead.take().flatten(),
            _ => Some(config.clone()),
        });
        let wanted = wanted.collect();
        self.want(wanted)
    }

    fn want(&mut self, wanted: Vec<EndpointConfig>) -> Result<(), String> {
        let settled = settle(wanted, self.checker.dialect()).map_err(|error| error.to_string())?;
        self.change_all(settled);
        Ok(())
    }

    fn named(&self, name: &str) -> impl Iterator<Item = EndpointId> {
        let ids = self.io.endpoints.ids().into_iter();
        ids.filter(move |id| self.io.endpoints[*id].name == name)
    }

    /// The endpoint that is called so in the configuration. The number behind its name, by which it
    /// is told from another one, cannot be said there.
    fn one_configured(&self, name: &str) -> Result<EndpointId, String> {
        let mut alike = self.alike(name);
        match (alike.next(), alike.next()) {
            (Some(only), None) => Ok(only),
            (None, _) => self.one_named(name),
            _ => Err(format!("there are several endpoints {name}: give them names (?name=NAME)")),
        }
    }

    fn alike(&self, name: &str) -> impl Iterator<Item = EndpointId> {
        let alike = self.configured().filter(move |(_, config)| config.name() == name);
        alike.map(|(id, _)| id)
    }

    /// The endpoint of this name, if it is one that somebody configured.
    fn one_named(&self, name: &str) -> Result<EndpointId, String> {
        let own = format!("internal:{name}");
        let mut owns = self.named(&own).filter(|id| is_internal(&self.io.endpoints[*id].config));
        match self.named(name).next().or_else(|| owns.next()) {
            Some(index) if is_internal(&self.io.endpoints[index].config) => Err(format!(
                "{name} is a part of the program itself, which no request changes: set the option \
                 that brings it (such as flight_log), and reload or start again"
            )),
            Some(index) => Ok(index),
            None => Err(format!("there is no endpoint {name} ({})", self.known_names())),
        }
    }

    fn known_names(&self) -> String {
        let configured = self.configured().map(|(id, _)| &self.io.endpoints[id].name);
        let names: Vec<&str> = configured.map(String::as_str).collect();
        match &names[..] {
            [] => "there is none at all".to_owned(),
            names => format!("there are: {}", names.join(", ")),
        }
    }

    /// Why an endpoint is not open, and whether waiting may help.
    fn shortcoming(&self, name: &str) -> Option<(String, bool)> {
        let index = self.named(name).chain(self.alike(name)).next()?;
        let endpoint = &self.io.endpoints[index];
        let State::Waiting = endpoint.state else { return None };
        endpoint.failure.as_ref().map(|failure| (failure.text.clone(), failure.may_pass))
    }
}

fn answer(outcome: Outcome) -> Answer {
    match outcome {
        Ok(text) => Answer::Done(text),
        Err(text) => Answer::Error(text),
    }
}
