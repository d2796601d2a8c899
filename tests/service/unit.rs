//! The unit that ships: judged by `systemd-analyze`, and held to what the program needs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use mavswitch::config::CONFIG_DIR;

use crate::harness::{PROGRAM, TempDir};

/// The worst that is allowed, of 10.
const MOST_EXPOSED: f64 = 1.5;

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("packaging/mavswitch.service")
}

/// The values of a setting, in their order.
pub(crate) fn values(name: &str) -> Vec<String> {
    let unit = fs::read_to_string(path()).unwrap();
    let settings = unit.lines().filter_map(|line| line.split_once('='));
    settings.filter(|(key, _)| *key == name).map(|(_, value)| value.to_owned()).collect()
}

/// What `systemd-analyze` says and whether it is content; `None` where it is not installed.
fn analyze(arguments: &[&str]) -> Option<(bool, String)> {
    let mut command = Command::new("systemd-analyze");
    let output = match command.args(arguments).env("SYSTEMD_COLORS", "0").output() {
        Ok(output) => output,
        Err(error) => {
            println!("SKIPPED: systemd-analyze {}: {error}", arguments[0]);
            return None;
        }
    };
    let mut text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.push_str(&String::from_utf8_lossy(&output.stderr));
    Some((output.status.success(), text))
}

#[test]
fn its_exposure_is_at_most_one_and_a_half() {
    let path = path();
    let Some((is_content, text)) =
        analyze(&["security", "--offline=true", "--no-pager", path.to_str().unwrap()])
    else {
        return;
    };
    assert!(is_content, "{text}");
    let (_, figure) = text.split_once("exposure level for mavswitch.service: ").expect(&text);
    let figure: f64 = figure.split_whitespace().next().unwrap().parse().expect(figure);
    assert!(figure <= MOST_EXPOSED, "{text}");
}

#[test]
fn systemd_finds_nothing_wrong_with_it() {
    // The program is not installed where tests run, so the one just built stands in for it.
    let unit = fs::read_to_string(path()).unwrap();
    assert_eq!(unit.matches("ExecStart=/usr/bin/mavswitch\n").count(), 1);
    let unit = unit.replace("/usr/bin/mavswitch\n", &format!("{PROGRAM}\n"));
    let dir = TempDir::new();
    let path = dir.write("mavswitch.service", &unit);
    let arguments = ["verify", "--man=no", path.to_str().unwrap()];
    let Some((is_content, text)) = analyze(&arguments) else { return };
    let own: Vec<_> = text.lines().filter(|line| line.contains("mavswitch")).collect();
    assert!(is_content && own.is_empty(), "{text}");
}

/// Whether the unit's condition lets the service start with these files, and what it says.
fn condition(files: &[(&str, &str)]) -> (bool, String) {
    let dir = TempDir::new();
    fs::create_dir(dir.path("conf.d")).unwrap();
    for (name, text) in files {
        dir.write(name, text);
    }
    let [line] = &values("ExecCondition")[..] else { panic!("one condition") };
    let script = line.strip_prefix("+/bin/sh -c '").unwrap().strip_suffix('\'').unwrap();
    let script = script.replace(CONFIG_DIR, dir.path("").to_str().unwrap().trim_end_matches('/'));
    let output = Command::new("/bin/sh").args(["-c", &script]).output().unwrap();
    // Other statuses are a failure, and not a condition.
    let is_met = match output.status.code() {
        Some(0) => true,
        Some(1..=254) => false,
        other => panic!("{other:?}"),
    };
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    (is_met, String::from_utf8(output.stdout).unwrap())
}

#[test]
fn it_starts_once_an_endpoint_is_configured_and_says_so_until_then() {
    let shipped = include_str!("../../packaging/mavswitch.toml");
    let general = ("mavswitch.toml", "log_level = \"debug\" # no endpoint\n");
    for files in [&[][..], &[("mavswitch.toml", shipped)], &[general]] {
        let (is_met, text) = condition(files);
        assert!(!is_met && text.starts_with("<4>not started: no endpoint"), "{text}");
        assert!(text.lines().count() == 1 && text.contains("mavswitch.toml"), "{text}");
    }
    let edited = shipped.replace("#endpoint.fc", "endpoint.fc");
    let table = "[endpoint.gcs]\naddress = \"udpin:14550\"\n";
    let wrong = "[ endpoint . gcs ]\nadress = 1\n";
    for text in [edited.as_str(), table, wrong] {
        assert_eq!(condition(&[("mavswitch.toml", text)]), (true, String::new()));
        let drop_in = [("mavswitch.toml", shipped), ("conf.d/10.toml", text)];
        assert_eq!(condition(&drop_in), (true, String::new()));
    }
}

#[test]
fn serial_ports_may_be_opened_whenever_they_come() {
    let allowed = values("DeviceAllow");
    for group in ["ttyUSB", "ttyACM", "ttyAMA", "ttyTHS", "ttyS"] {
        assert!(allowed.contains(&format!("char-{group} rw")), "{group}: {allowed:?}");
    }
    // A /dev of its own would not show what is plugged in later.
    assert!(values("PrivateDevices").is_empty());
    assert_eq!(values("SupplementaryGroups"), ["dialout"]);
}

#[test]
fn it_waits_for_nothing_but_the_messages_of_the_program() {
    assert_eq!(values("Type"), ["notify"]);
    assert!(values("Requires").is_empty() && values("BindsTo").is_empty());
    assert!(!values("Wants").concat().contains("network-online"));
    assert_eq!(values("WatchdogSec"), ["10"]);
    assert_eq!(values("Restart"), ["on-failure"]);
}
