//! Configuration files: what they add to the command line, and what is said when they are wrong.

use std::fs;
use std::path::Path;
use std::process::Output;

use rustix::process::Signal;

use crate::harness::*;

const UDP: &str = "udpin:127.0.0.1:0?name=udp";

/// What a run printed that went well.
fn stdout(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    // The harness gathers lines, without the end of the last one.
    format!("{}\n", String::from_utf8_lossy(&output.stdout))
}

/// The program ends with this status and says these words of its configuration.
#[track_caller]
fn assert_said(output: &Output, status: i32, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{text}");
    for word in words {
        assert!(text.contains(word), "no {word:?} in {text}");
    }
    assert!(text.lines().all(|line| line.starts_with("mavswitch: ")), "{text}");
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn endpoints_of_the_command_line_add_to_those_of_the_file() {
    let dir = TempDir::new();
    let file = dir.write("a.toml", "[endpoint.tcp]\naddress = \"tcpin:127.0.0.1:0\"\n");
    let router = Router::start(&["-c", text(&file), UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_file_can_be_all_there_is() {
    let dir = TempDir::new();
    let endpoints = "[endpoint.tcp]\naddress = \"tcpin:127.0.0.1:0\"\n\
        [endpoint.udp]\naddress = \"udpin:127.0.0.1:0?max_peers=3\"\npeer_timeout = 5\n";
    let file = dir.write("a.toml", endpoints);
    let router = Router::start(&["--config", text(&file)]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn the_command_line_overrides_the_file() {
    let dir = TempDir::new();
    let general = "learn = \"heartbeat\"\nstrict = true\nroute_age = 5\nsniffer = 3\n\
        dialect = [\"x.xml\"]\nlog_format = \"json\"\nlog_level = \"error\"\n\
        system = 1\ncomponent = 192\n";
    let file = dir.write("a.toml", general);
    let with = |flags: &[&str]| stdout(&run(&[&["config", "-c", text(&file)], flags].concat()));
    let unchanged = with(&[]);
    let dialect = dir.path("x.xml");
    // What a log would be recorded as stands behind, written or not.
    let (unchanged, records) = unchanged.split_once("record_telemetry").unwrap();
    assert_eq!(unchanged, general.replace("x.xml", text(&dialect)));
    let flags = ["--learn=all", "--strict=false", "--route-age=0", "--sniffer=4", "-v"];
    let more = ["--dialect=/y.xml", "--log-format=plain", "--system=7", "--component=25"];
    let changed = with(&[&flags[..], &more[..]].concat());
    let expected = "learn = \"all\"\nstrict = false\nroute_age = 0\nsniffer = 4\n\
        dialect = [\"/y.xml\"]\nlog_format = \"plain\"\nlog_level = \"debug\"\n\
        system = 7\ncomponent = 25\n";
    assert_eq!(changed, format!("{expected}record_telemetry{records}"));
}

#[test]
fn the_effective_configuration_reads_back_as_the_same() {
    let dir = TempDir::new();
    let arguments = [
        "/dev/ttyACM0",
        "udpin:14550?name=a%20name&rate=ATTITUDE:0.5&allow_systems_out=1,2",
        "udpout:[fe80::1%wlan0]?bind=:14551&group=x&path=best",
        "--route-age=1.5",
    ];
    let empty = dir.write("empty.toml", "");
    let first = stdout(&run(&[&["config", "-c", text(&empty)], &arguments[..]].concat()));
    let file = dir.write("first.toml", &first);
    assert_eq!(stdout(&run(&["config", "-c", text(&file)])), first);
}

#[test]
fn a_name_is_given_once() {
    let dir = TempDir::new();
    let file = dir.write("a.toml", "[endpoint.gcs]\naddress = \"tcpin:127.0.0.1:0\"\n");
    let same = "udpin:127.0.0.1:0?name=gcs";
    let place =
        format!("command line: udpin:127.0.0.1:0 has the name `gcs` of {}:1:11", text(&file));
    for command in [&["-c", text(&file), same][..], &["config", "-c", text(&file), same]] {
        assert_said(&run(command), 2, &[&place, "give one of them another"]);
    }
    let other = "udpout:127.0.0.1:9?name=gcs";
    let words = ["udpout:127.0.0.1:9 has the name `gcs` of udpin:127.0.0.1:0: "];
    assert_said(&run(&[same, other]), 2, &words);
}

#[test]
fn who_has_the_port_is_told() {
    let endpoints = ["tcpin:127.78.0.1:5760?name=one", "tcpin:127.78.0.1:5760?name=two"];
    let told = "two: TCP 127.78.0.1:5760 is taken by endpoint one already";
    assert_said(&run(&endpoints), 2, &[told]);
}

/// What a file names and cannot be had is as wrong as the file itself: whoever starts the program
/// again would start it for ever.
#[test]
fn a_check_a_start_and_a_reload_agree_about_what_is_wrong() {
    let dir = TempDir::new();
    dir.write("open.key", &"a5".repeat(32));
    let good = "[endpoint.a]\naddress = \"tcpin:127.0.0.1:0\"\n";
    let endpoint = |address: &str| format!("{good}[endpoint.b]\naddress = \"{address}\"\n");
    let verify = endpoint("udpin:127.0.0.1:0?verify=radio");
    let cases = [
        (verify.clone(), "b: no key is called `radio`"),
        (format!("keys = {{ radio = \"no.key\" }}\n{verify}"), "b: key `radio`: cannot read "),
        (format!("keys = {{ radio = \"open.key\" }}\n{verify}"), "is open to others"),
        (format!("dialect = [\"no.xml\"]\n{good}"), "no.xml: No such file"),
        (format!("dialect = [\"open.key\"]\n{good}"), "open.key: "),
        (endpoint("tlog:no.tlog"), "b: cannot play back "),
        (endpoint("tlog:open.key"), "it is no telemetry log"),
        (endpoint("udpin:127.0.0.1:0?rate=ATTITUD:1"), "b: no message is called ATTITUD"),
        (
            endpoint("udpin:127.78.0.2:9") + "[endpoint.c]\naddress = \"udpin:127.78.0.2:9\"\n",
            "c: UDP 127.78.0.2:9 is taken by endpoint b already",
        ),
    ];
    let file = dir.write("a.toml", good);
    let router = Router::start(&["-c", text(&file)]);
    for (wrong, told) in cases {
        fs::write(&file, wrong).unwrap();
        assert_said(&run(&["check", text(&file)]), 2, &[told]);
        assert_said(&run(&["-c", text(&file)]), 2, &[told]);
        let from = router.log.len();
        router.signal(Signal::HUP);
        router.log.wait_from(from, &["cannot be reloaded: everything stays as it was"]);
        let lines = router.log.lines().split_off(from);
        assert!(lines.iter().any(|line| line.contains(told)), "no {told:?} in {lines:#?}");
    }
}

#[test]
fn a_wrong_command_line_is_told_with_what_would_be_right() {
    for (words, told) in [
        (&["udpin:127.0.0.1:0?rate=ATTITUD:1"][..], "called ATTITUD: did you mean ATTITUDE?"),
        (&["--metrics", "9550", UDP], "write the address too, as 127.0.0.1:9550"),
        (&["--key", "a=x", "--key", "a=y", UDP], "--key names `a` twice: keep one"),
        (&["log", "cut", "x", "--from", "2m", "--to", "1m", "-o", "y"], "--from is not before"),
    ] {
        let output = run(words);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && text.contains(told), "{words:?}: {text}");
    }
}

#[test]
fn a_command_behind_an_option_is_seen_through() {
    let output = run(&["--control", "off", "status"]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("a command goes first"), "{text}");
}

#[test]
fn a_wrong_file_is_told_with_line_and_column() {
    let dir = TempDir::new();
    let file = dir.write("a.toml", "[endpoint.gcs]\naddress = \"udpin:127.0.0.1:0\"\nmtoo = 1\n");
    let place = format!("{}:3:1: ", text(&file));
    let words = [&place, "unknown key `mtoo`"];
    assert_said(&run(&["-c", text(&file), UDP]), 2, &words);
    assert_said(&run(&["check", text(&file)]), 2, &words);
    assert_said(&run(&["check", "-c", text(&file)]), 2, &words);
    assert_said(&run(&["config", "-c", text(&file)]), 2, &words);
    // All of it at once.
    fs::write(&file, "strickt = true\nlearn = 1\n").unwrap();
    assert_said(&run(&["-c", text(&file), UDP]), 2, &["`strict`", "all or heartbeat"]);
}

#[test]
fn a_file_that_is_not_there_is_told() {
    let dir = TempDir::new();
    let absent = dir.path("absent.toml");
    let words = [text(&absent), "No such file"];
    assert_said(&run(&["-c", text(&absent), UDP]), 2, &words);
    assert_said(&run(&["check", text(&absent)]), 2, &words);
}

#[test]
fn a_file_without_endpoints_is_not_enough() {
    let dir = TempDir::new();
    let file = dir.write("a.toml", "strict = true\n");
    let output = run(&["-c", text(&file)]);
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("nothing to join") && text.contains("mavswitch.toml"), "{text}");
}

#[test]
fn a_check_explains_and_warns_and_opens_nothing() {
    let dir = TempDir::new();
    let listener = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let endpoints = format!(
        "[endpoint.gcs]\naddress = \"udpin:{address}\"\n\
         [endpoint.fc]\naddress = \"/dev/absent\"\n"
    );
    let file = dir.write("a.toml", &endpoints);
    let output = run(&["check", text(&file)]);
    let place = format!("mavswitch: {}:4:11: warning: fc: /dev/absent is not there", text(&file));
    assert_said(&output, 0, &[&place]);
    let explained = stdout(&output);
    assert!(explained.starts_with(&format!("gcs: listens for UDP at {address}\n")), "{explained}");
    assert!(explained.ends_with(": right, with 1 warning\n"), "{explained}");
    fs::write(&file, "[endpoint.gcs]\naddress = \"udpin:1?rate=RAW_IUM:1\"\n").unwrap();
    assert_said(&run(&["check", text(&file)]), 2, &["did you mean RAW_IMU?"]);
}
