//! A new configuration while the loop runs: read and checked by a thread of its own, taken over
//! between two turns.
//!
//! What is wrong is told, and changes nothing. What is right takes effect as a whole: endpoints that
//! are the same keep their links, options that can change under them do, and the others are closed
//! and opened again.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use mio::Waker;
use tracing::{error, info, warn};

use super::change::list;
use super::endpoint::Endpoint;
use super::endpoint_table::EndpointId;
use super::event_loop::{Daemon, DaemonConfig};
use super::plan::{Plan, plan};
use super::settings::{Settings, settle};
use crate::config::{GENERAL, General, LogLevel};
use crate::control::Answer;
use crate::mavlink::{Dialect, Key};

/// The program around the daemon.
pub trait Host: Send + Sync {
    /// Reads the whole configuration once more, as at the start. Called on a thread of its own.
    ///
    /// # Errors
    ///
    /// All that is wrong with it, one line each.
    fn load(&self) -> Result<DaemonConfig, Vec<String>>;

    /// Logs at another level from now on.
    fn set_log_level(&self, level: LogLevel);
}

/// A configuration with every word of it looked up.
pub(super) struct Fresh {
    general: General,
    dialect: Dialect,
    endpoints: Vec<Settings>,
}

/// What has become of the endpoints.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Counts {
    pub(super) added: usize,
    pub(super) removed: usize,
    /// Closed and opened again.
    pub(super) replaced: usize,
    /// Changed under their links.
    pub(super) changed: usize,
    pub(super) same: usize,
}

/// Reads configurations, one at a time.
pub(super) struct Reloader {
    host: Arc<dyn Host>,
    answers: (Sender<Outcome>, Receiver<Outcome>),
    waker: Arc<Waker>,
    /// Whether a thread is reading.
    is_reading: bool,
    /// Whether it was asked once more meanwhile: what it reads may be older than that.
    is_asked_again: bool,
    /// What was read, until the turn is over.
    answer: Option<Outcome>,
}

type Outcome = Result<Fresh, Vec<String>>;

impl Reloader {
    /// A reader that wakes the loop of `waker`.
    pub(super) fn new(host: Arc<dyn Host>, waker: Arc<Waker>) -> Self {
        Self {
            host,
            answers: channel(),
            waker,
            is_reading: false,
            is_asked_again: false,
            answer: None,
        }
    }

    /// Begins to read, or does so once more when it has finished; says whether it begins now.
    ///
    /// # Errors
    ///
    /// If the system refuses another thread.
    fn ask(&mut self) -> io::Result<bool> {
        if self.is_reading {
            self.is_asked_again = true;
            return Ok(false);
        }
        // What was read but not yet taken over is older, too.
        self.answer = None;
        let host = Arc::clone(&self.host);
        let (answers, waker) = (self.answers.0.clone(), Arc::clone(&self.waker));
        let read = move || {
            // Fails only when the program ends and nobody wants to know.
            if answers.send(read(host.as_ref())).is_ok() {
                let _ = waker.wake();
            }
        };
        thread::Builder::new().name("reload".into()).spawn(read)?;
        self.is_reading = true;
        Ok(true)
    }

    /// Looks for an answer; that of a reader that was asked again meanwhile counts for nothing.
    fn poll(&mut self) -> io::Result<()> {
        let Ok(answer) = self.answers.1.try_recv() else { return Ok(()) };
        self.is_reading = false;
        if std::mem::take(&mut self.is_asked_again) {
            return self.ask().map(drop);
        }
        self.answer = Some(answer);
        Ok(())
    }
}

fn read(host: &dyn Host) -> Outcome {
    let DaemonConfig { general, endpoints, dialect } = host.load()?;
    let endpoints = settle(endpoints, &dialect).map_err(|error| vec![error.to_string()])?;
    Ok(Fresh { general, dialect, endpoints })
}

impl Daemon {
    /// SIGHUP has come, or somebody asks for the same.
    pub(super) fn ask_reload(&mut self) {
        self.tell_reloading();
        match self.reloader.ask() {
            Ok(true) => info!("reloading the configuration"),
            // The one that runs is followed by another.
            Ok(false) => {}
            Err(error) => self.reloader.answer = Some(Err(no_thread(&error))),
        }
    }

    /// A thread may have finished reading.
    pub(super) fn handle_reloaded(&mut self) {
        if let Err(error) = self.reloader.poll() {
            self.reloader.answer = Some(Err(no_thread(&error)));
        }
    }

