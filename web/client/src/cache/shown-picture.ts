import type { LumelPicture, LumelRegion } from '../api.js';
import type { Tile } from '../codec/lightmap-shape.js';
import { Passage } from './passage.js';

/** Of all pictures of all lightmaps, so that a region that comes anew has another one. */
let revisions = 0;

/** The picture that is shown of a region, and the passage to it. */
export class ShownPicture {
  private picture: LumelPicture | undefined;
  private revision = 0;
  private readonly passage = new Passage();

  constructor(
    private readonly region: number,
    private readonly tile: Tile,
  ) {}

  get lit(): boolean {
    return this.picture !== undefined;
  }

  /** Shows another picture, or another part of what is kept in the same. */
  replace(picture: LumelPicture): void {
    this.picture = picture;
    this.revision = ++revisions;
  }

  /** The passage to the picture begins; see {@link Passage.begin}. */
  begin(now: number, made: number): void {
    this.passage.begin(now, made);
  }

  /** The region at `now`; `undefined` before there is a picture. */
  at(now: number): LumelRegion | undefined {
    const { picture, region, revision, tile } = this;
    return picture && { region, ...tile, revision, picture, shown: this.passage.at(now) };
  }
}
