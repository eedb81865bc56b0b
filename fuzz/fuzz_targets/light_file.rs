//! Saved light fields.

#![no_main]

use libfuzzer_sys::fuzz_target;
use lumencast_cache::Cache;
use lumencast_codec::LightFile;

fuzz_target!(|data: &[u8]| {
    if let Ok(file) = LightFile::read(data) {
        LightFile::read(&file.write()).expect("what was written");
        drop(file.volumes());
        drop(Cache::new().load(data, 0.0));
    }
});
