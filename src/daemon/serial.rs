//! Serial ports: opened by a helper, tried at several baud rates, told of when nothing comes.

use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tracing::debug;

use super::endpoint::{Endpoint, State};
use super::endpoint_table::EndpointId;
use super::error::{StartError, may_pass};
use super::event_loop::Daemon;
use super::links::{Link, Output, StreamOutput};
use super::open::OpenError;
use crate::config::{Address, Device, FlowControl};
use crate::link::{SerialAnswer, SerialOutcome, SerialSettings, Stream};
use crate::routing::LinkId;

/// How long a baud rate is tried: a heartbeat comes each second, and the first may be cut.
const BAUD_TRIAL: Duration = Duration::from_millis(2_500);

/// After how long without a frame a serial port is told of.
const SILENCE: Duration = Duration::from_secs(5);

/// After how long a driver that does not even open its port is told of.
const SLOW_OPEN: Duration = Duration::from_secs(5);

/// How long the start waits for drivers, so that what cannot be opened at all ends the program.
const START: Duration = Duration::from_secs(2);

/// How long the end waits for ports to be closed.
const END: Duration = Duration::from_secs(1);

impl Daemon {
    /// Has a serial port opened; [`Daemon::handle_serial_answers`] goes on with it.
    pub(super) fn open_serial(&mut self, index: EndpointId) -> Result<(), OpenError> {
        let endpoint = &mut self.io.endpoints[index];
        let Some((device, settings)) = endpoint.serial_settings() else { return Ok(()) };
        if !endpoint.is_asking {
            let action = format!("open {}", named(device.as_ref()));
            let asked = self.opener.open(index, device, settings);
            asked.map_err(|error| OpenError { action, error })?;
            endpoint.is_asking = true;
        }
        endpoint.set_state(State::Opening, self.now);
        self.set_deadline(index, SLOW_OPEN);
        Ok(())
    }

    /// Waits, for a while, until the serial ports are open that were asked for at the start.
    ///
    /// # Errors
    ///
    /// If one cannot be opened and waiting would not help.
    pub(super) fn await_serial_ports(&mut self) -> Result<(), StartError> {
        let end = Instant::now() + START;
        let is_opening = |endpoint: &Endpoint| matches!(endpoint.state, State::Opening);
        while self.io.endpoints.iter().any(is_opening) {
            let left = end.saturating_duration_since(Instant::now());
            let Some(answer) = self.opener.wait(left) else { break };
            let index = answer.asker;
            let Err(failure) = self.handle_serial_answer(answer) else { continue };
            let config = &self.io.endpoints[index].config;
            if !may_pass(config, &failure.error) {
                return Err(StartError::endpoint(config, failure.action, failure.error, None));
            }
            self.try_later(index, failure);
        }
        Ok(())
    }

    /// Takes what the helper has done.
    pub(super) fn handle_serial_answers(&mut self) {
        while let Some(answer) = self.opener.poll() {
            let index = answer.asker;
            if self.io.endpoints.get(index).is_none() {
                // It has gone meanwhile, and its link with it.
                if let SerialOutcome::Opened { port: Ok(port), .. } = answer.outcome {
                    self.opener.close(port);
                }
            } else if let Err(failure) = self.handle_serial_answer(answer) {
                self.try_later(index, failure);
            }
        }
    }

    fn handle_serial_answer(&mut self, answer: SerialAnswer<EndpointId>) -> Result<(), OpenError> {
        let SerialAnswer { asker, outcome } = answer;
        let endpoint = &mut self.io.endpoints[asker];
        endpoint.is_asking = false;
        match (outcome, &endpoint.state) {
            (SerialOutcome::Opened { device, real, settings, port }, State::Opening) => {
                self.io.endpoints[asker].real_device = real;
                let action = match &device {
                    Some(device) => format!("open {}", device.display()),
                    None => "find a flight controller".to_owned(),
                };
                let baud = settings.baud;
                let added = port.and_then(|port| self.add_port(asker, device.as_ref(), baud, port));
                added.map_err(|error| OpenError { action, error })
            }
            (SerialOutcome::Opened { port, .. }, _) => {
                port.into_iter().for_each(|port| self.opener.close(port));
                Ok(())
            }
            (SerialOutcome::BaudSet(baud, result), State::Up(link)) => {
                let link = *link;
                self.handle_baud_set(asker, link, baud, result);
                Ok(())
            }
            // The port went away meanwhile, and could not be asked for before this answer.
            (SerialOutcome::BaudSet(..), State::Opening) => self.open_serial(asker),
            (SerialOutcome::BaudSet(..), _) => Ok(()),
        }
    }

