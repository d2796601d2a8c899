//! What can be asked and answered, as values, and the lines that carry them.
//!
//! A request is `{"version":1,"id":7,"request":"status"}`, its answer
//! `{"version":1,"id":7,"status":{...}}`. Fields that are not known are passed over, so that one may
//! be added; a change of meaning takes another [`VERSION`].

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::listen::Frames;
use crate::status::{Snapshot, Why};

/// The version of the protocol.
pub const VERSION: u32 = 1;

/// How long a request may be, in bytes, with the end of its line.
pub const MAX_REQUEST: usize = 8 * 1_024;

/// How often snapshots may be asked for.
pub const MIN_INTERVAL: Duration = Duration::from_millis(100);

/// How seldom; who wants fewer asks for them one by one.
pub const MAX_INTERVAL: Duration = Duration::from_secs(60);

/// What can be asked for.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case")]
pub enum Request {
    /// What is going on; answered by [`Answer::Status`].
    Status,
    /// The same, again and again until the connection ends. Whoever does not read gets fewer.
    Follow {
        /// The time between two answers, in milliseconds; [`MIN_INTERVAL`] to
        /// [`MAX_INTERVAL`].
        interval_ms: u64,
    },
    /// Take in another endpoint.
    EndpointAdd {
        /// As on the command line.
        endpoint: String,
    },
    /// Give the endpoint of the same name these settings; its links stay where that is possible.
    EndpointChange {
        /// As on the command line.
        endpoint: String,
    },
    /// Close an endpoint and forget it.
    EndpointRemove {
        /// Its name, or its address if it has none.
        name: String,
    },
    /// Open an endpoint that was switched off.
    EndpointEnable {
        /// Its name, or its address if it has none.
        name: String,
    },
    /// Close an endpoint, and leave it so until it is switched on again.
    EndpointDisable {
        /// Its name, or its address if it has none.
        name: String,
    },
    /// Why frames go where they go; answered by [`Answer::Why`].
    Why {
        /// Who sends: a component as `1/190`, a system as `1`, or the name of an endpoint.
        from: String,
        /// Whom it is for: the same, or `all`.
        to: String,
        /// Which message: its name or number.
        #[serde(default)]
        message: Option<String>,
        /// In which version of MAVLink, 1 or 2; 2 if it is left out.
        #[serde(default)]
        mavlink: Option<u8>,
        /// Whether it is signed; if it is left out, it is where signatures are asked for.
        #[serde(default)]
        signed: Option<bool>,
    },
    /// Frames as they pass, until the connection ends; answered by [`Answer::Frames`] again and
    /// again, the first one empty.
    Listen {
        /// Which frames; see [`crate::listen::Selection`].
        #[serde(default)]
        filter: String,
    },
    /// Begin or stop to record telemetry.
    Record {
        /// Whether it is to be recorded.
        enabled: bool,
    },
    /// Read the configuration anew, as SIGHUP has it done; answered once that has had its effect, by
    /// [`Answer::Done`] or [`Answer::Wrong`].
    Reload,
    /// Log at another level from now on.
    LogLevel {
        /// `error`, `warn`, `info`, `debug` or `trace`.
        level: String,
    },
}

/// What is answered.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Answer {
    /// What is going on.
    Status(Box<Snapshot>),
    /// Why frames go where they go.
    Why(Box<Why>),
    /// Frames that passed.
    Frames(Frames),
    /// It has been done; in words.
    Done(String),
    /// The configuration cannot be used, and everything is as it was: all that is wrong with it.
    Wrong(Vec<String>),
    /// It has not: what, why, and what to do about it.
    Error(String),
}

/// A request on its way.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct RequestLine {
    /// [`VERSION`], also if it is left out.
    #[serde(default = "version")]
    pub version: u32,
    /// Whatever the client likes; the answers have the same.
    #[serde(default)]
    pub id: u64,
    /// The request itself.
    #[serde(flatten)]
    pub request: Request,
}

/// An answer on its way.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct AnswerLine {
    /// [`VERSION`].
    pub version: u32,
    /// That of the request.
    pub id: u64,
    /// The answer itself.
    #[serde(flatten)]
    pub answer: Answer,
}

fn version() -> u32 {
    VERSION
}

/// What can be read of a line that may be no request.
#[derive(Deserialize)]
struct Envelope {
    #[serde(default = "version")]
    version: u32,
    #[serde(default)]
    id: u64,
}

impl RequestLine {
    /// Reads a line.
    ///
    /// # Errors
    ///
    /// The answer to give to a line that is no request, or one of another version.
    pub fn parse(line: &[u8]) -> Result<Self, AnswerLine> {
        let envelope = serde_json::from_slice(line);
        let Envelope { version, id } = envelope.map_err(|error| no_request(0, &error))?;
        if version != VERSION {
            let text =
                format!("version {version} of the protocol is not known here: this is {VERSION}");
            return Err(AnswerLine::new(id, Answer::Error(text)));
        }
        serde_json::from_slice(line).map_err(|error| no_request(id, &error))
    }
}

