//! A cable between two UDP endpoints that a test can cut, and that loses, delays and counts.

use std::collections::VecDeque;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::harness::{Noise, roomy_udp_socket};

/// A running relay: who sends to its address is joined with the target.
pub(crate) struct Relay {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

/// What the test and the two directions share.
#[derive(Default)]
struct Shared {
    /// Who sent to the relay last.
    caller: Mutex<Option<SocketAddr>>,
    loss_percent: AtomicU32,
    delay_ms: AtomicU32,
    is_cut: AtomicBool,
    is_one_way: AtomicBool,
    is_holding: AtomicBool,
    is_over: AtomicBool,
    carried: AtomicUsize,
}

/// How often a direction looks whether the relay is over.
const LOOK: Duration = Duration::from_millis(20);

impl Relay {
    /// Between whoever sends to it, at this address, and the target.
    pub(crate) fn start(ip: IpAddr, target: SocketAddr) -> Self {
        let outside = roomy_udp_socket(SocketAddr::new(ip, 0));
        let inside = roomy_udp_socket(SocketAddr::new(target.ip(), 0));
        inside.connect(target).expect("a way to the target");
        let address = outside.local_addr().expect("a bound socket");
        let shared = Arc::<Shared>::default();
        let inwards = Direction::new(&shared, &outside, &inside);
        let outwards = Direction::new(&shared, &inside, &outside);
        let threads = vec![
            thread::spawn(move || inwards.run(Direction::send_inside)),
            thread::spawn(move || outwards.run(Direction::send_outside)),
        ];
        Self { shared, address, threads }
    }

    /// Where to send.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// From now on each direction loses and delays so much.
    pub(crate) fn set_weather(&self, loss_percent: u32, delay: Duration) {
        self.shared.loss_percent.store(loss_percent, Relaxed);
        let delay_ms = u32::try_from(delay.as_millis()).expect("a short delay");
        self.shared.delay_ms.store(delay_ms, Relaxed);
    }

    /// From now on nothing goes through, or everything again.
    pub(crate) fn set_cut(&self, is_cut: bool) {
        self.shared.is_cut.store(is_cut, Relaxed);
    }

    /// From now on nothing goes back to who calls the relay, or everything again.
    pub(crate) fn set_one_way(&self, is_one_way: bool) {
        self.shared.is_one_way.store(is_one_way, Relaxed);
    }

    /// From now on everything waits in the relay, or goes on, with all that has waited: what modems
    /// do where there is no coverage.
    pub(crate) fn set_holding(&self, is_holding: bool) {
        self.shared.is_holding.store(is_holding, Relaxed);
    }

    /// How many datagrams were handed to it so far that it did not lose, both ways.
    pub(crate) fn carried(&self) -> usize {
        self.shared.carried.load(Relaxed)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Relaxed);
        for thread in self.threads.drain(..) {
            if thread.join().is_err() && !thread::panicking() {
                panic!("a relay failed");
            }
        }
    }
}

/// One of the two ways through a relay.
struct Direction {
    shared: Arc<Shared>,
    from: UdpSocket,
    to: UdpSocket,
    noise: Noise,
    /// What is on its way, and when it is due.
    waiting: VecDeque<(Instant, Vec<u8>)>,
}

impl Direction {
    fn new(shared: &Arc<Shared>, from: &UdpSocket, to: &UdpSocket) -> Self {
        // No two may lose the same frames.
        static COUNT: AtomicU64 = AtomicU64::new(1);
        let seed = COUNT.fetch_add(1, Relaxed).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let copy = |socket: &UdpSocket| socket.try_clone().expect("a second descriptor");
        Self {
            shared: Arc::clone(shared),
            from: copy(from),
            to: copy(to),
            noise: Noise::new(seed),
            waiting: VecDeque::new(),
        }
    }

    fn run(mut self, send: fn(&Self, &[u8])) {
        let mut buffer = [0; 2048];
        while !self.shared.is_over.load(Relaxed) {
            let due = self.waiting.front().map(|(due, _)| due.duration_since(Instant::now()));
            let wait = due.unwrap_or(LOOK).clamp(Duration::from_millis(1), LOOK);
            self.from.set_read_timeout(Some(wait)).expect("a time limit");
            // An error is a time that is up, or a refusal that answers an earlier datagram.
            if let Ok((count, from)) = self.from.recv_from(&mut buffer) {
                self.take(&buffer[..count], from);
            }
            while let Some((due, _)) = self.waiting.front()
                && *due <= Instant::now()
                && !self.shared.is_holding.load(Relaxed)
            {
                let (_, datagram) = self.waiting.pop_front().expect("the front");
                send(&self, &datagram);
            }
        }
    }

    fn take(&mut self, datagram: &[u8], from: SocketAddr) {
        let is_inwards = self.from.peer_addr().is_err();
        if is_inwards {
            *self.shared.caller.lock().expect("the caller") = Some(from);
        }
        let loss = u64::from(self.shared.loss_percent.load(Relaxed));
        let is_lost = (self.noise.next() >> 16) % 100 < loss;
        let is_barred = !is_inwards && self.shared.is_one_way.load(Relaxed);
        if is_lost || is_barred || self.shared.is_cut.load(Relaxed) {
            return;
        }
        self.shared.carried.fetch_add(1, Relaxed);
        let delay = Duration::from_millis(self.shared.delay_ms.load(Relaxed).into());
        self.waiting.push_back((Instant::now() + delay, datagram.to_vec()));
    }

    fn send_inside(&self, datagram: &[u8]) {
        // Nobody may be there yet, or any more.
        let _ = self.to.send(datagram);
    }

    fn send_outside(&self, datagram: &[u8]) {
        let caller = *self.shared.caller.lock().expect("the caller");
        if let Some(caller) = caller {
            let _ = self.to.send_to(datagram, caller);
        }
    }
}