    /// A port is open: makes a link of it.
    fn add_port(
        &mut self,
        index: EndpointId,
        device: Option<&PathBuf>,
        baud: u32,
        port: File,
    ) -> io::Result<()> {
        let peer = format!("{} at {baud} baud", named(device));
        let link = self.add_stream(index, peer, Stream::Serial(port))?;
        self.set_open(index, State::Up(link));
        self.watch_serial(index);
        if self.io.endpoints[index].baud_in_use() != Some(baud) {
            // Other rates were configured while it was being opened.
            self.use_baud(index, link);
        }
        Ok(())
    }

    /// Sees to it that a serial port is looked at when frames should have come.
    fn watch_serial(&mut self, index: EndpointId) {
        let endpoint = &self.io.endpoints[index];
        let Address::Serial { bauds, .. } = &endpoint.config.address else { return };
        let is_one_of_several = bauds.len() > 1 && !endpoint.baud_is_proven;
        self.set_deadline(index, if is_one_of_several { BAUD_TRIAL } else { SILENCE });
    }

    /// Goes on at the baud rate in use if it is among those that are configured now, or else begins
    /// with the first.
    pub(super) fn change_bauds(&mut self, index: EndpointId, in_use: Option<u32>) {
        let endpoint = &mut self.io.endpoints[index];
        let Address::Serial { bauds, .. } = &endpoint.config.address else { return };
        let at = bauds.iter().position(|baud| Some(*baud) == in_use);
        endpoint.baud = at.unwrap_or(0);
        endpoint.baud_is_proven &= at.is_some();
        let State::Up(link) = endpoint.state else { return };
        if at.is_none() {
            endpoint.baud_since = self.now;
        }
        self.watch_serial(index);
        if at.is_none() {
            self.use_baud(index, link);
        }
    }

    /// A driver has not opened its port for a while: says so. There is nothing to be done about it.
    pub(super) fn warn_of_slow_open(&mut self, index: EndpointId) {
        let device = self.io.endpoints[index].serial_settings().and_then(|(device, _)| device);
        let device = named(device.as_ref());
        self.warn(index, &format!("opening {device} takes long: its driver does not answer"));
    }

    /// A serial port has been open for a while: says so if no frame came, and of several baud
    /// rates keeps the one at which frames are heard, or tries the next.
    pub(super) fn check_serial(&mut self, index: EndpointId, id: LinkId) {
        let endpoint = &mut self.io.endpoints[index];
        let Address::Serial { bauds, .. } = &endpoint.config.address else { return };
        let last_heard = self.router.port(id).and_then(|port| port.quality().last_heard);
        let heard = last_heard.is_some_and(|at| at > endpoint.baud_since);
        let is_one_of_several = bauds.len() > 1;
        if heard {
            endpoint.baud_is_proven = true;
            if is_one_of_several {
                let text = format!("frames at {} baud", bauds[endpoint.baud]);
                self.tell(index, &text);
            }
            return;
        }
        if endpoint.baud + 1 == bauds.len() {
            self.warn_of_silence(index, id);
        }
        if is_one_of_several {
            self.try_next_baud(index, id);
        }
    }

