//! Any requests to simulated vehicles.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| mavswitch::sim::fuzz_sim(data));
