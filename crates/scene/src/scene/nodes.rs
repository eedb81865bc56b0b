//! The tree of nodes.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Affine3A;

use crate::asset::Skin;
use crate::trs::Trs;
use crate::{Light, MeshId, NodeId};

/// A node of the scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Node {
    pub(crate) name: String,
    pub(crate) parent: Option<NodeId>,
    pub(crate) children: Vec<NodeId>,
    pub(crate) parent_from_node: Trs,
    pub(crate) mesh: Option<MeshId>,
    pub(crate) skin: Option<PlacedSkin>,
    pub(crate) light: Option<Light>,
    /// Model and index of its camera.
    pub(crate) camera: Option<(usize, u32)>,
    /// Morph weights, one a target of the mesh.
    pub(crate) weights: Vec<f32>,
}

/// A skin whose joints are nodes of the scene.
#[derive(Clone, Debug)]
pub(crate) struct PlacedSkin {
    pub(crate) skin: Arc<Skin>,
    /// The number of the node that is the file's node 0.
    pub(crate) first_node: u32,
}

/// Nodes by number, and the roots of what is drawn. A node that is neither a root nor below one is
/// known but not drawn (glTF files can hold such).
#[derive(Clone, Debug, Default)]
pub(crate) struct Nodes {
    nodes: BTreeMap<NodeId, Node>,
    roots: Vec<NodeId>,
    /// The next free number; numbers are never used twice.
    next: u32,
}

impl Nodes {
    pub(crate) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn next(&self) -> u32 {
        self.next
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

    /// In order of their numbers.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (NodeId, &Node)> {
        self.nodes.iter().map(|(id, node)| (*id, node))
    }

    /// Puts a node in, with its parent and children as it names them.
    pub(crate) fn insert(&mut self, id: NodeId, node: Node) {
        self.next = self.next.max(id.0.saturating_add(1));
        self.nodes.insert(id, node);
    }

    pub(crate) fn add_root(&mut self, id: NodeId) {
        self.roots.push(id);
    }

    /// Puts a node in below another, or at the top.
    pub(crate) fn attach(&mut self, id: NodeId, node: Node) {
        match node.parent.and_then(|parent| self.nodes.get_mut(&parent)) {
            Some(parent) => parent.children.push(id),
            None => self.roots.push(id),
        }
        self.insert(id, node);
    }

    /// A node with all below it, parents first.
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

    /// Takes a node with all below it out.
    pub(crate) fn remove(&mut self, id: NodeId) {
        let parent = self.nodes.get(&id).and_then(|n| n.parent);
        let siblings = match parent.and_then(|parent| self.nodes.get_mut(&parent)) {
            Some(parent) => &mut parent.children,
            None => &mut self.roots,
        };
        siblings.retain(|sibling| *sibling != id);
        for node in self.subtree(id) {
            self.nodes.remove(&node);
        }
    }

    pub(crate) fn world_from_node(&self, id: NodeId) -> Affine3A {
        let mut world = Affine3A::IDENTITY;
        let mut at = Some(id);
        while let Some(node) = at.and_then(|id| self.nodes.get(&id)) {
            world = node.parent_from_node.affine() * world;
            at = node.parent;
        }
        world
    }

    /// Nodes that are drawn, parents first, with their place in the world.
    pub(crate) fn placed(&self) -> Vec<(NodeId, &Node, Affine3A)> {
        self.placed_below(self.roots.iter().map(|root| (*root, Affine3A::IDENTITY)))
    }

    /// A node and all below it, parents first, with their place in the world.
    pub(crate) fn placed_from(&self, id: NodeId) -> Vec<(NodeId, &Node, Affine3A)> {
        let parent = self.nodes.get(&id).and_then(|n| n.parent);
        let world = parent.map_or(Affine3A::IDENTITY, |parent| self.world_from_node(parent));
        self.placed_below([(id, world)].into_iter())
    }

    fn placed_below(
        &self,
        tops: impl Iterator<Item = (NodeId, Affine3A)>,
    ) -> Vec<(NodeId, &Node, Affine3A)> {
        let mut placed = Vec::with_capacity(self.nodes.len());
        let mut open: Vec<_> = tops.collect();
        open.reverse();
        while let Some((id, world_from_parent)) = open.pop() {
            let Some(node) = self.nodes.get(&id) else { continue };
            let world = world_from_parent * node.parent_from_node.affine();
            placed.push((id, node, world));
            open.extend(node.children.iter().rev().map(|child| (*child, world)));
        }
        placed
    }
}
