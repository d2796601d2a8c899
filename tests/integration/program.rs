//! The command line: what it says, in which words, and with which exit status.

use std::net::{TcpListener, UdpSocket};
use std::process::Output;

use mavswitch::mavlink::Crc;

use crate::harness::*;

const TCP: &str = "tcpin:127.0.0.1:0?name=tcp";
const UDP: &str = "udpin:127.0.0.1:0?name=udp";

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The program could not start: status 1, and one line that says why.
#[track_caller]
pub(crate) fn assert_refused(output: &Output, words: &[&str]) {
    assert_ended(output, 1, words);
}

#[track_caller]
fn assert_ended(output: &Output, status: i32, words: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(status), "{text}");
    let lines: Vec<_> = text.lines().filter(|line| line.starts_with("mavswitch: ")).collect();
    assert_eq!(lines.len(), 1, "{text}");
    for word in words {
        assert!(lines[0].contains(word), "no {word:?} in {text}");
    }
    assert!(!text.contains("panicked"), "{text}");
}

#[test]
fn without_endpoints_it_says_what_to_type() {
    let output = run(&[]);
    assert_eq!(output.status.code(), Some(2));
    let text = stderr(&output);
    assert!(text.contains("mavswitch ") && text.contains("udpin:"), "{text}");
}

