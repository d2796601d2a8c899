//! Metrics and the status page: who asks by HTTP is answered, and whoever asks wrongly, slowly or too
//! much harms nobody.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use mavswitch::daemon::MAX_HTTP_CLIENTS;
use mavswitch::status::{PAGE, Snapshot};

use crate::harness::*;

const METRICS: &str = "--metrics=127.0.0.1:0";

fn connect(to: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(to).expect("a router that listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    stream
}

/// What is answered until the router closes the connection; nothing if it resets it.
fn rest(mut stream: TcpStream) -> String {
    let mut bytes = Vec::new();
    match stream.read_to_end(&mut bytes) {
        Err(error) if error.kind() != ErrorKind::ConnectionReset => panic!("{error}"),
        _ => String::from_utf8(bytes).expect("text"),
    }
}

fn say(to: SocketAddr, text: &str) -> String {
    let mut stream = connect(to);
    stream.write_all(text.as_bytes()).expect("a request that is taken");
    rest(stream)
}

fn ask(to: SocketAddr, method: &str, path: &str) -> (String, String) {
    let answer = say(to, &format!("{method} {path} HTTP/1.1\r\nHost: {to}\r\n\r\n"));
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head");
    (head.to_owned(), body.to_owned())
}

fn get(to: SocketAddr, path: &str) -> String {
    let (head, body) = ask(to, "GET", path);
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    assert!(head.contains(&format!("Content-Length: {}\r\n", body.len())), "{head}");
    body
}

/// The value of a sample.
fn sample(text: &str, name: &str) -> u64 {
    let line = text.lines().find(|line| line.starts_with(name));
    let line = line.unwrap_or_else(|| panic!("no {name} in\n{text}"));
    line.rsplit(' ').next().unwrap().parse::<f64>().unwrap() as u64
}

#[test]
fn the_figures_are_those_of_the_traffic_and_stay_when_links_go() {
    let router =
        Router::start(&[METRICS, "udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp"]);
    let to = router.metrics();
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    let text = get(to, "/metrics");
    let received = sample(&text, "mavswitch_received_frames_total{endpoint=\"tcp\"}");
    assert!(received > 0);
    assert_eq!(sample(&text, "mavswitch_endpoint_links{endpoint=\"tcp\"}"), 1);
    let snapshot: Snapshot = serde_json::from_str(&get(to, "/status.json")).unwrap();
    assert_eq!(snapshot.endpoints[1].links[0].counters.frames_in, received);
    drop(gcs);
    eventually("the link is gone", || {
        let links = sample(&get(to, "/metrics"), "mavswitch_endpoint_links{endpoint=\"tcp\"}");
        links == 0
    });
    let text = get(to, "/metrics");
    assert_eq!(sample(&text, "mavswitch_received_frames_total{endpoint=\"tcp\"}"), received);
}

#[test]
fn the_page_stands_for_itself() {
    let router = Router::start(&[METRICS, "udpin:127.0.0.1:0"]);
    let to = router.metrics();
    assert_eq!(get(to, "/"), PAGE);
    let (head, body) = ask(to, "HEAD", "/");
    assert!(head.contains(&format!("Content-Length: {}", PAGE.len())) && body.is_empty(), "{head}");
    assert!(head.contains("X-Frame-Options: DENY"), "{head}");
    assert!(PAGE.contains("default-src 'none'"));
    // It takes nothing from anywhere else, and puts no text of others on it as HTML.
    for word in ["https://", "innerHTML", "insertAdjacentHTML", "document.write", "eval("] {
        assert!(!PAGE.contains(word), "{word}");
    }
}

#[test]
fn wrong_requests_are_told_so() {
    let router = Router::start(&[METRICS, "udpin:127.0.0.1:0"]);
    let to = router.metrics();
    let status = |text: &str| say(to, text).lines().next().unwrap_or_default().to_owned();
    let host = format!("Host: {to}\r\n\r\n");
    assert_eq!(status(&format!("GET /x HTTP/1.1\r\n{host}")), "HTTP/1.1 404 Not Found");
    let post = say(to, &format!("POST / HTTP/1.1\r\nContent-Length: 3\r\n{host}abc"));
    assert!(post.starts_with("HTTP/1.1 405 ") && post.contains("Allow: GET, HEAD\r\n"), "{post}");
    assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "HTTP/1.1 400 Bad Request");
    assert_eq!(status("hello\r\n\r\n"), "HTTP/1.1 400 Bad Request");
    // A page of a stranger, whose name leads here.
    let rebound = "GET /status.json HTTP/1.1\r\nHost: evil.example:9550\r\n\r\n";
    assert_eq!(status(rebound), "HTTP/1.1 421 Misdirected Request");
    let long = format!("GET /{} HTTP/1.1\r\n", "a".repeat(20_000));
    assert_eq!(status(&long), "HTTP/1.1 431 Request Header Fields Too Large");
    get(to, "/metrics");
}

