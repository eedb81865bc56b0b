//! Nodes that go when those who edit them have gone.

use std::collections::{BTreeMap, BTreeSet};

use lumencast_scene::{Edit, NodeId};

/// The nodes that clients have added for as long as they are there, and who has edited each.
#[derive(Debug, Default)]
pub(crate) struct Temporary {
    editors: BTreeMap<NodeId, BTreeSet<String>>,
}

impl Temporary {
    /// Takes note of an edit that was applied. Whoever edits a temporary node keeps it.
    pub(crate) fn edited(&mut self, client: &str, edit: &Edit, is_temporary: bool) {
        match edit {
            Edit::AddInstance { node: Some(node), .. }
            | Edit::AddLight { node: Some(node), .. }
                if is_temporary =>
            {
                self.editors.insert(*node, BTreeSet::from([client.to_owned()]));
            }
            Edit::RemoveNode { node } => drop(self.editors.remove(node)),
            Edit::MoveNode { node, .. }
            | Edit::SetLight { node, .. }
            | Edit::RemoveLight { node } => {
                if let Some(editors) = self.editors.get_mut(node) {
                    editors.insert(client.to_owned());
                }
            }
            _ => {}
        }
    }

    /// The nodes that a client was the last to keep.
    pub(crate) fn left_by(&mut self, client: &str) -> Vec<NodeId> {
        for editors in self.editors.values_mut() {
            editors.remove(client);
        }
        self.editors.extract_if(.., |_, editors| editors.is_empty()).map(|(node, _)| node).collect()
    }
}

#[cfg(test)]
mod tests {
    use lumencast_scene::Transform;

    use super::*;

    fn added(node: u32) -> Edit {
        let (parent, transform) = (None, Transform::default());
        let source = lumencast_scene::InstanceSource::Mesh(lumencast_scene::MeshId(0));
        Edit::AddInstance { node: Some(NodeId(node)), name: None, source, parent, transform }
    }

    #[test]
    fn nodes_go_with_their_last_editor() {
        let mut temporary = Temporary::default();
        let moved = |node| Edit::MoveNode { node: NodeId(node), transform: Transform::default() };
        temporary.edited("a", &added(1), true);
        temporary.edited("a", &added(2), true);
        temporary.edited("a", &added(3), false);
        temporary.edited("a", &added(4), true);
        temporary.edited("b", &moved(2), false);
        temporary.edited("b", &moved(3), true);
        temporary.edited("b", &Edit::RemoveNode { node: NodeId(4) }, false);
        assert_eq!(temporary.left_by("c"), []);
        assert_eq!(temporary.left_by("a"), [NodeId(1)]);
        assert_eq!(temporary.left_by("b"), [NodeId(2)]);
        assert_eq!(temporary.left_by("b"), []);
    }
}
