//! The side that asks: blocking, with an end to every wait. For commands, never for the loop.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use socket2::{Domain, SockAddr, Socket, Type};

use super::place::places_to_ask;
use super::protocol::{Answer, AnswerLine, Request, RequestLine, VERSION, to_line};
use crate::status::Snapshot;

/// How long an answer may take: a daemon answers between two turns of its loop.
const PATIENCE: Duration = Duration::from_secs(5);

/// An answer longer than this comes from nobody we know, in bytes.
const MAX_ANSWER: u64 = 64 * 1_024 * 1_024;

/// The id of what is said to whoever may have asked.
const TO_ALL: u64 = 0;

/// A daemon could not be asked, or did not do what it was asked for.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nobody answers at any of the places where a daemon may be.
    #[error("no mavswitch answers{}", list(.0))]
    Nobody(Vec<(PathBuf, io::Error)>),
    /// The daemon was there and is not any more.
    #[error("the daemon has closed the connection (it ended, or nothing was read for too long)")]
    Closed,
    /// The daemon says nothing.
    #[error(
        "the daemon at {0} does not answer (is it stopped? `ps -C mavswitch -o pid,stat` tells)"
    )]
    Silent(PathBuf),
    /// The connection broke.
    #[error("the connection to the daemon broke: {0}")]
    Broken(#[from] io::Error),
    /// What it says cannot be understood.
    #[error("the daemon's answer cannot be read: {0} (is it another version than this program?)")]
    Garbled(#[from] serde_json::Error),
    /// It says why it does not.
    #[error("{0}")]
    Refused(String),
    /// It answered something else.
    #[error("the daemon answered something else than what it was asked for")]
    Unexpected,
}

fn list(tried: &[(PathBuf, io::Error)]) -> String {
    let mut text = String::new();
    for (path, error) in tried {
        text += &format!("\n  {}: {}{}", path.display(), error, remedy(error));
    }
    text + "\nIs it running? A daemon started with --control PATH is asked with --control PATH."
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::PermissionDenied => " (ask as the user who runs it, or as root: sudo)",
        io::ErrorKind::ConnectionRefused => " (left behind by a daemon that has ended)",
        _ => "",
    }
}

/// A connection to a daemon.
#[derive(Debug)]
pub struct Client {
    path: PathBuf,
    stream: BufReader<UnixStream>,
    /// The line that is being read.
    line: Vec<u8>,
    last_id: u64,
}

impl Client {
    /// Connects to the daemon at `path`, or to the first one at the places where they are.
    ///
    /// # Errors
    ///
    /// If there is none that may be asked.
    pub fn connect(path: Option<&Path>) -> Result<Self, ClientError> {
        let places = path.map_or_else(places_to_ask, |path| vec![path.to_owned()]);
        let mut tried = Vec::new();
        for path in places {
            match open(&path) {
                Ok(stream) => {
                    let stream = BufReader::new(stream);
                    return Ok(Self { path, stream, line: Vec::new(), last_id: 0 });
                }
                Err(error) => tried.push((path, error)),
            }
        }
        Err(ClientError::Nobody(tried))
    }

    /// Where the daemon is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Asks, and waits for the answer to this very request.
    ///
    /// # Errors
    ///
    /// [`ClientError::Refused`] for [`Answer::Error`]; others if there is no answer.
    pub fn ask(&mut self, request: Request) -> Result<Answer, ClientError> {
        self.ask_within(PATIENCE, request)
    }

    /// Asks for what takes the daemon more time than that between two turns of its loop.
    ///
    /// # Errors
    ///
    /// As [`Client::ask`].
    pub fn ask_within(
        &mut self,
        patience: Duration,
        request: Request,
    ) -> Result<Answer, ClientError> {
        let id = self.send(request)?;
        let end = Instant::now() + patience;
        loop {
            match self.receive(end.saturating_duration_since(Instant::now()))? {
                Some(AnswerLine { id: of, answer, .. }) if of == id || of == TO_ALL => {
                    return unless_error(answer);
                }
                Some(_) => {}
                None => return Err(ClientError::Silent(self.path.clone())),
            }
        }
    }

    /// Asks for what is going on.
    ///
    /// # Errors
    ///
    /// As [`Client::ask`].
    pub fn status(&mut self) -> Result<Snapshot, ClientError> {
        match self.ask(Request::Status)? {
            Answer::Status(snapshot) => Ok(*snapshot),
            _ => Err(ClientError::Unexpected),
        }
    }

    /// Sends a request and waits for nothing; says which id its answers will have. The first is 1.
    ///
    /// # Errors
    ///
    /// If the connection broke.
    pub fn send(&mut self, request: Request) -> Result<u64, ClientError> {
        self.last_id += 1;
        let line = RequestLine { version: VERSION, id: self.last_id, request };
        if let Err(error) = self.stream.get_mut().write_all(&to_line(&line)) {
            return Err(self.farewell().unwrap_or_else(|| error.into()));
        }
        Ok(self.last_id)
    }

    /// Why a daemon has closed the connection, if it has said so.
    fn farewell(&mut self) -> Option<ClientError> {
        let last = self.receive(Duration::ZERO).ok()??;
        unless_error(last.answer).err()
    }

    /// The next answer, if it comes within `wait`; what has come of it is kept for the next call.
    ///
    /// # Errors
    ///
    /// If the connection broke, or what comes cannot be understood.
    pub fn receive(&mut self, wait: Duration) -> Result<Option<AnswerLine>, ClientError> {
        let end = Instant::now() + wait;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            // Zero would be for ever.
            let left = left.max(Duration::from_millis(1));
            self.stream.get_ref().set_read_timeout(Some(left))?;
            let room = MAX_ANSWER.saturating_sub(self.line.len() as u64);
            match (&mut self.stream).take(room).read_until(b'\n', &mut self.line) {
                Ok(_) if self.line.ends_with(b"\n") => break,
                Ok(_) => return Err(ClientError::Closed),
                Err(error) if is_timeout(&error) && Instant::now() < end => {}
                Err(error) if is_timeout(&error) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
        }
        let line = std::mem::take(&mut self.line);
        Ok(Some(serde_json::from_slice(&line)?))
    }
}

fn unless_error(answer: Answer) -> Result<Answer, ClientError> {
    match answer {
        Answer::Error(text) => Err(ClientError::Refused(text)),
        answer => Ok(answer),
    }
}

/// A stopped daemon has nobody to accept; its kernel does so for the first few, and no more.
fn open(path: &Path) -> io::Result<UnixStream> {
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None)?;
    socket.set_write_timeout(Some(PATIENCE))?;
    socket.connect(&SockAddr::unix(path)?)?;
    Ok(UnixStream::from(std::os::fd::OwnedFd::from(socket)))
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted
    )
}
