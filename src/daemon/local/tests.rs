//! Links inside the program, in a loop of their own.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use mio::Events;

use super::*;
use crate::config::General;
use crate::daemon::stage::{self, until};
use crate::mavlink::{Component, FrameSpec, MessageId};

/// A peer of which the test holds the other end.
#[derive(Clone, Default, Debug)]
struct Puppet(Rc<RefCell<Strings>>);

#[derive(Default, Debug)]
struct Strings {
    /// What it is to say, at once or when there is room.
    says: VecDeque<Vec<u8>>,
    can_wait: VecDeque<Vec<u8>>,
    /// Said over and over again.
    chorus: Option<Vec<u8>>,
    speaks_at: Option<Time>,
    heard: Vec<Vec<u8>>,
    ended: Option<String>,
}

#[derive(Debug)]
struct Hand(Puppet, Option<String>);

impl LocalPeer for Hand {
    fn handle_frame(&mut self, frame: &Frame<'_>, _now: Time) {
        self.0.0.borrow_mut().heard.push(frame.bytes().to_vec());
    }

    fn poll_transmit(&mut self, now: Time, out: &mut Vec<u8>) -> bool {
        let mut strings = self.0.0.borrow_mut();
        if strings.speaks_at.is_some_and(|at| at > now) {
            return false;
        }
        strings.speaks_at = None;
        self.1 = strings.ended.clone();
        let next = strings.says.pop_front().or_else(|| strings.chorus.clone());
        out.extend(next.iter().flatten());
        next.is_some()
    }

    fn bulk(&self, _now: Time) -> Option<Precedence> {
        (!self.0.0.borrow().can_wait.is_empty()).then_some(Precedence::Routine)
    }

    fn poll_bulk(&mut self, _now: Time, out: &mut Vec<u8>) -> bool {
        let next = self.0.0.borrow_mut().can_wait.pop_front();
        out.extend(next.iter().flatten());
        next.is_some()
    }

    fn poll_timeout(&self) -> Option<Time> {
        self.0.0.borrow().speaks_at
    }

    fn ended(&self) -> Option<&str> {
        self.1.as_deref()
    }
}

impl Puppet {
    fn hand(&self) -> Box<Hand> {
        Box::new(Hand(self.clone(), None))
    }

    fn heard(&self) -> usize {
        self.0.borrow().heard.len()
    }
}

fn daemon() -> Daemon {
    stage::daemon(General::default(), Vec::new())
}

fn add(daemon: &mut Daemon, puppet: &Puppet, bandwidth: Option<u32>) -> (EndpointId, LinkId) {
    let options = EndpointOptions { bandwidth, ..EndpointOptions::default() };
    daemon.add_internal("puppet", options, &[], puppet.hand()).unwrap()
}

fn heartbeat(system: u8, seq: u8) -> Vec<u8> {
    frame(system, seq, 0, 50, &[0, 0, 0, 0, 2, 3, 81, 4, 3])
}

/// COMMAND_LONG to a component.
fn command(system: u8, to: Component) -> Vec<u8> {
    let mut payload = [0; 33];
    payload[30..32].copy_from_slice(&[to.system, to.component]);
    payload[32] = 1;
    frame(system, 0, 76, 152, &payload)
}

fn frame(system: u8, seq: u8, id: u32, crc_extra: u8, payload: &[u8]) -> Vec<u8> {
    let spec = FrameSpec::new(Component::new(system, 1), MessageId(id), crc_extra, payload);
    FrameSpec { seq, ..spec }.to_frame()
}

#[test]
fn what_one_says_the_other_hears_and_all_of_it_is_counted() {
    let mut daemon = daemon();
    let (a, b) = (Puppet::default(), Puppet::default());
    let (_, to_a) = add(&mut daemon, &a, None);
    let (_, to_b) = add(&mut daemon, &b, None);
    a.0.borrow_mut().says.push_back(heartbeat(1, 0));
    until(&mut daemon, "b hears a", |_| b.heard() == 1);
    assert_eq!(b.0.borrow().heard[0], heartbeat(1, 0));
    // Its answer is asked for when it has heard something, and comes to whom it is for.
    let answer = command(2, Component::new(1, 1));
    b.0.borrow_mut().says.push_back(answer.clone());
    a.0.borrow_mut().says.push_back(heartbeat(1, 1));
    a.0.borrow_mut().speaks_at = Some(daemon.clock() + Duration::from_millis(2));
    daemon.receive_local(to_a);
    until(&mut daemon, "a hears the answer", |_| (a.heard(), b.heard()) == (1, 2));
    assert_eq!(a.0.borrow().heard, [answer]);
    let counters = |id| *daemon.router.counters(id).unwrap();
    assert_eq!((counters(to_a).frames_in, counters(to_a).frames_out), (2, 1));
    assert_eq!((counters(to_b).frames_in, counters(to_b).frames_out), (1, 2));
    assert_eq!(counters(to_b).bytes_out, 2 * heartbeat(1, 0).len() as u64);
}

