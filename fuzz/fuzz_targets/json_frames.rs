//! Catalogs, state frames and edits; what is accepted is accepted again after encoding.

#![no_main]

use libfuzzer_sys::fuzz_target;
use lumencast_cache::Cache;
use lumencast_codec::{Catalog, ClientEdit, StateFrame};

fuzz_target!(|data: &[u8]| {
    if let Ok(catalog) = Catalog::decode(data) {
        Catalog::decode(&catalog.encode()).expect("what was encoded");
        let mut cache = Cache::new();
        cache.catalog(data, 0.0).expect("what decodes is taken in");
    }
    if let Ok(frame) = StateFrame::decode(data) {
        StateFrame::decode(&frame.encode()).expect("what was encoded");
    }
    if let Ok(edit) = ClientEdit::decode(data) {
        ClientEdit::decode(&edit.encode()).expect("what was encoded");
    }
});
