/** A page that adds lamps of its own to the server's scene, one for each name it is given. */
import { connect, type LumencastLight } from '@lumencast/three';
import { PerspectiveCamera, PointLight, Scene, WebGLRenderer } from 'three';

const query = new URLSearchParams(location.search);
const [scene, camera] = [new Scene(), new PerspectiveCamera()];
const light = await connect(query.get('server')!, { scene, renderer: new WebGLRenderer() });
const own = query.getAll('lamp').map((name) => Object.assign(new PointLight(0xffffff, 3), { name }));
for (const lamp of own) {
  scene.add(lamp);
  light.follow(lamp);
}
setInterval(() => light.update(camera), 50);

window.lamps = {
  light,
  nodes: () => own.map((lamp) => light.content.nodeOf(lamp)),
  lights() {
    let count = 0;
    scene.traverse((object) => void (count += object instanceof PointLight ? 1 : 0));
    return count;
  },
};

declare global {
  interface Window {
    lamps?: {
      readonly light: LumencastLight;
      /** Nodes of the page's own lamps, as far as they are known. */
      nodes(): (number | undefined)[];
      /** How many point lights the page shows. */
      lights(): number;
    };
  }
}
