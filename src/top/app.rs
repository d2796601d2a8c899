//! What the view knows: the newest snapshot, how the figures went, and what the keys have asked for.

use std::collections::HashMap;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::table::{Column, View, rows};
use super::trace::Trace;
use crate::status::{ComponentStatus, Counters, Snapshot};

/// What is followed over time. The number tells which figure of it.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) enum Key {
    /// 0, 1: frames of all links in and out; 2, 3: their bytes.
    Total(u8),
    /// 0, 1: frames of a link in and out; 2, 3: its bytes; 4: frames that were refused.
    Link(String, u16, u8),
    /// 0: frames; 1: frames lost.
    Component(u8, u8, u8),
    /// 0: frames; 1: bytes.
    Message(u8, u8, u32, u8),
}

/// What the view shows.
#[derive(Debug)]
pub(super) struct App {
    snapshot: Option<Snapshot>,
    traces: HashMap<Key, Trace>,
    /// Why the daemon cannot be asked, if it cannot.
    pub(super) trouble: Option<String>,
    pub(super) view: View,
    /// By which column.
    pub(super) sort: Option<usize>,
    pub(super) is_reversed: bool,
    /// Rows that have none of this are left out.
    pub(super) filter: String,
    pub(super) is_typing: bool,
    pub(super) is_paused: bool,
    pub(super) is_helping: bool,
    /// How many rows are above the window.
    pub(super) scroll: usize,
    pub(super) has_colour: bool,
}

/// Whether to go on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Next {
    GoOn,
    Quit,
}

impl App {
    pub(super) fn new(has_colour: bool) -> Self {
        Self {
            snapshot: None,
            traces: HashMap::new(),
            trouble: None,
            view: View::Links,
            sort: None,
            is_reversed: false,
            filter: String::new(),
            is_typing: false,
            is_paused: false,
            is_helping: false,
            scroll: 0,
            has_colour,
        }
    }

    /// The newest.
    pub(super) fn snapshot(&self) -> Option<&Snapshot> {
        self.snapshot.as_ref()
    }

