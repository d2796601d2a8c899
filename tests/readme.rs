//! The README says what the program does: its options, addresses, flags and bounds are read back
//! and compared with the program's own.

#![allow(clippy::unwrap_used)]

use clap::CommandFactory;
use mavswitch::cli::Cli;
use mavswitch::config::{
    AddressKind, EndpointConfig, GENERAL, MAX_CONFIG_FILE, MAX_ENDPOINTS, MAX_KEY_FILE, OPTIONS,
    OnChange, OptionSpec,
};
use mavswitch::control::MAX_REQUEST;
use mavswitch::daemon::{LISTEN_ROOM, MAX_CONTROL_CLIENTS, MAX_HTTP_CLIENTS};
use mavswitch::link::{BATCH, Backoff};
use mavswitch::mavlink::{MAX_DEFINITIONS, MAX_FRAME, MAX_MESSAGES, Splitter};
use mavswitch::record::{MAX_FLIGHT_VEHICLES, RECORD_BUFFER};
use mavswitch::routing::{
    Capacity, HELD_BACK, LOOP_WINDOW, LinkOptions, MAX_COMPONENTS, MAX_HEARD, MAX_LINKS,
    MAX_TALLIES, QueueLimits, REMEMBERED, RING_WINDOW, RouterOptions,
};
use mavswitch::status::MAX_COMPONENT_SERIES;

const README: &str = include_str!("../README.md");

/// The cells of the rows of the table in the section `title`.
fn table(title: &str) -> Vec<Vec<String>> {
    let section = README.split("\n## ").find(|section| section.starts_with(title)).unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| "));
    // The bar within a cell is escaped; the first row is the head.
    let cells = |row: &str| {
        let row = row.replace("\\|", "\0");
        let cells = row.trim_matches('|').split('|');
        cells.map(|cell| cell.trim().replace('\0', "|")).collect()
    };
    rows.skip(1).map(cells).collect()
}

