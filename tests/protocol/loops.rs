//! Several routers joined in loops, without groups: no storm, and they heal when a link is cut.

use crate::frames::{Random, Receiver, frame};
use crate::network::{STATION, VEHICLE, command, heartbeat};
use mavswitch::mavlink::{Component, Input, Version};
use mavswitch::routing::{LinkId, LinkOptions, Router, RouterOptions, Time};
use std::collections::VecDeque;
use std::time::Duration;

/// One end of a cable: a router and its link.
type End = (usize, LinkId);

/// Routers, the cables between them, and frames on their way.
struct Mesh {
    routers: Vec<Router>,
    cables: Vec<(End, End)>,
    on_the_way: VecDeque<(End, Vec<u8>)>,
    /// How many frames have gone over cables, in all.
    carried: usize,
    /// The cable that loses the next frame.
    loses: Option<usize>,
    /// Cables that hold back what they should carry, and what that is.
    holds: Vec<usize>,
    held_back: Vec<(End, Vec<u8>)>,
    /// The link that closes once it has brought something.
    leaves: Option<End>,
    /// By chance every fourth frame is lost, if there is any.
    loss: Option<Random>,
    now: Time,
}

impl Mesh {
    fn new(routers: usize, cables: &[(usize, usize)]) -> Self {
        let routers = (0..routers).map(|_| Router::new(RouterOptions::default())).collect();
        let now = Time::from_millis(1_000_000);
        let mut mesh = Self {
            routers,
            cables: Vec::new(),
            on_the_way: VecDeque::new(),
            carried: 0,
            loses: None,
            holds: Vec::new(),
            held_back: Vec::new(),
            leaves: None,
            loss: None,
            now,
        };
        for (a, b) in cables {
            let ends = (mesh.link(*a), mesh.link(*b));
            mesh.cables.push(ends);
        }
        mesh
    }

    fn link(&mut self, router: usize) -> End {
        let link = self.routers[router].add_link(LinkOptions::default(), self.now);
        (router, link.unwrap())
    }

    fn cut(&mut self, cable: usize) {
        let (a, b) = self.cables.remove(cable);
        self.routers[a.0].remove_link(a.1);
        self.routers[b.0].remove_link(b.1);
    }

    /// `bytes` come in at one end of the mesh; what comes out at `exit`, when all is quiet?
    fn send(&mut self, at: End, bytes: &[u8], exit: End) -> usize {
        self.on_the_way.push_back((at, bytes.to_vec()));
        self.run(exit)
    }

    /// What was held back arrives, and may be held back again; what comes out at `exit`?
    fn release(&mut self, exit: End) -> usize {
        self.on_the_way.extend(std::mem::take(&mut self.held_back));
        self.run(exit)
    }

    /// Until nothing is held back any more; each time it takes so many milliseconds.
    fn rest(&mut self, millis: u64, exit: End) {
        for _ in 0..8 {
            self.now = self.now + Duration::from_millis(millis);
            self.release(exit);
        }
        let left = self.held_back.len();
        assert_eq!(left, 0, "frames still go round over {:?}", self.holds);
    }

    fn run(&mut self, exit: End) -> usize {
        let mut came_out = 0;
        while let Some(((router, link), bytes)) = self.on_the_way.pop_front() {
            let (core, now) = (&mut self.routers[router], self.now);
            Receiver::new().each(&bytes, Input::Paused, |frame| {
                core.handle(link, frame, now);
            });
            if self.leaves == Some((router, link)) {
                self.routers[router].remove_link(link);
            }
            for link in self.routers[router].take_dirty().iter() {
                let port = self.routers[router].port_mut(link).unwrap();
                let (first, second) = port.head(usize::MAX);
                let bytes = [first, second].concat();
                port.consume(bytes.len());
                came_out += usize::from((router, link) == exit);
                self.carry((router, link), bytes);
            }
            assert!(self.carried < 100_000, "a storm");
        }
        came_out
    }

    fn carry(&mut self, from: End, bytes: Vec<u8>) {
        for (number, (a, b)) in self.cables.iter().enumerate() {
            let to = if *a == from { b } else { a };
            if *a == from || *b == from {
                self.carried += 1;
                if self.loses == Some(number) {
                    self.loses = None;
                    return;
                }
                if self.loss.as_mut().is_some_and(|random| random.below(4) == 0) {
                    return;
                }
                match self.holds.contains(&number) {
                    true => self.held_back.push((*to, bytes)),
                    false => self.on_the_way.push_back((*to, bytes)),
                }
                return;
            }
        }
    }

    /// The vehicle sends ten frames a second; how many of them come out, at least once?
    fn fly(&mut self, seconds: u64, vehicle: End, station: End) -> usize {
        let mut arrived = 0;
        for number in 0..seconds * 10 {
            self.now = self.now + Duration::from_millis(100);
            let bytes = frame(Version::V2, number as u8, VEHICLE, (30, 39), &[number as u8; 28]);
            arrived += usize::from(self.send(vehicle, &bytes, station) > 0);
        }
        arrived
    }
}

