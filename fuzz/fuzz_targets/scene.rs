//! The glTF reader, and edits of what it has read; scripts of edits.

#![no_main]

use libfuzzer_sys::fuzz_target;
use lumencast_scene::{Edit, Scene, Script};

fuzz_target!(|data: &[u8]| {
    if let Ok(mut scene) = Scene::from_glb("fuzz", data.to_vec()) {
        scene.snapshot();
        scene.advance(0.3);
        scene.snapshot();
        scene.edits_since_load();
    }
    if let Ok(edit) = serde_json::from_slice::<Edit>(data)
        && let Some(mut scene) = Scene::builtin("cornell")
        && scene.apply(&edit).is_ok()
    {
        scene.snapshot();
        scene.edits_since_load();
    }
    if let Ok(text) = std::str::from_utf8(data)
        && let Ok(script) = Script::parse(text)
    {
        script.due(0.0, 1.0).count();
    }
});
