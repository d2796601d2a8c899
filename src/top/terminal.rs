//! The terminal: taken over, drawn on, and given back as it was, whatever ends the view.

use std::env;
use std::io::{self, IsTerminal};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use super::app::{App, Next};
use super::draw::draw;
use super::follow::{News, follow};
use crate::control::{Client, ClientError};

/// How long a key is waited for before news is looked at.
const TURN: Duration = Duration::from_millis(100);

/// The view could not be had.
#[derive(Debug, thiserror::Error)]
pub enum TopError {
    /// There is nothing to draw on.
    #[error("top needs a terminal (`mavswitch status` prints the same once)")]
    NoTerminal,
    /// The daemon cannot be asked.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The terminal cannot be used.
    #[error("cannot use the terminal: {0}")]
    Terminal(#[from] io::Error),
}

/// Shows what is going on in the daemon at `control`, or in the first one found, until `q` is pressed
/// or a signal asks to end.
///
/// # Errors
///
/// If no daemon answers at first, or there is no terminal. One that goes later is waited for.
pub fn top(control: Option<&Path>) -> Result<(), TopError> {
    if !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        return Err(TopError::NoTerminal);
    }
    let client = Client::connect(control)?;
    let news = follow(client, control)?;
    let is_ended = Arc::new(AtomicBool::new(false));
    // SIGHUP ends it at once: then there is no terminal to give back.
    for signal in [SIGTERM, SIGINT] {
        flag::register(signal, Arc::clone(&is_ended))?;
    }
    // It also sees to it that a panic gives the terminal back first.
    let mut terminal = ratatui::try_init()?;
    let outcome = show(&mut terminal, &news, &is_ended);
    ratatui::try_restore()?;
    Ok(outcome?)
}

fn show(
    terminal: &mut DefaultTerminal,
    news: &Receiver<News>,
    is_ended: &AtomicBool,
) -> io::Result<()> {
    let mut app = App::new(has_colour());
    let mut is_changed = true;
    while !is_ended.load(Ordering::Relaxed) {
        for it in news.try_iter() {
            is_changed = true;
            match it {
                News::Snapshot(snapshot) => app.handle_snapshot(*snapshot),
                News::Trouble(trouble) => app.handle_trouble(trouble),
            }
        }
        if std::mem::take(&mut is_changed) {
            terminal.draw(|frame| draw(&app, frame))?;
        }
        if !wait_for_key()? {
            return Ok(());
        }
        while event::poll(Duration::ZERO)? {
            is_changed = true;
            if let Event::Key(key) = event::read()?
                && key.kind != KeyEventKind::Release
                && app.handle_key(key) == Next::Quit
            {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// Waits a turn, or less if something is typed; `false` if the terminal is gone. Whoever reads keys
/// must not find that out: it would read nothing, again and again.
fn wait_for_key() -> io::Result<bool> {
    let stdin = io::stdin();
    let mut keys = [PollFd::new(&stdin, PollFlags::IN)];
    let turn = Timespec::try_from(TURN).map_err(io::Error::other)?;
    match poll(&mut keys, Some(&turn)) {
        // A signal, or another size of the window.
        Ok(_) | Err(Errno::INTR) => {}
        Err(error) => return Err(error.into()),
    }
    Ok(!keys[0].revents().intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL))
}

/// As `NO_COLOR` asks for it, and where the terminal has any.
fn has_colour() -> bool {
    let is_set = |name| env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && env::var_os("TERM").is_none_or(|term| term != "dumb")
}
