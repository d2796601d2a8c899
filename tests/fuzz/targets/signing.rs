//! Signs, checks and bends whatever frame the bytes can be made into.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::mavlink::fuzz_signing(data));
