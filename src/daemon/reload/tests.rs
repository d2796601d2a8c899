//! However a daemon came to its configuration, it is the same daemon.

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use mio::Events;

use super::*;
use crate::config::{AddressKind, EndpointConfig, OPTIONS, OnChange, OwnOptions};
use crate::daemon::endpoint::{Role, State};
use crate::daemon::plan::is_internal;
use crate::daemon::stage::daemon_of;
use crate::mavlink::Key;
use crate::routing::{Learn, LinkId, LinkOptions, RouterOptions};
use crate::test_chance::Chance;

/// A host that has whatever configuration the test wants.
struct Desk {
    wanted: Mutex<Wanted>,
    levels: Mutex<Vec<LogLevel>>,
    /// How often it was asked.
    loads: AtomicUsize,
}

type Wanted = Result<DaemonConfig, Vec<String>>;

impl Host for Desk {
    fn load(&self) -> Wanted {
        self.loads.fetch_add(1, Ordering::Relaxed);
        self.wanted.lock().unwrap().clone()
    }

    fn set_log_level(&self, level: LogLevel) {
        self.levels.lock().unwrap().push(level);
    }
}

fn desk() -> Arc<Desk> {
    let wanted = Mutex::new(Err(Vec::new()));
    Arc::new(Desk { wanted, levels: Mutex::default(), loads: AtomicUsize::new(0) })
}

fn config(texts: &[String], general: &General) -> DaemonConfig {
    let endpoint = |text: &String| {
        let mut endpoint: EndpointConfig = text.parse().unwrap();
        let options = &mut endpoint.options;
        for named in [&mut options.sign, &mut options.verify].into_iter().flatten() {
            named.key = Some(Key::from_passphrase(&named.name));
        }
        endpoint
    };
    let endpoints = texts.iter().map(endpoint).collect();
    DaemonConfig { general: general.clone(), endpoints, dialect: Dialect::builtin() }
}

/// A daemon that has opened what can be opened.
fn start(config: DaemonConfig, host: Arc<Desk>) -> Daemon {
    let mut daemon = daemon_of(host, config);
    daemon.open_all().unwrap();
    daemon.refresh_own();
    daemon
}

/// What is wanted instead is read, taken over, and answered to.
fn reload(daemon: &mut Daemon, host: &Desk, wanted: Wanted) {
    *host.wanted.lock().unwrap() = wanted;
    daemon.ask_reload();
    settle_down(daemon);
}

/// Lets the daemon work until no reload is under way.
fn settle_down(daemon: &mut Daemon) {
    let give_up = Instant::now() + Duration::from_secs(60);
    let mut events = Events::with_capacity(8);
    while daemon.reloader.is_reading {
        assert!(Instant::now() < give_up, "nobody reads it");
        daemon.turn(&mut events, Some(Duration::from_millis(1))).unwrap();
        daemon.take_over();
    }
}

/// All that the router and the loop know of the endpoints, by their names and not by numbers.
fn described(daemon: &Daemon) -> Vec<String> {
    let table = &daemon.io.endpoints;
    let groups = table.groups();
    let mut lines = Vec::new();
    for index in table.ids() {
        let endpoint = &table[index];
        let membership = endpoint.membership.map(|m| {
            assert_eq!(m.member, index.slot());
            let mates =
                table.iter().filter(|it| it.membership.is_some_and(|it| it.group == m.group));
            let mates: BTreeSet<String> = mates.map(|it| it.config.to_string()).collect();
            (mates, m.rank, m.best_only, groups[usize::from(m.group.0)])
        });
        let links: Vec<String> = daemon
            .links_of(index)
            .into_iter()
            .map(|id| {
                let port = daemon.router.port(id).unwrap();
                assert_eq!(port.options().membership, endpoint.membership);
                let options = LinkOptions { membership: None, ..port.options().clone() };
                format!("{options:?} {:?} {:?}", port.rate(), port.backlog())
            })
            .collect();
        let state = match &endpoint.state {
            // When the refusal comes is chance.
            State::Waiting | State::Connecting(..) => "not open",
            State::Resolving => "resolving",
            State::Opening => "not open",
            State::Listening(..) => "listening",
            State::Datagrams(_) => "datagrams",
            State::Up(_) => "up",
        };
        let lists = (&endpoint.filter_in, &endpoint.filter_out, &endpoint.caps);
        let (name, config) = (endpoint.config.name(), &endpoint.config);
        // With a number behind it if another one was there first.
        assert!(endpoint.name.starts_with(&name), "{} is {name}", endpoint.name);
        lines.push(format!("{name}: {config} {lists:?} {membership:?} {state} {links:?}"));
    }
    lines.push(format!("{:?}", daemon.router.options()));
    lines.sort();
    lines
}

