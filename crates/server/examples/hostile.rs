//! A hostile client, and what somebody else notices of it: `hostile ADDRESS ATTACK`, by
//! `benches/hostile.py`. Prints a line of JSON.
#![expect(clippy::print_stdout, reason = "a program for the terminal")]

use std::time::{Duration, Instant};

use lumencast_codec::{ClientEdit, StateFrame};
use lumencast_scene::{Edit, Environment, InstanceSource, NodeId, Transform};
use lumencast_transport::{
    Broadcast, Client, ConnectOptions, Error, ReadOptions, TrackReader, TrackWriter,
};
use serde_json::{Value, json};

type Failure = Box<dyn std::error::Error>;

/// How long a bystander waits for an answer before it counts as none.
const PATIENCE: Duration = Duration::from_secs(60);

#[tokio::main]
async fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [address, attack] = &words[..] else { return Err("hostile ADDRESS ATTACK".into()) };
    let seen = match attack.as_str() {
        "files" => files(address).await?,
        "names" => names(address).await?,
        "impostor" => impostor(address).await?,
        "numbers" => numbers(address).await?,
        "long_edit" => long_edit(address).await?,
        "spellings" => spellings(address).await?,
        other => return Err(format!("no attack {other}").into()),
    };
    println!("{seen}");
    Ok(())
}

/// Somebody who edits, and watches what becomes of it.
struct Editor {
    _client: Client,
    state: TrackReader,
    name: String,
    seq: u64,
    track: TrackWriter,
    _broadcast: Broadcast,
}

impl Editor {
    async fn connect(address: &str, name: &str) -> Result<Self, Failure> {
        let client = Client::connect(address, ConnectOptions::default()).await?;
        let all = ReadOptions::default().with_max_age(Duration::from_secs(5));
        let state = client.subscribe(client.scene(), "state", all);
        let (broadcast, track) = publish(&client, name)?;
        let name = name.split('.').next().unwrap_or(name).to_owned();
        Ok(Self { _client: client, state, name, seq: 0, track, _broadcast: broadcast })
    }

    fn send(&mut self, edit: Edit) -> Result<u64, Failure> {
        self.seq += 1;
        let frame = ClientEdit { seq: self.seq, edit, temporary: false }.encode();
        self.track.write(frame.into(), false)?;
        Ok(self.seq)
    }

    /// Waits until the edit of a number is answered; whether it was, and the longest time without a tick.
    async fn answered(&mut self, seq: u64) -> Result<(bool, f64), Failure> {
        let (began, mut last, mut gap) = (Instant::now(), Instant::now(), 0_f64);
        while began.elapsed() < PATIENCE {
            let frame = tokio::time::timeout(PATIENCE, self.state.next()).await;
            gap = gap.max(last.elapsed().as_secs_f64());
            last = Instant::now();
            let Ok(Ok(Some(frame))) = frame else { break };
            let state = StateFrame::decode(&frame.bytes)?;
            let accepted = state.edits.iter().filter_map(|edit| edit.source.as_ref());
            let refused = state.refused.iter().map(|refused| (&refused.client, refused.seq));
            let mut all = accepted.map(|(client, seq)| (client, *seq)).chain(refused);
            if all.any(|(client, number)| *client == self.name && number == seq) {
                return Ok((true, gap));
            }
        }
        Ok((false, gap))
    }
}

fn publish(client: &Client, name: &str) -> Result<(Broadcast, TrackWriter), Error> {
    let broadcast = client.publish(&format!("{}/edits/{name}", client.scene()))?;
    let track = broadcast.track("edits", 0)?;
    broadcast.announce()?;
    Ok((broadcast, track))
}

fn harmless() -> Edit {
    Edit::MoveNode { node: NodeId(0), transform: Transform::default() }
}

/// 200 edits that name a large file which is no glTF, each in its own spelling.
async fn files(address: &str) -> Result<Value, Failure> {
    let mut attacker = Editor::connect(address, "attacker").await?;
    let mut bystander = Editor::connect(address, "bystander").await?;
    let mut last = 0;
    for number in 0..200 {
        let source = InstanceSource::File(format!("{}large.bin", "./".repeat(number)));
        let (node, name, parent, transform) = (None, None, None, Transform::default());
        last = attacker.send(Edit::AddInstance { node, name, source, parent, transform })?;
    }
    tokio::time::sleep(Duration::from_millis(200)).await;
    let seq = bystander.send(harmless())?;
    let (answered, gap) = bystander.answered(seq).await?;
    let (all, later) = attacker.answered(last).await?;
    Ok(json!({ "answered": answered, "longest_silence": gap.max(later), "all_answered": all }))
}

