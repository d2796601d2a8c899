//! Vehicles and ground stations whose links are well: each numbers what it sends to each other, and
//! must hear each number once and in order, in time.

use std::collections::HashMap;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mavswitch::mavlink::Component;

use crate::Clock;
use crate::harness::*;
use crate::latency::Thirds;

/// How often everybody speaks.
pub(crate) const PERIOD: Duration = Duration::from_millis(20);

/// How many frames went from whom to whom, once all have.
#[derive(Default)]
pub(crate) struct Ledger(Mutex<HashMap<(Component, Component), u32>>);

/// One of them.
pub(crate) struct Party<W: Wire> {
    peer: Peer<W>,
    me: Component,
    partners: [Component; 2],
    /// How many frames each partner was sent, and the number that is expected of it next.
    sent: u32,
    next: HashMap<Component, u32>,
    account: Account,
}

/// What a party has to tell.
pub(crate) struct Account {
    me: Component,
    received: u64,
    lost: u64,
    /// What the kernel threw away in front of its socket.
    dropped: u64,
    ages: Thirds,
}

impl<W: Wire + Dropping> Party<W> {
    pub(crate) fn new(peer: Peer<W>, me: Component, partners: [Component; 2]) -> Self {
        let account = Account { me, received: 0, lost: 0, dropped: 0, ages: Thirds::new() };
        Self { peer, me, partners, sent: 0, next: partners.map(|it| (it, 0)).into(), account }
    }

    /// Speaks and listens until the run is over, then listens to what is still on its way.
    pub(crate) fn live(mut self, clock: &Clock, ledger: &Ledger) -> Account {
        let mut due = Instant::now();
        while !clock.is_over() {
            self.speak(clock);
            due = (due + PERIOD).max(Instant::now());
            while let left = due.saturating_duration_since(Instant::now())
                && !left.is_zero()
            {
                self.listen(clock, left);
            }
        }
        let sent = self.partners.map(|partner| ((self.me, partner), self.sent));
        ledger.0.lock().unwrap().extend(sent);
        let patience = Instant::now() + PATIENCE;
        while !self.has_all(ledger) && Instant::now() < patience {
            self.listen(clock, PERIOD);
        }
        for partner in self.partners {
            let sent = ledger.0.lock().unwrap().get(&(partner, self.me)).copied();
            let sent = sent.unwrap_or_else(|| panic!("{partner} has not ended"));
            self.account.lost += u64::from(sent - self.next[&partner]);
        }
        self.account.dropped = self.peer.wire.dropped();
        self.account
    }

    /// Telemetry for all, and something for each partner alone.
    fn speak(&mut self, clock: &Clock) {
        self.peer.send(attitude(self.me, self.sent));
        for partner in self.partners {
            let mut payload = vec![0, partner.system, partner.component];
            payload.extend(self.sent.to_le_bytes());
            payload.extend(clock.now().to_le_bytes());
            let seq = self.sent.to_le_bytes()[0];
            let draft = Draft::new(self.me, FILE_TRANSFER_PROTOCOL, payload);
            self.peer.send(draft.seq(seq).build());
        }
        self.sent += 1;
    }

    fn listen(&mut self, clock: &Clock, time: Duration) {
        let Some(frame) = self.peer.try_receive(time) else { return };
        let payload = &frame[10..];
        if frame[7..10] != [110, 0, 0] {
            return;
        }
        assert_eq!([payload[1], payload[2]], [self.me.system, self.me.component], "not for us");
        // Zeros at the end are cut off, and the time may end with zeros.
        let mut fields = [0; 12];
        let end = payload.len().min(15 + 2) - 2;
        fields[..end - 3].copy_from_slice(&payload[3..end]);
        let number = u32::from_le_bytes(*fields.first_chunk().unwrap());
        let time = u64::from_le_bytes(*fields.last_chunk().unwrap());
        let from = source_of(&frame);
        let next = self.next.get_mut(&from).unwrap_or_else(|| panic!("{from} is no partner"));
        assert!(number >= *next, "{number} of {from} comes again or too late: {next} is next");
        self.account.lost += u64::from(number - *next);
        *next = number + 1;
        self.account.received += 1;
        self.account.ages.count(clock, time);
    }

    fn has_all(&self, ledger: &Ledger) -> bool {
        let ledger = ledger.0.lock().unwrap();
        let has_all = |it: &Component| ledger.get(&(*it, self.me)) == Some(&self.next[it]);
        self.partners.iter().all(has_all)
    }
}

/// A wire that may lose what nobody has fetched in time.
pub(crate) trait Dropping {
    /// How many frames it has lost so on the way to us.
    fn dropped(&self) -> u64;
}

impl Dropping for TcpWire {
    fn dropped(&self) -> u64 {
        0
    }
}

impl Dropping for UdpWire {
    fn dropped(&self) -> u64 {
        dropped_at(self.address().port())
    }
}

/// How many datagrams the kernel threw away as nobody fetched them from the socket at this port.
pub(crate) fn dropped_at(port: u16) -> u64 {
    let table = std::fs::read_to_string("/proc/net/udp").unwrap();
    let port = format!(":{port:04X}");
    let sockets = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
    let mine = sockets.filter(|fields| fields[1].ends_with(&port));
    mine.map(|fields| fields.last().unwrap().parse::<u64>().unwrap()).sum()
}

/// No frame is lost but by the kernel, and frames are as young in the end as in the beginning, or as
/// the machine lets them be.
pub(crate) fn judge(accounts: &[Account], mirror: &Thirds, dropped_at_router: u64) {
    let mut ages = Thirds::new();
    let mut lost = 0;
    let mut dropped = dropped_at_router;
    for account in accounts {
        println!(
            "{}: {} directed frames received, {} lost; the kernel threw {} datagrams away",
            account.me, account.received, account.lost, account.dropped
        );
        assert!(account.received > 0, "{} heard nothing", account.me);
        ages.add(&account.ages);
        lost += account.lost;
        dropped += account.dropped;
    }
    for (who, ages) in [("mavswitch", &ages), ("a blind forwarder", mirror)] {
        for (name, part) in [("p50", 0.5), ("p99", 0.99), ("p99.9", 0.999)] {
            println!("{who}, {name} of each third: {:.0?}", ages.quantiles(part));
        }
    }
    assert!(lost <= dropped, "{lost} directed frames lost; the kernel threw {dropped} away");
    let [first, _, last] = ages.quantiles(0.99);
    let blind = mirror.quantiles(0.99)[2];
    let most = (first.max(blind) * 4).max(Duration::from_millis(20));
    assert!(last < most, "frames grow older: from {first:?} to {last:?}, {blind:?} if blind");
}
