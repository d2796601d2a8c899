//! Host names to addresses, by a thread for each question, so that nobody else waits for it.

use std::io;
use std::net::{SocketAddr, ToSocketAddrs};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use mio::Waker;

/// An answer.
#[derive(Debug)]
pub struct Resolved<A> {
    /// Whose question it was.
    pub asker: A,
    /// The addresses, in the order to try them; or why there are none.
    pub addresses: io::Result<Vec<SocketAddr>>,
}

/// Asks the system's resolver, and wakes the poll loop when it has answered.
///
/// A name server that never answers holds up its own question only. Each asker should have one
/// question open at a time; that bounds the threads. `A` is what an asker is known by.
pub struct Resolver<A> {
    answers: (Sender<Resolved<A>>, Receiver<Resolved<A>>),
    waker: Arc<Waker>,
}

impl<A: Send + 'static> Resolver<A> {
    /// A resolver that wakes the loop of `waker`.
    pub fn new(waker: Arc<Waker>) -> Self {
        Self { answers: channel(), waker }
    }

    /// Asks for the addresses of a host; the answer comes from [`Resolver::poll`].
    ///
    /// # Errors
    ///
    /// If the system refuses another thread.
    pub fn ask(&self, asker: A, host: String, port: u16) -> io::Result<()> {
        let (answers, waker) = (self.answers.0.clone(), Arc::clone(&self.waker));
        let ask = move || {
            let addresses = (host.as_str(), port).to_socket_addrs().map(Iterator::collect);
            // Fails only when the program ends and nobody wants to know.
            if answers.send(Resolved { asker, addresses }).is_ok() {
                let _ = waker.wake();
            }
        };
        thread::Builder::new().name("resolver".into()).spawn(ask).map(drop)
    }

    /// The next answer.
    pub fn poll(&self) -> Option<Resolved<A>> {
        self.answers.1.try_recv().ok()
    }
}