    /// Takes over the configuration that was read, if it is right; says whether one was read.
    pub(super) fn take_over(&mut self) -> bool {
        let Some(outcome) = self.reloader.answer.take() else { return false };
        let answer = match outcome {
            Ok(fresh) => Answer::Done(self.apply(fresh)),
            Err(problems) => {
                say_failed(&problems);
                Answer::Wrong(problems)
            }
        };
        // In this order: who was told by the one finds the other told, too.
        self.tell_ready();
        self.answer_reload(&answer);
        true
    }

    /// Has this configuration from now on; says what that has changed.
    fn apply(&mut self, fresh: Fresh) -> String {
        self.now = self.clock();
        self.change_general(fresh.general);
        // Before the endpoints: they name messages that it may have.
        self.checker.set_dialect(fresh.dialect);
        let Counts { added, removed, replaced, changed, same } = self.change_all(fresh.endpoints);
        let text = format!(
            "configuration reloaded; endpoints: {added} added, {removed} removed, {replaced} opened \
             again, {changed} changed, {same} as before",
        );
        info!("{text}");
        text
    }

    /// Has these endpoints and no others from now on.
    pub(super) fn change_all(&mut self, wanted: Vec<Settings>) -> Counts {
        let Plan { gone, kept, new } = plan(&self.io.endpoints, wanted);
        let counts = (gone.len(), new.len(), kept.len());
        let replaced = new.iter().filter(|(_, before)| before.is_some()).count();
        // First what is given up: another one may want the port, or the number of a group.
        self.remove_all(&gone, &new);
        for (index, settings) in &kept {
            let endpoint = &mut self.io.endpoints[*index];
            if endpoint.options().group != settings.config.options.group {
                endpoint.membership = None;
            }
        }
        self.set_groups();
        let mut changed = 0;
        for (index, settings) in kept {
            changed += usize::from(self.change_endpoint(index, settings));
        }
        self.io.endpoints.tell_names_apart();
        self.add_endpoints(new.into_iter().map(|(settings, _)| settings));
        self.begin_signing_time(false);
        self.forget_keys();
        self.refresh_own();
        let (gone, new, kept) = counts;
        Counts {
            added: new - replaced,
            removed: gone - replaced,
            replaced,
            changed,
            same: kept - changed,
        }
    }

    fn remove_all(&mut self, gone: &[EndpointId], new: &[(Settings, Option<EndpointId>)]) {
        for index in gone {
            let old = &self.io.endpoints[*index];
            let successor = new.iter().find(|(_, before)| *before == Some(*index));
            match successor {
                Some((settings, _)) => {
                    let reason = match &old.config.differences(&settings.config)[..] {
                        [] => "another endpoint has its port for IPv4, or had it".to_owned(),
                        differences => format!("changed {}", list(differences)),
                    };
                    info!("{}: opening again: {reason}", old.name);
                }
                None => info!("{}: removed", old.name),
            }
            self.remove_endpoint(*index, "the configuration has changed");
        }
    }

    /// Forgets keys that are not configured any more, so that nothing has them and they are wiped. An
    /// endpoint without a link just now still needs to know what was heard by its key.
    fn forget_keys(&mut self) {
        let verify = |endpoint: &Endpoint| endpoint.gate.verify_key().cloned();
        let used: Vec<Key> = self.io.endpoints.iter().filter_map(verify).collect();
        self.router.forget_keys(|key| used.contains(key));
    }

    /// Logs at another level from now on.
    pub(super) fn set_log_level(&mut self, level: LogLevel) {
        if level != self.general.log_level {
            self.reloader.host.set_log_level(level);
        }
        self.general.log_level = level;
    }

    fn change_general(&mut self, general: General) {
        self.set_log_level(general.log_level);
        for spec in GENERAL.iter().filter(|spec| !spec.is_reloaded) {
            if general.show(spec) != self.started_with.show(spec) {
                warn!("{}: another value takes effect at the next start", spec.name);
            }
        }
        self.router.set_options(general.router, self.now);
        let before = std::mem::replace(&mut self.general, general);
        self.change_recorder(&before.record);
        self.open_http();
    }
}

fn no_thread(error: &io::Error) -> Vec<String> {
    vec![format!("cannot start a thread to read the configuration: {error}")]
}

fn say_failed(problems: &[String]) {
    for problem in problems {
        error!("{problem}");
    }
    error!("the configuration cannot be reloaded: everything stays as it was");
}

#[cfg(test)]
mod tests;
