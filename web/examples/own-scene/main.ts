/**
 * A page that builds its scene in code, and is lit by a server that has the same scene in a file:
 *
 *   npm run dev                      # the page offers room.glb
 *   lumencast serve room.glb         # then the light comes
 */
import { connect } from '@lumencast/three';
import { AgXToneMapping, PerspectiveCamera, WebGLRenderer } from 'three';
import { GLTFExporter } from 'three/addons/exporters/GLTFExporter.js';
import { buildRoom } from './room.js';

const server = new URLSearchParams(location.search).get('server') ?? 'http://localhost:4443';
const words = document.querySelector('p')!;

const renderer = new WebGLRenderer({ antialias: true });
renderer.shadowMap.enabled = true;
renderer.toneMapping = AgXToneMapping;
document.body.append(renderer.domElement);
const camera = new PerspectiveCamera(50, 1, 0.1, 50);
camera.position.set(0, 1.5, 5.2);

const { scene, lamp } = buildRoom();
const file = (await new GLTFExporter().parseAsync(scene, { binary: true })) as ArrayBuffer;
const download = document.createElement('a');
download.href = URL.createObjectURL(new Blob([file]));
download.textContent = download.download = 'room.glb';
download.style.color = 'inherit';
words.append(download, ' ');

// The room is shown at once; the light comes when the server does.
const light = await connect(`${server}/room`, {
  scene,
  renderer,
  onWarning: (message) => words.append(document.createElement('br'), message),
});
light.follow(lamp);

resize();
addEventListener('resize', resize);
renderer.setAnimationLoop((time) => {
  lamp.position.x = Math.sin(time / 2000);
  light.update(camera);
  renderer.render(scene, camera);
});

function resize(): void {
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.setSize(innerWidth, innerHeight);
}
