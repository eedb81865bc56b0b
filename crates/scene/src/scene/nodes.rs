//! The tree of nodes.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DAffine3, Vec3};

use crate::asset::Skin;
use crate::trs::{Trs, is_in_world};
use crate::{MeshId, NodeId, PunctualLight};

/// A node of the scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) parent: Option<NodeId>,
    pub(crate) children: Vec<NodeId>,
    pub(crate) parent_from_node: Trs,
    pub(crate) mesh: Option<MeshId>,
    /// Transforms at which the mesh is shown, relative to the node. Where absent, it is shown once,
    /// at the node.
    pub(crate) instances: Option<Arc<[DAffine3]>>,
    pub(crate) skin: Option<PlacedSkin>,
    pub(crate) light: Option<PunctualLight>,
    /// Index of the model, and index of the camera in it.
    pub(crate) camera: Option<(usize, u32)>,
    /// Whether the node and all below it are hidden: neither drawn nor giving light.
    pub(crate) hidden: bool,
    /// Whether an animation of its file moves it.
    pub(crate) animated: bool,
    /// Morph weights, one for each target of the mesh.
    pub(crate) weights: Vec<f32>,
}

/// A skin whose joints are nodes of the scene.
#[derive(Clone, Debug)]
pub(crate) struct PlacedSkin {
    pub(crate) skin: Arc<Skin>,
    /// Number of the node that is the file's node 0.
    pub(crate) first_node: u32,
}

/// Nodes by number, and the roots of the drawn trees. A node that is in none of these trees is
/// known but not drawn; glTF files can hold such nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Nodes {
    nodes: BTreeMap<NodeId, Node>,
    roots: Vec<NodeId>,
    /// The next free number; numbers are never reused.
    next: u32,
    /// Number of instances of all nodes.
    instances: usize,
    /// The world position that transforms are relative to.
    origin: Vec3,
}

impl Node {
    fn instance_count(&self) -> usize {
        self.instances.as_ref().map_or(0, |instances| instances.len())
    }

    /// Numbers and transforms at which the mesh is shown, given the node's: one, or one for each
    /// instance whose transform is within the world.
    pub(crate) fn places(&self, node: &DAffine3) -> impl Iterator<Item = (u32, DAffine3)> {
        let once = self.instances.is_none().then_some((0, *node));
        let instances = self.instances.as_deref().unwrap_or_default();
        let placed = (0..).zip(instances).map(move |(copy, place)| (copy, *node * *place));
        once.into_iter().chain(placed.filter(|(_, place)| is_in_world(&place.as_affine3a())))
    }
}

impl Nodes {
    /// Number of nodes and instances.
    pub(crate) fn size(&self) -> usize {
        self.nodes.len() + self.instances
    }

    pub(crate) fn next(&self) -> u32 {
        self.next
    }

    pub(crate) fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Sets the world position that transforms are relative to.
    pub(crate) fn set_origin(&mut self, origin: Vec3) {
        self.origin = origin;
    }

    /// The world's transform, relative to the origin.
    fn place_of_world(&self) -> DAffine3 {
        DAffine3::from_translation(-self.origin.as_dvec3())
    }

    pub(crate) fn get(&self, id: NodeId) -> Option<&Node> {
        self.nodes.get(&id)
    }

    pub(crate) fn get_mut(&mut self, id: NodeId) -> Option<&mut Node> {
        self.nodes.get_mut(&id)
    }

    pub(crate) fn contains(&self, id: NodeId) -> bool {
        self.nodes.contains_key(&id)
    }

    /// Nodes in ascending order of numbers.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.nodes.iter().map(|(id, node)| (*id, node))
    }

    /// Inserts a node whose parent and children are set.
    pub(crate) fn insert(&mut self, id: NodeId, node: Node) {
        self.next = self.next.max(id.0.saturating_add(1));
        self.instances += node.instance_count();
        self.nodes.insert(id, node);
    }

    pub(crate) fn add_root(&mut self, id: NodeId) {
        self.roots.push(id);
    }

    /// Inserts a node below its parent, or at the top.
    pub(crate) fn attach(&mut self, id: NodeId, node: Node) {
        match node.parent.and_then(|parent| self.nodes.get_mut(&parent)) {
            Some(parent) => parent.children.push(id),
            None => self.roots.push(id),
        }
        self.insert(id, node);
    }

    /// A node and all nodes below it, parents first.
    pub(crate) fn subtree(&self, id: NodeId) -> Vec<NodeId> {
        let mut found = vec![id];
        let mut at = 0;
        while let Some(node) = found.get(at) {
            if let Some(node) = self.nodes.get(node) {
                found.extend_from_slice(&node.children);
            }
            at += 1;
        }
        found
    }

    /// Removes a node and all nodes below it.
    pub(crate) fn remove(&mut self, id: NodeId) {
        let parent = self.nodes.get(&id).and_then(|n| n.parent);
        let siblings = match parent.and_then(|parent| self.nodes.get_mut(&parent)) {
            Some(parent) => &mut parent.children,
            None => &mut self.roots,
        };
        siblings.retain(|sibling| *sibling != id);
        for node in self.subtree(id) {
            let removed = self.nodes.remove(&node);
            self.instances -= removed.map_or(0, |node| node.instance_count());
        }
    }

    /// A node's transform, relative to the origin.
    pub(crate) fn place_of(&self, id: NodeId) -> DAffine3 {
        let mut place = DAffine3::IDENTITY;
        let mut at = Some(id);
        while let Some(node) = at.and_then(|id| self.nodes.get(&id)) {
            place = node.parent_from_node.precise() * place;
            at = node.parent;
        }
        self.place_of_world() * place
    }

    /// The drawn trees' nodes, parents first, with their transforms.
    pub(crate) fn placed(&self) -> Vec<(NodeId, &Node, DAffine3)> {
        self.placed_below(self.tops(), |_| true)
    }

    /// Those nodes that are neither hidden nor below a hidden node.
    pub(crate) fn shown(&self) -> Vec<(NodeId, &Node, DAffine3)> {
        self.placed_below(self.tops(), |node| !node.hidden)
    }

    /// The roots, with the transform that they are placed in.
    fn tops(&self) -> impl Iterator<Item = (NodeId, DAffine3)> {
        self.roots.iter().map(|root| (*root, self.place_of_world()))
    }

    /// A node and all nodes below it, parents first, with their transforms.
    pub(crate) fn placed_from(&self, id: NodeId) -> Vec<(NodeId, &Node, DAffine3)> {
        let parent = self.nodes.get(&id).and_then(|n| n.parent);
        let place = parent.map_or(self.place_of_world(), |parent| self.place_of(parent));
        self.placed_below([(id, place)].into_iter(), |_| true)
    }

    fn placed_below(
        &self,
        tops: impl Iterator<Item = (NodeId, DAffine3)>,
        wanted: impl Fn(&Node) -> bool,
    ) -> Vec<(NodeId, &Node, DAffine3)> {
        let mut placed = Vec::with_capacity(self.nodes.len());
        let mut open: Vec<_> = tops.collect();
        open.reverse();
        while let Some((id, parent)) = open.pop() {
            let Some(node) = self.nodes.get(&id).filter(|node| wanted(node)) else { continue };
            let place = parent * node.parent_from_node.precise();
            placed.push((id, node, place));
            open.extend(node.children.iter().rev().map(|child| (*child, place)));
        }
        placed
    }
}
