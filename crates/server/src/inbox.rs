//! Edits on their way in: order, duplicates and limits, a client each. No socket and no clock: the
//! caller passes bytes and time in.

use std::collections::BTreeMap;

use lumencast_codec::{ClientEdit, RefusedEdit, limits};
use lumencast_scene::Edit;

/// How much one client may send.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Edits a second, on average.
    pub rate: f64,
    /// Edits at once.
    pub burst: f64,
    /// Edits waiting for the next tick.
    pub pending: usize,
    /// Frames that are no edits at all before the client is [cut off](Verdict::CutOff).
    pub rubbish: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self { rate: 250.0, burst: 500.0, pending: 1024, rubbish: 16 }
    }
}

/// Clients remembered at a time.
pub(crate) const MAX_CLIENTS: usize = 1024;
/// Edits taken in one tick, and refusals reported in one: the wire's limit for a delta.
pub(crate) const MAX_EDITS_A_TICK: usize = 4096;
/// Bytes of a frame; no edit is nearly as long.
pub(crate) const MAX_FRAME: usize = 4 * 1024;
/// Edits of all clients that wait for the next tick.
const MAX_PENDING: usize = 4 * MAX_EDITS_A_TICK;
/// Bytes of the edits taken in one tick: half of what a frame of the state may hold.
const MAX_BYTES_A_TICK: usize = limits::FRAME_BYTES / 2;
/// Characters of a reason for refusing an edit that cannot be read.
const MAX_REASON: usize = 200;
/// Seconds after which a silent client's numbers are forgotten.
const FORGET_AFTER: f64 = 60.0;

/// An edit with its sender.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Name of the client.
    pub client: String,
    /// Its number of the edit.
    pub seq: u64,
    /// The edit.
    pub edit: Edit,
}

/// What a tick takes from the inbox.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mail {
    /// Edits, in the order in which they came.
    pub edits: Vec<Received>,
    /// What was refused beforehand.
    pub refused: Vec<RefusedEdit>,
    /// The last number dealt with once these edits are, for each client heard in the last minute.
    pub acks: BTreeMap<String, u64>,
}

/// What became of a frame from a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It waits for the next tick, or was a number that the server had already.
    Taken,
    /// It is refused; the reason goes out with the next tick.
    Refused,
    /// Not an edit frame.
    Rubbish,
    /// The client has sent too much rubbish, or there are too many clients: read it no further.
    CutOff,
}

/// Edits that wait for the next tick.
#[derive(Debug, Default)]
pub struct Inbox {
    limits: Limits,
    clients: BTreeMap<String, Mailbox>,
    /// With the bytes that each came in.
    pending: Vec<(Received, usize)>,
    refused: Vec<RefusedEdit>,
}

#[derive(Debug)]
struct Mailbox {
    /// Last number dealt with or waiting to be.
    last: u64,
    pending: usize,
    allowance: f64,
    rubbish: u32,
    heard: f64,
}

