//! Catalogs, state frames and edits.

#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| lumencast_fuzz::frames(data));
