//! Edits on their way in: order, duplicates and limits, a client each. No socket and no clock: the
//! caller passes bytes and time in.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use lumencast_codec::{ClientEdit, RefusedEdit, limits};
use lumencast_scene::Edit;

use crate::names;

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
    /// Edits over the rate before it is; they are forgotten at the rate.
    pub excess: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { rate: 250.0, burst: 500.0, pending: 1024, rubbish: 16, excess: 1000.0 }
    }
}

/// Clients remembered at a time: as many as are read, and some that have gone.
const MAX_CLIENTS: usize = 2 * names::MAX_CLIENTS;
/// Edits taken in one tick: 12,800 a second at 25 Hz.
pub(crate) const MAX_EDITS_A_TICK: usize = 512;
/// Edits refused beforehand that one tick reports.
pub(crate) const MAX_REFUSED_A_TICK: usize = 256;
/// How far a number may be beyond the last: whoever sends a larger one keeps that client's next edits
/// from being taken.
const MAX_AHEAD: u64 = 1 << 16;
/// Edits of all clients that wait for the next tick, and refusals that wait to be reported.
const MAX_PENDING: usize = 16 * 1024;
/// Bytes of the edits taken in one tick. With their senders, refusals and acknowledgements they stay
/// below 3/8 of what a frame of the state may hold; the rest is for the scene itself, which
/// [`crate::Tick`] keeps below 5/8.
const MAX_BYTES_A_TICK: usize = limits::FRAME_BYTES / 16;
/// Characters of a reason for refusing an edit.
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
    /// Whether what it adds goes with those who edit it.
    pub temporary: bool,
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
    /// Clients that have gone.
    pub gone: Vec<String>,
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
    /// The client has sent too much, or too much rubbish, or there are too many clients: read it no
    /// further.
    CutOff,
}

/// Edits that wait for the next tick.
#[derive(Debug, Default)]
pub struct Inbox {
    limits: Limits,
    clients: BTreeMap<String, Mailbox>,
    /// With the bytes that each has as JSON.
    pending: Vec<(Received, usize)>,
    refused: VecDeque<RefusedEdit>,
    gone: Vec<String>,
}

#[derive(Debug)]
struct Mailbox {
    /// Last number dealt with or waiting to be.
    last: u64,
    pending: usize,
    allowance: f64,
    rubbish: u32,
    excess: f64,
    heard: f64,
}

impl Inbox {
    /// An empty inbox.
    pub fn new(limits: Limits) -> Self {
        Self { limits, ..Self::default() }
    }

    /// Takes a frame of a client's `edits` track, `{"seq": 17, "edit": EDIT}`, at `now` seconds.
    pub fn receive(&mut self, client: &str, bytes: &[u8], now: f64) -> Verdict {
        if !self.clients.contains_key(client) && !self.make_room() {
            return Verdict::CutOff;
        }
        let limits = self.limits;
        let mailbox = self.clients.entry(client.to_owned()).or_insert_with(|| Mailbox {
            last: 0,
            pending: 0,
            allowance: limits.burst,
            rubbish: 0,
            excess: 0.0,
            heard: now,
        });
        let regained = (now - mailbox.heard).max(0.0) * limits.rate;
        mailbox.allowance = (mailbox.allowance + regained).min(limits.burst);
        mailbox.excess = (mailbox.excess - regained).max(0.0);
        mailbox.heard = now;

        // The first may be any: a client goes on counting when its server has begun anew.
        let (first, last) = (mailbox.last == 0, mailbox.last);
        let near = |seq: u64| first || seq.saturating_sub(last) <= MAX_AHEAD;
        let Some((seq, edit)) = parse(bytes).filter(|(seq, _)| near(*seq)) else {
            mailbox.rubbish += 1;
            return match mailbox.rubbish > limits.rubbish {
                true => Verdict::CutOff,
                false => Verdict::Rubbish,
            };
        };
        if seq <= mailbox.last {
            return Verdict::Taken;
        }
        let is_over = mailbox.allowance < 1.0;
        mailbox.excess += f64::from(u8::from(is_over));
        if mailbox.excess > limits.excess || self.refused.len() >= MAX_PENDING {
            return Verdict::CutOff;
        }
        mailbox.last = seq;
        let edit = if is_over {
            Err(format!("more than {} edits a second", limits.rate))
        } else if mailbox.pending >= limits.pending || self.pending.len() >= MAX_PENDING {
            Err("too many edits are waiting for the next tick".to_owned())
        } else {
            edit
        };
        mailbox.allowance = (mailbox.allowance - 1.0).max(0.0);
        match edit {
            Ok(ClientEdit { edit, temporary, .. }) => {
                mailbox.pending += 1;
                // As it will be passed on: numbers may be written otherwise than they came.
                let length = serde_json::to_vec(&edit).map_or(bytes.len(), |json| json.len());
                let received = Received { client: client.to_owned(), seq, edit, temporary };
                self.pending.push((received, length));
                Verdict::Taken
            }
            Err(reason) => {
                self.refused.push_back(refusal(client.to_owned(), seq, &reason));
                Verdict::Refused
            }
        }
    }