impl Inbox {
    /// An empty inbox.
    pub fn new(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// Takes a frame of a client's `edits` track, `{"seq": 17, "edit": EDIT}`, at `now` seconds.
    pub fn receive(&mut self, client: &str, bytes: &[u8], now: f64) -> Verdict {
        if !self.clients.contains_key(client) && self.clients.len() >= MAX_CLIENTS {
            return Verdict::CutOff;
        }
        let limits = self.limits;
        let mailbox = self.clients.entry(client.to_owned()).or_insert_with(|| Mailbox {
            last: 0,
            pending: 0,
            allowance: limits.burst,
            rubbish: 0,
            heard: now,
        });
        let elapsed = (now - mailbox.heard).max(0.0);
        mailbox.allowance = (mailbox.allowance + elapsed * limits.rate).min(limits.burst);
        mailbox.heard = now;

        let Some((seq, edit)) = parse(bytes) else {
            mailbox.rubbish += 1;
            return match mailbox.rubbish > limits.rubbish {
                true => Verdict::CutOff,
                false => Verdict::Rubbish,
            };
        };
        if seq <= mailbox.last {
            return Verdict::Taken;
        }
        mailbox.last = seq;
        let edit = if mailbox.allowance < 1.0 {
            Err(format!("more than {} edits a second", limits.rate))
        } else if mailbox.pending >= limits.pending || self.pending.len() >= MAX_PENDING {
            Err("too many edits are waiting for the next tick".to_owned())
        } else {
            edit
        };
        mailbox.allowance = (mailbox.allowance - 1.0).max(0.0);
        match edit {
            Ok(edit) => {
                mailbox.pending += 1;
                let received = Received { client: client.to_owned(), seq, edit };
                self.pending.push((received, bytes.len()));
                Verdict::Taken
            }
            Err(reason) => {
                if self.refused.len() < MAX_EDITS_A_TICK {
                    self.refused.push(RefusedEdit { client: client.to_owned(), seq, reason });
                }
                Verdict::Refused
            }
        }
    }

    /// What there is for a tick at `now` seconds, edits in the order in which they came. Edits over
    /// the limit of a tick stay for the next.
    pub fn take(&mut self, now: f64) -> Mail {
        let mut room = MAX_BYTES_A_TICK;
        let fits = |(_, bytes): &&(Received, usize)| {
            let taken = room.checked_sub(*bytes);
            room = taken.unwrap_or(0);
            taken.is_some()
        };
        let count = self.pending.iter().take(MAX_EDITS_A_TICK).take_while(fits).count();
        let edits: Vec<Received> = self.pending.drain(..count).map(|(edit, _)| edit).collect();
        for received in &edits {
            if let Some(mailbox) = self.clients.get_mut(&received.client) {
                mailbox.pending -= 1;
            }
        }
        self.clients.retain(|_, m| m.pending > 0 || now - m.heard < FORGET_AFTER);
        Mail { edits, refused: std::mem::take(&mut self.refused), acks: self.acks() }
    }

    /// The last number that is not waiting, for each client.
    fn acks(&self) -> BTreeMap<String, u64> {
        let mut acks: BTreeMap<_, _> =
            self.clients.iter().map(|(name, m)| (name.clone(), m.last)).collect();
        for (waiting, _) in &self.pending {
            if let Some(ack) = acks.get_mut(&waiting.client) {
                *ack = waiting.seq.saturating_sub(1).min(*ack);
            }
        }
        acks.retain(|_, ack| *ack > 0);
        acks
    }
}

/// The number of a frame and its edit, or why the edit cannot be read; `None` where there is not
/// even a number.
fn parse(bytes: &[u8]) -> Option<(u64, Result<Edit, String>)> {
    if bytes.len() > MAX_FRAME {
        return None;
    }
    match ClientEdit::decode(bytes) {
        Ok(ClientEdit { seq, edit }) => Some((seq, Ok(edit))),
        Err((seq, error)) => {
            let reason = format!("not an edit: {error}");
            Some((seq?, Err(reason.chars().take(MAX_REASON).collect())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(seq: u64) -> Vec<u8> {
        format!(r#"{{"seq":{seq},"edit":{{"edit":"remove_node","node":{seq}}}}}"#).into_bytes()
    }

    fn taken(inbox: &mut Inbox) -> Vec<(String, u64)> {
        inbox.take(0.0).edits.into_iter().map(|r| (r.client, r.seq)).collect()
    }

    #[test]
    fn keeps_the_order_and_ignores_numbers_it_had() {
        let mut inbox = Inbox::new(Limits::default());
        for (client, seq) in [("a", 1), ("b", 1), ("a", 2), ("a", 2), ("a", 1), ("b", 4)] {
            assert_eq!(inbox.receive(client, &frame(seq), 0.0), Verdict::Taken);
        }
        let expected = [("a", 1), ("b", 1), ("a", 2), ("b", 4)];
        assert_eq!(taken(&mut inbox), expected.map(|(c, s)| (c.to_owned(), s)));
        assert_eq!(inbox.receive("a", &frame(2), 0.0), Verdict::Taken);
        assert!(taken(&mut inbox).is_empty(), "2 was dealt with");
        assert_eq!(
            inbox.take(1.0).acks,
            BTreeMap::from([("a".to_owned(), 2), ("b".to_owned(), 4)])
        );
        assert!(inbox.take(61.0).acks.is_empty(), "forgotten after a minute");
    }

    #[test]
    fn refuses_what_is_over_the_rate_with_a_reason() {
        let limits = Limits { rate: 10.0, burst: 20.0, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        let verdicts: Vec<_> = (1..=30).map(|s| inbox.receive("a", &frame(s), 0.0)).collect();
        assert_eq!(verdicts.iter().filter(|v| **v == Verdict::Taken).count(), 20);
        // Another client is not held up, and after a second ten more pass.
        assert_eq!(inbox.receive("b", &frame(1), 0.0), Verdict::Taken);
        let Mail { edits, refused, .. } = inbox.take(0.0);
        assert_eq!((edits.len(), refused.len()), (21, 10));
        assert_eq!(refused[0].seq, 21);
        assert!(refused[0].reason.contains("10 edits a second"), "{}", refused[0].reason);
        let verdicts: Vec<_> = (31..=60).map(|s| inbox.receive("a", &frame(s), 1.0)).collect();
        assert_eq!(verdicts.iter().filter(|v| **v == Verdict::Taken).count(), 10);
    }

    #[test]
    fn waiting_edits_are_limited() {
        let limits = Limits { rate: 1e9, burst: 1e9, pending: 3, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        for seq in 1..=3 {
            assert_eq!(inbox.receive("a", &frame(seq), 0.0), Verdict::Taken);
        }
        assert_eq!(inbox.receive("a", &frame(4), 0.0), Verdict::Refused);
        let mail = inbox.take(0.0);
        assert_eq!((mail.edits.len(), mail.acks["a"]), (3, 4));
    }

    #[test]
    fn what_a_tick_cannot_take_waits_unacknowledged() {
        let limits = Limits { rate: 1e9, burst: 1e9, pending: 1 << 20, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        let many = MAX_EDITS_A_TICK as u64 + 10;
        for seq in 1..=many {
            assert_eq!(inbox.receive("a", &frame(seq), 0.0), Verdict::Taken);
        }
        let mail = inbox.take(0.0);
        assert_eq!(mail.edits.len(), MAX_EDITS_A_TICK);
        assert_eq!(mail.acks["a"], MAX_EDITS_A_TICK as u64);
        let mail = inbox.take(0.0);
        assert_eq!((mail.edits.len(), mail.acks["a"]), (10, many));
    }

    #[test]
    fn long_edits_are_spread_over_ticks() {
        let limits = Limits { rate: 1e9, burst: 1e9, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        for seq in 1..=200 {
            let name = "x".repeat(MAX_FRAME - 100);
            let edit = format!(r#"{{"edit":"add_instance","source":{{"file":"{name}"}}}}"#);
            let frame = format!(r#"{{"seq":{seq},"edit":{edit}}}"#);
            assert_eq!(inbox.receive("a", frame.as_bytes(), 0.0), Verdict::Taken);
        }
        let (first, second) = (inbox.take(0.0), inbox.take(0.0));
        assert!(first.edits.len() * MAX_FRAME <= MAX_BYTES_A_TICK + 100 * first.edits.len());
        assert_eq!(first.edits.len() + second.edits.len(), 200);
        assert_eq!(second.acks["a"], 200);
        let long = "x".repeat(MAX_FRAME + 1);
        assert_eq!(inbox.receive("a", long.as_bytes(), 0.0), Verdict::Rubbish);
    }

    #[test]
    fn unreadable_edits_are_refused_and_rubbish_cuts_off() {
        let mut inbox = Inbox::new(Limits { rubbish: 2, ..Limits::default() });
        let unknown = br#"{"seq":1,"edit":{"edit":"paint_it_black"}}"#;
        assert_eq!(inbox.receive("a", unknown, 0.0), Verdict::Refused);
        let Mail { edits, refused, .. } = inbox.take(0.0);
        assert!(edits.is_empty());
        assert!(refused[0].reason.contains("paint_it_black"), "{}", refused[0].reason);
        for bytes in [&b"\xff\x00"[..], b"{}"] {
            assert_eq!(inbox.receive("a", bytes, 0.0), Verdict::Rubbish);
        }
        assert_eq!(inbox.receive("a", b"[]", 0.0), Verdict::CutOff);
        // Other clients go on.
        assert_eq!(inbox.receive("b", &frame(1), 0.0), Verdict::Taken);
    }

    #[test]
    fn clients_are_limited() {
        let mut inbox = Inbox::new(Limits::default());
        for i in 0..MAX_CLIENTS {
            assert_eq!(inbox.receive(&i.to_string(), &frame(1), 0.0), Verdict::Taken);
        }
        assert_eq!(inbox.receive("one more", &frame(1), 0.0), Verdict::CutOff);
        inbox.take(0.0);
        inbox.take(100.0);
        assert_eq!(inbox.receive("one more", &frame(1), 100.0), Verdict::Taken);
    }
}
