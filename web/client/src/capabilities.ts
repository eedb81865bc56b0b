/** What this browser and page allow, with words for the page where something is missing. */
export interface Capabilities {
  /** Whether the page is a secure context, to which alone browsers offer the next two. */
  readonly secureContext: boolean;
  readonly webTransport: boolean;
  readonly webCodecs: boolean;
  readonly webSocket: boolean;
  /** What is missing, what that means, and what helps; empty when all is well. */
  readonly notices: readonly string[];
}

/** Looks at an environment: the page's own unless another is given. */
export function capabilities(environment: object = globalThis): Capabilities {
  const here = environment as {
    isSecureContext?: boolean;
    WebTransport?: unknown;
    VideoDecoder?: unknown;
    WebSocket?: unknown;
  };
  const found = {
    // Outside of browsers there is no such distinction.
    secureContext: here.isSecureContext ?? true,
    webTransport: here.WebTransport !== undefined,
    webCodecs: here.VideoDecoder !== undefined,
    webSocket: here.WebSocket !== undefined,
  };
  return { ...found, notices: notices(found) };
}

function notices(found: Omit<Capabilities, 'notices'>): string[] {
  const { secureContext, webTransport, webCodecs, webSocket } = found;
  const words = [];
  if (!webTransport && !webSocket) {
    words.push('This browser offers neither WebTransport nor WebSocket, so no light can be received.');
  } else if (!webTransport) {
    words.push(
      secureContext
        ? 'This browser has no WebTransport: the light comes over a WebSocket, with more delay on a busy link.'
        : 'Browsers offer WebTransport only to secure pages: the light comes over a WebSocket, with more delay on a busy link. Open the page by https or as localhost.',
    );
  }
  if (!webCodecs) {
    words.push(
      secureContext
        ? 'This browser has no WebCodecs: fields that travel as video are left out.'
        : 'Browsers offer WebCodecs only to secure pages: fields that travel as video are left out. Open the page by https or as localhost.',
    );
  }
  return words;
}