    /// A client has gone for good, as far as one can know: what it has added for its time goes, too.
    pub fn leave(&mut self, client: String) {
        self.gone.push(client);
    }

    /// Whether one more client can be remembered: the one that has been silent for longest is
    /// forgotten, unless edits of it wait.
    fn make_room(&mut self) -> bool {
        if self.clients.len() < MAX_CLIENTS {
            return true;
        }
        let idle = self.clients.iter().filter(|(_, mailbox)| mailbox.pending == 0);
        let silent = idle.min_by(|(_, a), (_, b)| a.heard.total_cmp(&b.heard));
        let Some(name) = silent.map(|(name, _)| name.clone()) else { return false };
        self.clients.remove(&name).is_some()
    }

    /// What there is for a tick at `now` seconds, in the order in which it came. What is over the
    /// limits of a tick stays for the next.
    pub fn take(&mut self, now: f64) -> Mail {
        self.take_ready(now, |_| true)
    }

    /// The same, but for edits that are not ready; those stay, and with them what the same client has
    /// sent since.
    pub fn take_ready(&mut self, now: f64, mut is_ready: impl FnMut(&Edit) -> bool) -> Mail {
        let (mut edits, mut kept, mut waiting) = (Vec::new(), Vec::new(), BTreeSet::new());
        let mut room = MAX_BYTES_A_TICK;
        let mut pending = std::mem::take(&mut self.pending).into_iter();
        for (received, bytes) in pending.by_ref() {
            if waiting.contains(&received.client) || !is_ready(&received.edit) {
                waiting.insert(received.client.clone());
                kept.push((received, bytes));
                continue;
            }
            let left = room.checked_sub(bytes).filter(|_| edits.len() < MAX_EDITS_A_TICK);
            let Some(left) = left else {
                kept.push((received, bytes));
                break;
            };
            room = left;
            edits.push(received);
        }
        kept.extend(pending);
        self.pending = kept;
        for received in &edits {
            if let Some(mailbox) = self.clients.get_mut(&received.client) {
                mailbox.pending -= 1;
            }
        }
        self.clients.retain(|_, m| m.pending > 0 || now - m.heard < FORGET_AFTER);
        let reported = self.refused.len().min(MAX_REFUSED_A_TICK);
        let refused = self.refused.drain(..reported).collect();
        // Who has gone may have left edits, which come first.
        let (gone, remaining) = std::mem::take(&mut self.gone)
            .into_iter()
            .partition(|name| self.clients.get(name).is_none_or(|m| m.pending == 0));
        self.gone = remaining;
        Mail { edits, refused, acks: self.acks(), gone }
    }

    /// The last number that is not waiting, for each client.
    fn acks(&self) -> BTreeMap<String, u64> {
        let mut acks: BTreeMap<_, _> =
            self.clients.iter().map(|(name, m)| (name.clone(), m.last)).collect();
        let pending = self.pending.iter().map(|(edit, _)| (&edit.client, edit.seq));
        let refused = self.refused.iter().map(|refused| (&refused.client, refused.seq));
        for (client, seq) in pending.chain(refused) {
            if let Some(ack) = acks.get_mut(client) {
                *ack = seq.saturating_sub(1).min(*ack);
            }
        }
        acks.retain(|_, ack| *ack > 0);
        acks
    }
}

/// An edit that is refused, for a reason of bounded length.
pub(crate) fn refusal(client: String, seq: u64, reason: &str) -> RefusedEdit {
    let reason = reason.chars().filter(|c| !c.is_control()).take(MAX_REASON).collect();
    RefusedEdit { client, seq, reason }
}

