import { connect, type ConnectOptions, fetchLight, openLight, type Session } from '@lumencast/client';
import './style.css';
import { openPage } from './page.js';
import { Failure } from './words.js';

/** What the server says of itself, in `lumencast.json`. */
interface Served {
  /** Name of the scene's broadcast. */
  readonly broadcast: string;
  /** The scene's file under `scene/`. */
  readonly root: string;
}

/**
 * Parameters of the page's address: `?light=` names a `.light` file to show until the server's light
 * comes, and together with `?gltf=`, the scene's file, instead of any server.
 */
const query = new URLSearchParams(location.search);

/** An address beside the page, which a proxy may have under any path. */
const beside = (path: string) => new URL(path, location.href);

void openPage(async () => {
  const [light, gltf] = [query.get('light'), query.get('gltf')];
  const saved = light === null ? undefined : await readLight(beside(light));
  if (saved && gltf !== null) {
    const file = beside(gltf);
    const name = decodeURIComponent(file.pathname.split('/').at(-1) ?? '') || 'scene';
    return { name, file: file.href, connect: () => withFile(() => openLight(saved, { files: file })) };
  }
  const { broadcast, root } = await askServer();
  const address = beside(`./${encodeURIComponent(broadcast)}${location.search}`);
  const options: ConnectOptions = { scene: broadcast, transport: transport(), ...(saved && { saved }) };
  return {
    name: root,
    file: beside(`scene/${root.split('/').map(encodeURIComponent).join('/')}`).href,
    connect: () => withFile(() => connect(address, options)),
  };
});

async function askServer(): Promise<Served> {
  const address = beside('lumencast.json');
  const response = await fetch(address).catch((cause: unknown) => {
    throw new Failure('The server does not answer.', 'Is it still running? Its terminal says more.', {
      cause,
    });
  });
  const served = response.ok ? await response.json().catch(() => undefined) : undefined;
  if (isServed(served)) return served;
  throw new Failure(
    'There is no Lumencast server here.',
    'lumencast serve starts one. Saved light is shown by ?light=FILE.light&gltf=FILE.glb.',
    { cause: new Error(`${address.href} answers ${response.status}`) },
  );
}

function isServed(value: unknown): value is Served {
  const { broadcast, root } = (value ?? {}) as Partial<Served>;
  return typeof broadcast === 'string' && typeof root === 'string';
}

async function readLight(address: URL): Promise<Uint8Array> {
  return fetchLight(address).catch((cause: unknown) => {
    throw new Failure(
      `The file of the light does not come: ${(cause as Error).message}`,
      'Is its name right, and is it where this address says?',
      { cause },
    );
  });
}

/** Makes a session, which reads the saved light if there is any. */
function withFile(session: () => Session): Session {
  try {
    return session();
  } catch (cause) {
    throw new Failure(
      'The file of the light cannot be read.',
      'Has lumencast bake of this version written it?',
      { cause },
    );
  }
}

/** `?transport=websocket` and the like, for measurements and for networks that swallow UDP. */
function transport(): NonNullable<ConnectOptions['transport']> {
  const asked = query.get('transport');
  return asked === 'webtransport' || asked === 'websocket' ? asked : 'auto';
}
