import { describe, expect, it } from 'vitest';

import { Turns } from '../src/session/turns.js';

const NAMES = ['near', 'middle', 'far'];
const BEAT = 0.25;

/** Runs for some seconds; `carries` tells who is heard at a beat. Tells each beat's turn and who was read. */
function run(turns: Turns, seconds: number, carries: (turn: string | undefined) => string[], slow = true) {
  const beats = [];
  for (let now = BEAT; now <= seconds; now += BEAT) {
    for (const name of carries(turns.turn)) if (turns.reads(name)) turns.heard(name);
    turns.judge(now, slow);
    beats.push({ now, turn: turns.turn, read: NAMES.filter((name) => turns.reads(name)) });
  }
  return beats;
}

describe('turns', () => {
  it('are not needed while all regions are heard', () => {
    const beats = run(new Turns(NAMES, 0.04, 0), 20, () => NAMES);
    expect(beats.every(({ turn, read }) => turn === undefined && read.length === 3)).toBe(true);
  });

  it('are given to regions that get nothing, one after the other, half of the time', () => {
    const beats = run(new Turns(NAMES, 0.04, 0), 60, (turn) => ['near', ...(turn ? [turn] : [])]);
    expect(beats.filter(({ now }) => now < 2.9).every(({ read }) => read.length === 3)).toBe(true);
    const turns = beats.map(({ turn }) => turn).filter((turn) => turn !== undefined);
    expect(turns.length).toBeLessThanOrEqual(beats.length / 2);
    for (const name of ['middle', 'far']) {
      expect(turns.filter((turn) => turn === name).length).toBeGreaterThan(10);
    }
    expect(turns).not.toContain('near');
  });

  it('end when nothing comes, so that others have theirs', () => {
    const beats = run(new Turns(NAMES, 0.04, 0), 90, () => []);
    for (const name of NAMES) expect(beats.some(({ turn }) => turn === name)).toBe(true);
    const far = beats.filter(({ turn }) => turn === 'far').length;
    const near = beats.filter(({ turn }) => turn === 'near').length;
    // By one turn, at most.
    expect(Math.abs(far - near)).toBeLessThanOrEqual(4 / BEAT + 1);
  });

  it('end when the link is fast enough again', () => {
    const turns = new Turns(NAMES, 0.04, 0);
    run(turns, 5, () => ['near']);
    expect(NAMES.every((name) => turns.reads(name))).toBe(false);
    expect(turns.judge(6, false)).toBe(true);
    expect(turns.turn).toBeUndefined();
    expect(NAMES.every((name) => turns.reads(name))).toBe(true);
  });

  it('wait for servers that tick seldom', () => {
    const beats = run(new Turns(NAMES, 1, 0), 11, () => []);
    expect(beats.every(({ turn }) => turn === undefined)).toBe(true);
  });
});
