//! The splitter as a program, for tests in other languages: bytes in, frames out.
//!
//! Each frame on standard output: its length (two bytes, little-endian), whether its check was a
//! full one (one byte), and the frame.

use std::io::{Read, Write, stdin, stdout};

use mavswitch::mavlink::{Checker, Dialect, Input, Splitter};

/// How much is read at once: an odd number, so that frames are cut everywhere.
const READ: usize = 4_093;

fn main() -> std::io::Result<()> {
    let (mut input, mut output) = (stdin().lock(), std::io::BufWriter::new(stdout().lock()));
    let (mut splitter, mut checker) = (Splitter::new(), Checker::new(Dialect::builtin()));
    let mut buffer = vec![0; Splitter::CARRY + READ];
    loop {
        let received = input.read(&mut buffer[Splitter::CARRY..])?;
        // The end of the input is a pause: what stands behind an unfinished frame comes out yet.
        let pause = if received == 0 { Input::Paused } else { Input::Flowing };
        let mut cutter = splitter.cut(&mut buffer, received, pause);
        while let Some(frame) = cutter.next(&mut checker) {
            let [low, high] = u16::try_from(frame.bytes.len()).unwrap_or(u16::MAX).to_le_bytes();
            output.write_all(&[low, high, u8::from(frame.verified)])?;
            output.write_all(frame.bytes)?;
        }
        if received == 0 {
            return output.flush();
        }
    }
}
