//! A server without a network, at its own pace, and the edit that measurements of live light make.

use std::time::{Duration, Instant};

use anyhow::Result;
use glam::{Affine3A, Quat, Vec3};
use lumencast_codec::Epoch;
use lumencast_gather::Gather;
use lumencast_light::Light;
use lumencast_scene::{Aabb, Edit, LightKind, NodeId, NodeInfo, Scene, Transform};
use lumencast_server::{Beat, Mail, Outlet, Received, Report, Tick, TickOptions};

use super::Nobody;

/// A server's tick waits for light as long.
const PATIENCE: Duration = Duration::from_millis(200);
/// A light moves by so much of the scene's diagonal, and at most by so much of the way to its middle.
const STEP: f32 = 0.1;
const MOST: f32 = 0.5;
/// A light without a place turns by so much, radians.
const TURN: f32 = 0.26;

/// A scene that is cast.
pub(super) struct Cast {
    pub(super) tick: Tick,
    beat: Beat,
    start: Instant,
    seq: u64,
}

impl Cast {
    pub(super) fn new(
        scene: Scene,
        gatherer: Box<dyn Gather>,
        options: TickOptions,
    ) -> Result<Self> {
        let beat = Beat::new(options.period, 0.0);
        let tick = Tick::new(scene, gatherer, options, Epoch(0))?;
        Ok(Self { tick, beat, start: Instant::now(), seq: 0 })
    }

    /// Seconds since the beginning.
    pub(super) fn now(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// One tick at `scene_now`.
    pub(super) fn step(&mut self, scene_now: f64, mail: Mail, outlet: &mut dyn Outlet) -> Report {
        self.beat.start(self.now());
        self.tick.step_within(scene_now, mail, outlet, PATIENCE)
    }

    /// Waits until the next tick is due.
    pub(super) fn rest(&self) {
        std::thread::sleep(Duration::from_secs_f64(self.beat.wait(self.now())));
    }

    /// So many seconds of a scene whose time stands still, which begin with edits. `seen` is given the
    /// light of each tick, and the seconds since they began.
    pub(super) fn go_on(
        &mut self,
        edits: &[Edit],
        seconds: f64,
        mut seen: impl FnMut(&Light, f64),
    ) {
        let began = self.now();
        let mut mail = Mail::default();
        for edit in edits {
            self.seq += 1;
            let (client, edit) = ("bench".into(), edit.clone());
            mail.edits.push(Received { client, seq: self.seq, edit, temporary: false });
        }
        while self.now() - began <= seconds {
            self.step(0.0, std::mem::take(&mut mail), &mut Nobody { watches: true });
            seen(self.tick.light(), self.now() - began);
            self.rest();
        }
    }
}

/// The edit that moves the first light of a scene a part of the way to the scene's middle, or turns it
/// where it stands nowhere.
pub(super) fn moved_light(scene: &Scene) -> Option<Edit> {
    let Aabb { min, max } = scene.bounds();
    let nodes: Vec<NodeInfo<'_>> = scene.nodes().collect();
    let node = nodes.iter().find(|node| node.light.is_some())?;
    let (translation, rotation) = (node.transform.translation?, node.transform.rotation?);
    let transform = match node.light?.kind {
        LightKind::Directional { .. } => {
            let rotation = Some(rotation * Quat::from_rotation_x(TURN));
            Transform { rotation, ..Transform::default() }
        }
        _ => {
            let world_from_parent = world_from_node(&nodes, node.parent);
            let way = 0.5 * (min + max) - world_from_parent.transform_point3(translation);
            let step = way.clamp_length_max((STEP * (max - min).length()).min(MOST * way.length()));
            let step = world_from_parent.inverse().transform_vector3(step);
            Transform { translation: Some(translation + step), ..Transform::default() }
        }
    };
    Some(Edit::MoveNode { node: node.id, transform })
}

fn world_from_node(nodes: &[NodeInfo<'_>], id: Option<NodeId>) -> Affine3A {
    let Some(node) = nodes.iter().find(|node| Some(node.id) == id) else {
        return Affine3A::IDENTITY;
    };
    let Transform { translation, rotation, scale } = node.transform;
    let parent_from_node = Affine3A::from_scale_rotation_translation(
        scale.unwrap_or(Vec3::ONE),
        rotation.unwrap_or(Quat::IDENTITY),
        translation.unwrap_or(Vec3::ZERO),
    );
    world_from_node(nodes, node.parent) * parent_from_node
}