/// One session under 1,024 names.
async fn names(address: &str) -> Result<Value, Failure> {
    let attacker = Client::connect(address, ConnectOptions::default()).await?;
    let names = (0..1024).map(|n| publish(&attacker, &format!("n{n}")));
    let _names = names.collect::<Result<Vec<_>, _>>()?;
    tokio::time::sleep(Duration::from_secs(2)).await;
    let mut bystander = Editor::connect(address, "bystander").await?;
    let seq = bystander.send(harmless())?;
    Ok(json!({ "answered": bystander.answered(seq).await?.0 }))
}

/// Somebody under another's name, with numbers ahead of it.
async fn impostor(address: &str) -> Result<Value, Failure> {
    let mut victim = Editor::connect(address, "victim.key").await?;
    let first = victim.send(harmless())?;
    if !victim.answered(first).await?.0 {
        // Servers without keys.
        victim = Editor::connect(address, "victim").await?;
        let first = victim.send(harmless())?;
        victim.answered(first).await?;
    }
    let mut impostors = Vec::new();
    for name in ["victim", "victim.guess", "x/victim"] {
        let mut impostor = Editor::connect(address, name).await?;
        impostor.seq = 1_000_000;
        impostor.send(harmless())?;
        impostors.push(impostor);
    }
    tokio::time::sleep(Duration::from_secs(1)).await;
    let seq = victim.send(harmless())?;
    let (answered, _) = tokio::time::timeout(Duration::from_secs(10), victim.answered(seq))
        .await
        .unwrap_or(Ok((false, 0.0)))?;
    Ok(json!({ "answered": answered }))
}

/// A number that JavaScript cannot tell from its neighbours.
async fn numbers(address: &str) -> Result<Value, Failure> {
    let mut attacker = Editor::connect(address, "attacker").await?;
    attacker.seq = 1 << 60;
    attacker.send(harmless())?;
    let mut bystander = Editor::connect(address, "bystander").await?;
    let seq = bystander.send(harmless())?;
    bystander.answered(seq).await?;
    // Of the next snapshots, which those who join begin with.
    let mut readable = true;
    for _ in 0..130 {
        let Some(frame) = bystander.state.next().await? else { break };
        let text = String::from_utf8_lossy(&frame.bytes);
        readable &= !text.contains(&((1_u64 << 60) + 1).to_string());
    }
    Ok(json!({ "answered": readable }))
}

/// An edit of five kilobytes before another.
async fn long_edit(address: &str) -> Result<Value, Failure> {
    let mut editor = Editor::connect(address, "editor").await?;
    let source = InstanceSource::File("x".repeat(5000));
    let (node, name, parent, transform) = (None, None, None, Transform::default());
    editor.send(Edit::AddInstance { node, name, source, parent, transform })?;
    let seq = editor.send(harmless())?;
    let (answered, _) = tokio::time::timeout(Duration::from_secs(10), editor.answered(seq))
        .await
        .unwrap_or(Ok((false, 0.0)))?;
    Ok(json!({ "answered": answered }))
}

/// One picture of the environment under 30 spellings, and another one after them.
async fn spellings(address: &str) -> Result<Value, Failure> {
    let mut editor = Editor::connect(address, "editor").await?;
    let shine = |uri: String| Edit::SetEnvironment {
        environment: Environment::Image { uri, intensity: 1.0, rotation: 0.0, image: None },
    };
    let mut gap = 0_f64;
    for number in 0..30 {
        let seq = editor.send(shine(format!("{}sky.hdr", "./".repeat(number))))?;
        gap = gap.max(editor.answered(seq).await?.1);
    }
    let seq = editor.send(shine("other.hdr".into()))?;
    let (began, name) = (Instant::now(), editor.name.clone());
    let mut accepted = false;
    while !accepted && began.elapsed() < PATIENCE {
        let Some(frame) = editor.state.next().await? else { break };
        let state = StateFrame::decode(&frame.bytes)?;
        accepted = state.edits.iter().any(|edit| edit.source == Some((name.clone(), seq)));
        if state.refused.iter().any(|refused| refused.client == name) {
            break;
        }
    }
    Ok(json!({ "answered": accepted, "longest_silence": gap }))
}
