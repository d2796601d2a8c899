//! Follows the daemon from a thread of its own, and connects again when it has gone.

use std::path::Path;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::Duration;

use crate::control::{Answer, Client, ClientError, Request};
use crate::status::Snapshot;

/// How often a snapshot is asked for.
const INTERVAL: Duration = Duration::from_secs(1);

/// A daemon that says nothing for so long is told of.
const PATIENCE: Duration = Duration::from_secs(3);

/// What has come of it.
#[derive(Debug)]
pub(super) enum News {
    Snapshot(Box<Snapshot>),
    Trouble(String),
}

/// Follows the daemon that `client` is connected to, and later whoever is at `path`.
///
/// # Errors
///
/// If the system refuses the thread.
pub(super) fn follow(client: Client, path: Option<&Path>) -> std::io::Result<Receiver<News>> {
    let (sender, receiver) = mpsc::channel();
    let path = path.map(Path::to_owned);
    thread::Builder::new()
        .name("follow".to_owned())
        .spawn(move || follow_for_ever(client, path.as_deref(), &sender))?;
    Ok(receiver)
}

fn follow_for_ever(client: Client, path: Option<&Path>, sender: &Sender<News>) {
    let mut client = Ok(client);
    loop {
        let error = match client {
            Ok(client) => match hand_over(client, sender) {
                Ok(()) => return,
                Err(error) => error,
            },
            Err(error) => error,
        };
        if sender.send(News::Trouble(error.to_string())).is_err() {
            return;
        }
        thread::sleep(INTERVAL);
        client = Client::connect(path);
    }
}

/// Returns without an error when nobody takes the news any more.
fn hand_over(mut client: Client, sender: &Sender<News>) -> Result<(), ClientError> {
    client.send(Request::Follow { interval_ms: INTERVAL.as_millis() as u64 })?;
    loop {
        let news = match client.receive(PATIENCE)? {
            Some(line) => match line.answer {
                Answer::Status(snapshot) => News::Snapshot(snapshot),
                Answer::Error(text) => return Err(ClientError::Refused(text)),
                _ => return Err(ClientError::Unexpected),
            },
            None => News::Trouble("the daemon does not answer (is it stopped?)".to_owned()),
        };
        if sender.send(news).is_err() {
            return Ok(());
        }
    }
}
