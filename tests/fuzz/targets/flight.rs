//! Any steps of a vehicle that sends its log, and of whoever wants it.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::record::fuzz_flight(data));