fn check(mut mesh: Mesh, vehicle: End, station: End) {
    let cables = mesh.cables.len();
    assert_eq!(mesh.fly(30, vehicle, station), 300, "all arrive");
    let most = 300 * 2 * cables;
    assert!(mesh.carried <= most, "{} frames over {cables} cables for 300", mesh.carried);
    mesh.send(station, &heartbeat(STATION), vehicle);
    assert!(mesh.send(station, &command(STATION, VEHICLE), vehicle) > 0, "and back");
    mesh.cut(0);
    let arrived = mesh.fly(30, vehicle, station);
    assert!(arrived >= 250, "{arrived} of 300 arrive after the cut: healed within 5 s");
}

#[test]
fn two_routers_joined_by_two_links_make_no_storm_and_heal() {
    let mut mesh = Mesh::new(2, &[(0, 1), (0, 1)]);
    let (vehicle, station) = (mesh.link(0), mesh.link(1));
    check(mesh, vehicle, station);
}

#[test]
fn three_routers_in_a_ring_make_no_storm_and_heal() {
    let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
    let (vehicle, station) = (mesh.link(0), mesh.link(1));
    check(mesh, vehicle, station);
}

#[test]
fn frames_that_teach_nothing_make_no_storm_either() {
    let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
    let (vehicle, station) = (mesh.link(0), mesh.link(1));
    for seq in 0..100 {
        let nobody = frame(Version::V2, seq, Component::new(0, 0), (0, 50), &[1; 9]);
        assert!(mesh.send(vehicle, &nobody, station) > 0);
        let unknown = frame(Version::V2, seq, VEHICLE, (54_321 + u32::from(seq), 7), &[seq; 9]);
        assert!(mesh.send(vehicle, &unknown, station) > 0);
    }
    assert!(mesh.carried <= 200 * 3 * 2, "{} frames over 3 cables for 200", mesh.carried);
}

/// One lost frame, and the next one goes round and round: each router hears its source always on
/// the one side, and never on the other, where it goes on.
#[test]
fn a_lost_frame_starts_no_storm() {
    for lossy in 0..2 {
        let mut mesh = Mesh::new(2, &[(0, 1), (0, 1)]);
        let (vehicle, station) = (mesh.link(0), mesh.link(1));
        mesh.loses = Some(lossy);
        assert!(mesh.send(vehicle, &heartbeat(VEHICLE), station) > 0);
    }
    for lossy in [0, 2] {
        let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
        let (vehicle, station) = (mesh.link(0), mesh.link(1));
        mesh.loses = Some(lossy);
        assert!(mesh.send(vehicle, &heartbeat(VEHICLE), station) > 0);
    }
}

#[test]
fn five_routers_each_joined_to_each_make_no_storm() {
    let pairs: Vec<(usize, usize)> = (0..5).flat_map(|a| (a + 1..5).map(move |b| (a, b))).collect();
    let mut mesh = Mesh::new(5, &pairs);
    let (vehicle, station) = (mesh.link(0), mesh.link(4));
    assert_eq!(mesh.fly(30, vehicle, station), 300);
    assert!(mesh.carried <= 300 * pairs.len() * 2, "{} frames carried", mesh.carried);
    let other = frame(Version::V2, 0, Component::new(9, 9), (0, 50), &[1; 9]);
    assert!(mesh.send(station, &other, vehicle) > 0);
}

/// Between two and five routers joined in any way, twice or three times here and there.
fn any_mesh(random: &mut Random) -> (usize, Vec<(usize, usize)>) {
    let routers = 2 + random.below(4);
    let mut cables: Vec<_> = (1..routers).map(|router| (random.below(router), router)).collect();
    for _ in 0..random.below(5) {
        let (a, b) = (random.below(routers), random.below(routers));
        cables.extend((a != b).then_some((a, b)));
    }
    (routers, cables)
}

/// Each router passes each frame on once, whatever was lost before.
#[test]
fn any_mesh_makes_no_storm_whatever_is_lost() {
    for seed in 0..300 {
        let mut random = Random::new(seed);
        let (routers, cables) = any_mesh(&mut random);
        println!("seed {seed}: {routers} routers, {cables:?}");
        let mut mesh = Mesh::new(routers, &cables);
        let (vehicle, station) = (mesh.link(0), mesh.link(routers - 1));
        mesh.loss = Some(random);
        mesh.fly(10, vehicle, station);
        mesh.loss = None;
        let before = mesh.carried;
        let arrived = mesh.fly(10, vehicle, station);
        let carried = mesh.carried - before;
        let most = 100 * 2 * cables.len();
        assert!(carried <= most, "{carried} frames carried for 100: more than once each way");
        assert!(arrived >= 40, "{arrived} of 100 arrive");
    }
}

/// Three cables, and every fourth frame is lost: what came over the first came again over the second,
/// over the first again, and so on.
#[test]
fn three_cables_that_lose_frames_make_no_storm() {
    for seed in 0..100 {
        let mut mesh = Mesh::new(2, &[(0, 1); 3]);
        let (vehicle, station) = (mesh.link(0), mesh.link(1));
        mesh.loss = Some(Random::new(seed));
        let arrived = mesh.fly(30, vehicle, station);
        assert!(mesh.carried <= 300 * 3 * 2, "{} frames carried, seed {seed}", mesh.carried);
        assert!(arrived > 200, "{arrived} of 300 arrive, seed {seed}");
    }
}

