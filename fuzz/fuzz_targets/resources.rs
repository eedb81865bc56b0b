//! Layouts and charts.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lumencast_fuzz::resources(data));
