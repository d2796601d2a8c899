//! What every option takes, refuses, shows and defaults to.

use super::*;
use crate::config::AddressKind::{Serial, Sim, Tlog};
use crate::config::{Address, EndpointConfig, EndpointOptions};

/// Values at the edges of what each option takes; the second list is refused.
const EDGES: &[(&str, &[&str], &[&str])] = &[
    ("name", &["n", "50%25 & ä"], &["", "a\u{7}"]),
    ("enabled", &["true", "false"], &["TRUE"]),
    ("bind", &[":0", "10.0.0.1", "[::1]:1"], &["", "::1", "gcs", "10.0.0.1:65536"]),
    ("dev", &["lo", "fifteen-bytes--"], &["", "sixteen-bytes---"]),
    ("baudrate", &["50", "20000000", "921600,57600"], &["49", "20000001", "57600,", ""]),
    ("flow", &["none", "rtscts"], &["xonxoff", "true", ""]),
    ("bandwidth", &["10", "1000000000"], &["9", "1000000001", "1k", "-1"]),
    ("queue_time", &["10ms", "60s", "0.25", "1m"], &["9ms", "61s", "", "s"]),
    ("rate", &["attitude:4,30:0.5", "0:0.001", "16777215:1000"], RATES_REFUSED),
    ("max_peers", &["1", "1000"], &["0", "1001", "1.5"]),
    (
        "allow_from",
        &["127.0.0.1", "192.168.0.0/16,fd00::/8", "0.0.0.0/0", "::1"],
        &["", "10.0.0.1/8", "10.0.0.0/33", "10.0.0.1,", "gcs.local", "[::1]"],
    ),
    ("peer_timeout", &["100ms", "60m", "1.5"], &["99ms", "3601", "inf", "1e3"]),
    ("stall_timeout", &["100ms", "60m"], &["0", "99ms", "3601s", "1h"]),
    ("retry", &["0", "100ms", "60m", "5"], &["99ms", "3601", "-1", "", "never"]),
    ("sticky", &["true", "false"], &["yes", "1", ""]),
    ("pack", &["true", "false"], &["TRUE"]),
    ("mtu", &["280", "65507"], &["279", "65508", "65536"]),
    ("ttl", &["0", "255"], &["256", "-1"]),
    ("allow_messages_in", &["RAW_IMU", "27,ATTITUDE"], &["", "27,", "[27]", "16777216"]),
    ("block_messages_in", &["RAW_IMU", "27,ATTITUDE"], &["", "27,", "[27]", "16777216"]),
    ("allow_systems_in", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("block_systems_in", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("allow_components_in", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("block_components_in", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("allow_messages_out", &["RAW_IMU", "27,ATTITUDE"], &["", "27,", "[27]", "16777216"]),
    ("block_messages_out", &["RAW_IMU", "27,ATTITUDE"], &["", "27,", "[27]", "16777216"]),
    ("allow_systems_out", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("block_systems_out", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("allow_components_out", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("block_components_out", &["1", "0,255"], &["", "256", "1,", "a"]),
    ("sniffer", &["true", "false"], &["yes"]),
    ("forward_setup_signing", &["true", "false"], &["1"]),
    ("record", &["true", "false"], &["on"]),
    ("group", &["lte"], &[""]),
    ("path", &["all", "best"], &["any"]),
    ("prefer", &["0", "255"], &["256"]),
    ("dedup", &["1", "1000", "1s", "0.5s", "2ms"], &["0", "1001", "2s", "0.4"]),
    ("readonly", &["true", "false"], &["yes"]),
    ("max_rate", &["1", "1000000"], &["0", "1000001", "1.5", ""]),
    ("remap", &["1:7", "1:7,2:8", "255:1"], &["", "1", "1:1", "0:1", "1:7,7:8", "1:256", "1/1:2"]),
    ("version", &["1", "2"], &["0", "3", "v1"]),
    ("version_strict", &["true", "false"], &["1"]),
    ("heartbeats", &["true", "false"], &["0"]),
    ("sign", &["radio", "my radio"], &["", "a=b", "a\u{7}"]),
    ("v1", &["pass", "upgrade", "drop"], &["", "true", "convert"]),
    ("verify", &["radio"], &["", "a=b"]),
    ("allow_unsigned", &["RADIO", "27,ATTITUDE", "none"], &["", "27,", "none,27x"]),
    ("strip", &["true", "false"], &["1"]),
    ("own_component", &["true", "false"], &["1"]),
    ("request_streams", &["1", "50"], &["0", "51", "4.5", ""]),
    ("block_stream_requests", &["true", "false"], &["1"]),
    ("speed", &["0", "0.5", "1000"], &["", "-1", "1001", "fast"]),
    ("loop", &["true", "false"], &["1"]),
    ("count", &["1", "250"], &["0", "251", "-1", ""]),
    ("system", &["1", "255"], &["0", "256", ""]),
    ("vehicle", &["copter", "plane", "rover", "boat"], &["Copter", "quad", ""]),
];
const RATES_REFUSED: &[&str] = &[
    "",
    "ATTITUDE",
    "ATTITUDE:",
    "ATTITUDE:0",
    "ATTITUDE:1001",
    "ATTITUDE:nan",
    "A:1,a:2",
    "16777216:1",
    ":1",
    "A:1,",
    "1A:1",
    "A:B:1",
];

fn plain(kind: AddressKind) -> EndpointConfig {
    let address = match kind {
        Multicast => "239.0.0.1",
        Serial => "auto",
        Tlog => "/tmp/flight.tlog",
        Sim => "",
        _ => "10.0.0.2",
    };
    let address = Address::parse(&format!("{}:{address}", kind.scheme())).unwrap();
    let options = EndpointOptions::default();
    EndpointConfig { address, options }
}

#[test]
fn each_option_takes_what_it_says_and_shows_it_again() {
    for (spec, (name, taken, refused)) in OPTIONS.iter().zip(EDGES) {
        assert_eq!(spec.name, *name);
        for kind in spec.applies_to {
            for text in *taken {
                let (mut once, mut twice) = (plain(*kind), plain(*kind));
                assert_eq!(spec.set(&mut once, text), Ok(()), "{name}={text}");
                if let Some(shown) = spec.show(&once.options) {
                    assert_eq!(spec.set(&mut twice, &shown), Ok(()), "{name}={shown}");
                    assert_eq!(twice, once);
                }
            }
            for text in *refused {
                assert!(spec.set(&mut plain(*kind), text).is_err(), "{name}={text}");
            }
        }
    }
    assert_eq!(EDGES.len(), OPTIONS.len());
}

#[test]
fn each_default_text_is_the_default_value() {
    for spec in OPTIONS {
        let default = EndpointOptions::default();
        assert_eq!(spec.show(&default).as_deref(), spec.default, "{}", spec.name);
        for kind in spec.applies_to {
            let mut written = plain(*kind);
            if let Some(default) = spec.default {
                assert_eq!(spec.set(&mut written, default), Ok(()));
            }
            assert_eq!(written, plain(*kind), "{}", spec.name);
        }
    }
}

#[test]
fn names_are_unique_and_fit_a_file() {
    for (number, spec) in OPTIONS.iter().enumerate() {
        let is_allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        assert!(spec.name.chars().all(is_allowed), "{}", spec.name);
        let others = &OPTIONS[number + 1..];
        assert!(others.iter().all(|other| other.name != spec.name));
    }
}
