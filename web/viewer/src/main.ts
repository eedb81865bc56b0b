import { connect, type ConnectOptions, type Session } from '@lumencast/client';
import './style.css';
import { openPage } from './page.js';

/** What the server says of itself, under `/lumencast.json`. */
interface Served {
  /** Name of the scene's broadcast. */
  readonly broadcast: string;
  /** The scene's file under `/scene/`. */
  readonly root: string;
}

/**
 * Parameters of the page's address: `?light=` names a `.light` file to show until the server's light
 * comes, and together with `?gltf=`, the scene's file, instead of any server.
 */
const query = new URLSearchParams(location.search);

void openPage(async () => {
  const [light, gltf] = [query.get('light'), query.get('gltf')];
  const saved = light === null ? undefined : await readLight(light);
  if (saved && gltf !== null) {
    const file = new URL(gltf, location.href);
    const name = decodeURIComponent(file.pathname.split('/').at(-1) ?? '') || 'scene';
    return { name, file: file.href, connect: () => savedLight(name, saved) };
  }
  const response = await fetch('/lumencast.json').catch(() => undefined);
  if (!response?.ok) throw new Error(`The server does not answer${response ? ` (${response.status})` : ''}.`);
  const { broadcast, root } = (await response.json()) as Served;
  const address = new URL(`/${encodeURIComponent(broadcast)}${location.search}`, location.href);
  const options: ConnectOptions = { scene: broadcast, transport: transport(), ...(saved && { saved }) };
  return {
    name: root,
    file: new URL(`/scene/${root.split('/').map(encodeURIComponent).join('/')}`, location.href).href,
    connect: () => connect(address, options),
  };
});

async function readLight(address: string): Promise<Uint8Array> {
  const response = await fetch(new URL(address, location.href)).catch(() => undefined);
  if (!response?.ok) throw new Error(`${address} cannot be read${response ? ` (${response.status})` : ''}.`);
  return new Uint8Array(await response.arrayBuffer());
}

/** A session that asks no server. */
function savedLight(scene: string, saved: Uint8Array): Session {
  const connector = () => Promise.reject(new Error('there is none'));
  const session = connect(location.origin, { scene, saved, connector });
  session.close('this is saved light, without a server');
  return session;
}

/** `?transport=websocket` and the like, for measurements and for networks that swallow UDP. */
function transport(): NonNullable<ConnectOptions['transport']> {
  const asked = query.get('transport');
  return asked === 'webtransport' || asked === 'websocket' ? asked : 'auto';
}
