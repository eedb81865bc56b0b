import type { LightSession } from './light-session.js';

/** The name of the file that a URI stands for; what is no sequence of UTF-8 stays as it is. */
export function nameOf(uri: string): string {
  return uri.replace(/(?:%[0-9a-f]{2})+/gi, (bytes) => {
    try {
      return decodeURIComponent(bytes);
    } catch {
      return bytes;
    }
  });
}

/** The address of a file of a session's scene, by its name. */
export function sceneFile({ files }: Pick<LightSession, 'files'>, name: string): string {
  return new URL(name.split('/').map(encodeURIComponent).join('/'), files).href;
}

/** Files that saved light brings along, at addresses of their own until a server is there. */
export class SavedFiles {
  readonly #addresses = new Map<Uint8Array, string>();

  constructor(private readonly session: LightSession) {}

  /** Where the file lies that the session has at an address, if it came with the light. */
  addressInstead(address: string): string | undefined {
    const { saved, status } = this.session;
    if (status.state === 'connected') return undefined;
    for (const [name, bytes] of saved?.files ?? []) {
      if (sceneFile(this.session, name) === address) return this.#addressOf(bytes);
    }
    return undefined;
  }

  dispose(): void {
    for (const address of this.#addresses.values()) URL.revokeObjectURL(address);
    this.#addresses.clear();
  }

  #addressOf(bytes: Uint8Array): string {
    let address = this.#addresses.get(bytes);
    if (address === undefined) {
      address = URL.createObjectURL(new Blob([bytes.slice()]));
      this.#addresses.set(bytes, address);
    }
    return address;
  }
}