/// Values of every option that an endpoint can have on any machine.
const VALUES: &[(&str, &[&str])] = &[
    ("name", &["a", "b", "c", "d"]),
    ("enabled", &["true", "false"]),
    ("bind", &["127.0.0.1:0", "0.0.0.0:0"]),
    ("dev", &["absent0", "absent1"]),
    ("baudrate", &[]),
    ("flow", &["none", "rtscts"]),
    ("bandwidth", &["1000", "9000", "100000"]),
    ("queue_time", &["50ms", "1s"]),
    ("rate", &["ATTITUDE:4", "ATTITUDE:4,RAW_IMU:1", "27:2"]),
    ("max_peers", &["1", "9"]),
    ("allow_from", &["127.0.0.1", "10.0.0.0/8,fd00::/8"]),
    ("peer_timeout", &["1s", "9s"]),
    ("stall_timeout", &["1s", "9s"]),
    ("retry", &["0", "9s"]),
    ("sticky", &["true", "false"]),
    ("pack", &["true", "false"]),
    ("mtu", &["300", "900"]),
    ("ttl", &["0", "2"]),
    ("allow_messages_in", &["RAW_IMU", "27,ATTITUDE"]),
    ("block_messages_in", &["RAW_IMU", "27,ATTITUDE"]),
    ("allow_systems_in", &["1", "1,2"]),
    ("block_systems_in", &["1", "1,2"]),
    ("allow_components_in", &["1", "1,2"]),
    ("block_components_in", &["1", "1,2"]),
    ("allow_messages_out", &["RAW_IMU", "27,ATTITUDE"]),
    ("block_messages_out", &["RAW_IMU", "27,ATTITUDE"]),
    ("allow_systems_out", &["1", "1,2"]),
    ("block_systems_out", &["1", "1,2"]),
    ("allow_components_out", &["1", "1,2"]),
    ("block_components_out", &["1", "1,2"]),
    ("sniffer", &["true", "false"]),
    ("forward_setup_signing", &["true", "false"]),
    ("record", &["true", "false"]),
    ("group", &["g", "h", "i"]),
    ("path", &["all", "best"]),
    ("prefer", &["3", "7"]),
    ("dedup", &["100", "200"]),
    ("readonly", &["true", "false"]),
    ("max_rate", &["1", "1000"]),
    ("remap", &["1:7", "2:8,3:9"]),
    ("version", &["1", "2"]),
    ("version_strict", &["true", "false"]),
    ("heartbeats", &["true", "false"]),
    ("sign", &["a", "b"]),
    ("v1", &["upgrade", "drop"]),
    ("verify", &["a", "b"]),
    ("allow_unsigned", &["RADIO", "none"]),
    ("strip", &["true", "false"]),
    ("own_component", &["true", "false"]),
    ("request_streams", &["4", "10"]),
    ("block_stream_requests", &["true", "false"]),
    ("speed", &["0.5", "2"]),
    ("loop", &["true", "false"]),
    ("count", &["1", "3"]),
    ("system", &["1", "7"]),
    ("vehicle", &["plane", "boat"]),
];

/// Addresses that open, or do not, in the same way each time.
const ADDRESSES: &[&str] = &[
    "udpin:127.0.0.1:0",
    "udpin:127.0.0.2:0",
    "tcpin:127.0.0.1:0",
    "udpout:127.0.0.1:9",
    "udpout:127.0.0.1:10",
    "udpbcast:127.255.255.255:9",
    "serial:/dev/absent-0:57600",
    "serial:/dev/absent-0:57600,38400",
    "serial:/dev/absent-0:115200",
    "serial:/dev/absent-1:57600,115200",
];

/// Configurations as if by chance.
struct Maker(Chance);

