//! What catalogs name by hash, also for those that read them late.

use std::collections::HashMap;

use bytes::Bytes;
use lumencast_codec::{Resource, ResourceHash};

/// Sets that can be had, the newest among them. A client may read a catalog that others have replaced
/// already, and asks for what that one names.
const SETS: u64 = 32;

/// Resources by hash: those of the newest set and of the sets that it replaced most recently.
#[derive(Debug, Default)]
pub(crate) struct Resources {
    /// The number of the newest set.
    newest: u64,
    /// Bytes, and the number of the last set that has them.
    known: HashMap<ResourceHash, (Bytes, u64)>,
}

impl Resources {
    /// Resources that the first catalog names.
    pub(crate) fn new(set: Vec<Resource>) -> Self {
        let mut resources = Self::default();
        resources.replace(set);
        resources
    }

    /// Takes what the next catalog names.
    pub(crate) fn replace(&mut self, set: Vec<Resource>) {
        self.newest += 1;
        for resource in set {
            self.known.insert(resource.hash(), (resource.into_bytes().into(), self.newest));
        }
        self.known.retain(|_, (_, last)| *last + SETS > self.newest);
    }

    /// The bytes of one, where it can still be had.
    pub(crate) fn get(&self, hash: ResourceHash) -> Option<Bytes> {
        self.known.get(&hash).map(|(bytes, _)| bytes.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resources_stay_while_someone_may_read_their_catalog() {
        let resource = |name: &str| Resource::new(name.into());
        let hash = |name: &str| resource(name).hash();
        let mut resources = Resources::new(vec![resource("charts"), resource("layout 0")]);
        for set in 1..=SETS {
            assert!(resources.get(hash("layout 0")).is_some(), "after {set} sets");
            let layout = resource(&format!("layout {set}"));
            resources.replace(vec![resource("charts"), layout.clone()]);
            assert_eq!(resources.get(layout.hash()).as_deref(), Some(layout.bytes()));
        }
        assert_eq!(resources.get(hash("layout 0")), None);
        assert!(resources.get(hash("layout 1")).is_some());
        assert!(resources.get(hash("charts")).is_some());
    }
}