/// What stands in backticks.
fn spans(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

fn endpoint(text: &str) -> EndpointConfig {
    text.parse().unwrap_or_else(|error| panic!("{error}"))
}

/// Which endpoints take an option, as the README has it.
fn kinds(spec: &OptionSpec) -> String {
    let all = AddressKind::ALL.iter().copied();
    let without: Vec<_> = all.filter(|kind| !spec.is_for(*kind)).collect();
    match without[..] {
        [] => "any".to_owned(),
        [AddressKind::Serial, AddressKind::Tlog, AddressKind::Sim] => {
            "any but serial, tlog and sim".to_owned()
        }
        _ => spec.applies_to.iter().map(|kind| kind.scheme()).collect::<Vec<_>>().join(", "),
    }
}

#[test]
fn the_option_table_is_that_of_the_program() {
    let rows = table("Options of an endpoint");
    assert_eq!(rows.len(), OPTIONS.len());
    for (row, spec) in rows.iter().zip(OPTIONS) {
        assert_eq!(row[0], format!("`{}`", spec.name));
        assert_eq!(row[1], format!("`{}`", spec.value), "{}", spec.name);
        // A default in backticks can be typed; other words explain what holds without one.
        assert_eq!(spans(&row[2]).next(), spec.default, "{}", spec.name);
        assert_eq!(row[3], kinds(spec), "{}", spec.name);
    }
}

#[test]
fn every_spelling_of_the_address_table_is_read_as_the_same_kind() {
    let fill = |text: &str| {
        let text = text.replace("BAUD", "57600").replace("DEVICE", "/dev/ttyS1");
        let text = text.replace("GROUP", "239.1.2.3").replace("ADDR", "10.0.0.255");
        text.replace("HOST", "10.0.0.2").replace("PORT", "14550")
    };
    let rows = table("Addresses");
    assert_eq!(rows.len(), AddressKind::ALL.len());
    for (row, kind) in rows.iter().zip(AddressKind::ALL) {
        for text in spans(&row[0]).chain(spans(&row[2])) {
            assert_eq!(endpoint(&fill(text)).address.kind(), *kind, "{text}");
        }
    }
}

#[test]
fn every_endpoint_of_a_command_can_be_read() {
    let blocks = README.split("```sh\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let words = blocks.flat_map(str::split_whitespace).map(|word| word.trim_matches('\''));
    let is_endpoint = |word: &&str| {
        let scheme = word.split(':').next().unwrap();
        word.starts_with("/dev/") || AddressKind::ALL.iter().any(|kind| kind.scheme() == scheme)
    };
    let endpoints: Vec<EndpointConfig> = words.filter(is_endpoint).map(endpoint).collect();
    assert!(endpoints.len() > 20, "only {} endpoints were found", endpoints.len());
}

#[test]
fn every_flag_exists_and_every_flag_is_told() {
    let foreign =
        ["release", "locked", "path", "no-mavproxy", "master", "now", "bench", "router", "test"];
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let words = README.split("--").skip(1).map(|rest| rest.split(|c| !is_name(c)).next().unwrap());
    let is_flag = |word: &&str| word.starts_with(|c: char| c.is_ascii_lowercase());
    let told: Vec<&str> = words.filter(is_flag).filter(|word| !foreign.contains(word)).collect();
    let mut command = Cli::command();
    command.build();
    let flags: Vec<&str> = command.get_arguments().filter_map(|flag| flag.get_long()).collect();
    for word in &told {
        assert!(has_flag(&command, word), "--{word}");
    }
    // Of these, the short forms are told, or nothing need be.
    let spared = ["verbose", "quiet", "version", "config"];
    for flag in flags.iter().filter(|flag| !spared.contains(flag)) {
        assert!(told.contains(flag), "no word of --{flag}");
    }
}

/// Whether a command, or one below it, has a flag.
fn has_flag(command: &clap::Command, name: &str) -> bool {
    command.get_arguments().any(|flag| flag.get_long() == Some(name))
        || command.get_subcommands().any(|below| has_flag(below, name))
}

/// The numbers in the second cell of the row of the bounds that begins with `what`.
fn bounds(what: &str) -> Vec<usize> {
    let rows = table("What is bounded");
    let row = rows.iter().find(|row| row[0].starts_with(what)).unwrap();
    let digits = row[1].replace(',', "");
    let numbers = digits.split(|c: char| !c.is_ascii_digit()).filter(|text| !text.is_empty());
    numbers.map(|text| text.parse().unwrap()).collect()
}

#[test]
fn the_bounds_are_those_of_the_program() {
    let seconds = |time: std::time::Duration| time.as_secs() as usize;
    let Capacity::Bytes(queue) = LinkOptions::default().capacity else { panic!("it is paced") };
    let (least, shares) = (QueueLimits::with_total(0).total, QueueLimits::with_total(100_000));
    let age = RouterOptions::default().route_age.unwrap();
    let mut backoff = Backoff::new();
    let delays: Vec<_> = (0..9).map(|_| backoff.next_delay().as_millis() as usize).collect();

    assert_eq!(bounds("links in all"), [MAX_LINKS]);
    assert_eq!(bounds("endpoints"), [MAX_ENDPOINTS]);
    assert_eq!(bounds("components known"), [MAX_COMPONENTS]);
    assert_eq!(bounds("queue of a link without pace"), [queue]);
    assert_eq!(bounds("queue of a paced link")[1], least);
    assert_eq!(bounds("share of broadcast")[0] * 1_000, shares.routine);
    assert_eq!(bounds("share of directed frames")[0] * 1_000, shares.immediate);
    assert_eq!(bounds("silence of a route"), [seconds(age)]);
    assert_eq!(bounds("loop window"), [seconds(LOOP_WINDOW)]);
    assert_eq!(bounds("frames remembered"), [REMEMBERED, seconds(RING_WINDOW), seconds(HELD_BACK)]);
    assert_eq!(bounds("requests by HTTP")[0], MAX_HTTP_CLIENTS);
    assert_eq!(bounds("components with series"), [MAX_COMPONENT_SERIES]);
    assert_eq!(bounds("requests by the control socket"), [MAX_CONTROL_CLIENTS, MAX_REQUEST]);
    assert_eq!(bounds("frames that wait for a `mavswitch listen`"), [LISTEN_ROOM]);
    assert_eq!(bounds("what waits to be recorded"), [RECORD_BUFFER]);
    assert_eq!(bounds("vehicles whose flight-stack logs"), [MAX_FLIGHT_VEHICLES]);
    assert_eq!(bounds("pairs of a component and a link"), [MAX_HEARD]);
    assert_eq!(bounds("pairs of a component and a message"), [MAX_TALLIES]);
    assert_eq!(bounds("a configuration file"), [MAX_CONFIG_FILE as usize]);
    assert_eq!(bounds("a key file"), [MAX_KEY_FILE as usize]);
    assert_eq!(bounds("length of a frame"), [MAX_FRAME]);
    assert_eq!(bounds("unfinished frame"), [Splitter::CARRY]);
    assert_eq!(bounds("reading from one link")[2], BATCH);
    assert_eq!(bounds("messages in a")[0], MAX_MESSAGES);
    assert_eq!(bounds("message definitions"), [MAX_DEFINITIONS]);
    let told = README.contains(&format!("after {} ms, doubling up to 2,000 ms", delays[0]));
    assert!(told && delays[8] == 2_000, "{delays:?}");
}

#[test]
fn what_needs_an_endpoint_opened_again_is_told() {
    let names = |specs: Vec<&str>| -> String {
        let (last, others) = specs.split_last().unwrap();
        format!("`{}` and `{last}`", others.join("`, `"))
    };
    let reopen = OPTIONS.iter().filter(|spec| spec.on_change == OnChange::Reopen);
    let reopen = names(reopen.map(|spec| spec.name).collect());
    assert!(README.contains(&format!("{reopen} need it closed")), "{reopen}");
    let fixed = GENERAL.iter().filter(|spec| !spec.is_reloaded).map(|spec| spec.name);
    assert_eq!(fixed.collect::<Vec<_>>(), ["log_format", "control"]);
    assert!(README.contains("All general keys take effect, but for `log_format` and `control`"));
}

#[test]
fn a_bound_that_is_an_option_has_its_default() {
    for row in table("What is bounded") {
        let named = row[1].split_once("(`").and_then(|(_, rest)| rest.split('`').next());
        let spec = named.and_then(|name| OPTIONS.iter().find(|spec| spec.name == name));
        let Some(default) = spec.and_then(|spec| spec.default) else { continue };
        let limit = row[1].replace([',', ' '], "");
        assert!(limit.contains(default), "{}: no {default} in {limit}", row[0]);
    }
}
