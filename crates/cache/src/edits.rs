//! Edits on their way to the server, and what has become of the scene.

use std::collections::VecDeque;

use lumencast_codec::{ClientEdit, SceneState, StateFrame, limits};
use lumencast_scene::Edit;

use crate::CacheError;

/// Edits that may wait for the server at once.
const PENDING: usize = 4096;

/// What happened to the scene, in order.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SceneEvent {
    /// Start again from the scene as it stands in its file and apply these.
    Snapshot(Vec<Edit>),
    /// Apply this. Node numbers are filled in, also in an edit of one's own.
    Edit {
        /// The edit.
        edit: Edit,
        /// Its sequence number where it was this client's own, and so may be shown already.
        own: Option<u64>,
    },
    /// An edit of this client was dealt with, and the scene shows what came of it.
    Acknowledged {
        /// Its sequence number.
        seq: u64,
    },
    /// An edit of this client was refused: take back what was shown of it
    /// (see [`crate::Cache::server_edits`]).
    Refused {
        /// Its sequence number.
        seq: u64,
        /// The edit.
        edit: Edit,
        /// Why.
        reason: String,
    },
    /// An edit of this client was on its way to a server that has restarted since.
    Lost {
        /// Its sequence number at the old server.
        seq: u64,
        /// The edit.
        edit: Edit,
    },
}

/// This client's edits, the server's, and what the caller has yet to hear of.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edits {
    client: String,
    last_seq: u64,
    pending: VecDeque<ClientEdit>,
    /// The newest tick; `None` before the first frame.
    tick: Option<u64>,
    /// Whether no tick is missing since the last snapshot that was passed on.
    following: bool,
    /// What turns the file's scene into the server's; empty while not `following`.
    server: Vec<Edit>,
    events: Vec<SceneEvent>,
}

impl Edits {
    pub(crate) fn of_client(client: String) -> Self {
        Self { client, ..Self::default() }
    }

    pub(crate) fn client(&self) -> &str {
        &self.client
    }

    pub(crate) fn pending(&self) -> &VecDeque<ClientEdit> {
        &self.pending
    }

    pub(crate) fn server(&self) -> Option<&[Edit]> {
        self.following.then_some(&self.server)
    }

    pub(crate) fn take_events(&mut self) -> Vec<SceneEvent> {
        std::mem::take(&mut self.events)
    }

    /// Numbers an edit; the bytes are to be sent.
    pub(crate) fn add(&mut self, edit: Edit) -> Result<Vec<u8>, CacheError> {
        if self.pending.len() >= PENDING {
            return Err(CacheError::TooManyPending(PENDING));
        }
        let edit = ClientEdit { seq: self.last_seq + 1, edit, temporary: false };
        let bytes = edit.encode();
        self.last_seq = edit.seq;
        self.pending.push_back(edit);
        Ok(bytes)
    }

    /// A server has started anew: it knows nothing of what the old one was told.
    pub(crate) fn restart(&mut self) {
        self.tick = None;
        self.following = false;
        self.server.clear();
        self.last_seq = 0;
        let lost = self.pending.drain(..).map(|e| SceneEvent::Lost { seq: e.seq, edit: e.edit });
        self.events.extend(lost);
    }

    /// Takes a frame in; whether it was newer than all before.
    pub(crate) fn take_in(&mut self, frame: &StateFrame) -> bool {
        if self.tick.is_some_and(|tick| frame.tick <= tick) {
            return false;
        }
        let in_order = self.following && self.tick.is_some_and(|tick| frame.tick == tick + 1);
        self.tick = Some(frame.tick);
        self.following = in_order || frame.snapshot.is_some();
        if in_order {
            self.follow(frame);
        }
        match &frame.snapshot {
            Some(state) => {
                self.server.clone_from(&state.edits);
                if !in_order {
                    self.events.push(SceneEvent::Snapshot(state.edits.clone()));
                }
            }
            None if in_order => self.server.extend(frame.edits.iter().map(|e| e.edit.clone())),
            None => self.server.clear(),
        }
        // Snapshots come often enough; a server that sends none is not kept in mind for ever.
        if self.server.len() > limits::SNAPSHOT_EDITS {
            self.server.clear();
            self.following = false;
        }
        self.settle(frame);
        true
    }

    /// Passes on the edits of a tick that follows the one before.
    fn follow(&mut self, frame: &StateFrame) {
        for accepted in &frame.edits {
            let own = match &accepted.source {
                Some((client, seq)) if *client == self.client => Some(*seq),
                _ => None,
            };
            self.events.push(SceneEvent::Edit { edit: accepted.edit.clone(), own });
        }
    }

