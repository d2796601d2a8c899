//! The control socket, served by the loop between two turns: then nothing is in the middle of
//! anything, and a request may change what there is.
//!
//! Events only note what can be read or written. A client is answered one request after another, each
//! when the answer before it has been taken: one that does not read gets nothing, and costs nothing.

mod client;
mod endpoints;
mod listen;
mod record;
mod reload;
mod socket;
mod why;

use std::time::Duration;

use mio::Interest;
use mio::event::Event;
use mio::net::UnixStream;
use tracing::{debug, info, warn};

use self::client::{ControlClient, Input, Mode};
pub use self::listen::ROOM as LISTEN_ROOM;
use self::socket::ControlSocket;
use self::why::FrameShape;
use super::event_loop::{Daemon, Meaning};
use super::peers::{ACCEPT_AGAIN, next_caller};
use super::timers::Timer;
use crate::config::{ControlPlace, LogLevel};
use crate::control::{
    Answer, AnswerLine, MAX_INTERVAL, MIN_INTERVAL, Request, RequestLine, default_place,
};
use crate::routing::Time;

/// How many clients there can be at the same time.
pub const MAX_CLIENTS: usize = 8;

/// A client that has asked nothing, or taken nothing, for so long is not waited for any more.
const IDLE: Duration = Duration::from_secs(120);

/// One that asks nothing for so long makes room for a new one.
const REPLACEABLE_AFTER: Duration = Duration::from_secs(10);

/// The socket, and who is connected.
pub(super) struct Control {
    socket: Option<ControlSocket>,
    clients: [Option<ControlClient>; MAX_CLIENTS],
    /// Whether somebody may wait to be accepted.
    is_knocked: bool,
    /// Whether there may be anything to do before the next turn.
    has_work: bool,
    /// When to try again to accept, where that failed.
    accept_at: Option<Time>,
    /// What [`Timer::Control`] was last set for.
    deadline: Option<Time>,
}

impl Control {
    /// No socket, and nobody there.
    pub(super) fn closed() -> Self {
        Self {
            socket: None,
            clients: [const { None }; MAX_CLIENTS],
            is_knocked: false,
            has_work: false,
            accept_at: None,
            deadline: None,
        }
    }

    /// Something has happened to the socket, `number` 0, or to a client.
    pub(super) fn handle_event(&mut self, number: u8, event: &Event) {
        self.has_work = true;
        match usize::from(number).checked_sub(1) {
            None => self.is_knocked = true,
            Some(slot) => {
                if let Some(Some(client)) = self.clients.get_mut(slot) {
                    client.handle_event(event);
                }
            }
        }
    }

    /// A deadline has come.
    pub(super) fn handle_timeout(&mut self) {
        (self.has_work, self.deadline) = (true, None);
    }

    /// A place for one more client, if need be that of one who has nothing to say.
    fn make_room(&mut self, now: Time) -> Option<usize> {
        let silence = |client: &ControlClient| now.since(client.last_progress);
        if let Some(free) = self.clients.iter().position(Option::is_none) {
            return Some(free);
        }
        let clients = self.clients.iter().enumerate();
        let idle = clients.filter_map(|(slot, client)| {
            let client = client.as_ref().filter(|client| client.is_idle())?;
            Some((silence(client), slot))
        });
        let (silent_for, slot) = idle.max()?;
        (silent_for >= REPLACEABLE_AFTER).then_some(slot)
    }
}

impl Daemon {
    /// Opens the socket, if one is wanted. Without it everything else works as well.
    pub(super) fn open_control(&mut self) {
        let path = match &self.general.control {
            ControlPlace::Off => return,
            ControlPlace::At(path) => path.clone(),
            ControlPlace::Default => match default_place(rustix::process::geteuid().is_root()) {
                Some(path) => path,
                None => return debug!("no control socket: there is no XDG_RUNTIME_DIR for it"),
            },
        };
        let token = Meaning::Control(0).token();
        match ControlSocket::open(&path, self.poll.registry(), token) {
            Ok(socket) => {
                debug!("control socket at {}", path.display());
                self.control.socket = Some(socket);
            }
            Err(error) => warn!("no control socket at {}: {error}", path.display()),
        }
    }

    /// Serves whoever has asked; says whether the next turn may not wait.
    pub(super) fn serve_control(&mut self) -> bool {
        if !std::mem::take(&mut self.control.has_work) {
            return false;
        }
        self.now = self.clock();
        self.accept_clients();
        let mut is_busy = false;
        for slot in 0..MAX_CLIENTS {
            is_busy |= self.serve_client(slot);
        }
        self.control.has_work = is_busy;
        self.set_control_timer();
        is_busy
    }

    fn accept_clients(&mut self) {
        self.control.accept_at = None;
        while let (true, Some(socket)) = (self.control.is_knocked, &self.control.socket) {
            match next_caller(|| socket.accept()) {
                Ok(Some(stream)) => self.admit_client(stream),
                Ok(None) => self.control.is_knocked = false,
                Err(_) => {
                    self.control.accept_at = Some(self.now + ACCEPT_AGAIN);
                    return;
                }
            }
        }
    }