#[test]
fn a_directed_frame_arrives_once_in_a_ring() {
    let rings: [&[(usize, usize)]; 2] = [&[(0, 1), (0, 1)], &[(0, 1), (1, 2), (2, 0)]];
    for cables in rings {
        let mut mesh = Mesh::new(3, cables);
        let (vehicle, station) = (mesh.link(0), mesh.link(1));
        mesh.send(vehicle, &heartbeat(VEHICLE), station);
        mesh.send(station, &heartbeat(STATION), vehicle);
        assert_eq!(mesh.send(station, &command(STATION, VEHICLE), vehicle), 1);
        assert_eq!(mesh.send(vehicle, &command(VEHICLE, STATION), station), 1);
    }
}

/// Both heartbeats are lost on the short way, so commands to either go the long way round, past the
/// station: each of its neighbours has heard the vehicle from there, and from there alone.
#[test]
fn commands_that_go_the_long_way_round_keep_no_broadcast_off_it() {
    let mut mesh = Mesh::new(4, &[(0, 1), (1, 2), (2, 3), (3, 0)]);
    let (vehicle, station) = (mesh.link(0), mesh.link(2));
    for (router, short_way, system) in [(1, 0, 2), (3, 3, 3)] {
        let target = Component::new(system, 1);
        let at = mesh.link(router);
        mesh.loses = Some(short_way);
        mesh.send(at, &heartbeat(target), station);
        assert_eq!(mesh.send(vehicle, &command(VEHICLE, target), at), 1);
    }
    assert_eq!(mesh.fly(1, vehicle, station), 10, "all arrive");
}

/// A script says one thing and is gone, while its frame is on its way round. The router knows it on
/// the ring alone then, as if it were there.
#[test]
fn the_last_words_of_who_is_gone_make_no_storm() {
    for lossy in [None, Some(0), Some(2)] {
        let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
        let (script, station) = (mesh.link(0), mesh.link(1));
        mesh.loses = lossy;
        mesh.leaves = Some(script);
        assert!(mesh.send(script, &heartbeat(VEHICLE), station) > 0);
        assert!(mesh.carried <= 12, "{} frames over 3 cables for one", mesh.carried);
    }
}

/// A modem without coverage holds frames back for longer than they are remembered to go round. Each
/// router could take them for news then, from the one before it, and so for ever.
#[test]
fn what_was_held_back_for_long_does_not_go_round() {
    for count in [1, 50] {
        for goes_on in [true, false] {
            let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
            let (vehicle, station) = (mesh.link(0), mesh.link(1));
            mesh.holds = vec![0];
            for seq in 0..count {
                let bytes = frame(Version::V2, 200 + seq, VEHICLE, (30, 39), &[99; 28]);
                assert_eq!(mesh.send(vehicle, &bytes, station), 1, "the other way");
            }
            mesh.holds.clear();
            match goes_on {
                true => assert_eq!(mesh.fly(3, vehicle, station), 30),
                false => mesh.now = mesh.now + Duration::from_secs(6),
            }
            mesh.carried = 0;
            let again = mesh.release(station);
            let count = usize::from(count);
            assert!(mesh.carried <= 6 * count, "{} frames carried for {count}", mesh.carried);
            let most = if goes_on { 0 } else { count };
            assert!(again <= most, "told {again} of {count} times again");
        }
    }
}

/// Some cables of the ring take six seconds each time, and the vehicle has said its last word.
#[test]
fn nothing_goes_round_slowly() {
    for slow in 1..8_usize {
        for count in [1, 5, 50] {
            let mut mesh = Mesh::new(3, &[(0, 1), (1, 2), (2, 0)]);
            let (vehicle, station) = (mesh.link(0), mesh.link(1));
            mesh.holds = (0..3).filter(|cable| slow >> cable & 1 == 1).collect();
            for seq in 0..count {
                let bytes = frame(Version::V2, seq, VEHICLE, (30, 39), &[seq; 28]);
                mesh.send(vehicle, &bytes, station);
            }
            mesh.rest(6_000, station);
        }
    }
}

/// All cables are slow, there are many ways round, and the last words of several come by all of them.
#[test]
fn nothing_goes_round_slowly_in_a_mesh() {
    let pairs: Vec<(usize, usize)> = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b))).collect();
    for closes in [false, true] {
        let mut mesh = Mesh::new(4, &pairs);
        let (vehicle, station) = (mesh.link(0), mesh.link(3));
        mesh.holds = (0..pairs.len()).collect();
        for seq in 0..20 {
            let bytes = frame(Version::V2, seq, VEHICLE, (30, 39), &[seq; 28]);
            mesh.send(vehicle, &bytes, station);
        }
        if closes {
            mesh.routers[0].remove_link(vehicle.1);
        }
        mesh.rest(2_500, station);
    }
}
