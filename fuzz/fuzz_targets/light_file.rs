//! Saved light.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lumencast_fuzz::light_file(data));
