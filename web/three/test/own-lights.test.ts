/** Lights of pages' own that they add to a server's scene: they must neither pile up nor be lost. */
import { Object3D, PointLight, SpotLight } from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { type NamedNode, nodeName } from '../src/names.js';
import { type Page, SharedServer } from './support/shared-server.js';

let server: SharedServer;

beforeEach(() => {
  vi.useFakeTimers();
  server = new SharedServer();
});

afterEach(() => vi.useRealTimers());

function lampIn({ scene }: Page, name = 'lamp', light: PointLight | SpotLight = new PointLight()) {
  light.name = name;
  scene.add(light);
  return light;
}

/** The light sources of a page's scene. */
function lightsOf({ scene }: Page): Object3D[] {
  const lights: Object3D[] = [];
  scene.traverse((object) => {
    if (object instanceof PointLight || object instanceof SpotLight) lights.push(object);
  });
  return lights;
}

/** A page that has added its lamp, which is node 10. */
async function lit(): Promise<{ page: Page; lamp: PointLight | SpotLight }> {
  const page = await server.open();
  const lamp = lampIn(page);
  page.light.follow(lamp);
  await server.ticks(3);
  expect([...server.lights.keys()]).toEqual([10]);
  return { page, lamp };
}

describe('a light that a page follows', () => {
  it('is added by its name, for as long as it is edited, once it is known what there is', async () => {
    const page = await server.open();
    const lamp = lampIn(page);
    page.light.follow(lamp);
    server.draw(page);
    expect(page.edits()).toEqual([]);
    await server.ticks(5);
    expect(page.net.link.edits).toEqual([
      { seq: 1, temporary: true, edit: expect.objectContaining({ edit: 'add_light', name: 'lamp' }) },
    ]);
    expect(page.warnings).toEqual(["lamp is no light of the server's scene, and is added to it"]);
    expect(lightsOf(page)).toEqual([lamp]);
  });

  it('is looked for when there is a connection, and not added before', async () => {
    const page = await server.open();
    await server.tick();
    page.net.link.break('gone');
    await vi.advanceTimersByTimeAsync(10);
    page.light.follow(lampIn(page));
    server.accept({ edit: 'add_light', node: 10, name: 'lamp', light: { type: 'point' } });
    await server.ticks(3);
    await vi.advanceTimersByTimeAsync(300);
    await server.join(page);
    await server.ticks(3);
    expect([...server.lights.keys()]).toEqual([10]);
  });

  it('is that of the page before, after a reload', async () => {
    const { page } = await lit();
    page.session.close();
    const reloaded = await server.open();
    const lamp = lampIn(reloaded);
    lamp.position.x = 7;
    reloaded.light.follow(lamp);
    await server.ticks(3);
    expect(reloaded.edits()).toMatchObject([
      { edit: 'move_node', node: 10, translation: [7, 0, 0] },
      { edit: 'set_light', node: 10, intensity: 1 },
    ]);
    expect(server.lights.size).toBe(1);
    expect(lightsOf(reloaded)).toEqual([lamp]);
    expect(lamp.position.x).toBe(7);
    expect(reloaded.warnings).toEqual([]);
    lamp.position.x = 8;
    await server.ticks(2);
    expect(server.lights.get(10)!.transform!.translation).toEqual([8, 0, 0]);
  });

  it.each([
    ['of another name', 'torch', new PointLight()],
    ['without a name', '', new PointLight()],
    ['of another kind', 'lamp', new SpotLight()],
  ])('%s is another', async (_, name, light) => {
    await lit();
    const other = await server.open();
    other.light.follow(lampIn(other, name, light));
    await server.ticks(3);
    expect([...server.lights.values()].map((added) => [added.light.type, added.name])).toEqual([
      ['point', 'lamp'],
      [light instanceof SpotLight ? 'spot' : 'point', name || undefined],
    ]);
  });

  it('keeps what others have hung below it', async () => {
    const { page } = await lit();
    server.accept({ edit: 'add_light', node: 20, parent: 10, light: { type: 'point' } });
    await server.tick();
    page.session.close();
    const reloaded = await server.open();
    const lamp = lampIn(reloaded);
    reloaded.light.follow(lamp);
    await server.ticks(2);
    expect(reloaded.light.content.object(20)!.parent).toBe(lamp);
  });

  it('has those of its name in order', async () => {
    const page = await server.open();
    const lamps = [lampIn(page), lampIn(page)];
    for (const lamp of lamps) page.light.follow(lamp);
    await server.ticks(3);
    page.session.close();
    const reloaded = await server.open();
    const again = [lampIn(reloaded), lampIn(reloaded)];
    for (const lamp of again) reloaded.light.follow(lamp);
    await server.ticks(3);
    expect(again.map((lamp) => reloaded.light.content.nodeOf(lamp))).toEqual([10, 11]);
    expect(server.lights.size).toBe(2);
  });

  it('is the one of the server’s file, though it is made late, and not one that edits have added', async () => {
    await lit();
    const page = await server.open([
      { node: 3, name: 'lamp' },
      { node: 4, name: 'door' },
    ]);
    await server.tick();
    const lamp = lampIn(page);
    page.light.follow(lamp);
    await server.ticks(2);
    expect(page.light.content.nodeOf(lamp)).toBe(3);
    expect(page.edits()[0]).toMatchObject({ edit: 'move_node', node: 3 });
    expect(page.warnings).toEqual([]);
  });

  it('is not mistaken for what others have added when the file’s names come', async () => {
    await lit();
    let tell = (_names: readonly NamedNode[]): void => {};
    const page = await server.open(new Promise((resolve) => (tell = resolve)));
    const lamp = lampIn(page);
    await server.tick();
    expect(lightsOf(page)).toHaveLength(2);
    tell([{ node: 3, name: 'lamp' }]);
    await server.tick();
    expect(page.light.content.nodeOf(lamp)).toBe(3);
    expect(page.warnings).toEqual([]);
  });

  it('is added once where the server refuses it', async () => {
    const page = await server.open();
    const lamp = lampIn(page);
    page.light.follow(lamp);
    vi.spyOn(page.session, 'edit').mockRejectedValue(new Error('too many lights'));
    await server.ticks(4);
    expect(page.session.edit).toHaveBeenCalledOnce();
    expect(page.warnings).toHaveLength(2);
    expect(page.warnings[1]).toBe('lamp: too many lights');
  });
});

