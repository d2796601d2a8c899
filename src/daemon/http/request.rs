//! What is asked: the head of a request as a value, or why it is none.

use std::net::IpAddr;

use super::response::Status;
use crate::status::MetricsFormat;

/// How long the head of a request may be, in bytes.
pub(super) const MAX_HEAD: usize = 8 * 1_024;

/// How many header lines it may have.
const MAX_HEADERS: usize = 64;

/// A request that can be answered.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Request {
    /// What is asked for.
    pub(super) resource: Resource,
    /// Whether only the head of the answer is wanted.
    pub(super) is_head: bool,
    /// Whether its `Host` is an address or `localhost`, which no stranger's page can be called.
    pub(super) is_for_this_computer: bool,
}

/// What there is to ask for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Resource {
    /// `/`
    Page,
    /// `/status.json`
    Status,
    /// `/metrics`
    Metrics(MetricsFormat),
}

/// What bytes are the beginning of.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Parsed {
    /// A whole request.
    Request(Request),
    /// More is to come.
    Unfinished,
    /// It gets this.
    Refused(Status),
}

/// Reads what has come so far, at most [`MAX_HEAD`] bytes.
pub(super) fn parse(bytes: &[u8]) -> Parsed {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) if bytes.len() < MAX_HEAD => return Parsed::Unfinished,
        Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => {
            return Parsed::Refused(Status::TooLarge);
        }
        Err(_) => return Parsed::Refused(Status::BadRequest),
    }
    understand(&request).map_or_else(Parsed::Refused, Parsed::Request)
}

fn understand(request: &httparse::Request<'_, '_>) -> Result<Request, Status> {
    let mut hosts = request.headers.iter().filter(|it| it.name.eq_ignore_ascii_case("host"));
    // From version 1.1 on there is one, and never more.
    let is_for_this_computer = match (hosts.next(), hosts.next(), request.version) {
        (Some(host), None, _) => is_this_computer(host.value),
        (None, _, Some(0)) => true,
        _ => return Err(Status::BadRequest),
    };
    let is_head = match request.method {
        Some("GET") => false,
        Some("HEAD") => true,
        _ => return Err(Status::WrongMethod),
    };
    let path = request.path.unwrap_or_default().split('?').next();
    let resource = match path {
        Some("/") => Resource::Page,
        Some("/status.json") => Resource::Status,
        Some("/metrics") => Resource::Metrics(MetricsFormat::accepted(accept(request))),
        _ => return Err(Status::NotFound),
    };
    Ok(Request { resource, is_head, is_for_this_computer })
}

fn accept<'a>(request: &httparse::Request<'_, 'a>) -> &'a str {
    let mut headers = request.headers.iter();
    let accept = headers.find(|it| it.name.eq_ignore_ascii_case("accept"));
    accept.and_then(|it| std::str::from_utf8(it.value).ok()).unwrap_or_default()
}

/// Whether a `Host` is an address, whichever, or `localhost`.
fn is_this_computer(host: &[u8]) -> bool {
    let Ok(host) = std::str::from_utf8(host) else { return false };
    let host = host.trim();
    let (name, port) = match host.rsplit_once(':') {
        // The last colon of an IPv6 address stands within its brackets.
        Some((name, port)) if !port.ends_with(']') => (name, port),
        _ => (host, "0"),
    };
    let bracketed = name.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    let is_address = bracketed.unwrap_or(name).parse::<IpAddr>().is_ok();
    port.parse::<u16>().is_ok() && (is_address || name.eq_ignore_ascii_case("localhost"))
}

