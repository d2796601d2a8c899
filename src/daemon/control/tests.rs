//! Requests, made of a loop that the test turns itself.

use std::io::{self, BufRead, BufReader, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream as Caller;
use std::time::Instant;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::*;
use crate::config::{EndpointConfig, EndpointOptions, General, KeyFile};
use crate::control::MAX_REQUEST;
use crate::daemon::stage::{self, until};
use crate::mavlink::Key;
use crate::sim::Swarm;

fn daemon(endpoints: Vec<EndpointConfig>) -> Daemon {
    stage::daemon(General::default(), endpoints)
}

/// Somebody who has connected.
fn call(daemon: &mut Daemon) -> Caller {
    let (ours, theirs) = Caller::pair().unwrap();
    theirs.set_nonblocking(true).unwrap();
    daemon.admit_client(UnixStream::from_std(theirs));
    ours
}

fn ask(daemon: &mut Daemon, caller: &Caller, request: &str) -> String {
    writeln!(&*caller, "{request}").unwrap();
    until(daemon, request, |_| is_readable(caller));
    let mut line = String::new();
    BufReader::new(caller).read_line(&mut line).unwrap();
    line
}

/// Whether there is anything to read.
fn is_readable(caller: &Caller) -> bool {
    let mut ready = [PollFd::new(caller, PollFlags::IN)];
    poll(&mut ready, Some(&Timespec::default())).unwrap() > 0
}

fn names(daemon: &Daemon) -> Vec<&str> {
    daemon.io.endpoints.iter().map(|endpoint| endpoint.name.as_str()).collect()
}

fn done(answer: Answer) -> String {
    match answer {
        Answer::Done(text) => text,
        other => panic!("{other:?}"),
    }
}

fn refused(answer: Answer) -> String {
    match answer {
        Answer::Error(text) => text,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_belongs_to_the_program_itself_is_neither_copied_nor_taken_away() {
    let mut daemon = daemon(Vec::new());
    let options = EndpointOptions::default();
    let peer = Box::new(Swarm::new(options.sim, daemon.now));
    daemon.add_internal("flight-logs", options, &[], peer).unwrap();
    done(daemon.request_add("udpin:127.0.0.1:0?name=a"));
    done(daemon.request_add("udpin:127.0.0.1:0?name=b"));
    done(daemon.request_change("udpin:127.0.0.1:0?name=b&max_peers=3"));
    done(daemon.request_enabled("a", false));
    assert_eq!(names(&daemon), ["internal:flight-logs", "a", "b"]);
    done(daemon.request_remove("a"));
    assert_eq!(names(&daemon), ["internal:flight-logs", "b"]);
    for answer in [
        daemon.request_remove("internal:flight-logs"),
        daemon.request_enabled("flight-logs", false),
    ] {
        let text = refused(answer);
        assert!(text.contains("flight-logs is a part of the program itself"), "{text}");
    }
    assert_eq!(names(&daemon), ["internal:flight-logs", "b"]);
    let text = refused(daemon.request_remove("c"));
    assert_eq!(text, "there is no endpoint c (there are: b)");
}

#[test]
fn a_request_finds_the_keys_that_are_loaded_and_tells_of_others_how_to_load_them() {
    let mut config: EndpointConfig = "udpin:127.0.0.1:0?name=a&sign=radio".parse().unwrap();
    config.options.sign.as_mut().unwrap().key = Some(Key::from_passphrase("radio"));
    let mut daemon = daemon(vec![config]);
    done(daemon.request_change("udpin:127.0.0.1:0?name=a&sign=radio&max_peers=3"));
    done(daemon.request_add("udpin:127.0.0.1:0?name=b&verify=radio"));
    let text = refused(daemon.request_add("udpin:127.0.0.1:0?name=c&sign=other"));
    assert!(text.starts_with("c: key `other` is not loaded"), "{text}");
    assert!(text.contains("under `keys`") && text.contains("reload"), "{text}");
    // Those that no endpoint uses yet are there as well, if they could be read.
    let file = |name: &str, key| KeyFile { name: name.into(), path: "/x.key".into(), key };
    daemon.general.keys =
        vec![file("spare", Some(Key::from_passphrase("spare"))), file("torn", None)];
    done(daemon.request_add("udpin:127.0.0.1:0?name=d&sign=spare&verify=radio"));
    let text = refused(daemon.request_add("udpin:127.0.0.1:0?name=e&sign=torn"));
    assert!(text.contains("/x.key could not be read"), "{text}");
    let text = refused(daemon.request_add("udpin:127.0.0.1:0?name=e&sign=other"));
    assert!(text.contains("there are: spare, torn"), "{text}");
}

#[test]
fn endpoints_of_one_address_have_names_of_their_own() {
    let texts = ["udpin:127.0.0.1:0?dev=absent0", "udpin:127.0.0.1:0?dev=absent1"];
    let mut daemon = daemon(texts.map(|text| text.parse().unwrap()).to_vec());
    let first = "udpin:127.0.0.1:0";
    assert_eq!(names(&daemon), [first.to_owned(), format!("{first}#2")]);
    let text = refused(daemon.request_change(&format!("{first}?max_peers=3")));
    assert!(text.starts_with("there are several endpoints"), "{text}");
    done(daemon.request_remove(&format!("{first}#2")));
    let left: Vec<String> = daemon.io.endpoints.iter().map(|it| it.config.to_string()).collect();
    assert_eq!(left, texts[..1]);
}

#[test]
fn an_endpoint_is_changed_under_its_address_when_another_one_of_that_is_gone() {
    let texts = ["udpin:127.0.0.1:0?dev=absent0", "udpin:127.0.0.1:0?dev=absent1"];
    let mut daemon = daemon(texts.map(|text| text.parse().unwrap()).to_vec());
    done(daemon.request_remove("udpin:127.0.0.1:0"));
    assert_eq!(names(&daemon), ["udpin:127.0.0.1:0#2"]);
    let changed = format!("{}&max_peers=3", texts[1]);
    done(daemon.request_change(&changed));
    let left: Vec<String> = daemon.io.endpoints.iter().map(|it| it.config.to_string()).collect();
    assert_eq!(left, [changed]);
}

#[test]
fn a_failure_is_told_again_after_it_was_switched_off_and_on() {
    let mut daemon = daemon(vec!["serial:/dev/absent:57600?name=fc".parse().unwrap()]);
    let index = daemon.io.endpoints.ids()[0];
    daemon.io.endpoints[index].told = Some(("open".to_owned(), io::ErrorKind::NotFound));
    done(daemon.request_enabled("fc", false));
    assert_eq!(daemon.io.endpoints[index].told, None);
}

#[test]
fn a_follower_that_has_gone_leaves_its_place_at_once() {
    let mut daemon = daemon(Vec::new());
    let caller = call(&mut daemon);
    let answer = ask(&mut daemon, &caller, r#"{"request":"follow","interval_ms":1000000000000}"#);
    assert!(answer.contains("expected 100 to 60000"), "{answer}");
    let answer = ask(&mut daemon, &caller, r#"{"request":"follow","interval_ms":60000}"#);
    assert!(answer.contains(r#""status":"#), "{answer}");
    let began = Instant::now();
    drop(caller);
    until(&mut daemon, "it is gone", |it| it.control.clients.iter().all(Option::is_none));
    assert!(began.elapsed() < Duration::from_secs(50), "only with its next picture");
}

#[test]
fn who_follows_listens_no_more() {
    let mut daemon = daemon(Vec::new());
    let caller = call(&mut daemon);
    ask(&mut daemon, &caller, r#"{"request":"listen"}"#);
    assert!(daemon.router.tap().is_open());
    ask(&mut daemon, &caller, r#"{"request":"follow","interval_ms":1000}"#);
    assert!(!daemon.router.tap().is_open());
}

#[test]
fn who_sends_no_more_is_told_of_frames_until_it_has_gone() {
    let mut daemon = daemon(Vec::new());
    let caller = call(&mut daemon);
    ask(&mut daemon, &caller, r#"{"request":"listen"}"#);
    caller.shutdown(Shutdown::Write).unwrap();
    let has_ended = |it: &Daemon| it.control.clients.iter().flatten().all(ControlClient::has_ended);
    until(&mut daemon, "it sends no more", has_ended);
    assert!(daemon.router.tap().is_open());
    drop(caller);
    until(&mut daemon, "it is gone", |it| it.control.clients.iter().all(Option::is_none));
    assert!(!daemon.router.tap().is_open());
}

#[test]
fn who_listened_and_sends_too_long_a_line_gets_the_answer_and_no_frames() {
    let mut daemon = daemon(Vec::new());
    let caller = call(&mut daemon);
    writeln!(&caller, r#"{{"request":"listen"}}"#).unwrap();
    (&caller).write_all(&[b'x'; MAX_REQUEST]).unwrap();
    daemon.control.has_work = true;
    assert!(daemon.serve_control() && daemon.router.tap().is_open());
    assert!(daemon.serve_control() && !daemon.router.tap().is_open());
    while daemon.serve_control() {}
    let lines: Vec<String> = BufReader::new(&caller).lines().map(Result::unwrap).collect();
    assert!(lines.len() == 2 && lines[1].contains("a request has at most"), "{lines:?}");
}