/// The number of a frame and its edit, or why the edit cannot be read; `None` where there is not
/// even a number.
fn parse(bytes: &[u8]) -> Option<(u64, Result<ClientEdit, String>)> {
    match ClientEdit::decode(bytes) {
        Ok(edit) => Some((edit.seq, Ok(edit))),
        Err((seq, error)) => Some((seq?, Err(format!("not an edit: {error}")))),
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

    /// The first number may be any, since a client goes on counting when its server begins anew.
    #[test]
    fn numbers_far_ahead_are_no_edits() {
        let mut inbox = Inbox::new(Limits::default());
        let mut receive = |seq| inbox.receive("a", &frame(seq), 0.0);
        assert_eq!(receive(1 << 30), Verdict::Taken);
        assert_eq!(receive((1 << 30) + MAX_AHEAD + 1), Verdict::Rubbish);
        assert_eq!(receive(1 << 53), Verdict::Rubbish);
        assert_eq!(receive((1 << 30) + MAX_AHEAD), Verdict::Taken);
        assert_eq!(receive((1 << 30) + MAX_AHEAD + 1), Verdict::Taken);
        assert_eq!(taken(&mut inbox).len(), 3);
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

    /// Who goes on far over the rate is cut off; who is over it for a moment is not.
    #[test]
    fn floods_are_cut_off() {
        let limits = Limits { rate: 10.0, burst: 20.0, excess: 30.0, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        let flood: Vec<_> = (1..=60).map(|s| inbox.receive("a", &frame(s), 0.0)).collect();
        let count = |verdict| flood.iter().filter(|v| **v == verdict).count();
        assert_eq!((count(Verdict::Taken), count(Verdict::Refused)), (20, 30));
        assert_eq!(flood[50..], [Verdict::CutOff; 10]);
        assert_eq!(inbox.take(0.0).acks["a"], 50, "the rest was never read");
        for second in 0..20 {
            for i in 1..=15 {
                let verdict = inbox.receive("b", &frame(second * 15 + i), second as f64);
                assert_ne!(verdict, Verdict::CutOff, "half as much again");
            }
        }
    }

    /// However much is refused, a tick reports no more than its frame can hold, and acknowledges
    /// only what it has reported.
    #[test]
    fn refusals_are_spread_over_ticks() {
        let limits = Limits { rate: 0.0, burst: 0.0, excess: 1e9, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        let many = MAX_REFUSED_A_TICK as u64 + 10;
        for seq in 1..=many {
            assert_eq!(inbox.receive("a", &frame(seq), 0.0), Verdict::Refused);
        }
        let (first, second) = (inbox.take(0.0), inbox.take(0.0));
        assert_eq!((first.refused.len(), first.acks["a"]), (MAX_REFUSED_A_TICK, many - 10));
        assert_eq!((second.refused.len(), second.acks["a"]), (10, many));
        let long = refusal("a".into(), 1, &"\u{1}ä".repeat(1000));
        assert_eq!(long.reason, "ä".repeat(MAX_REASON));
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

    /// A client's edits keep their order; others' go on.
    #[test]
    fn who_waits_for_a_file_waits_alone() {
        let mut inbox = Inbox::new(Limits::default());
        for (client, seq) in [("a", 1), ("a", 2), ("b", 1), ("a", 3), ("b", 2)] {
            assert_eq!(inbox.receive(client, &frame(seq), 0.0), Verdict::Taken);
        }
        let of_node =
            |edit: &Edit, number| matches!(edit, Edit::RemoveNode { node } if node.0 == number);
        let mut asked = 0;
        let mut take = |blocked: u32| {
            let mail = inbox.take_ready(0.0, |edit| {
                asked += 1;
                !of_node(edit, blocked)
            });
            let edits = mail.edits.into_iter().map(|r| format!("{}{}", r.client, r.seq));
            (edits.collect::<Vec<_>>().join(" "), mail.acks)
        };
        assert_eq!(take(1), (String::new(), BTreeMap::new()), "both are blocked by their first");
        assert_eq!(
            take(3),
            ("a1 a2 b1 b2".into(), BTreeMap::from([("a".into(), 2), ("b".into(), 2)]))
        );
        assert_eq!(take(0).0, "a3");
        assert_eq!(asked, 2 + 5 + 1, "what comes after is not looked at");
    }

    #[test]
    fn long_edits_are_spread_over_ticks() {
        let limits = Limits { rate: 1e9, burst: 1e9, ..Limits::default() };
        let mut inbox = Inbox::new(limits);
        for seq in 1..=200 {
            let name = "x".repeat(limits::EDIT_BYTES - 100);
            let edit = format!(r#"{{"edit":"add_instance","source":{{"file":"{name}"}}}}"#);
            let frame = format!(r#"{{"seq":{seq},"edit":{edit}}}"#);
            assert_eq!(inbox.receive("a", frame.as_bytes(), 0.0), Verdict::Taken);
        }
        let mut taken = 0;
        while taken < 200 {
            let mail = inbox.take(0.0);
            assert!(!mail.edits.is_empty());
            assert!(
                mail.edits.len() * limits::EDIT_BYTES <= MAX_BYTES_A_TICK + 100 * mail.edits.len()
            );
            taken += mail.edits.len();
            assert_eq!(mail.acks["a"], taken as u64);
        }
        assert_eq!(taken, 200);
        let long = "x".repeat(limits::EDIT_BYTES + 1);
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
        assert_eq!(inbox.receive("one more", &frame(1), 0.0), Verdict::CutOff, "all wait");
        while !inbox.take(0.0).edits.is_empty() {}
        assert_eq!(inbox.receive("1", &frame(2), 1.0), Verdict::Taken);
        assert_eq!(inbox.receive("one more", &frame(1), 2.0), Verdict::Taken);
        let acks = inbox.take(2.0).acks;
        assert!(acks.contains_key("1") && acks.contains_key("one more"));
        assert!(acks.len() == MAX_CLIENTS && !acks.contains_key("0"), "silent for longest");
    }
}