    /// Tells, once, that nothing is understood on a serial port.
    fn warn_of_silence(&mut self, index: EndpointId, id: LinkId) {
        let Some(link) = self.io.links.get(id) else { return };
        let text = match link.splitter.stats().skipped_bytes {
            0 => "nothing received yet (is the port set to MAVLink? are RX and TX swapped?)".into(),
            bytes => format!("{bytes} bytes received and no frame (another baud rate?)"),
        };
        let endpoint = &mut self.io.endpoints[index];
        if !std::mem::replace(&mut endpoint.silence_is_told, true) {
            self.warn(index, &text);
        }
    }

    fn try_next_baud(&mut self, index: EndpointId, id: LinkId) {
        let endpoint = &mut self.io.endpoints[index];
        let Address::Serial { bauds, .. } = &endpoint.config.address else { return };
        if endpoint.is_asking {
            return;
        }
        endpoint.baud = (endpoint.baud + 1) % bauds.len();
        debug!("{}: no frames; trying {} baud", endpoint.name, bauds[endpoint.baud]);
        self.use_baud(index, id);
    }

    /// Changes the port to the baud rate that its endpoint is at now; if something is asked of the
    /// helper already, when that is answered.
    fn use_baud(&mut self, index: EndpointId, id: LinkId) {
        let endpoint = &mut self.io.endpoints[index];
        let Some(baud) = endpoint.baud_in_use().filter(|_| !endpoint.is_asking) else { return };
        let Some(Link { output: Output::Stream(output), .. }) = self.io.links.get(id) else {
            return;
        };
        let Stream::Serial(port) = &output.stream else { return };
        match self.opener.set_baud(index, port, baud) {
            Ok(()) => endpoint.is_asking = true,
            Err(error) => self.close_unchanged(id, baud, &error),
        }
    }

    /// A port has another baud rate now, or was to have it.
    fn handle_baud_set(
        &mut self,
        index: EndpointId,
        id: LinkId,
        baud: u32,
        result: io::Result<()>,
    ) {
        if let Err(error) = result {
            return self.close_unchanged(id, baud, &error);
        }
        let endpoint = &mut self.io.endpoints[index];
        if endpoint.baud_in_use() != Some(baud) {
            // Other rates have been configured meanwhile.
            return self.use_baud(index, id);
        }
        endpoint.baud_since = self.now;
        let pace = endpoint.pace();
        if let Some(link) = self.io.links.get_mut(id) {
            link.splitter.forget();
        }
        if let (Some(pace), Some(port)) = (pace, self.router.port_mut(id)) {
            port.set_line_rate(pace, self.now);
        }
        self.watch_serial(index);
    }

    fn close_unchanged(&mut self, id: LinkId, baud: u32, error: &io::Error) {
        self.close_link(id, &format!("cannot change to {baud} baud: {error}"));
    }

    /// Closes what bytes went through, without waiting for its driver.
    pub(super) fn discard(&self, output: Output) {
        if let Output::Stream(StreamOutput { stream: Stream::Serial(port), .. }) = output {
            self.opener.close(port);
        }
    }

    /// Closes all serial ports at the end. A driver that never lets go of its port is left to the
    /// system.
    pub(super) fn close_serial_ports(mut self) {
        for id in self.router.links().iter() {
            if let Some(link) = self.io.links.remove(id) {
                self.discard(link.output);
            }
        }
        self.opener.wait_until_closed(END);
    }
}

/// What a port is called that may be yet to be found.
fn named(device: Option<&PathBuf>) -> String {
    device.map_or_else(|| "a flight controller".to_owned(), |path| path.display().to_string())
}

impl Endpoint {
    /// The port to open, unless that is to be found, and how; `None` if this is no serial endpoint.
    fn serial_settings(&self) -> Option<(Option<PathBuf>, SerialSettings)> {
        let Address::Serial { device, bauds } = &self.config.address else { return None };
        let device = match device {
            Device::Path(path) => Some(path.clone()),
            Device::Auto => None,
        };
        let rtscts = self.options().flow == FlowControl::RtsCts;
        Some((device, SerialSettings { baud: *bauds.get(self.baud)?, rtscts }))
    }
}
