//! How it looks: a pure function from what the view knows to a screen of whatever size.

use ratatui::Frame;
use ratatui::layout::{Constraint, Flex, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Block, Cell, Clear, Paragraph, Row, Table};

use super::app::{App, Key};
use super::table::{self, Tone, View, rows};
use crate::printable::printable;
use crate::status::units::{bytes, number, time};
use crate::status::{RecordState, RecordStatus, record_line};

/// Below this there is nothing to be seen.
const LEAST: (u16, u16) = (30, 7);

/// How wide a small curve is.
const BARS: u16 = 20;

const KEYS: &str = "Tab view  s sort  r reverse  / filter  Space pause  ? help  q quit";

const HELP: &str = "\
1 2 3, Tab    links, components, messages
s             sort by the next column
r             reverse the order
/ TEXT Enter  show only rows that have TEXT; Esc: all
Space, p      pause, and go on
arrows, Page  scroll
q, Ctrl-C     quit

IN, OUT   as the router sees it: what came from the link, what was queued for it
QUEUE     how full it is, and how long its oldest frame waits
LOSS      frames lost on the way to us, by their sequence numbers
RTT ms    how long a question to the other side and its answer take
REF/s     frames refused: queue full, filter, limit, copy, loop";

/// Draws everything.
pub(super) fn draw(app: &App, frame: &mut Frame<'_>) {
    let area = frame.area();
    if area.width < LEAST.0 || area.height < LEAST.1 {
        return frame.render_widget(Paragraph::new("make the window larger"), area);
    }
    let one = Constraint::Length(1);
    let record = app.snapshot().and_then(|snapshot| snapshot.record.as_ref());
    let recorded = Constraint::Length(record.is_some().into());
    let [title, received, sent, recorded, tabs, body, keys] =
        Layout::vertical([one, one, one, recorded, one, Constraint::Fill(1), one]).areas(area);
    draw_title(app, frame, title);
    for (what, sign, colour, area) in
        [(0, "▼ in ", Color::Green, received), (1, "▲ out", Color::Blue, sent)]
    {
        frame.render_widget(total(app, what, sign, colour, area.width), area);
    }
    if let Some(record) = record {
        frame.render_widget(record_line_of(app, record), recorded);
    }
    frame.render_widget(views(app), tabs);
    draw_table(app, frame, body);
    frame.render_widget(foot(app), keys);
    if app.is_helping {
        draw_help(frame, area);
    }
}

fn draw_title(app: &App, frame: &mut Frame<'_>, area: Rect) {
    let (state, style) = match (&app.trouble, app.is_paused) {
        (Some(_), _) => (" RECONNECTING ", colour(app, Color::Red)),
        (None, true) => (" PAUSED ", colour(app, Color::Yellow)),
        (None, false) => (" LIVE ", colour(app, Color::Green)),
    };
    let width = state.len() as u16;
    let [left, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(width)]).areas(area);
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let mut line = Line::from(Span::styled("mavswitch", bold));
    if let Some(it) = app.snapshot() {
        let links: usize = it.endpoints.iter().map(|endpoint| endpoint.links.len()).sum();
        let (version, components) = (&it.program.version, it.components.len());
        line.push_span(format!(
            " {version}  up {}  {}  {}",
            time(it.time_us / 1_000),
            counted(links, "link"),
            counted(components, "component")
        ));
    }
    frame.render_widget(line, left);
    frame.render_widget(Span::styled(state, style.add_modifier(Modifier::REVERSED)), right);
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// A line for all links together, with how it went.
fn total(app: &App, what: u8, sign: &str, hue: Color, width: u16) -> Line<'static> {
    let (frames, octets) = (app.trace(&Key::Total(what)), app.trace(&Key::Total(what + 2)));
    let figures =
        format!("{sign} {:>6} frames/s {:>8}/s ", number(frames.rate()), bytes(octets.rate()));
    let room = usize::from(width).saturating_sub(figures.chars().count()).min(60);
    let bars = Span::styled(frames.bars(room), colour(app, hue));
    Line::from(vec![Span::raw(figures), bars])
}

/// A line for what is recorded: as bright as it is serious.
fn record_line_of(app: &App, record: &RecordStatus) -> Line<'static> {
    let style = match record.state {
        RecordState::Failing => colour(app, Color::Red).add_modifier(Modifier::BOLD),
        _ if record.lost > 0 => colour(app, Color::Yellow),
        RecordState::Recording => colour(app, Color::Green),
        RecordState::Waiting | RecordState::Stopped => Style::new().add_modifier(Modifier::DIM),
    };
    Line::from(vec![Span::styled("● ", style), Span::raw(record_line(record))])
}

