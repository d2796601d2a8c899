//! Any operations on a transmit queue, beside a plain vector.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::routing::fuzz_queue(data));
