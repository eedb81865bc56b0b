import type { Playback } from '@lumencast/client';
import { type AnimationAction, AnimationMixer } from 'three';
import type { Animation, Content } from './content.js';

/**
 * How an animation stands: at `time` (seconds of its own) when the scene's time was `since`. All play
 * in a loop from the scene's beginning, until edits say otherwise.
 */
interface Clock extends Required<Playback> {
  since: number;
}

interface Playing {
  readonly copies: Copy[];
  clock: Clock;
}

/** One copy of what an animation moves. */
interface Copy {
  readonly of: Animation;
  readonly mixer: AnimationMixer;
  readonly action: AnimationAction;
  /** Where the scene shows it. */
  shown: number;
}

const FROM_START: Clock = { playing: true, time: 0, speed: 1, since: 0 };

/** The animations of a scene, driven by the server's scene time. */
export class Animations {
  readonly #playing = new Map<number, Playing>();

  constructor(private readonly content: Content) {}

  /** As the file says, from scene time 0. */
  restart(): void {
    for (const playing of this.#playing.values()) playing.clock = { ...FROM_START };
  }

  playback(animation: number): Required<Playback> | undefined {
    const clock = this.#get(animation)?.clock;
    return clock && { playing: clock.playing, time: clock.time, speed: clock.speed };
  }

  /**
   * Plays, pauses, seeks; `now` is the server's scene time at which this holds. What the animation
   * moves is put there at once: edits that follow may move it on.
   */
  set(animation: number, change: Playback, now: number): void {
    const playing = this.#get(animation);
    if (!playing) return;
    playing.clock = { ...playing.clock, time: timeAt(playing.clock, now), since: now, ...change };
    pose(playing, now);
  }

  /** Moves the scene to a time; true when something moved. */
  update(now: number): boolean {
    let moved = false;
    for (const animation of this.content.animations.keys()) {
      const playing = this.#get(animation);
      if (playing && pose(playing, now)) moved = true;
    }
    return moved;
  }

  #get(animation: number): Playing | undefined {
    const sources = this.content.animations.get(animation);
    if (!sources) {
      this.#playing.delete(animation);
      return undefined;
    }
    let playing = this.#playing.get(animation);
    if (!playing) {
      playing = { copies: [], clock: { ...FROM_START } };
      this.#playing.set(animation, playing);
    }
    for (const source of sources.slice(playing.copies.length)) playing.copies.push(start(source));
    return playing;
  }
}

/** Puts an animation's nodes where it has them at a scene time; true when that moves any. */
function pose({ copies, clock }: Playing, now: number): boolean {
  let moved = false;
  for (const copy of copies) {
    const time = wrap(timeAt(clock, now), copy.of.clip.duration);
    if (time === copy.shown) continue;
    copy.shown = copy.action.time = time;
    copy.mixer.update(0);
    moved = true;
  }
  return moved;
}

/** An animation's own time, not wrapped, at a scene time. */
export function timeAt({ playing, time, speed, since }: Clock, now: number): number {
  return playing ? time + speed * (now - since) : time;
}

/** Into [0, duration), also for times before 0; 0 for an animation without length. */
export function wrap(time: number, duration: number): number {
  return duration > 0 ? time - Math.floor(time / duration) * duration : 0;
}

function start(of: Animation): Copy {
  // A mixer each: their order says which one wins where two move the same node, as on the server.
  const mixer = new AnimationMixer(of.root);
  const action = mixer.clipAction(of.clip);
  action.play();
  return { of, mixer, action, shown: Number.NaN };
}
