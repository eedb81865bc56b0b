/** What the page says when something is not there: a sentence that anybody understands, and the details. */
export interface Words {
  readonly message: string;
  /** What the program says of it, for those who ask. */
  readonly details?: string;
}

/** Why there will be no picture. */
export class Failure extends Error {
  constructor(
    message: string,
    /** What one can do about it. */
    readonly help: string,
    options?: ErrorOptions,
  ) {
    super(message, options);
  }

  get details(): string | undefined {
    return this.cause instanceof Error ? this.cause.message : undefined;
  }
}

/** The parts of a session's status that are said. */
export interface Standing {
  readonly state: string;
  readonly reason?: string;
  /** What keeps a session from its light, where that is known. */
  readonly problem?: string;
}

const PROBLEMS: Readonly<Record<string, string>> = {
  origin: 'The server lets in no pages from this address.',
  stranger: 'What answers here is no Lumencast server.',
  refused: 'The server does not let this page in: the token may be wrong or have expired, or too many watch.',
  scene: 'The server does not show this scene.',
  silent: 'The server answers, but sends no light.',
};

/** How a session stands, in words; `undefined` when there is nothing to say. */
export function wordsFor({ state, reason = '', problem }: Standing, hasLight: boolean): Words | undefined {
  if (state === 'lost') {
    const known = PROBLEMS[problem ?? problemIn(reason)];
    const what = known ?? (hasLight ? 'The server is gone.' : 'The server does not answer.');
    return {
      message: `${what} ${hasLight ? 'The light stays; trying again.' : 'Trying again.'}`,
      details: reason,
    };
  }
  if (state !== 'closed') return undefined;
  const message = /version/.test(`${problem} ${reason}`)
    ? 'This page is of another version than the server. Reload it.'
    : 'The page follows the light no more. Reload it.';
  return { message, details: reason };
}

function problemIn(reason: string): string {
  if (reason.includes('token')) return 'refused';
  return reason.includes('no scene') ? 'scene' : '';
}

/** A file of the page's address that has not come. */
export function missingFile(what: string, address: string, answer: string, cause?: unknown): Failure {
  const message =
    answer === '404' ? `${what} is missing: ${address}` : `${what} does not come (${answer}): ${address}`;
  return new Failure(message, 'Is its name right, and is it where this address says?', { cause });
}

/** What a page shows of a lightmap. */
export interface ShownLumels {
  readonly pages: number;
  readonly pageSize: number;
  /** Meshes that are lit by it. */
  readonly meshes: number;
}

/** What there is of lumels. */
export function lumelWords({ pages, pageSize, meshes }: ShownLumels): string {
  const on = `${pages === 1 ? 'one page' : `${pages} pages`} of ${pageSize} × ${pageSize}`;
  return `On ${on}; they light ${meshes === 1 ? 'one mesh' : `${meshes} meshes`}.`;
}

/** Why a page shows none of a lightmap that a server casts: it travels as video. */
export function unshownWords({ secureContext }: { readonly secureContext: boolean }): string {
  return secureContext
    ? 'They travel as video, which this browser does not decode for pages. Probes light all.'
    : 'They travel as video, which browsers decode only for secure pages. Probes light all. Open the page by https or as localhost.';
}
