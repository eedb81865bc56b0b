/**
 * Light that was computed beforehand, on a page without a server:
 *
 *   lumencast bake room.glb -o room.light
 */
import { show } from '@lumencast/three';
import { AgXToneMapping, PerspectiveCamera, Scene, WebGLRenderer } from 'three';

const renderer = new WebGLRenderer({ antialias: true });
renderer.shadowMap.enabled = true;
renderer.toneMapping = AgXToneMapping;
document.body.append(renderer.domElement);
const camera = new PerspectiveCamera(50, 1, 0.1, 50);
camera.position.set(0, 1.5, 5.2);

const scene = new Scene();
try {
  const light = await show('../room.light', { scene, renderer });
  resize();
  addEventListener('resize', resize);
  renderer.setAnimationLoop((time) => {
    camera.position.x = Math.sin(time / 3000);
    camera.lookAt(0, 1.5, 0);
    camera.updateMatrixWorld();
    light.update(camera);
    renderer.render(scene, camera);
  });
} catch (error) {
  document.querySelector('p')!.textContent = (error as Error).message;
}

function resize(): void {
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.setSize(innerWidth, innerHeight);
}