impl Maker {
    fn endpoint(&mut self) -> String {
        let address = self.0.choose(ADDRESSES);
        let kind =
            AddressKind::ALL.iter().find(|kind| address.split(':').next() == Some(kind.scheme()));
        let mut text = format!("{address}?");
        let has_group = self.0.below(3) == 0;
        for (spec, (_, values)) in OPTIONS.iter().zip(VALUES) {
            let is_wanted = match spec.name {
                "name" => self.0.below(2) == 0,
                "group" => has_group,
                _ if spec.needs.is_some() => {
                    let needed = format!("{}=", spec.needs.unwrap());
                    text.contains(&needed) && self.0.below(2) == 0
                }
                _ => self.0.below(12) == 0,
            };
            if is_wanted && !values.is_empty() && spec.is_for(*kind.unwrap()) {
                text += &format!("{}={}&", spec.name, self.0.choose(values));
            }
        }
        text.trim_end_matches(['?', '&']).to_owned()
    }

    /// Some of the endpoints of `before` as they are, some changed, and some that are new.
    fn endpoints(&mut self, before: &[String]) -> Vec<String> {
        let kept = before.iter().filter(|_| self.0.below(3) > 0).cloned().collect::<Vec<_>>();
        let mut all: Vec<String> = kept;
        (0..self.0.below(5)).for_each(|_| all.push(self.endpoint()));
        let swaps = all.len();
        (0..swaps).for_each(|at| all.swap(at, self.0.below(swaps as u64) as usize));
        all
    }

    fn general(&mut self) -> General {
        let router = RouterOptions {
            learn: self.0.choose(&[Learn::All, Learn::Heartbeat]),
            strict: self.0.below(2) == 0,
            route_age: self.0.choose(&[None, Some(Duration::from_secs(5))]),
            sniffer: self.0.choose(&[None, Some(1), Some(200)]),
        };
        let own = OwnOptions {
            system: self.0.choose(&[None, Some(1), Some(7)]),
            component: self.0.choose(&[191, 25]),
        };
        General { router, own, ..General::default() }
    }
}

#[test]
fn a_reload_leads_to_what_a_start_leads_to() {
    let names: Vec<&str> = VALUES.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, OPTIONS.iter().map(|spec| spec.name).collect::<Vec<_>>());
    for seed in 1..=20 {
        let mut chance = Maker(Chance::new(seed));
        let mut texts = chance.endpoints(&[]);
        let host = desk();
        let mut daemon = start(config(&texts, &chance.general()), Arc::clone(&host));
        for step in 0..10 {
            texts = chance.endpoints(&texts);
            let wanted = config(&texts, &chance.general());
            reload(&mut daemon, &host, Ok(wanted.clone()));
            let fresh = start(wanted, desk());
            assert_eq!(
                described(&daemon),
                described(&fresh),
                "seed {seed}, step {step}: {texts:#?}"
            );
        }
    }
}

/// The endpoints that a configuration names.
fn configured(daemon: &Daemon) -> Vec<EndpointId> {
    let ids = daemon.io.endpoints.ids().into_iter();
    ids.filter(|id| !is_internal(&daemon.io.endpoints[*id].config)).collect()
}

/// The link of the only endpoint.
fn only_link(daemon: &Daemon) -> Option<LinkId> {
    daemon.router.links().iter().next()
}

#[test]
fn every_option_that_claims_it_changes_under_the_link() {
    for (spec, (name, values)) in OPTIONS.iter().zip(VALUES) {
        let address = if spec.is_for(AddressKind::UdpOut) {
            "udpout:127.0.0.1:9"
        } else if spec.is_for(AddressKind::UdpBroadcast) {
            "udpbcast:127.255.255.255:9"
        } else {
            continue;
        };
        let more = spec
            .needs
            .map(|needed| format!("&{needed}={}", if needed == "version" { "1" } else { "g" }))
            .unwrap_or_default();
        let with =
            |value: &str| config(&[format!("{address}?{name}={value}{more}")], &General::default());
        let host = desk();
        let mut daemon = start(with(values[0]), Arc::clone(&host));
        let link = only_link(&daemon);
        reload(&mut daemon, &host, Ok(with(values[1])));
        assert_eq!(described(&daemon), described(&start(with(values[1]), desk())), "{name}");
        let generation = configured(&daemon);
        // What is switched off has no link.
        if spec.on_change == OnChange::InPlace && *name != "enabled" {
            assert_eq!((only_link(&daemon), link.is_some()), (link, true), "{name}");
        }
        // And once more the same: nothing happens.
        reload(&mut daemon, &host, Ok(with(values[1])));
        assert_eq!(configured(&daemon), generation);
    }
}

