//! Any operations on a router, beside what must be true of all of them.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::routing::fuzz_router(data));