    /// Takes off the list what the server has dealt with.
    fn settle(&mut self, frame: &StateFrame) {
        for (client, seq) in frame.edits.iter().filter_map(|accepted| accepted.source.as_ref()) {
            if *client == self.client && self.remove(*seq).is_some() {
                self.events.push(SceneEvent::Acknowledged { seq: *seq });
            }
        }
        for refused in &frame.refused {
            if refused.client == self.client
                && let Some(edit) = self.remove(refused.seq)
            {
                let (seq, reason) = (refused.seq, refused.reason.clone());
                self.events.push(SceneEvent::Refused { seq, edit, reason });
            }
        }
        let acked = |state: &SceneState| state.acks.get(&self.client).copied();
        if let Some(acked) = frame.snapshot.as_ref().and_then(acked) {
            while self.pending.front().is_some_and(|edit| edit.seq <= acked) {
                let seq = self.pending.pop_front().map_or(0, |edit| edit.seq);
                self.events.push(SceneEvent::Acknowledged { seq });
            }
        }
    }

    fn remove(&mut self, seq: u64) -> Option<Edit> {
        let index = self.pending.iter().position(|edit| edit.seq == seq)?;
        self.pending.remove(index).map(|edit| edit.edit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lumencast_codec::{AcceptedEdit, RefusedEdit};
    use lumencast_scene::NodeId;

    fn remove(node: u32) -> Edit {
        Edit::RemoveNode { node: NodeId(node) }
    }

    fn accepted(seq: u64, node: u32) -> AcceptedEdit {
        AcceptedEdit { source: Some(("me".into(), seq)), edit: remove(node) }
    }

    fn snapshot(tick: u64, edits: Vec<Edit>, acked: u64) -> StateFrame {
        let acks = [("me".to_owned(), acked)].into();
        StateFrame { tick, snapshot: Some(SceneState { edits, acks }), ..StateFrame::default() }
    }

    #[test]
    fn a_follower_takes_deltas_and_leaves_snapshots_alone() {
        let mut edits = Edits::of_client("me".into());
        assert!(edits.take_in(&snapshot(1, vec![remove(1)], 0)));
        let delta = StateFrame {
            tick: 2,
            edits: vec![AcceptedEdit { source: None, edit: remove(2) }],
            ..StateFrame::default()
        };
        assert!(edits.take_in(&delta));
        assert!(!edits.take_in(&delta), "a doubled frame");
        assert_eq!(edits.server(), Some(&[remove(1), remove(2)][..]));
        assert!(edits.take_in(&snapshot(3, vec![remove(7)], 0)));
        assert_eq!(
            edits.take_events(),
            [
                SceneEvent::Snapshot(vec![remove(1)]),
                SceneEvent::Edit { edit: remove(2), own: None }
            ]
        );
        assert_eq!(edits.server(), Some(&[remove(7)][..]));
    }

    #[test]
    fn after_a_gap_only_a_snapshot_helps() {
        let mut edits = Edits::of_client("me".into());
        edits.take_in(&snapshot(1, vec![], 0));
        edits.take_events();
        let late = StateFrame { tick: 3, edits: vec![accepted(9, 3)], ..StateFrame::default() };
        assert!(edits.take_in(&late));
        assert_eq!((edits.take_events(), edits.server()), (vec![], None));
        edits.take_in(&snapshot(4, vec![remove(2), remove(3)], 0));
        assert_eq!(edits.take_events(), [SceneEvent::Snapshot(vec![remove(2), remove(3)])]);
    }

    #[test]
    fn own_edits_are_acknowledged_refused_or_lost() {
        let mut edits = Edits::of_client("me".into());
        edits.take_in(&snapshot(1, vec![], 0));
        edits.take_events();
        for node in 1..=4 {
            let bytes = edits.add(remove(node)).unwrap();
            assert_eq!(ClientEdit::decode(&bytes).unwrap().seq, u64::from(node));
        }
        let frame = StateFrame {
            tick: 2,
            edits: vec![accepted(1, 1)],
            refused: vec![
                RefusedEdit { client: "me".into(), seq: 2, reason: "no".into() },
                RefusedEdit { client: "other".into(), seq: 3, reason: "no".into() },
            ],
            ..StateFrame::default()
        };
        edits.take_in(&frame);
        assert_eq!(
            edits.take_events(),
            [
                SceneEvent::Edit { edit: remove(1), own: Some(1) },
                SceneEvent::Acknowledged { seq: 1 },
                SceneEvent::Refused { seq: 2, edit: remove(2), reason: "no".into() },
            ]
        );
        // The frame that named number 3 was lost; a snapshot tells.
        edits.take_in(&snapshot(9, vec![], 3));
        assert_eq!(edits.take_events()[1..], [SceneEvent::Acknowledged { seq: 3 }]);
        edits.restart();
        assert_eq!(edits.take_events(), [SceneEvent::Lost { seq: 4, edit: remove(4) }]);
        assert_eq!(ClientEdit::decode(&edits.add(remove(5)).unwrap()).unwrap().seq, 1);
    }

    #[test]
    fn what_waits_is_bounded() {
        let mut edits = Edits::of_client("me".into());
        for _ in 0..PENDING {
            edits.add(remove(1)).unwrap();
        }
        assert_eq!(edits.add(remove(1)), Err(CacheError::TooManyPending(PENDING)));
    }
}