    /// The columns of the view that is looked at.
    pub(super) fn columns(&self) -> &'static [Column] {
        let endpoints = self.snapshot.iter().flat_map(|it| &it.endpoints);
        let mut links = endpoints.flat_map(|endpoint| &endpoint.links);
        self.view.columns(links.any(|link| link.round_trip_ms.is_some()))
    }

    /// How a figure went.
    pub(super) fn trace(&self, key: &Key) -> Trace {
        self.traces.get(key).cloned().unwrap_or_default()
    }

    /// A newer one has come.
    pub(super) fn handle_snapshot(&mut self, snapshot: Snapshot) {
        self.trouble = None;
        if self.is_paused {
            return;
        }
        let before = self.snapshot.as_ref().filter(|it| it.program == snapshot.program);
        let seconds = match before {
            Some(before) => snapshot.time_us.saturating_sub(before.time_us) as f64 / 1e6,
            None => {
                self.traces.clear();
                0.0
            }
        };
        let mut traces = HashMap::new();
        for (key, count) in figures(&snapshot) {
            let mut trace = self.traces.remove(&key).unwrap_or_default();
            trace.push(count, seconds);
            traces.insert(key, trace);
        }
        // What is not there any more is forgotten.
        self.traces = traces;
        self.snapshot = Some(snapshot);
    }

    /// The daemon cannot be asked.
    pub(super) fn handle_trouble(&mut self, trouble: String) {
        self.trouble = Some(trouble);
    }

    /// A key was pressed.
    pub(super) fn handle_key(&mut self, key: KeyEvent) -> Next {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return if key.code == KeyCode::Char('c') { Next::Quit } else { Next::GoOn };
        }
        if self.is_typing {
            self.type_filter(key.code);
            return Next::GoOn;
        }
        if self.is_helping {
            self.is_helping = false;
            return Next::GoOn;
        }
        match key.code {
            KeyCode::Char('q') => return Next::Quit,
            KeyCode::Char('?' | 'h') => self.is_helping = true,
            KeyCode::Char('/') => self.is_typing = true,
            KeyCode::Esc => self.filter.clear(),
            KeyCode::Char(' ' | 'p') => self.is_paused = !self.is_paused,
            KeyCode::Char('s') => self.sort_by_next(),
            KeyCode::Char('r') => self.is_reversed = !self.is_reversed,
            KeyCode::Char(digit @ '1'..='3') => self.show(View::ALL[digit as usize - '1' as usize]),
            KeyCode::Tab | KeyCode::Right => self.show_other(1),
            KeyCode::BackTab | KeyCode::Left => self.show_other(View::ALL.len() - 1),
            code => self.scroll(code),
        }
        Next::GoOn
    }

    fn type_filter(&mut self, code: KeyCode) {
        match code {
            KeyCode::Enter => self.is_typing = false,
            KeyCode::Esc => (self.is_typing, self.filter) = (false, String::new()),
            KeyCode::Backspace => drop(self.filter.pop()),
            KeyCode::Char(letter) if self.filter.len() < 40 => self.filter.push(letter),
            _ => {}
        }
        self.scroll = 0;
    }

    fn show(&mut self, view: View) {
        self.view = view;
        (self.sort, self.is_reversed, self.scroll) = (view.first_sort(), false, 0);
    }

    fn show_other(&mut self, steps: usize) {
        let place = View::ALL.iter().position(|it| *it == self.view).unwrap_or(0);
        self.show(View::ALL[(place + steps) % View::ALL.len()]);
    }

    /// By each column in turn, then in the order that there was.
    fn sort_by_next(&mut self) {
        self.is_reversed = false;
        self.sort = match self.sort {
            None => Some(0),
            Some(column) if column + 1 < self.columns().len() => Some(column + 1),
            Some(_) => None,
        };
    }

    fn scroll(&mut self, code: KeyCode) {
        let last = rows(self).len().saturating_sub(1);
        self.scroll = match code {
            KeyCode::Down | KeyCode::Char('j') => self.scroll + 1,
            KeyCode::Up | KeyCode::Char('k') => self.scroll.saturating_sub(1),
            KeyCode::PageDown => self.scroll + 10,
            KeyCode::PageUp => self.scroll.saturating_sub(10),
            KeyCode::Home => 0,
            KeyCode::End => last,
            _ => self.scroll,
        }
        .min(last);
    }
}

/// Every count that is followed, and how far it is.
fn figures(snapshot: &Snapshot) -> Vec<(Key, u64)> {
    let mut figures = Vec::new();
    let mut totals = [0; 4];
    for endpoint in &snapshot.endpoints {
        for total in totals.iter_mut().zip(counts(&endpoint.past)) {
            *total.0 += total.1;
        }
        for link in &endpoint.links {
            let counted = counts(&link.counters);
            totals.iter_mut().zip(counted).for_each(|(total, count)| *total += count);
            let refused = link.counters.refused.values().sum();
            let each = counted.into_iter().chain([refused]).zip(0..);
            let key = |what| Key::Link(endpoint.name.clone(), link.id, what);
            figures.extend(each.map(|(count, what)| (key(what), count)));
        }
    }
    figures.extend((0..).map(Key::Total).zip(totals));
    for it in &snapshot.components {
        let key = |what| Key::Component(it.system, it.component, what);
        figures.extend([(key(0), sum_heard(it).0), (key(1), sum_heard(it).1)]);
    }
    for it in &snapshot.messages {
        let key = |what| Key::Message(it.system, it.component, it.id, what);
        figures.extend([(key(0), it.frames), (key(1), it.bytes)]);
    }
    figures
}

fn counts(counters: &Counters) -> [u64; 4] {
    [counters.frames_in, counters.frames_out, counters.bytes_in, counters.bytes_out]
}

fn sum_heard(component: &ComponentStatus) -> (u64, u64) {
    let heard = component.heard.iter();
    heard.fold((0, 0), |sum, it| (sum.0 + it.frames, sum.1 + it.lost))
}
