//! The protocol as a service manager meets it, with time as an argument.

use super::*;

const START: Time = Time::ZERO;

/// Names and values.
type Variables<'a> = &'a [(&'a str, &'a str)];

/// A service manager, at an abstract address of its own.
struct Manager {
    socket: UnixDatagram,
    name: String,
}

impl Manager {
    fn new(test: &str) -> Self {
        let name = format!("mavswitch-notify-{}-{test}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).unwrap();
        let socket = UnixDatagram::bind_addr(&address).unwrap();
        socket.set_nonblocking(true).unwrap();
        Self { socket, name }
    }

    fn notifier(&self, more: Variables<'_>) -> Notifier {
        let path = format!("@{}", self.name);
        let mut variables = vec![("NOTIFY_SOCKET", path.as_str())];
        variables.extend(more);
        notifier(&variables)
    }

    /// The next message, if one has come.
    fn hear(&self) -> Option<String> {
        let mut bytes = [0; 4096];
        let count = self.socket.recv(&mut bytes).ok()?;
        Some(String::from_utf8_lossy(&bytes[..count]).into_owned())
    }
}

fn notifier(variables: Variables<'_>) -> Notifier {
    let find = |name: &str| variables.iter().find(|(other, _)| *other == name);
    Notifier::from_variables(|name| find(name).map(|(_, value)| value.into()))
}

fn at(millis: u64) -> Time {
    Time::from_millis(millis)
}

#[test]
fn without_a_socket_nothing_is_opened_and_nothing_wakes_the_loop() {
    for variables in [&[][..], &[("WATCHDOG_USEC", "1000")], &[("NOTIFY_SOCKET", "vsock:2:1")]] {
        let mut notifier = notifier(variables);
        notifier.handle_ready("all is well".to_owned(), START);
        assert!(notifier.target.is_none());
        assert_eq!(notifier.deadline, None);
        assert!(!notifier.wants_status(at(60_000)));
    }
}

#[test]
fn without_a_watchdog_nothing_wakes_the_loop() {
    let manager = Manager::new("idle");
    let mut notifier = manager.notifier(&[]);
    notifier.handle_ready("1 link".to_owned(), START);
    assert_eq!(manager.hear().as_deref(), Some("READY=1\nSTATUS=1 link"));
    assert_eq!(notifier.deadline, None);
    notifier.handle_stopping();
    assert_eq!(manager.hear().as_deref(), Some("STOPPING=1"));
}

#[test]
fn the_watchdog_is_fed_at_half_its_period() {
    let manager = Manager::new("watchdog");
    let mut notifier = manager.notifier(&[("WATCHDOG_USEC", "3000000")]);
    assert_eq!(notifier.deadline, None);
    notifier.handle_ready(String::new(), START);
    manager.hear().unwrap();
    for turn in 1..4 {
        assert_eq!(notifier.deadline, Some(at(turn * 1_500)));
        notifier.handle_timeout(at(turn * 1_500));
        assert_eq!(manager.hear().as_deref(), Some("WATCHDOG=1"));
    }
}

#[test]
fn a_watchdog_for_somebody_else_or_without_a_time_is_none() {
    let own = std::process::id().to_string();
    let cases: [(Variables<'_>, Option<u64>); 7] = [
        (&[], None),
        (&[("WATCHDOG_USEC", "0")], None),
        (&[("WATCHDOG_USEC", "soon")], None),
        (&[("WATCHDOG_USEC", "20000"), ("WATCHDOG_PID", "1")], None),
        (&[("WATCHDOG_USEC", "20000"), ("WATCHDOG_PID", "")], None),
        (&[("WATCHDOG_USEC", "20000"), ("WATCHDOG_PID", &own)], Some(10)),
        (&[("WATCHDOG_USEC", "1")], Some(1)),
    ];
    for (variables, millis) in cases {
        let find = |name: &str| variables.iter().find(|(other, _)| *other == name);
        let period = watchdog_period(|name| find(name).map(|(_, value)| value.into()));
        assert_eq!(period, millis.map(Duration::from_millis), "{variables:?}");
    }
}

#[test]
fn a_status_is_told_when_it_has_changed_and_looked_for_once_a_second() {
    let manager = Manager::new("status");
    let mut notifier = manager.notifier(&[]);
    assert!(!notifier.wants_status(START), "not before it is ready");
    notifier.handle_ready("1 link".to_owned(), START);
    manager.hear().unwrap();
    assert!(!notifier.wants_status(at(999)));
    assert!(notifier.wants_status(at(1_000)));
    assert!(!notifier.wants_status(at(1_999)));
    notifier.handle_status("1 link".to_owned());
    assert_eq!(manager.hear(), None);
    notifier.handle_status("2 links".to_owned());
    assert_eq!(manager.hear().as_deref(), Some("STATUS=2 links"));
}

#[test]
fn what_a_busy_manager_must_know_is_said_again() {
    let manager = Manager::new("busy");
    let mut notifier = manager.notifier(&[("WATCHDOG_USEC", "600000")]);
    let mut filled = 0;
    while notifier.send("STATUS=filling") == Outcome::Done {
        filled += 1;
    }
    notifier.handle_ready("1 link".to_owned(), START);
    notifier.handle_status("2 links".to_owned());
    assert_eq!(notifier.deadline, Some(at(100)));
    (0..filled).for_each(|_| assert_eq!(manager.hear().as_deref(), Some("STATUS=filling")));
    notifier.handle_timeout(at(100));
    assert_eq!(manager.hear().as_deref(), Some("READY=1\nSTATUS=1 link"));
    assert_eq!(manager.hear(), None);
    assert_eq!(notifier.deadline, Some(at(400)));
    notifier.handle_status("2 links".to_owned());
    assert_eq!(manager.hear().as_deref(), Some("STATUS=2 links"));
}

#[test]
fn a_manager_that_is_gone_does_no_harm() {
    let manager = Manager::new("gone");
    let mut notifier = manager.notifier(&[("WATCHDOG_USEC", "600000")]);
    drop(manager);
    notifier.handle_ready("1 link".to_owned(), START);
    assert!(notifier.owed.is_empty());
    assert_eq!(notifier.deadline, Some(at(300)));
    notifier.handle_timeout(at(300));
    notifier.handle_stopping();
}

/// What a message of a reload says of its time.
fn reloading_at(message: &str) -> i64 {
    let micros = message.strip_prefix("RELOADING=1\nMONOTONIC_USEC=");
    micros.and_then(|micros| micros.parse().ok()).expect(message)
}

fn monotonic_micros() -> i64 {
    let clock = clock_gettime(ClockId::Monotonic);
    clock.tv_sec * 1_000_000 + clock.tv_nsec / 1_000
}

#[test]
fn a_reload_says_when_it_begins_and_that_it_is_over() {
    let manager = Manager::new("reload");
    let mut notifier = manager.notifier(&[]);
    notifier.handle_ready("1 link".to_owned(), START);
    manager.hear().unwrap();
    let before = monotonic_micros();
    notifier.handle_reloading(at(5_000));
    let told = reloading_at(&manager.hear().unwrap());
    assert!((before..=monotonic_micros()).contains(&told), "{told}");
    notifier.handle_ready("2 links".to_owned(), at(5_000));
    assert_eq!(manager.hear().as_deref(), Some("READY=1\nSTATUS=2 links"));
    assert_eq!(manager.hear(), None);
}

#[test]
fn a_reload_does_not_put_off_the_watchdog_nor_set_a_second_timer() {
    let manager = Manager::new("reload-watchdog");
    let mut notifier = manager.notifier(&[("WATCHDOG_USEC", "600000")]);
    notifier.handle_ready(String::new(), START);
    assert_eq!(notifier.take_timeout(), Some(at(300)));
    notifier.handle_reloading(at(200));
    notifier.handle_ready(String::new(), at(250));
    assert_eq!(notifier.take_timeout(), None);
    (0..3).for_each(|_| drop(manager.hear().unwrap()));
    notifier.handle_timeout(at(299));
    assert_eq!(manager.hear(), None);
    notifier.handle_timeout(at(300));
    assert_eq!(manager.hear().as_deref(), Some("WATCHDOG=1"));
    assert_eq!(notifier.take_timeout(), Some(at(600)));
}

#[test]
fn a_busy_manager_hears_of_the_last_reload_in_order() {
    let manager = Manager::new("reload-busy");
    let mut notifier = manager.notifier(&[]);
    notifier.handle_ready(String::new(), START);
    manager.hear().unwrap();
    let mut filled = 0;
    while notifier.send("STATUS=filling") == Outcome::Done {
        filled += 1;
    }
    for round in 1..=3 {
        notifier.handle_reloading(at(round));
        notifier.handle_ready(format!("round {round}"), at(round));
    }
    (0..filled).for_each(|_| drop(manager.hear().unwrap()));
    let again = notifier.take_timeout().unwrap();
    notifier.handle_timeout(again);
    reloading_at(&manager.hear().unwrap());
    assert_eq!(manager.hear().as_deref(), Some("READY=1\nSTATUS=round 3"));
    assert_eq!(manager.hear(), None);
    assert_eq!(notifier.take_timeout(), None, "there is nothing to send");
}