#[test]
fn who_asks_slowly_or_takes_nothing_holds_up_nobody() {
    let router =
        Router::start(&[METRICS, "udpin:127.0.0.1:0?name=udp", "tcpin:127.0.0.1:0?name=tcp"]);
    let to = router.metrics();
    let before = router.process().descriptors();
    let mut vehicle = router.udp("udp", VEHICLE);
    let mut gcs = router.tcp("tcp", GCS);
    let mut idle: Vec<TcpStream> = (0..4 * MAX_HTTP_CLIENTS).map(|_| connect(to)).collect();
    for half in idle.iter_mut().step_by(2) {
        half.write_all(b"GET / HT").expect("room in the system");
    }
    router.assert_serves(&mut gcs, &mut vehicle);
    let open = router.process().descriptors();
    assert!(open <= before + MAX_HTTP_CLIENTS + 4, "{before} descriptors grew to {open}");
    // They are closed in their turn, and then there is room again.
    for stream in idle {
        let _ = rest(stream);
    }
    get(to, "/metrics");
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn all_who_ask_at_once_are_answered() {
    let router = Router::start(&[METRICS, "udpin:127.0.0.1:0"]);
    let to = router.metrics();
    let asking: Vec<TcpStream> = (0..2 * MAX_HTTP_CLIENTS).map(|_| connect(to)).collect();
    for mut stream in &asking {
        let text = format!("GET /metrics HTTP/1.1\r\nHost: {to}\r\n\r\n");
        stream.write_all(text.as_bytes()).expect("a request that is taken");
    }
    for stream in asking {
        let answer = rest(stream);
        assert!(answer.starts_with("HTTP/1.1 200 OK\r\n"), "{answer}");
    }
}

#[test]
fn a_reload_moves_the_port() {
    use rustix::process::Signal;
    let dir = TempDir::new();
    let endpoint = "[endpoint.udp]\naddress = \"udpin:127.0.0.1:0\"\n";
    let file = dir.write("a.toml", endpoint);
    let router = Router::start(&["-c", file.to_str().unwrap()]);
    dir.write("a.toml", &format!("metrics = \"127.0.0.1:0\"\n{endpoint}"));
    router.signal(Signal::HUP);
    let to = router.metrics();
    get(to, "/metrics");
    dir.write("a.toml", endpoint);
    router.signal(Signal::HUP);
    eventually("nobody listens any more", || TcpStream::connect(to).is_err());
}

#[test]
fn a_port_that_is_taken_stops_nothing() {
    let port = FreePort::new();
    let taken = std::net::TcpListener::bind(port.here()).unwrap();
    let to = taken.local_addr().unwrap();
    let router = Router::start(&[&format!("--metrics={to}"), "udpin:127.0.0.1:0"]);
    router.log.wait_for(&["WARN", "no metrics: cannot listen on"]);
    drop(taken);
    assert_eq!(router.metrics(), to);
    get(to, "/metrics");
}

/// Prints what a scrape a second costs with 100 links. What another machine's load adds to it is no
/// fault, so the bound is wide of the aim, which is 1 %.
#[test]
fn metrics_of_a_hundred_links_cost_little() {
    let router = Router::start(&[METRICS, "tcpin:127.0.0.1:0?name=tcp&max_peers=200"]);
    let to = router.metrics();
    let mut peers: Vec<_> =
        (1..=100).map(|system| router.tcp_unnoticed("tcp", Component::new(system, 1))).collect();
    for peer in &mut peers {
        peer.send_mark();
    }
    let links = "mavswitch_endpoint_links{endpoint=\"tcp\"}";
    eventually("a hundred links", || sample(&get(to, "/metrics"), links) == 100);
    eventually("all are heard", || sample(&get(to, "/metrics"), "mavswitch_components ") == 100);
    let size = get(to, "/metrics").len();
    let scrapes = 50;
    let (before, began) = (router.process().processor_time(), Instant::now());
    (0..scrapes).for_each(|_| drop(get(to, "/metrics")));
    let each = (router.process().processor_time() - before) / scrapes;
    println!(
        "a scrape of {size} bytes, 100 links: {each:?} of processor time, {:?} in all",
        began.elapsed()
    );
    assert!(each < Duration::from_millis(50), "{each:?} of processor time for a scrape");
}
