//! Anything told to the program's own component.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::own::fuzz_own(data));
