//! A forwarder that never looks at what it forwards: what the machine itself makes of such frames at
//! the same time.

use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, Instant};

use crate::Clock;
use crate::latency::Thirds;
use crate::party::PERIOD;

/// One datagram each [`PERIOD`], from one thread over a second to a third; how old each was.
pub(crate) fn measure(clock: &Clock) -> Thirds {
    let [from, between, to] = [(); 3].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    let [first, last] = [&between, &to].map(|socket| socket.local_addr().unwrap());
    for socket in [&between, &to] {
        socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    }
    thread::scope(|scope| {
        scope.spawn(move || {
            let mut due = Instant::now();
            while !clock.is_over() {
                from.send_to(&clock.now().to_le_bytes(), first).unwrap();
                due = (due + PERIOD).max(Instant::now());
                thread::sleep(due.saturating_duration_since(Instant::now()));
            }
        });
        scope.spawn(move || {
            let mut datagram = [0; 8];
            while !clock.is_over() {
                if between.recv(&mut datagram).is_ok() {
                    between.send_to(&datagram, last).unwrap();
                }
            }
        });
        let mut ages = Thirds::new();
        let mut datagram = [0; 8];
        while !clock.is_over() {
            if to.recv(&mut datagram).is_ok() {
                ages.count(clock, u64::from_le_bytes(datagram));
            }
        }
        ages
    })
}
