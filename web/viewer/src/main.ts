import { connect, type ConnectOptions } from '@lumencast/client';
import './style.css';
import { openPage } from './page.js';

/** What the server says of itself, under `/lumencast.json`. */
interface Served {
  /** Name of the scene's broadcast. */
  readonly broadcast: string;
  /** The scene's file under `/scene/`. */
  readonly root: string;
}

void openPage(async () => {
  const response = await fetch('/lumencast.json').catch(() => undefined);
  if (!response?.ok) throw new Error(`The server does not answer${response ? ` (${response.status})` : ''}.`);
  const { broadcast, root } = (await response.json()) as Served;
  const address = new URL(`/${encodeURIComponent(broadcast)}${location.search}`, location.href);
  return {
    name: root,
    file: new URL(`/scene/${root.split('/').map(encodeURIComponent).join('/')}`, location.href).href,
    connect: () => connect(address, { scene: broadcast, transport: transport() }),
  };
});

/** `?transport=websocket` and the like, for measurements and for networks that swallow UDP. */
function transport(): NonNullable<ConnectOptions['transport']> {
  const asked = new URLSearchParams(location.search).get('transport');
  return asked === 'webtransport' || asked === 'websocket' ? asked : 'auto';
}
