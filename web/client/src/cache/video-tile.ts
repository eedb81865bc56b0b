import type { LumelRegion, Planes } from '../api.js';
import type { Tile } from '../codec/lightmap-shape.js';
import { splitVideoFrame, type VideoHeader } from '../codec/video-frame.js';
import { WireError } from '../wire-error.js';
import type { Arrival, OnLight, Received } from './field.js';
import type { PictureDecoder } from './picture-decoder.js';
import { ShownPicture } from './shown-picture.js';
import type { TileCache } from './tile.js';

/**
 * A page that is coded as video. Its pictures come some time after their frames; the passage to one begins
 * at the last look before it came, so that it gets on with every look, however seldom that is.
 */
export class VideoTile implements TileCache {
  newest: Arrival | undefined;
  private readonly shown: ShownPicture;
  private decoder: PictureDecoder | undefined;
  /** The newest update that the decoder has; `undefined` where it needs a keyframe. */
  private sent: number | undefined;
  /** The newest keyframe that it has. */
  private key = -1;
  /** The run of the server, counted; pictures of another one are late. */
  private run = 0;
  /** The newest frame without a picture, and the update of the picture that it confirms. */
  private confirmed: { readonly arrival: Arrival; readonly picture: number } | undefined;
  /** When it was last looked at. */
  private looked: number | undefined;
  /** Seconds in which the light was made that came since then. */
  private unseen: number | undefined;

  /** `onLate` is called after `onLight`, which is called outside of {@link add}. */
  constructor(
    private readonly region: number,
    tile: Tile,
    private readonly open: () => PictureDecoder,
    private readonly onLight: OnLight,
    private readonly onLate: () => void,
  ) {
    this.shown = new ShownPicture(region, tile);
  }

  get lit(): boolean {
    return this.shown.lit;
  }

  forgetUpdates(): void {
    this.run++;
    this.sent = undefined;
    this.key = -1;
    this.newest = undefined;
    this.confirmed = undefined;
  }

  add(frame: Uint8Array, now: number, tickSeconds: number): Received {
    const { header: head, unit } = splitVideoFrame(frame);
    const { update, base } = head;
    if (this.sent !== undefined && update <= this.sent) return { head, news: false };
    if (base !== undefined && base !== this.sent) {
      throw new WireError('missing_base', `update ${update} needs ${base}, which is not at hand`);
    }
    if (base === undefined) this.key = update;
    this.sent = update;
    if (unit.length === 0) {
      this.confirm({ head, arrived: now });
      return { head, news: true };
    }
    const run = this.run;
    this.decoder ??= this.open();
    void this.decoder.decode(unit, base === undefined).then((planes) => {
      if (run === this.run) this.came(head, planes, now, tickSeconds);
    });
    const newest = this.newest?.head.update ?? -1;
    return { head, news: update > newest };
  }

  /** The page is still what the frame's base shows, whose picture may be on its way. */
  private confirm(arrival: Arrival & { readonly head: VideoHeader }): void {
    const { base } = arrival.head;
    const { confirmed } = this;
    if (this.newest?.head.update === base) this.newest = arrival;
    else
      this.confirmed = {
        arrival,
        picture: confirmed?.arrival.head.update === base ? confirmed!.picture : base!,
      };
  }

  /** The picture of a frame that came at `arrived` is there, or nothing came of it. */
  private came(head: VideoHeader, planes: Planes | undefined, arrived: number, tickSeconds: number): void {
    if (!planes) {
      // Unless a keyframe is on its way already, later frames have lost their base.
      if (head.update >= this.key) this.sent = undefined;
      return;
    }
    const before = this.newest?.head;
    if (before && head.update <= before.update) return;
    const { scale, toe, octaves } = head;
    this.shown.replace({ kind: 'planes', scale, toe, octaves, ...planes });
    this.newest = this.confirmed?.picture === head.update ? this.confirmed.arrival : { head, arrived };
    this.unseen = (this.unseen ?? 0) + (before ? (head.tick - before.tick) * tickSeconds : 0);
    this.onLight(this.region, head);
    this.onLate();
  }

  at(now: number): LumelRegion | undefined {
    if (this.unseen !== undefined) this.shown.begin(this.looked ?? now, this.unseen);
    this.unseen = undefined;
    this.looked = now;
    return this.shown.at(now);
  }

  close(): void {
    this.run++;
    this.sent = undefined;
    this.decoder?.close();
    this.decoder = undefined;
  }
}
