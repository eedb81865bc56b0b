import type { Edit } from '@lumencast/client';
import type { Object3D, Scene } from 'three';
import { changedParts, FOLLOW_INTERVAL, type Pose, poseOf, worldPoseOf } from './follow.js';
import type { LightSession } from './light-session.js';
import { isPunctualLight, type PunctualLight } from './lights.js';
import { matchNames, type NamedNode } from './names.js';
import type { Replica } from './replica.js';

/** Edits of one object that may be under way at once: more would only queue on a slow link. */
const MAX_UNDER_WAY = 4;
/** States of a session in which there is nobody to send edits to, and never will be. */
const NOBODY: ReadonlySet<string> = new Set<LightSession['status']['state']>(['saved', 'closed']);

interface Followed {
  readonly object: Object3D;
  /** The object where it is a light of the program's own, which the server may be given. */
  readonly light: PunctualLight | undefined;
  node: number | undefined;
  release: (() => void) | undefined;
  sent: Pose | undefined;
  sentAt: number;
  /** Whether it was said that the server gets it as a new light. */
  isAnnounced: boolean;
  /** Whether another client has sent edits of it, too. */
  isShared: boolean;
  /** Whether the server has refused it as a new light; it is tried again after a snapshot. */
  isRefused: boolean;
  /** Edits that the server has not dealt with yet. */
  readonly underWay: Set<Promise<void>>;
}

/** The objects that this page moves, and that the server and everyone else follow. */
export class Following {
  readonly #followed = new Map<Object3D, Followed>();
  /** What is followed no more, until the server has dealt with it. */
  readonly #ending = new Map<Object3D, Followed>();
  /** Until it is known which objects of the page's own scene stand for which nodes. */
  #matching = false;
  /** The server's nodes that have names; none where its file is loaded, which holds them. */
  #names: readonly NamedNode[] = [];
  /** Whether a snapshot has told what edits have added. */
  #joined = false;

  constructor(
    private readonly session: Pick<LightSession, 'status' | 'edit'>,
    private readonly replica: Replica,
    private readonly warn: (message: string) => void,
  ) {}

