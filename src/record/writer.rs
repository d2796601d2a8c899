//! The writer: a thread of its own that does everything with files that may take its time.
//!
//! It writes what comes in portions, has it put on the disk each second, and sleeps while nothing
//! comes. When it cannot write it says so once, forgets what it is given and counts it, and tries
//! again each second, whether anything comes or not: nobody hands over a flight-stack log meanwhile.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering, fence};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use tracing::{info, warn};

use super::feed::{Drain, Kind, Piece};
use super::flight_files::FlightFiles;
use super::output::Output;
use super::status::{RecordState, RecordStatus, Shared};
use super::store::Store;
use crate::mavlink::{Frame, MAX_FRAME, unsigned};

/// How often what was written is put on the disk, and how often what failed is tried again.
const PERIOD: Duration = Duration::from_secs(1);

/// How many pieces are taken before files are looked after again.
const PIECES: usize = 50_000;

/// How often it is told that the disk is too slow.
const TELL: Duration = Duration::from_secs(10);

/// The writer; see the module.
pub(super) struct Writer {
    drain: Drain,
    shared: Arc<Shared>,
    files: Files,
    /// How many frames had overflowed when that was last told, and when that was.
    told: (u64, Option<Instant>),
}

/// What is being written.
struct Files {
    store: Store,
    output: Option<Output>,
    flights: FlightFiles,
    status: RecordStatus,
    /// What was lost when it began to fail.
    lost_before: u64,
    /// When it is tried again.
    again: Option<Instant>,
    /// The slots of flight-stack logs that broke off, as bits, until that is told.
    broken: u32,
}

impl Writer {
    pub(super) fn new(drain: Drain, shared: Arc<Shared>, store: Store) -> Self {
        let files = Files {
            flights: FlightFiles::default(),
            store,
            output: None,
            status: RecordStatus::default(),
            lost_before: 0,
            again: None,
            broken: 0,
        };
        Self { drain, shared, files, told: (0, None) }
    }

    /// Works until it is told to end.
    pub(super) fn run(mut self) {
        loop {
            let is_ending = self.shared.is_ending.load(Ordering::Acquire);
            let taken = self.work();
            if is_ending && taken == 0 {
                break;
            }
            if taken < PIECES {
                self.rest(taken > 0);
            }
        }
        self.files.close();
        self.shared.set_status(self.files.status);
    }

    /// Waits for the next second if there is something to do then, or for as long as nothing comes.
    fn rest(&self, has_worked: bool) {
        if has_worked || self.files.is_failing() {
            if !self.shared.is_ending.load(Ordering::Acquire) {
                thread::park_timeout(PERIOD);
            }
            return;
        }
        self.shared.is_asleep.store(true, Ordering::Relaxed);
        // Either this sees what has come meanwhile, or who brings it sees that this sleeps.
        fence(Ordering::SeqCst);
        if self.drain.is_empty() && !self.shared.is_ending.load(Ordering::Acquire) {
            thread::park();
        }
        self.shared.is_asleep.store(false, Ordering::Relaxed);
    }

    /// Takes what waits, a bounded number of pieces; says how many there were.
    fn work(&mut self) -> usize {
        let mut taken = 0;
        while taken < PIECES
            && let Some(piece) = self.drain.next_piece()
        {
            self.files.handle(&piece);
            taken += 1;
        }
        let has_failed = self.files.is_failing();
        if taken > 0 {
            self.files.look_after();
            self.tell_overflow();
        }
        if taken > 0 || has_failed {
            self.files.try_again();
            self.tell();
        }
        taken
    }

    /// Tells the loop how it is getting on.
    fn tell(&mut self) {
        let broken = std::mem::take(&mut self.files.broken);
        self.shared.broken.fetch_or(broken, Ordering::Relaxed);
        self.shared.is_failing.store(self.files.is_failing(), Ordering::Relaxed);
        self.shared.set_status(self.files.status.clone());
    }

    fn tell_overflow(&mut self) {
        let overflowed = load(&self.shared.overflowed);
        let (before, at) = self.told;
        if overflowed > before && at.is_none_or(|at| at.elapsed() >= TELL) {
            let lost = overflowed - before;
            warn!("{lost} frames were not recorded: the disk is slower than the traffic");
            self.told = (overflowed, Some(Instant::now()));
        }
    }
}

fn load(counter: &AtomicU64) -> u64 {
    counter.load(Ordering::Relaxed)
}

impl Files {
    fn is_failing(&self) -> bool {
        self.status.state == RecordState::Failing
    }

    fn handle(&mut self, piece: &Piece<'_>) {
        match piece.kind {
            Kind::Frame => self.handle_frame(piece),
            Kind::FirstFrame => {
                self.end_log();
                self.handle_frame(piece);
            }
            Kind::End => {
                self.end_log();
                self.tell_idle();
            }
            Kind::OpenFlight => self.flights.open(piece.slot, piece.bytes),
            Kind::Flight => self.handle_flight(piece),
            Kind::EndFlight => {
                if let Err(error) = self.flights.close(piece.slot) {
                    self.fail(0, &error);
                }
                self.tell_idle();
            }
        }
    }

    /// A log has ended: perhaps it was the last.
    fn tell_idle(&mut self) {
        if !self.is_failing() && self.output.is_none() && self.flights.paths().next().is_none() {
            self.status.state = RecordState::Waiting;
        }
    }