#[test]
fn what_is_wrong_changes_nothing() {
    let host = desk();
    let texts = ["udpout:127.0.0.1:9?name=a".to_owned()];
    let mut daemon = start(config(&texts, &General::default()), Arc::clone(&host));
    let (before, link) = (described(&daemon), only_link(&daemon));
    reload(&mut daemon, &host, Err(vec!["wrong".to_owned()]));
    let unknown = ["udpout:127.0.0.1:9?name=a&rate=NOBODY_KNOWS:1".to_owned()];
    let general = General { log_level: LogLevel::Debug, ..General::default() };
    reload(&mut daemon, &host, Ok(config(&unknown, &general)));
    assert_eq!((described(&daemon), only_link(&daemon)), (before, link));
    assert!(host.levels.lock().unwrap().is_empty());
    reload(&mut daemon, &host, Ok(config(&texts, &general)));
    assert_eq!(*host.levels.lock().unwrap(), [LogLevel::Debug]);
    assert_eq!(only_link(&daemon), link);
}

#[test]
fn what_was_asked_for_one_that_is_gone_is_answered_to_nobody() {
    let host = desk();
    let named = ["udpout:localhost:9?name=a".to_owned()];
    let mut daemon = start(config(&named, &General::default()), Arc::clone(&host));
    let wanted = config(&["udpout:127.0.0.1:10?name=b".to_owned()], &General::default());
    let old = daemon.io.endpoints.ids()[0];
    reload(&mut daemon, &host, Ok(wanted.clone()));
    assert_eq!(daemon.io.endpoints.ids()[0].slot(), old.slot());
    // Both may be answered by now, and the second is of one that was asked later.
    daemon.resolver.ask(old, "127.0.0.1".to_owned(), 9).unwrap();
    let mut events = Events::with_capacity(8);
    daemon.turn(&mut events, None).unwrap();
    daemon.handle_answers();
    assert_eq!(described(&daemon), described(&start(wanted, desk())));
    let State::Datagrams(port) = &daemon.io.endpoints.iter().next().unwrap().state else {
        panic!("it is not open")
    };
    let Role::Sender { remote, .. } = &port.role else { panic!("it sends to one address") };
    assert_eq!(remote.to_string(), "127.0.0.1:10");
}

#[test]
fn all_groups_can_get_new_names_at_once() {
    // Two to a group: while one still has the old name, the number of that is in use.
    let named = |prefix: &str| -> Vec<String> {
        let group = |n: usize| format!("group={prefix}{}&path=best", n % 256);
        let one = |n| format!("udpout:127.0.0.1:9?name=e{n}&dev=absent0&{}", group(n));
        (0..512).map(one).collect()
    };
    let host = desk();
    let mut daemon = start(config(&named("old"), &General::default()), Arc::clone(&host));
    reload(&mut daemon, &host, Ok(config(&named("new"), &General::default())));
    assert_eq!(daemon.io.endpoints.groups(), [Some(true); 256]);
    assert!(daemon.io.endpoints.iter().all(|endpoint| endpoint.membership.is_some()));
}

#[test]
fn it_reads_once_more_if_it_was_asked_meanwhile() {
    let host = desk();
    let texts = ["udpout:127.0.0.1:9?name=a".to_owned(), "udpout:127.0.0.1:10".to_owned()];
    let mut daemon = start(config(&texts[..1], &General::default()), Arc::clone(&host));
    let mut held = host.wanted.lock().unwrap();
    (0..3).for_each(|_| daemon.ask_reload());
    *held = Ok(config(&texts, &General::default()));
    drop(held);
    settle_down(&mut daemon);
    assert_eq!(host.loads.load(Ordering::Relaxed), 2);
    assert_eq!(daemon.io.endpoints.ids().len(), 2);
}

#[test]
fn what_was_read_before_it_was_asked_again_counts_for_nothing() {
    let host = desk();
    let texts = ["udpout:127.0.0.1:9?name=a".to_owned(), "udpout:127.0.0.1:10".to_owned()];
    let mut daemon = start(config(&texts[..1], &General::default()), Arc::clone(&host));
    *host.wanted.lock().unwrap() = Ok(config(&texts, &General::default()));
    daemon.ask_reload();
    let mut events = Events::with_capacity(8);
    while daemon.reloader.answer.is_none() {
        daemon.turn(&mut events, Some(Duration::from_millis(1))).unwrap();
    }
    // In one turn with the answer, another signal comes.
    let held = host.wanted.lock().unwrap();
    daemon.ask_reload();
    // Or the service manager would take the second reload for done with the first.
    assert!(!daemon.take_over());
    drop(held);
    settle_down(&mut daemon);
    assert_eq!(daemon.io.endpoints.ids().len(), 2);
}