#[test]
fn help_and_version_are_for_standard_output() {
    let help = run(&["--help"]);
    assert_eq!(help.status.code(), Some(0));
    let text = stdout(&help);
    let words =
        ["--learn", "--strict", "--route-age", "--dialect", "--log-format", "udpin:", "serial:"];
    for word in words {
        assert!(text.contains(word), "no {word} in {text}");
    }
    let version = run(&["--version"]);
    assert_eq!(version.status.code(), Some(0));
    assert!(stdout(&version).contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn completions_are_for_standard_output() {
    for (shell, word) in
        [("bash", "complete -F"), ("zsh", "#compdef mavswitch"), ("fish", "-c mavswitch")]
    {
        let output = run(&["completions", shell]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let text = stdout(&output);
        for word in [word, "log-format", "journal", "ports"] {
            assert!(text.contains(word), "{shell}: no {word} in {text}");
        }
    }
    assert_eq!(run(&["completions", "cmd"]).status.code(), Some(2));
}

#[test]
fn an_unknown_option_is_told() {
    let output = run(&["--strickt", TCP]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--strict"), "{}", stderr(&output));
}

#[test]
fn a_misspelt_endpoint_is_told_with_what_was_meant() {
    let cases = [
        ("udpinn:127.0.0.1:0", "udpin"),
        ("udpin:127.0.0.1:0?nmae=x", "name"),
        ("udpin:127.0.0.1:99999", "99999"),
        ("udpin:127.0.0.1:http", "http"),
        ("udpout:127.0.0.1:14550?bind=nonsense", "nonsense"),
        ("serial:/dev/ttyACM0:fast", "fast"),
        ("mcast:127.0.0.1:14550", "127.0.0.1"),
        ("", "udpin"),
    ];
    for (endpoint, word) in cases {
        let output = run(&[TCP, endpoint]);
        let text = stderr(&output);
        let code = output.status.code();
        assert!(matches!(code, Some(1 | 2)), "{endpoint}: {code:?} {text}");
        assert!(text.contains(word), "{endpoint}: no {word:?} in {text}");
        assert!(!text.contains("listening on") && !text.contains("panicked"), "{text}");
    }
}

#[test]
fn an_address_in_use_is_told_and_nothing_is_half_started() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let output = run(&[UDP, &format!("tcpin:{address}")]);
    assert_refused(&output, &[&address, "in use"]);
    assert!(!stderr(&output).contains(" ready"));
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap().to_string();
    assert_refused(&run(&[TCP, &format!("udpin:{address}")]), &[&address, "in use"]);
    // The port to look for is the one that was to be had, not the other side's.
    let output = run(&[TCP, &format!("udpout:127.0.0.1:9?bind={address}")]);
    let port = socket.local_addr().unwrap().port();
    assert_refused(&output, &[&address, "in use", &format!("sport = :{port}`")]);
}

#[test]
fn an_address_that_is_not_ours_yet_is_awaited_and_others_work_meanwhile() {
    // An address for documentation: no machine has it, as none has its own before the network.
    let router = Router::start(&["tcpin:192.0.2.1:0?name=outside", TCP, UDP]);
    router.log.wait_for(&["outside: ", "192.0.2.1", "waiting"]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn a_dialect_that_cannot_be_read_is_told() {
    let dir = TempDir::new();
    let absent = dir.path("absent.xml");
    let absent = absent.to_str().unwrap();
    assert_ended(&run(&["--dialect", absent, TCP]), 2, &[absent]);
    let broken = dir.write("broken.xml", "<mavlink><messages><message id=\"1\"");
    let broken = broken.to_str().unwrap();
    assert_ended(&run(&["--dialect", broken, TCP]), 2, &[broken]);
}

#[test]
fn the_log_says_who_came_and_who_went() {
    let router = Router::start(&[TCP, UDP]);
    let vehicle = router.tcp("tcp", VEHICLE);
    let up = router.log.wait_for(&["tcp: link #", " up: 127.0.0.1:"]);
    let number = up.split_once('#').unwrap().1.split(' ').next().unwrap();
    router.log.wait_for(&[&format!("component 1/1 seen on tcp (#{number})")]);
    drop(vehicle);
    router.log.wait_for(&[&format!("tcp: link #{number} down: ")]);
    router.log.wait_for(&["component 1/1 lost"]);
    assert!(!router.log.text().contains('\x1b'), "colour, and no terminal");
}

#[test]
fn when_nobody_reads_the_log_any_more_it_goes_on() {
    let router = Router::start(&[TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.log.hang_up();
    for system in 10..15 {
        // Each guest makes lines: one hangs up, the others meet the closed end.
        let mut guest = router.tcp_unnoticed("tcp", Component::new(system, 1));
        router.assert_serves(&mut gcs, &mut guest);
    }
    router.assert_serves(&mut gcs, &mut vehicle);
}

#[test]
fn when_the_log_is_not_read_for_a_while_it_goes_on() {
    let endpoint = |n: u32| format!("tcpin:127.0.0.1:0?name=many{n}");
    let endpoints: Vec<String> = (0..12).map(endpoint).collect();
    let mut arguments: Vec<&str> = endpoints.iter().map(String::as_str).collect();
    arguments.extend([TCP, UDP]);
    let router = Router::launch_with_narrow_log(&arguments);
    router.log.wait_for(&["ready"]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    let addresses: Vec<_> = (0..12).map(|n| router.address(&format!("many{n}"))).collect();
    router.log.pause();
    // Each endpoint writes some lines about its guests: together more than the pipe takes.
    for _ in 0..20 {
        for address in &addresses {
            drop(TcpWire::to(*address));
        }
        router.assert_serves(&mut gcs, &mut vehicle);
    }
}

#[test]
fn with_log_format_text_it_is_the_same() {
    let router = Router::start(&["--log-format", "text", TCP]);
    let _vehicle = router.tcp("tcp", VEHICLE);
}

#[test]
fn with_log_format_json_each_line_is_an_object() {
    let router = Router::start(&["--log-format", "json", "-v", TCP, UDP]);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut gcs = router.udp("udp", GCS);
    router.assert_serves(&mut gcs, &mut vehicle);
    drop(vehicle);
    router.wait_until_lost(VEHICLE);
    router.signal(rustix::process::Signal::TERM);
    let (_, text) = router.wait_for_end();
    assert!(text.lines().count() > 5, "{text}");
    for line in text.lines() {
        let value: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(value.is_object(), "{line}");
    }
}

#[test]
fn with_q_what_is_as_it_should_be_is_not_told() {
    let mut server = TcpServer::down();
    server.up();
    let router = Router::launch(&["-q", &format!("tcpout:{}", server.address())]);
    let mut vehicle = server.accept(VEHICLE);
    vehicle.send(heartbeat(VEHICLE));
    router.signal(rustix::process::Signal::TERM);
    let (status, text) = router.wait_for_end();
    assert_eq!(status.code(), Some(0));
    assert_eq!(text, "");
}

/// A message of one's own: who it is for stands at 4 and 5, behind the number.
const OWN_DIALECT: &str = r#"<?xml version="1.0"?>
<mavlink>
  <messages>
    <message id="54321" name="WINCH_ORDER">
      <description>Let out or pull in.</description>
      <field type="uint8_t" name="target_system">System ID</field>
      <field type="uint8_t" name="target_component">Component ID</field>
      <field type="uint32_t" name="length">How far.</field>
    </message>
  </messages>
</mavlink>
"#;

/// Rule 16: the name, and the base fields in wire order, the largest first.
fn own_crc_extra() -> u8 {
    let text = b"WINCH_ORDER uint32_t length uint8_t target_system uint8_t target_component ";
    let [low, high] = Crc::of(text).to_le_bytes();
    low ^ high
}

#[test]
fn with_dialect_messages_of_ones_own_go_to_their_target() {
    let dir = TempDir::new();
    let file = dir.write("own.xml", OWN_DIALECT);
    let router = Router::start(&["--dialect", file.to_str().unwrap(), TCP, UDP]);
    let mut gcs = router.udp("udp", GCS);
    let mut vehicle = router.tcp("tcp", VEHICLE);
    let mut other = router.tcp("tcp", OTHER);
    let message = Message { id: 54321, extra: own_crc_extra(), len: 6 };
    let order = Draft::new(GCS, message, [1, 2, 3, 4, VEHICLE.system, VEHICLE.component]).build();
    gcs.send(&order);
    vehicle.expect(&order);
    other.expect_nothing_from(&mut gcs);
    gcs.send(corrupted(&order));
    vehicle.expect_nothing_from(&mut gcs);
}

#[test]
fn the_included_dialects_count_too() {
    let dir = TempDir::new();
    dir.write("own.xml", OWN_DIALECT);
    let outer = "<mavlink><include>own.xml</include><messages></messages></mavlink>";
    let file = dir.write("outer.xml", outer);
    let output = run(&["dialect", file.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let row = format!("54321\t{}\tWINCH_ORDER\t6\t6\t4\t5\t", own_crc_extra());
    let text = stdout(&output);
    assert!(text.lines().any(|line| line.starts_with(&row)), "no {row:?} in {text}");
}