    fn handle_flight(&mut self, piece: &Piece<'_>) {
        if !self.flights.is_open(piece.slot) {
            return;
        }
        if !self.may_try() {
            self.broken |= self.flights.forget_unbegun(piece.slot);
            return;
        }
        match self.flights.write(&self.store, piece) {
            Ok(is_new) => {
                self.status.bytes += piece.bytes.len() as u64;
                self.status.files += u64::from(is_new);
                self.recover();
            }
            Err(error) => {
                self.fail(0, &error);
                self.broken |= self.flights.forget_unbegun(piece.slot);
            }
        }
    }

    /// Tries whether it works again, if it is time to.
    fn try_again(&mut self) {
        if !self.is_failing() || !self.may_try() {
            return;
        }
        self.broken |= self.flights.forget_vanished();
        match self.store.try_out() {
            Ok(()) => {
                self.recover();
                self.tell_files();
                self.tell_idle();
            }
            Err(error) => self.fail(0, &error),
        }
    }

    /// Whether writing may be tried: always, unless it has failed within the last second, or fails
    /// for want of room.
    fn may_try(&mut self) -> bool {
        let Some(again) = self.again else { return true };
        if Instant::now() < again {
            return false;
        }
        if let Err(error) = self.make_room() {
            self.fail(0, &error);
            return false;
        }
        self.again = None;
        true
    }

    fn make_room(&self) -> io::Result<()> {
        let mut open: Vec<_> = self.flights.paths().map(|(_, path)| path).collect();
        open.extend(self.output.as_ref().map(Output::path));
        // What does not exist takes no room, and is made when it is needed.
        if !self.store.dir.exists() { Ok(()) } else { self.store.make_room(&open) }
    }

    fn handle_frame(&mut self, piece: &Piece<'_>) {
        if !self.may_try() {
            self.status.lost += 1;
            return;
        }
        if self.output.is_none()
            && let Err(error) = self.begin_log()
        {
            return self.fail(1, &error);
        }
        let Some(output) = &mut self.output else { return };
        let mut bytes = [0; MAX_FRAME];
        // A piece of this kind is one frame.
        let Ok(frame) = Frame::parse(piece.bytes) else { return };
        if output.add(piece.number, unsigned(&frame, &mut bytes)) {
            self.write();
        }
    }

    fn begin_log(&mut self) -> io::Result<()> {
        let (file, path) = self.store.create("tlog", SystemTime::now())?;
        info!("recording to {}", path.display());
        self.status.files += 1;
        self.output = Some(Output::new(file, path));
        Ok(())
    }

    fn end_log(&mut self) {
        self.write();
        self.sync();
        self.output = None;
        self.tell_files();
    }

    /// Which files are being written.
    fn tell_files(&mut self) {
        self.status.file = self.output.as_ref().map(|output| output.path().to_owned());
        self.status.file_bytes = self.output.as_ref().map_or(0, Output::len);
        self.status.flight_files =
            self.flights.paths().map(|(slot, path)| (slot, path.to_owned())).collect();
    }

    /// Writes what the log has taken.
    fn write(&mut self) {
        match self.output.as_mut().map(Output::write) {
            None | Some(Ok((0, _))) => {}
            Some(Ok((frames, bytes))) => {
                self.status.frames += frames;
                self.status.bytes += bytes;
                self.recover();
            }
            Some(Err((frames, error))) => self.fail(frames, &error),
        }
    }

    fn sync(&mut self) {
        if let Some(Err(error)) = self.output.as_ref().map(Output::sync) {
            self.fail(0, &error);
        }
        if let Err(error) = self.flights.sync() {
            self.fail(0, &error);
        }
    }

    /// Writes everything, has it put on the disk, and sees that there is room and the files are still
    /// there.
    fn look_after(&mut self) {
        self.write();
        self.sync();
        if let Some(output) = self.output.take_if(|output| !output.is_there()) {
            warn!("record {} has vanished: beginning another", output.path().display());
        }
        self.broken |= self.flights.forget_vanished();
        if let Err(error) = self.make_room() {
            self.fail(0, &error);
        }
        self.tell_files();
    }

    /// So many frames could not be written.
    fn fail(&mut self, frames: u64, error: &io::Error) {
        if !self.is_failing() {
            let dir = self.store.dir.display();
            warn!("cannot record to {dir}: {error}; trying again each second ({})", remedy(error));
            self.lost_before = self.status.lost;
        }
        self.status.lost += frames;
        self.status.state = RecordState::Failing;
        self.status.error = Some(error.to_string());
        self.again = Some(Instant::now() + PERIOD);
        // A full card may have room again; anything else needs another file.
        if !is_full(error)
            && let Some(output) = self.output.take()
        {
            self.status.lost += output.waiting();
        }
    }

    /// Something was written.
    fn recover(&mut self) {
        if self.is_failing() {
            let lost = self.status.lost - self.lost_before;
            info!("recording again: {lost} frames were lost meanwhile");
        }
        self.status.state = RecordState::Recording;
        self.status.error = None;
        self.again = None;
    }

    fn close(&mut self) {
        self.end_log();
        self.flights.close_all();
        self.tell_files();
        self.status.state = RecordState::Waiting;
    }
}

fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "make room, or see record_min_free and record_max_files"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "may this user write there?"
        }
        _ => "is the disk there?",
    }
}