describe('a light that is no longer followed', () => {
  it('goes from the server’s scene and stays in the page’s', async () => {
    const page = await server.open();
    const lamp = lampIn(page);
    const unfollow = page.light.follow(lamp);
    const other = await server.open();
    await server.ticks(3);
    expect(lightsOf(other)).toHaveLength(1);
    unfollow();
    lamp.position.x = 1;
    await server.ticks(2);
    expect(page.edits().slice(1)).toEqual([{ edit: 'remove_node', node: 10 }]);
    expect(server.lights.size).toBe(0);
    expect(lightsOf(page)).toEqual([lamp]);
    expect(lightsOf(other)).toEqual([]);
    page.light.follow(lamp);
    await server.ticks(3);
    expect([...server.lights.keys()]).toEqual([11]);
    expect(page.light.content.nodeOf(lamp)).toBe(11);
  });

  it('goes too when its number had not come yet', async () => {
    const page = await server.open();
    await server.tick();
    const unfollow = page.light.follow(lampIn(page));
    server.draw(page);
    unfollow();
    await server.ticks(3);
    expect(page.edits()).toMatchObject([{ edit: 'add_light' }, { edit: 'remove_node', node: 10 }]);
    expect(page.warnings).toHaveLength(1);
  });

  it('is the same when it is followed again before its number has come', async () => {
    const page = await server.open();
    await server.tick();
    const lamp = lampIn(page);
    const unfollow = page.light.follow(lamp);
    server.draw(page);
    unfollow();
    page.light.follow(lamp);
    await server.ticks(3);
    expect([...server.lights.keys()]).toEqual([10]);
    lamp.position.x = 3;
    await server.ticks(2);
    expect(server.lights.get(10)!.transform!.translation).toEqual([3, 0, 0]);
  });

  it('was never added where nothing had been sent', async () => {
    const page = await server.open();
    page.light.follow(lampIn(page))();
    await server.ticks(2);
    expect(page.edits()).toEqual([]);
  });

  it('stays where another page has it too, until that one goes', async () => {
    const page = await server.open();
    const unfollow = page.light.follow(lampIn(page));
    await server.ticks(3);
    const other = await server.open();
    other.light.follow(lampIn(other));
    await server.ticks(3);
    expect(server.lights.size).toBe(1);
    unfollow();
    await server.ticks(2);
    expect([...server.lights.keys()]).toEqual([10]);
    other.light.dispose();
    await server.ticks(2);
    expect(server.lights.size).toBe(0);
  });

  it('stays where somebody has changed it', async () => {
    const page = await server.open();
    const unfollow = page.light.follow(lampIn(page));
    await server.ticks(3);
    const other = await server.open();
    void other.session.edit({ edit: 'set_light', node: 10, intensity: 3 });
    await server.ticks(2);
    unfollow();
    await server.ticks(2);
    expect([...server.lights.keys()]).toEqual([10]);
  });

  it('goes with the page’s light, which ends the session when the server has heard of it', async () => {
    const { page } = await lit();
    page.light.dispose();
    expect(page.session.status.state).toBe('connected');
    await server.tick();
    expect(server.lights.size).toBe(0);
    expect(page.session.status.state).toBe('closed');
  });

  it('ends the session in any case', async () => {
    const { page } = await lit();
    page.light.dispose();
    await vi.advanceTimersByTimeAsync(900);
    expect(page.session.status.state).toBe('connected');
    await vi.advanceTimersByTimeAsync(200);
    expect(page.session.status.state).toBe('closed');
  });
});

