import type { Object3D, Scene } from 'three';
import { changedParts, FOLLOW_INTERVAL, type Pose, poseOf, worldPoseOf } from './follow.js';
import type { LightSession } from './light.js';
import { describeLight, isPunctualLight } from './lights.js';
import { matchNames, type NamedNode } from './names.js';
import type { Replica } from './replica.js';

/** Edits of one object that may be under way at once: more would only queue on a slow link. */
const MAX_UNDER_WAY = 4;
/** States of a session in which there is nobody to send edits to, and never will be. */
const NOBODY: ReadonlySet<string> = new Set<LightSession['status']['state']>(['saved', 'closed']);

interface Followed {
  readonly object: Object3D;
  node: number | undefined;
  release: (() => void) | undefined;
  sent: Pose | undefined;
  sentAt: number;
  /** Whether it was said that the server gets it as a new light. */
  isAnnounced: boolean;
  /** Edits that the server has not dealt with yet. */
  readonly underWay: Set<Promise<void>>;
}

/** The objects that this page moves, and that the server and everyone else follow. */
export class Following {
  readonly #followed = new Map<Object3D, Followed>();
  /** Until it is known which objects of the page's own scene stand for which nodes. */
  #matching = false;

  constructor(
    private readonly session: Pick<LightSession, 'status' | 'edit'>,
    private readonly replica: Replica,
    private readonly warn: (message: string) => void,
  ) {}

  /** @throws Error when the server cannot know the object. */
  add(object: Object3D): void {
    if (this.#followed.has(object)) return;
    const node = this.#nodeOf(object);
    if (node === undefined && !isPunctualLight(object) && !this.#matching) throw new Error(unknown(object));
    const [release, sent, sentAt, underWay] = [undefined, undefined, 0, new Set<Promise<void>>()];
    const followed: Followed = { object, node, release, sent, sentAt, isAnnounced: false, underWay };
    if (node !== undefined) {
      followed.release = this.replica.hold(node);
      followed.sent = this.#poseOf(followed);
    }
    this.#followed.set(object, followed);
  }

  remove(object: Object3D): void {
    const followed = this.#followed.get(object);
    if (!followed) return;
    this.#sendNow(followed, performance.now());
    this.#followed.delete(object);
    // The last of our edits must be in the server's order before others' show again.
    void Promise.all(followed.underWay).then(() => followed.release?.());
  }

  clear(): void {
    for (const object of [...this.#followed.keys()]) this.remove(object);
  }

  /** Sends what has changed, of each object at most 30 times a second. */
  send(now: number): void {
    for (const followed of this.#followed.values()) {
      if (now - followed.sentAt < FOLLOW_INTERVAL || followed.underWay.size >= MAX_UNDER_WAY) continue;
      this.#sendNow(followed, now);
    }
  }

  /** After a snapshot, what is followed is sent anew. */
  restart(): void {
    for (const followed of this.#followed.values()) {
      followed.sent = undefined;
      const { node } = followed;
      if (node !== undefined && this.replica.content.object(node) === undefined) followed.node = undefined;
    }
  }

  /** Finds what stands for the server's nodes in a scene of the page's own. */
  async match(names: Promise<readonly NamedNode[]>, scene: Scene): Promise<void> {
    this.#matching = true;
    try {
      const { pairs, ambiguous } = matchNames(await names, scene);
      // What a program has said itself counts.
      this.replica.setNodes(pairs.filter(([, node]) => this.replica.content.object(node) === undefined));
      if (ambiguous.length > 0)
        this.warn(`setNode must say which objects are the server's, of those named ${ambiguous.join(', ')}`);
    } catch (error) {
      if (this.session.status.state === 'closed') return;
      this.warn(`the server's scene is not known, setNode must tell it: ${(error as Error).message}`);
    } finally {
      this.#matching = false;
    }
    for (const followed of this.#followed.values()) this.#settle(followed);
  }

  /** Looks again at what was followed before the server's nodes were known. */
  #settle(followed: Followed): void {
    const { object } = followed;
    followed.node ??= this.#nodeOf(object);
    if (followed.node !== undefined) followed.release ??= this.replica.hold(followed.node);
    else if (!isPunctualLight(object)) {
      this.#followed.delete(object);
      this.warn(`${unknown(object)}: nobody follows it`);
    }
  }

  /** The node that an object moves; a light that only hangs below one is none. */
  #nodeOf(object: Object3D): number | undefined {
    const { content } = this.replica;
    const node = content.nodeOf(object);
    const isOther = node !== undefined && isPunctualLight(object) && content.light(node) !== object;
    return isOther ? undefined : node;
  }

  #sendNow(followed: Followed, now: number): void {
    if (NOBODY.has(this.session.status.state)) return;
    if (followed.node === undefined) {
      if (!this.#matching) this.#adopt(followed, now);
      return;
    }
    const { node, sent } = followed;
    const pose = this.#poseOf(followed);
    const transform = changedParts(sent?.transform, pose.transform);
    const light = pose.light && changedParts(sent?.light, pose.light);
    if (!transform && !light) return;
    followed.sent = pose;
    followed.sentAt = now;
    this.replica.revision++;
    if (transform) this.#track(followed, this.session.edit({ edit: 'move_node', node, ...transform }));
    if (light) this.#track(followed, this.session.edit({ edit: 'set_light', node, ...light }));
  }

  #poseOf({ object, node }: Followed): Pose {
    const { replica } = this;
    if (isPunctualLight(object) && (node === undefined || replica.isAdopted(node)))
      return worldPoseOf(object);
    if (node === undefined) return poseOf(object, undefined);
    return poseOf(replica.content.object(node) ?? object, replica.content.light(node));
  }

  #adopt(followed: Followed, now: number): void {
    const { object } = followed;
    if (!isPunctualLight(object) || followed.underWay.size > 0) return;
    if (!followed.isAnnounced)
      this.warn(`${nameFor(object)} is no light of the server's scene, and is added to it`);
    followed.isAnnounced = true;
    const pose = this.#poseOf(followed);
    followed.sent = pose;
    followed.sentAt = now;
    const adopted = this.replica.adoptLight(object, describeLight(object), pose.transform).then((node) => {
      followed.node = node;
      followed.release = this.replica.hold(node);
    });
    this.#track(followed, adopted);
  }

  #track(followed: Followed, edit: Promise<void>): void {
    const { object, underWay } = followed;
    const settled = edit
      .catch((error: unknown) => {
        if (this.#followed.has(object)) this.warn(`${nameFor(object)}: ${(error as Error).message}`);
      })
      .finally(() => underWay.delete(settled));
    underWay.add(settled);
  }
}

function unknown(object: Object3D): string {
  return `${nameFor(object)} is not part of the server's scene, and not a light`;
}

/** What a message calls an object. */
function nameFor({ name, type }: Object3D): string {
  return name || type;
}
