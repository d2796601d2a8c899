//! Who makes trouble, each in a thread of its own, until the run is over; then they are gone.

use std::io::Write;
use std::net::{Shutdown, SocketAddr, TcpStream, UdpSocket};
use std::thread;
use std::time::Duration;

use mavswitch::mavlink::Component;
use socket2::SockRef;

use crate::Clock;
use crate::harness::*;
use crate::scene::Scene;

/// All of them.
pub(crate) const ALL: [fn(&Scene, &Clock); 7] =
    [callers, strangers, plug_and_unplug, server, stalled_readers, talker, reloads];

/// Waits that long, in steps; says whether the run goes on.
pub(crate) fn goes_on(clock: &Clock, millis: u64) -> bool {
    for _ in 0..millis.div_ceil(50) {
        if clock.is_over() {
            return false;
        }
        thread::sleep(Duration::from_millis(millis.min(50)));
    }
    !clock.is_over()
}

/// One of a bounded number of components that nobody here waits for.
fn stranger(noise: &mut Noise) -> Component {
    let [system, component] = [30, 20].map(|end| u8::try_from(noise.below(end)).unwrap());
    Component::new(100 + system, 1 + component)
}

/// What a bad neighbour says: noise, torn frames, wrong checksums, false starts, and good frames.
fn babble(noise: &mut Noise) -> Vec<u8> {
    let me = stranger(noise);
    let number = noise.next() as u32;
    match noise.below(6) {
        0 => {
            let count = noise.below(1_400);
            noise.bytes(count)
        }
        1 => attitude(me, number)[..17].to_vec(),
        2 => corrupted(&attitude(me, number)),
        3 => [0xfd; 300].to_vec(),
        4 => unknown(me, number),
        _ => [attitude(me, number), heartbeat(me)].concat(),
    }
}

/// Clients that come and leave in any way.
fn callers(scene: &Scene, clock: &Clock) {
    let (address, mut noise) = (scene.router.address("callers"), Noise::new(1));
    while goes_on(clock, 30) {
        let mut streams: Vec<TcpStream> =
            (0..1 + noise.below(4)).flat_map(|_| TcpStream::connect(address)).collect();
        for stream in &mut streams {
            // The router may have closed it already.
            let _ = stream.write_all(&heartbeat(stranger(&mut noise)));
            let _ = stream.write_all(&babble(&mut noise));
            let _ = match noise.below(3) {
                0 => SockRef::from(&*stream).set_linger(Some(Duration::ZERO)),
                1 => stream.shutdown(Shutdown::Write),
                _ => Ok(()),
            };
        }
    }
}

/// Datagrams from ports that were never seen before.
fn strangers(scene: &Scene, clock: &Clock) {
    let (address, mut noise) = (scene.router.address("strangers"), Noise::new(2));
    while goes_on(clock, 20) {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        for _ in 0..noise.below(5) {
            let _ = socket.send_to(&babble(&mut noise), address);
        }
        let to_nobody = command_long(stranger(&mut noise), stranger(&mut noise));
        let _ = socket.send_to(&to_nobody, address);
    }
}

/// A flight controller whose plug is pulled, now and then within a frame.
fn plug_and_unplug(scene: &Scene, clock: &Clock) {
    let mut noise = Noise::new(3);
    loop {
        let pty = Pty::new();
        scene.plug(&pty);
        let mut camera = Peer::new(pty.wire, CAMERA);
        for number in 0..20 {
            camera.send(attitude(CAMERA, number));
            if !goes_on(clock, 50) {
                break;
            }
        }
        camera.send(&babble(&mut noise)[..8]);
        scene.unplug();
        if !goes_on(clock, 300) {
            return;
        }
    }
}

/// A server that the router calls, and that hangs up, and is not there for a while.
fn server(scene: &Scene, clock: &Clock) {
    let mut server = TcpServer::at(scene.server);
    while goes_on(clock, 300) {
        server.up();
        for number in 0..20 {
            if let Some(mut peer) = server.try_accept(WITNESS) {
                let _ = peer.wire.stream.write_all(&attitude(WITNESS, number));
                peer.reset();
            }
            if !goes_on(clock, 50) {
                break;
            }
        }
        server.go_down();
    }
}

/// Clients that never read what they are sent.
fn stalled_readers(scene: &Scene, clock: &Clock) {
    let address = scene.router.address("callers");
    while !clock.is_over() {
        let stalled = [(); 3].map(|()| TcpWire::narrow_to(address));
        goes_on(clock, 4_000);
        drop(stalled);
    }
}

/// Somebody who sends a lot to everybody: what fills the links of who does not read.
fn talker(scene: &Scene, clock: &Clock) {
    let address: SocketAddr = scene.router.address("tcp");
    let mut number = 0;
    while !clock.is_over() {
        let mut talker = TcpWire::to(address);
        for _ in 0..100 {
            let frames = (0..20).map(|more| bulk(WITNESS, number + more));
            talker.send(&frames.collect::<Vec<_>>().concat());
            number += 20;
            if !goes_on(clock, 50) {
                return;
            }
        }
    }
}

/// The operator, who cannot leave the configuration alone.
fn reloads(scene: &Scene, clock: &Clock) {
    for number in 1.. {
        if !goes_on(clock, 1_500) {
            return;
        }
        scene.write(number % 4);
        scene.reload();
    }
}