describe('a followed light that somebody removes', () => {
  it('stays in its page and is added anew', async () => {
    const { page, lamp } = await lit();
    server.accept({ edit: 'remove_node', node: 10 });
    lamp.position.x = 5;
    server.draw(page);
    await server.tick();
    expect(lightsOf(page)).toEqual([lamp]);
    await server.ticks(2);
    expect([...server.lights.keys()]).toEqual([11]);
    expect(server.lights.get(11)!.transform!.translation).toEqual([5, 0, 0]);
    lamp.position.x = 6;
    await server.ticks(2);
    expect(server.lights.get(11)!.transform!.translation).toEqual([6, 0, 0]);
    // It was said once, and nothing of edits that came too late.
    expect(page.warnings).toHaveLength(1);
  });

  it('is added anew when there is a connection again', async () => {
    const { page, lamp } = await lit();
    page.net.link.break('gone');
    await vi.advanceTimersByTimeAsync(10);
    server.accept({ edit: 'remove_node', node: 10 });
    await server.ticks(2);
    expect(server.lights.size).toBe(0);
    await vi.advanceTimersByTimeAsync(300);
    await server.join(page);
    await server.ticks(4);
    expect([...server.lights.keys()]).toEqual([11]);
    expect(lightsOf(page)).toEqual([lamp]);
  });

  it('that another page has added goes from this one', async () => {
    await lit();
    const other = await server.open();
    await server.tick();
    const [shown] = lightsOf(other);
    other.light.follow(shown);
    server.accept({ edit: 'remove_node', node: 10 });
    await server.ticks(1);
    expect(lightsOf(other)).toEqual([]);
    await server.ticks(3);
    expect(other.edits()).toEqual([]);
  });

  it('by a restart is added anew, and not mistaken for one that has its number now', async () => {
    const page = await server.open();
    const lamp = lampIn(page, '');
    page.light.follow(lamp);
    await server.ticks(3);
    page.net.link.break('gone');
    await vi.advanceTimersByTimeAsync(300);
    server.restart();
    server.accept({ edit: 'add_light', node: 10, light: { type: 'point' } });
    await server.join(page);
    await server.ticks(4);
    expect(page.light.content.nodeOf(lamp)).not.toBe(10);
    expect(server.lights.size).toBe(2);
    expect(lightsOf(page)).toHaveLength(2);
  });
});

it.each([
  ['lamp', 'lamp'],
  ['a\nb\u0007c\ud800d', 'abcd'],
  ['\n', undefined],
  ['', undefined],
  ['ä'.repeat(40), 'ä'.repeat(32)],
  [`${'x'.repeat(63)}ä`, 'x'.repeat(63)],
  [`${'x'.repeat(61)}💡`, 'x'.repeat(61)],
])('the node of %j is named %j', (name, wanted) => {
  expect(nodeName(Object.assign(new Object3D(), { name }))).toBe(wanted);
});
