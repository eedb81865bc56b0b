//! Files that edits name, read beside the tick.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::{io, thread};

use lumencast_scene::{Edit, FileRead, FileToRead};

use crate::tick::Tick;

/// Reads files one after the other, on a thread of its own. A client's edits wait for the first of
/// them that names a file, so that each client has at most one file here.
#[derive(Debug)]
pub(crate) struct Loader {
    to_read: Sender<FileToRead>,
    read: Receiver<FileRead>,
    /// Files that are waited for: as edits write them, and by their names.
    awaited: BTreeMap<String, String>,
}

impl Loader {
    /// A loader whose thread ends with it, but for the file that it is reading: nobody waits for
    /// that one.
    pub(crate) fn start() -> io::Result<Self> {
        let (to_read, asked) = channel::<FileToRead>();
        let (answer, read) = channel();
        let body = move || {
            for file in asked {
                tracing::info!(file = file.name(), "an edit names a file, which is read");
                if answer.send(file.read()).is_err() {
                    return;
                }
            }
        };
        thread::Builder::new().name("loader".into()).spawn(body)?;
        Ok(Self { to_read, read, awaited: BTreeMap::new() })
    }

    /// Hands over one file that has been read: the edits that name it are to be applied next.
    pub(crate) fn deliver(&mut self, tick: &mut Tick) {
        if let Ok(file) = self.read.try_recv() {
            self.awaited.retain(|_, name| name != file.name());
            tick.take_in(file);
        }
    }

    /// Whether an edit can be applied without reading anything. If not, its file will be read.
    pub(crate) fn is_ready(&mut self, tick: &Tick, edit: &Edit) -> bool {
        let Some(uri) = edit.file() else { return true };
        if self.awaited.contains_key(uri) {
            return false;
        }
        let Some(file) = tick.scene().file_to_read(edit) else { return true };
        let name = file.name().to_owned();
        let is_new = !self.awaited.values().any(|awaited| *awaited == name);
        self.awaited.insert(uri.to_owned(), name);
        // Where its thread has died, the tick reads the file.
        is_new && self.to_read.send(file).is_err()
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use lumencast_codec::Epoch;
    use lumencast_gather::path_trace::{CpuPathTracer, Options};
    use lumencast_scene::{InstanceSource, Scene, Transform};

    use super::*;
    use crate::tick::TickOptions;

    fn add(file: &str) -> Edit {
        let (node, parent, transform) = (None, None, Transform::default());
        Edit::AddInstance {
            node,
            name: None,
            source: InstanceSource::File(file.into()),
            parent,
            transform,
        }
    }

    /// A tick of a scene in a folder of its own, with another model and a broken one beside it.
    fn tick(folder: &std::path::Path) -> Tick {
        std::fs::create_dir_all(folder).expect("a folder");
        let cornell = Scene::builtin("cornell").expect("built in");
        let lumencast_scene::FileContents::Bytes(glb) = &cornell.files()[0].contents else {
            panic!("built-in scenes are in memory");
        };
        for name in ["scene.glb", "more.glb"] {
            std::fs::write(folder.join(name), glb).expect("a file");
        }
        std::fs::write(folder.join("broken.glb"), "broken").expect("a file");
        let scene = Scene::load(&folder.join("scene.glb")).expect("a scene");
        let tracer = CpuPathTracer::new(Options::default()).expect("threads");
        Tick::new(scene, Box::new(tracer), TickOptions::default(), Epoch(1)).expect("a tick")
    }

    #[test]
    fn files_are_read_once_and_nothing_waits_in_the_tick() {
        let folder = std::env::temp_dir().join(format!("lumencast-loader-{}", std::process::id()));
        let mut tick = tick(&folder);
        let mut loader = Loader::start().expect("a thread");
        let edits = ["more.glb", "./more.glb", ".//more.glb", "broken.glb"].map(add);
        assert!(loader.is_ready(&tick, &add("../outside.glb")), "to be refused at once");
        for _ in 0..2 {
            let ready = edits.each_ref().map(|edit| loader.is_ready(&tick, edit));
            assert_eq!(ready, [false; 4], "until it is delivered");
        }
        let began = Instant::now();
        while !edits.iter().all(|edit| loader.is_ready(&tick, edit)) {
            assert!(began.elapsed() < Duration::from_secs(60), "{loader:?}");
            loader.deliver(&mut tick);
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(loader.awaited.is_empty());
        assert!(loader.read.try_recv().is_err(), "each was read once");
        std::fs::remove_dir_all(&folder).expect("removed");
        assert!(tick.scene().file_to_read(&edits[0]).is_none());
    }
}
