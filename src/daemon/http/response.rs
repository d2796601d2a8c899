//! What is answered, as bytes.

use std::borrow::Cow;
use std::io::Write;

use crate::status::{MetricsFormat, Snapshot};

/// Why there is nothing else to answer with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Status {
    Ok,
    BadRequest,
    NotFound,
    WrongMethod,
    WrongHost,
    TooLarge,
}

impl Status {
    fn line(self) -> &'static str {
        match self {
            Self::Ok => "200 OK",
            Self::BadRequest => "400 Bad Request",
            Self::NotFound => "404 Not Found",
            Self::WrongMethod => "405 Method Not Allowed",
            Self::WrongHost => "421 Misdirected Request",
            Self::TooLarge => "431 Request Header Fields Too Large",
        }
    }

    /// What is wrong and what to do, for people.
    fn text(self) -> &'static str {
        match self {
            Self::Ok => "",
            Self::BadRequest => "this is no HTTP/1.1 request with one Host\n",
            Self::NotFound => "there is /, /metrics and /status.json\n",
            Self::WrongMethod => "nothing can be changed here: use GET\n",
            Self::WrongHost => "use the address itself, or localhost, and no other name\n",
            Self::TooLarge => "the head of the request is too long\n",
        }
    }
}

/// An answer.
#[derive(Debug)]
pub(super) struct Response {
    status: Status,
    content_type: &'static str,
    body: Cow<'static, [u8]>,
}

impl Response {
    pub(super) fn refusal(status: Status) -> Self {
        let body = status.text().as_bytes().into();
        Self { status, content_type: "text/plain; charset=utf-8", body }
    }

    pub(super) fn page(page: &'static str) -> Self {
        Self::ok("text/html; charset=utf-8", page.as_bytes().into())
    }

    pub(super) fn json(snapshot: &Snapshot) -> Self {
        // Numbers, texts, lists and structures of them: there is nothing that JSON cannot say.
        let body = serde_json::to_vec(snapshot).unwrap_or_default();
        Self::ok("application/json", body.into())
    }

    pub(super) fn metrics(text: String, format: MetricsFormat) -> Self {
        Self::ok(format.content_type(), text.into_bytes().into())
    }

    fn ok(content_type: &'static str, body: Cow<'static, [u8]>) -> Self {
        Self { status: Status::Ok, content_type, body }
    }

    /// Head and body; for HEAD, the head alone.
    pub(super) fn to_bytes(&self, is_head: bool) -> Vec<u8> {
        let Self { status, content_type, body } = self;
        let mut bytes = Vec::with_capacity(body.len() + 512);
        let allow = if *status == Status::WrongMethod { "Allow: GET, HEAD\r\n" } else { "" };
        // Memory takes whatever is written to it.
        let _ = write!(
            bytes,
            "HTTP/1.1 {}\r\nContent-Type: {content_type}\r\nContent-Length: {}\r\n{allow}\
             Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
             X-Frame-Options: DENY\r\nConnection: close\r\n\r\n",
            status.line(),
            body.len(),
        );
        if !is_head {
            bytes.extend_from_slice(body);
        }
        bytes
    }
}
