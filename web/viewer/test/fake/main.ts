import '../../src/style.css';
import { openPage } from '../../src/page.js';
import { FakeSession } from './session.js';

/** The page without a server: `npm run dev`, then /test/fake/?file=/@fs/…/Sponza.glb&size=30,12,18 */
const query = new URLSearchParams(location.search);
const numbers = (name: string, otherwise: string) => (query.get(name) ?? otherwise).split(',').map(Number);

void openPage(async () => ({
  name: 'fake',
  file: query.get('file') ?? '',
  connect: () =>
    new FakeSession({
      center: numbers('center', '0,0,0') as [number, number, number],
      size: numbers('size', '10,10,10') as [number, number, number],
      radiance: Number(query.get('radiance') ?? 0.3),
      rotation: [
        0,
        Math.sin(Number(query.get('turn') ?? 0) / 2),
        0,
        Math.cos(Number(query.get('turn') ?? 0) / 2),
      ],
    }),
}));