/// Reads the head of a request that a stranger sent.
///
/// # Fuzzing
///
/// Asserts that what is refused or understood stays so whatever follows, and that no head is waited
/// for that is longer than [`MAX_HEAD`].
pub fn fuzz_http_request(data: &[u8]) {
    let data = &data[..data.len().min(MAX_HEAD)];
    let whole = parse(data);
    assert!(data.len() < MAX_HEAD || whole != Parsed::Unfinished, "waits for ever");
    let mut before = Parsed::Unfinished;
    let step = data.len() / 64 + 1;
    for end in (0..data.len()).step_by(step).chain([data.len()]) {
        let now = parse(&data[..end]);
        if before != Parsed::Unfinished {
            assert_eq!(now, before, "it was something else when less of it had come");
        }
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(text: &str) -> Parsed {
        parse(text.replace('\n', "\r\n").as_bytes())
    }

    fn resource(text: &str) -> Resource {
        match ask(text) {
            Parsed::Request(request) => request.resource,
            other => panic!("{text}: {other:?}"),
        }
    }

    #[test]
    fn a_request_is_understood_when_its_head_is_whole() {
        let text = "GET /metrics?x=1 HTTP/1.1\nHost: 127.0.0.1:9550\nUser-Agent: curl\n\n";
        assert_eq!(resource(text), Resource::Metrics(MetricsFormat::Plain));
        for end in 0..text.len() - 1 {
            assert_eq!(ask(&text[..end]), Parsed::Unfinished, "{}", &text[..end]);
        }
        assert_eq!(resource("GET / HTTP/1.0\n\n"), Resource::Page);
        assert_eq!(resource("GET /status.json HTTP/1.1\nhost: x\n\n"), Resource::Status);
        let accept = "GET /metrics HTTP/1.1\nHost: x\nAccept: application/openmetrics-text\n\n";
        assert_eq!(resource(accept), Resource::Metrics(MetricsFormat::OpenMetrics));
        let Parsed::Request(head) = ask("HEAD / HTTP/1.1\nHost: x\n\n") else { panic!() };
        assert!(head.is_head && !head.is_for_this_computer);
    }

    #[test]
    fn what_is_not_for_us_is_refused() {
        for (text, status) in [
            ("POST / HTTP/1.1\nHost: x\n\n", Status::WrongMethod),
            ("GET /etc/passwd HTTP/1.1\nHost: x\n\n", Status::NotFound),
            ("GET /../ HTTP/1.1\nHost: x\n\n", Status::NotFound),
            ("GET / HTTP/1.1\n\n", Status::BadRequest),
            ("GET / HTTP/1.1\nHost: a\nHost: b\n\n", Status::BadRequest),
            ("GET / HTTP/2.0\n\n", Status::BadRequest),
            ("hello\n\n", Status::BadRequest),
            ("\u{16}\u{3}\u{1}", Status::BadRequest),
        ] {
            assert_eq!(ask(text), Parsed::Refused(status), "{text}");
        }
    }

    #[test]
    fn a_head_is_bounded() {
        let long = format!("GET /{} HTTP/1.1\nHost: x\n\n", "a".repeat(MAX_HEAD));
        assert_eq!(parse(&long.as_bytes()[..MAX_HEAD]), Parsed::Refused(Status::TooLarge));
        let many = format!("GET / HTTP/1.1\n{}\n", "a: b\n".repeat(MAX_HEADERS + 1));
        assert_eq!(ask(&many), Parsed::Refused(Status::TooLarge));
    }

    #[test]
    fn a_name_of_somebody_else_is_not_this_computer() {
        for host in ["127.0.0.1:9550", "127.0.0.1", "[::1]:9550", "[::1]", "localhost:9550"] {
            assert!(is_this_computer(host.as_bytes()), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example:80", "", "127.0.0.1.nip.io", "a:b"] {
            assert!(!is_this_computer(host.as_bytes()), "{host}");
        }
    }

    #[test]
    fn exercise_fuzz_http_request() {
        let text = b"GET /metrics HTTP/1.1\r\nHost: [::1]:9550\r\nAccept: */*\r\n\r\n";
        for at in 0..text.len() {
            fuzz_http_request(&text[..at]);
            for byte in [0, b'\n', b':', b' ', 0xff] {
                let mut bytes = text.to_vec();
                bytes[at] = byte;
                fuzz_http_request(&bytes);
            }
        }
        fuzz_http_request(&[b'a'; MAX_HEAD + 1]);
    }
}