fn no_request(id: u64, error: &serde_json::Error) -> AnswerLine {
    let text = format!("this is no request: {error} (mavswitch-control(5) has them all)");
    AnswerLine::new(id, Answer::Error(text))
}

impl AnswerLine {
    /// An answer to the request with this id.
    pub fn new(id: u64, answer: Answer) -> Self {
        Self { version: VERSION, id, answer }
    }

    /// As a line, with its end.
    pub fn to_line(&self) -> Vec<u8> {
        to_line(self)
    }
}

/// A value as one line of JSON.
pub(super) fn to_line(value: &impl Serialize) -> Vec<u8> {
    // Numbers, texts, lists and structures of them: there is nothing that JSON cannot say.
    let mut line = serde_json::to_vec(value).unwrap_or_default();
    line.push(b'\n');
    line
}

/// Reads a line that a stranger may have written.
///
/// # Fuzzing
///
/// Asserts that a request is written as what it was read from, and that every refusal is an answer
/// that can be read.
pub fn fuzz_request(data: &[u8]) {
    match RequestLine::parse(data) {
        Ok(request) => {
            let line = to_line(&request);
            assert_eq!(RequestLine::parse(&line).ok().as_ref(), Some(&request));
        }
        Err(answer) => {
            let read: AnswerLine =
                serde_json::from_slice(&answer.to_line()).expect("an answer can be read");
            assert_eq!(read, answer);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> RequestLine {
        RequestLine::parse(line.as_bytes()).unwrap()
    }

    fn refusal(line: &str) -> (u64, String) {
        let answer = RequestLine::parse(line.as_bytes()).unwrap_err();
        match answer.answer {
            Answer::Error(text) => (answer.id, text),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn requests_are_lines_of_json() {
        let line = read(r#"{"version":1,"id":7,"request":"status"}"#);
        assert_eq!(line, RequestLine { version: 1, id: 7, request: Request::Status });
        let line = read(r#"{"request":"follow","interval_ms":500,"since":"never known"}"#);
        assert_eq!((line.id, line.request), (0, Request::Follow { interval_ms: 500 }));
        let line = read(r#"{"request":"endpoint_add","endpoint":"udpin::1"}"#);
        assert_eq!(line.request, Request::EndpointAdd { endpoint: "udpin::1".to_owned() });
    }

    #[test]
    fn answers_say_in_one_word_what_they_are() {
        let answer = AnswerLine::new(7, Answer::Done("gcs: removed".to_owned()));
        assert_eq!(answer.to_line(), b"{\"version\":1,\"id\":7,\"done\":\"gcs: removed\"}\n");
        let answer = AnswerLine::new(8, Answer::Status(Box::default()));
        let read: AnswerLine = serde_json::from_slice(&answer.to_line()).unwrap();
        assert_eq!(read, answer);
    }

    #[test]
    fn what_is_no_request_is_answered_with_why_not() {
        let (id, text) = refusal(r#"{"id":3,"request":"fly"}"#);
        assert_eq!(id, 3);
        assert!(text.contains("`fly`") && text.contains("`status`"), "{text}");
        let (id, text) = refusal(r#"{"version":2,"id":4,"request":"status"}"#);
        assert_eq!(id, 4);
        assert!(text.contains("version 2"), "{text}");
        assert!(refusal(r#"{"request":"follow"}"#).1.contains("interval_ms"));
        assert!(refusal("hello").1.starts_with("this is no request"));
        assert!(refusal("").1.starts_with("this is no request"));
    }

    #[test]
    fn exercise_fuzz_request() {
        let lines = [
            r#"{"version":1,"id":7,"request":"status"}"#,
            r#"{"id":18446744073709551615,"request":"follow","interval_ms":100}"#,
            r#"{"request":"endpoint_add","endpoint":"udpout:x?name=\u00e4\""}"#,
            r#"{"request":"log_level","level":"debug"}"#,
            r#"{"request":"reload"}"#,
        ];
        for line in lines {
            for cut in 0..line.len() {
                fuzz_request(&line.as_bytes()[..cut]);
                for byte in [0, b'"', b'{', b'}', b'[', b'9', b'-', b'\\', 0xff] {
                    let mut bytes = line.as_bytes().to_vec();
                    bytes[cut] = byte;
                    fuzz_request(&bytes);
                }
            }
            fuzz_request(line.as_bytes());
        }
        fuzz_request("[".repeat(MAX_REQUEST).as_bytes());
    }
}