  /** @throws Error when the server cannot know the object. */
  add(object: Object3D): void {
    if (this.#followed.has(object)) return;
    const ending = this.#ending.get(object);
    // Its first edit is still on its way, and brings its node.
    if (ending?.light && ending.node === undefined) return void this.#followed.set(object, ending);
    const node = this.#nodeOf(object);
    if (node === undefined && !isPunctualLight(object) && !this.#matching) throw new Error(unknown(object));
    const isOwn = node === undefined || this.replica.isAdopted(node);
    const followed: Followed = {
      object,
      light: isOwn && isPunctualLight(object) ? object : undefined,
      node: undefined,
      release: undefined,
      sent: undefined,
      sentAt: 0,
      isAnnounced: false,
      isShared: false,
      isRefused: false,
      underWay: new Set(),
    };
    this.#stand(followed, node);
    if (node !== undefined) followed.sent = this.#poseOf(followed);
    this.#followed.set(object, followed);
  }

  /** Returns what the server has still to answer, if anything. */
  remove(object: Object3D): Promise<void> | undefined {
    const followed = this.#followed.get(object);
    if (!followed) return undefined;
    if (this.#isOursAlone(followed)) this.#takeBack(followed);
    else if (followed.node !== undefined) this.#sendChanges(followed, performance.now());
    this.#followed.delete(object);
    if (followed.underWay.size > 0) return this.#end(followed);
    followed.release?.();
    return undefined;
  }

  /** Returns what the server has still to answer, if anything. */
  clear(): Promise<unknown> | undefined {
    const ends = [...this.#followed.keys()].map((object) => this.remove(object)).filter((end) => end);
    return ends.length > 0 ? Promise.all(ends) : undefined;
  }

  /** The last of our edits must be in the server's order before others' show again. */
  async #end(followed: Followed): Promise<void> {
    const { object } = followed;
    this.#ending.set(object, followed);
    await Promise.all(followed.underWay);
    this.#ending.delete(object);
    if (this.#followed.get(object) === followed) return;
    if (this.#isOursAlone(followed)) {
      // It was still on its way to the server.
      this.#takeBack(followed);
      await Promise.all(followed.underWay);
    }
    followed.release?.();
  }

  /** Whether the server has it from this page alone. */
  #isOursAlone({ node, isShared }: Followed): boolean {
    return node !== undefined && this.replica.isAdopted(node) && !isShared;
  }

  #takeBack(followed: Followed): void {
    const { node } = followed;
    if (node === undefined || NOBODY.has(this.session.status.state)) return;
    this.replica.disown(node);
    this.#stand(followed, undefined);
    this.#track(followed, this.session.edit({ edit: 'remove_node', node }), node);
  }

  /** Another client's edit has been accepted. */
  heard(edit: Edit): void {
    const node = 'node' in edit ? edit.node : undefined;
    const parent = 'parent' in edit ? edit.parent : undefined;
    for (const followed of this.#followed.values()) {
      if (followed.node === undefined) continue;
      followed.isShared ||= followed.node === node || followed.node === parent;
    }
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
    this.#joined = true;
    for (const followed of this.#followed.values()) {
      followed.sent = undefined;
      followed.isRefused = false;
    }
  }

  /** Finds what stands for the server's nodes in a scene of the page's own. */
  async match(names: Promise<readonly NamedNode[]>, scene: Scene): Promise<void> {
    this.#matching = true;
    try {
      this.#names = await names;
      const isAdded = (object: Object3D) => this.replica.isAdded(object);
      const { pairs, ambiguous } = matchNames(this.#names, scene, isAdded);
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
    if (followed.node === undefined) this.#stand(followed, this.#nodeOf(object));
    if (followed.node !== undefined || isPunctualLight(object)) return;
    this.#followed.delete(object);
    this.warn(`${unknown(object)}: nobody follows it`);
  }

  /** The node that an object moves; a light that only hangs below one is none. */
  #nodeOf(object: Object3D): number | undefined {
    const { content } = this.replica;
    const node = content.nodeOf(object);
    const isOther = node !== undefined && isPunctualLight(object) && content.light(node) !== object;
    return isOther ? undefined : node;
  }

  /** Lets a followed object stand for a node, or for none. */
  #stand(followed: Followed, node: number | undefined): void {
    followed.release?.();
    followed.node = node;
    followed.release = node === undefined ? undefined : this.replica.hold(node);
    followed.sent = undefined;
    followed.isShared = false;
  }

  #sendNow(followed: Followed, now: number): void {
    const { object, light, underWay } = followed;
    // Its node may have been removed, or its object set for another.
    if (followed.node !== undefined && this.#nodeOf(object) !== followed.node)
      this.#stand(followed, this.#nodeOf(object));
    if (followed.node === undefined && light && underWay.size === 0 && !this.#matching)
      this.#place(followed, light, now);
    this.#sendChanges(followed, now);
  }

  #sendChanges(followed: Followed, now: number): void {
    const { node, sent } = followed;
    if (node === undefined || NOBODY.has(this.session.status.state)) return;
    const pose = this.#poseOf(followed);
    const transform = changedParts(sent?.transform, pose.transform);
    const light = pose.light && changedParts(sent?.light, pose.light);
    if (!transform && !light) return;
    followed.sent = pose;
    followed.sentAt = now;
    this.replica.revision++;
    if (transform) this.#track(followed, this.session.edit({ edit: 'move_node', node, ...transform }), node);
    if (light) this.#track(followed, this.session.edit({ edit: 'set_light', node, ...light }), node);
  }

  #poseOf({ object, node }: Followed): Pose {
    const { replica } = this;
    if (isPunctualLight(object) && (node === undefined || replica.isAdopted(node)))
      return worldPoseOf(object);
    if (node === undefined) return poseOf(object, undefined);
    return poseOf(replica.content.object(node) ?? object, replica.content.light(node));
  }

  /** Finds a light's node by its name, in the server's file or among what edits have added, or adds it. */
  #place(followed: Followed, light: PunctualLight, now: number): void {
    if (!this.#joined || this.session.status.state !== 'connected') return;
    const { replica } = this;
    const inFile = this.#inFile(light);
    const node = inFile ?? replica.findAdded(light);
    if (node === undefined) return followed.isRefused ? undefined : this.#adopt(followed, light, now);
    // Held before it is set: what the page has made of it counts.
    this.#stand(followed, node);
    if (inFile === undefined) replica.takeOver(node, light);
    else replica.setNodes([[light, node]]);
  }

  /** The node of the server's file that has a light's name, and for which nothing stands yet. */
  #inFile(light: PunctualLight): number | undefined {
    const free = this.#names.filter(({ node }) => this.replica.content.object(node) === undefined);
    return matchNames(free, light).pairs.find(([object]) => object === light)?.[1];
  }

  #adopt(followed: Followed, light: PunctualLight, now: number): void {
    if (!followed.isAnnounced)
      this.warn(`${nameFor(light)} is no light of the server's scene, and is added to it`);
    followed.isAnnounced = true;
    const pose = this.#poseOf(followed);
    followed.sentAt = now;
    const adopted = this.replica.adoptLight(light, pose.transform).then(
      (node) => {
        this.#stand(followed, node);
        if (node !== undefined) followed.sent = pose;
      },
      (error: unknown) => {
        followed.isRefused = true;
        throw error;
      },
    );
    this.#track(followed, adopted);
  }

  #track(followed: Followed, edit: Promise<void>, node?: number): void {
    const { object, underWay } = followed;
    const settled = edit
      .catch((error: unknown) => {
        // What has been removed meanwhile is added anew.
        const isGone = node !== undefined && this.#nodeOf(object) !== node;
        if (this.#followed.has(object) && !isGone)
          this.warn(`${nameFor(object)}: ${(error as Error).message}`);
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
