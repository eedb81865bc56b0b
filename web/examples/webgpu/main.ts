/**
 * The server's scene, drawn by WebGPURenderer, which takes WebGL 2 where the browser has no WebGPU:
 *
 *   lumencast serve cornell
 */
import { connect } from '@lumencast/three/webgpu';
import { AgXToneMapping, PerspectiveCamera, Scene, WebGPURenderer } from 'three/webgpu';

const query = new URLSearchParams(location.search);
const address = query.get('address') ?? 'http://localhost:4443/cornell';

const renderer = new WebGPURenderer({ antialias: true });
renderer.shadowMap.enabled = true;
renderer.toneMapping = AgXToneMapping;
document.body.append(renderer.domElement);

const scene = new Scene();
try {
  const light = await connect(address, { scene, renderer });
  const camera = light.content.cameras[0] as PerspectiveCamera;
  resize(camera);
  addEventListener('resize', () => resize(camera));
  await renderer.setAnimationLoop(() => {
    light.update(camera);
    renderer.render(scene, camera);
  });
} catch (error) {
  document.querySelector('p')!.textContent = (error as Error).message;
}

function resize(camera: PerspectiveCamera): void {
  camera.aspect = innerWidth / innerHeight;
  camera.updateProjectionMatrix();
  renderer.setSize(innerWidth, innerHeight);
}