    fn admit_client(&mut self, stream: UnixStream) {
        let Some(slot) = self.control.make_room(self.now) else {
            let text = format!("{MAX_CLIENTS} clients are connected already: close one of them");
            return client::refuse(stream, &AnswerLine::new(0, Answer::Error(text)));
        };
        self.close_client(slot);
        let mut client = ControlClient::new(stream, self.now);
        // The socket is number 0.
        let token = Meaning::Control(slot as u8 + 1).token();
        let interest = Interest::READABLE | Interest::WRITABLE;
        if client.register(self.poll.registry(), token, interest).is_ok() {
            self.control.clients[slot] = Some(client);
        }
    }

    /// Does what there is to do for a client, at most one request; says whether there may be more.
    fn serve_client(&mut self, slot: usize) -> bool {
        let now = self.now;
        let Some(client) = &mut self.control.clients[slot] else { return false };
        if !client.flush(now) || now.since(client.last_progress) >= IDLE && client.is_stuck() {
            self.close_client(slot);
            return false;
        }
        if let Some(id) = client.take_due(now) {
            let answer = Answer::Status(Box::new(self.snapshot()));
            self.send_answer(slot, id, answer);
        }
        let Some(client) = &mut self.control.clients[slot] else { return false };
        match client.next_line(now) {
            Input::Line(line) => {
                self.handle_request(slot, &line);
                true
            }
            Input::TooLong(answer) => {
                client.push(&answer.to_line());
                self.set_mode(slot, Mode::Closing);
                true
            }
            Input::Nothing => false,
            Input::End => {
                self.close_client(slot);
                false
            }
        }
    }

    fn handle_request(&mut self, slot: usize, line: &[u8]) {
        match RequestLine::parse(line) {
            Ok(RequestLine { id, request, .. }) => {
                if let Some(answer) = self.answer(slot, id, request) {
                    self.send_answer(slot, id, answer);
                }
            }
            Err(answer) => {
                if let Some(client) = &mut self.control.clients[slot] {
                    client.push(&answer.to_line());
                }
            }
        }
    }

    /// Does what is asked for. Each kind of request has its own place where it is done. `None`: the
    /// answer comes later.
    fn answer(&mut self, slot: usize, id: u64, request: Request) -> Option<Answer> {
        Some(match request {
            Request::Reload => {
                self.begin_reload(slot, id);
                return None;
            }
            Request::Status => Answer::Status(Box::new(self.snapshot())),
            Request::Follow { interval_ms } => self.begin_follow(slot, id, interval_ms),
            Request::EndpointAdd { endpoint } => self.request_add(&endpoint),
            Request::EndpointChange { endpoint } => self.request_change(&endpoint),
            Request::EndpointRemove { name } => self.request_remove(&name),
            Request::EndpointEnable { name } => self.request_enabled(&name, true),
            Request::EndpointDisable { name } => self.request_enabled(&name, false),
            Request::Why { from, to, message, mavlink, signed } => {
                match FrameShape::new(mavlink, signed) {
                    Ok(shape) => self.request_why(&from, &to, message.as_deref(), shape),
                    Err(text) => Answer::Error(text),
                }
            }
            Request::Listen { filter } => self.begin_listen(slot, id, &filter),
            Request::Record { enabled } => self.request_record(enabled),
            Request::LogLevel { level } => self.request_log_level(&level),
        })
    }

    /// The first picture at once, the others later.
    fn begin_follow(&mut self, slot: usize, id: u64, interval_ms: u64) -> Answer {
        let interval = Duration::from_millis(interval_ms);
        if !(MIN_INTERVAL..=MAX_INTERVAL).contains(&interval) {
            let (least, most) = (MIN_INTERVAL.as_millis(), MAX_INTERVAL.as_millis());
            let text = format!("interval_ms is {interval_ms}: expected {least} to {most}");
            return Answer::Error(text);
        }
        self.set_mode(slot, Mode::Following { id, interval, next: self.now + interval });
        Answer::Status(Box::new(self.snapshot()))
    }

    /// From now on this and nothing else is done for a client without being asked again.
    fn set_mode(&mut self, slot: usize, mode: Mode) {
        if let Some(client) = &mut self.control.clients[slot] {
            client.mode = mode;
        }
        // It may have listened until now, or not yet.
        self.set_tap();
    }

    fn send_answer(&mut self, slot: usize, id: u64, answer: Answer) {
        if let Some(client) = &mut self.control.clients[slot] {
            client.push(&AnswerLine::new(id, answer).to_line());
            if !client.flush(self.now) {
                self.close_client(slot);
            }
        }
    }

    fn close_client(&mut self, slot: usize) {
        if let Some(mut client) = self.control.clients[slot].take() {
            client.deregister(self.poll.registry());
            self.set_tap();
        }
    }

    fn set_control_timer(&mut self) {
        let clients = self.control.clients.iter().flatten();
        let ends = clients.filter_map(|client| client.deadline(IDLE));
        if let Some(at) = ends.chain(self.control.accept_at).min()
            && self.control.deadline.is_none_or(|set| set > at)
        {
            self.control.deadline = Some(at);
            self.timers.set(at, Timer::Control);
        }
    }

    fn request_log_level(&mut self, level: &str) -> Answer {
        match LogLevel::find(level) {
            Some(level) => {
                let name = level.name();
                info!("log level: {name}, by request");
                self.set_log_level(level);
                Answer::Done(format!("log level: {name}, until the next reload or start"))
            }
            None => Answer::Error(format!(
                "`{level}` is no log level: expected error, warn, info, debug or trace"
            )),
        }
    }
}

#[cfg(test)]
mod tests;