fn views(app: &App) -> Line<'static> {
    let mut line = Line::default();
    for (view, digit) in View::ALL.into_iter().zip(1..) {
        let style = if view == app.view { Modifier::REVERSED } else { Modifier::empty() };
        let name = format!(" {digit} {} ", view.name());
        line.push_span(Span::styled(name, Style::new().add_modifier(style)));
    }
    if app.is_typing || !app.filter.is_empty() {
        let cursor = if app.is_typing { "_" } else { "" };
        line.push_span(format!("  /{}{cursor}", app.filter));
    }
    line
}

fn draw_table(app: &App, frame: &mut Frame<'_>, area: Rect) {
    let columns = app.columns();
    let least: u16 = columns.iter().map(|column| column.width + 1).sum();
    let has_bars = area.width >= least + BARS;
    let mut widths: Vec<Constraint> = columns.iter().map(width).collect();
    let mut head: Vec<Cell<'_>> =
        columns.iter().enumerate().map(|(place, column)| title(app, place, column)).collect();
    if has_bars {
        widths.push(Constraint::Length(BARS));
        head.push(Cell::from("LAST MINUTE"));
    }
    let all = rows(app);
    let first = app.scroll.min(all.len().saturating_sub(1));
    // No more than can be seen, with one line for the head.
    let shown = all.into_iter().skip(first).take(usize::from(area.height));
    let lines: Vec<Row<'_>> = shown.map(|row| line(app, row, has_bars)).collect();
    if lines.is_empty() {
        return frame.render_widget(Paragraph::new(nothing(app)), area);
    }
    let bold = Style::new().add_modifier(Modifier::BOLD);
    let table = Table::new(lines, widths).header(Row::new(head).style(bold)).column_spacing(1);
    frame.render_widget(table.flex(Flex::Start), area);
}

/// A figure needs what it needs; texts share what is left.
fn width(column: &table::Column) -> Constraint {
    if column.is_figure { Constraint::Length(column.width) } else { Constraint::Fill(column.width) }
}

fn title(app: &App, place: usize, column: &table::Column) -> Cell<'static> {
    let text = Text::from(column.title);
    let text = if column.is_figure { text.right_aligned() } else { text };
    let style = if app.sort == Some(place) { Modifier::UNDERLINED } else { Modifier::empty() };
    Cell::from(text).style(Style::new().add_modifier(style))
}

fn line(app: &App, row: table::Row, has_bars: bool) -> Row<'static> {
    let figures = app.columns().iter().map(|column| column.is_figure);
    let mut cells: Vec<Cell<'_>> = row
        .cells
        .into_iter()
        .zip(figures)
        .map(|(cell, is_figure)| {
            let text = Text::from(cell.text);
            Cell::from(if is_figure { text.right_aligned() } else { text })
        })
        .collect();
    if has_bars {
        let bars = row.trace.map(|trace| trace.bars(usize::from(BARS))).unwrap_or_default();
        cells.push(Cell::from(bars).style(colour(app, Color::Cyan)));
    }
    let style = match row.tone {
        Tone::Plain => Style::new(),
        Tone::Dim => Style::new().add_modifier(Modifier::DIM),
        Tone::Warn => colour(app, Color::Yellow),
        Tone::Bad => colour(app, Color::Red).add_modifier(Modifier::BOLD),
    };
    Row::new(cells).style(style)
}

fn nothing(app: &App) -> &'static str {
    match (app.snapshot(), app.filter.is_empty(), app.view) {
        (None, ..) => "waiting for the first figures",
        (_, false, _) => "nothing has that; Esc shows all",
        (_, _, View::Links) => "no endpoints",
        (_, _, View::Components) => "nobody was heard yet: no whole, correct frame has arrived",
        (_, _, View::Messages) => "no messages yet",
    }
}

fn foot(app: &App) -> Line<'static> {
    match &app.trouble {
        Some(trouble) => {
            let text = trouble.lines().next().unwrap_or_default();
            Line::styled(printable(text), colour(app, Color::Red))
        }
        None if app.is_typing => Line::from("type what rows must have  Enter done  Esc all rows"),
        None => Line::styled(KEYS, Style::new().add_modifier(Modifier::REVERSED)),
    }
}

fn draw_help(frame: &mut Frame<'_>, area: Rect) {
    let lines = HELP.lines().count() as u16 + 2;
    let width = HELP.lines().map(str::len).max().unwrap_or(0) as u16 + 4;
    let [area] = Layout::horizontal([Constraint::Max(width)]).flex(Flex::Center).areas(area);
    let [area] = Layout::vertical([Constraint::Max(lines)]).flex(Flex::Center).areas(area);
    frame.render_widget(Clear, area);
    let block = Block::bordered().title(" Help: any key closes it ");
    frame.render_widget(Paragraph::new(HELP).block(block), area);
}

/// A style in this colour, where colours are wanted.
fn colour(app: &App, colour: Color) -> Style {
    if app.has_colour { Style::new().fg(colour) } else { Style::new() }
}

#[cfg(test)]
mod tests;
