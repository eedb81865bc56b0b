import { Broadcast, Group, RemoteError, Time } from '@moq/net';
import { describe, expect, it, vi } from 'vitest';

import { EditTrack, MoqReader } from '../src/transport/moq.js';

const OPTIONS = { priority: 7, maxAge: 0 };

function frame(value: number): Group.Frame {
  return { payload: Uint8Array.of(value), timestamp: Time.Timestamp.now() };
}

/** Reads as over a connection, which holds a handle of its own. */
function read(broadcast: () => Broadcast.Producer, options = OPTIONS) {
  const held = new Map<Broadcast.Producer, Broadcast.Consumer>();
  const consume = () => {
    const base = held.get(broadcast()) ?? broadcast().consume();
    held.set(broadcast(), base);
    return base.clone();
  };
  const frames: number[] = [];
  const reader = new MoqReader(consume, 'light', options, (bytes) => frames.push(bytes[0]));
  return { reader, frames };
}

describe('a reader', () => {
  it('goes on with the next group when one went stale', async () => {
    const broadcast = new Broadcast.Producer();
    const track = broadcast.createTrack('light');
    const { reader, frames } = read(() => broadcast);
    const first = track.appendGroup();
    first.writeFrame(frame(1));
    await vi.waitFor(() => expect(frames).toEqual([1]));
    first.close(new RemoteError(52));
    const second = track.appendGroup();
    second.writeFrame(frame(2));
    second.writeFrame(frame(3));
    second.close();
    track.appendGroup().writeFrame(frame(4));
    await vi.waitFor(() => expect(frames).toEqual([1, 2, 3, 4]));
    reader.close();
    broadcast.close();
  });

  it('does not wait for a group that is held up when newer ones have come', async () => {
    const broadcast = new Broadcast.Producer();
    const track = broadcast.createTrack('light');
    const { reader, frames } = read(() => broadcast);
    const heldUp = track.appendGroup();
    heldUp.writeFrame(frame(1));
    await vi.waitFor(() => expect(frames).toEqual([1]));
    const alsoHeldUp = track.appendGroup();
    const newest = track.appendGroup();
    newest.writeFrame(frame(4));
    await vi.waitFor(() => expect(frames).toEqual([1, 4]));
    heldUp.writeFrame(frame(2));
    alsoHeldUp.writeFrame(frame(3));
    newest.writeFrame(frame(5));
    await vi.waitFor(() => expect(frames).toEqual([1, 4, 5]));
    reader.close();
    broadcast.close();
  });

  it('waits for a group that is held up as long as it was told to', async () => {
    const broadcast = new Broadcast.Producer();
    const track = broadcast.createTrack('light');
    const { reader, frames } = read(() => broadcast, { ...OPTIONS, maxAge: 200 });
    const heldUp = track.appendGroup();
    heldUp.writeFrame(frame(1));
    track.appendGroup().writeFrame(frame(3));
    await new Promise((resolve) => setTimeout(resolve, 50));
    heldUp.writeFrame(frame(2));
    await vi.waitFor(() => expect(frames).toEqual([1, 2]));
    await vi.waitFor(() => expect(frames).toEqual([1, 2, 3]));
    reader.close();
    broadcast.close();
  });

  it('asks again when its track has ended, and waits for one that is not there yet', async () => {
    let broadcast = new Broadcast.Producer();
    const { reader, frames } = read(() => broadcast);
    const early = await broadcast.requested();
    early?.reject(new Error('not found'));
    const track = broadcast.createTrack('light');
    track.appendGroup().writeFrame(frame(1));
    await vi.waitFor(() => expect(frames).toEqual([1]), 2000);
    track.close(new Error('the origin died'));
    broadcast.close();
    broadcast = new Broadcast.Producer();
    broadcast.createTrack('light').appendGroup().writeFrame(frame(2));
    await vi.waitFor(() => expect(frames).toEqual([1, 2]), 2000);
    reader.close();
    broadcast.close();
  });

  it('passes on its priority, and ends its subscription', async () => {
    const broadcast = new Broadcast.Producer();
    const track = broadcast.createTrack('light');
    const { reader, frames } = read(() => broadcast);
    await vi.waitFor(() => expect(track.subscription.peek()?.priority).toBe(7));
    reader.setPriority(200);
    await vi.waitFor(() => expect(track.subscription.peek()?.priority).toBe(200));
    reader.close();
    await vi.waitFor(() => expect(track.used.peek()).toBe(false));
    track.appendGroup().writeFrame(frame(1));
    await new Promise((resolve) => setTimeout(resolve, 300));
    expect(frames).toEqual([]);
    broadcast.close();
  });

  it('passes over frames that are too long', async () => {
    const broadcast = new Broadcast.Producer();
    const track = broadcast.createTrack('light');
    const { reader, frames } = read(() => broadcast);
    const group = track.appendGroup();
    group.writeFrame({ payload: new Uint8Array((1 << 20) + 1), timestamp: Time.Timestamp.now() });
    group.writeFrame(frame(5));
    await vi.waitFor(() => expect(frames).toEqual([5]));
    reader.close();
    broadcast.close();
  });
});

describe('the track of edits', () => {
  it('keeps order over more edits than a group holds', async () => {
    const edits = new EditTrack();
    const received: number[] = [];
    const reader = new MoqReader(
      () => edits.broadcast.consume(),
      'edits',
      { priority: 0, maxAge: 5000 },
      (bytes) => received.push(new DataView(bytes.buffer).getUint32(0)),
    );
    const sent = Array.from({ length: 1300 }, (_, i) => i);
    for (const i of sent) {
      const bytes = new Uint8Array(4);
      new DataView(bytes.buffer).setUint32(0, i);
      edits.send(bytes);
      if (i % 100 === 0) await new Promise((resolve) => setTimeout(resolve, 1));
    }
    await vi.waitFor(() => expect(received).toEqual(sent));
    reader.close();
    edits.broadcast.close();
  });
});