#[test]
fn who_never_ends_keeps_nobody_waiting() {
    let mut daemon = daemon();
    let (endless, other, listener) = (Puppet::default(), Puppet::default(), Puppet::default());
    endless.0.borrow_mut().chorus = Some(heartbeat(1, 0));
    let (_, from) = add(&mut daemon, &endless, None);
    add(&mut daemon, &listener, None);
    let mut events = Events::with_capacity(8);
    daemon.turn(&mut events, Some(Duration::ZERO)).unwrap();
    let said = daemon.router.counters(from).unwrap().bytes_in as usize;
    assert!((TURN..TURN + 2 * BREATH).contains(&said), "{said}");
    add(&mut daemon, &other, None);
    other.0.borrow_mut().says.push_back(heartbeat(2, 0));
    daemon.turn(&mut events, Some(Duration::ZERO)).unwrap();
    assert!(listener.0.borrow().heard.contains(&heartbeat(2, 0)));
    assert_eq!(daemon.timeout(), Some(Duration::ZERO), "it goes on");
}

#[test]
fn what_can_wait_waits_for_the_slowest_link_and_none_of_it_is_lost() {
    let mut daemon = daemon();
    let (talker, slow, fast) = (Puppet::default(), Puppet::default(), Puppet::default());
    let frames = (0..200).map(|seq| heartbeat(1, seq)).collect::<Vec<_>>();
    talker.0.borrow_mut().can_wait = frames.clone().into();
    let (_, to_slow) = add(&mut daemon, &slow, Some(20_000));
    add(&mut daemon, &fast, None);
    add(&mut daemon, &talker, None);
    until(&mut daemon, "everything arrives", |_| slow.heard() == 200 && fast.heard() == 200);
    assert_eq!(slow.0.borrow().heard, frames);
    assert_eq!(fast.0.borrow().heard, frames);
    let refused = crate::routing::DropReason::QueueFull;
    assert_eq!(daemon.router.counters(to_slow).unwrap()[refused], 0);
}

#[test]
fn what_has_come_to_its_end_is_closed_and_stays_so() {
    let mut daemon = daemon();
    let (mortal, listener) = (Puppet::default(), Puppet::default());
    add(&mut daemon, &listener, None);
    mortal.0.borrow_mut().says.push_back(heartbeat(1, 0));
    mortal.0.borrow_mut().ended = Some("the end of the log".to_owned());
    let (index, link) = add(&mut daemon, &mortal, None);
    until(&mut daemon, "its link is closed", |daemon| daemon.io.links.get(link).is_none());
    assert_eq!(listener.heard(), 1);
    assert!(daemon.io.endpoints[index].deadline.is_none(), "it is not tried again");
    let told = daemon.snapshot().endpoints.remove(1);
    assert_eq!(told.state, crate::status::EndpointState::GivenUp);
    assert_eq!(told.reason.as_deref(), Some("the end of the log"));
    assert!(told.is_internal);
    daemon.remove_endpoint(index, "not needed");
    assert!(daemon.io.endpoints.get(index).is_none());
}

#[test]
fn no_reload_touches_what_belongs_to_the_program_itself() {
    let mut daemon = daemon();
    let puppet = Puppet::default();
    let (index, _) = add(&mut daemon, &puppet, None);
    let plan = crate::daemon::plan::plan(&daemon.io.endpoints, Vec::new());
    assert!(plan.gone.is_empty() && plan.kept.is_empty());
    assert_eq!(daemon.io.endpoints[index].name, "internal:puppet");
    assert!("internal:puppet".parse::<EndpointConfig>().is_err());
}
