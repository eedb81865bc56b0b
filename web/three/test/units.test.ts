import {
  BatchedMesh,
  DataTexture,
  DirectionalLight,
  Group,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  PointLight,
  RectAreaLight,
  Scene,
  SkinnedMesh,
  SphereGeometry,
  SpotLight,
} from 'three';
import { describe, expect, it } from 'vitest';
import { unitsTaken } from '../src/units.js';

const map = () => new DataTexture();
const taken = (...materials: Material[]) => {
  const scene = new Scene().add(...materials.map((material) => new Mesh(undefined, material)));
  return [unitsTaken(scene, 'webgl'), unitsTaken(scene, 'webgpu')];
};

/** As GLTFLoader makes one: metalness and roughness are one texture. */
function gltfMaterial(): MeshPhysicalMaterial {
  const rough = map();
  return new MeshPhysicalMaterial({
    map: map(),
    normalMap: map(),
    metalnessMap: rough,
    roughnessMap: rough,
    emissiveMap: map(),
    aoMap: rough,
  });
}

describe('texture units', () => {
  it('are none in an empty scene, and next to none of plain materials', () => {
    expect(taken()).toEqual([0, 0]);
    expect(taken(new MeshLambertMaterial())).toEqual([0, 0]);
    expect(taken(new MeshStandardMaterial())).toEqual([1, 1]);
    expect(taken(new MeshBasicMaterial({ map: map() }))).toEqual([1, 1]);
  });

  it('are one a map in WebGL, one a texture in WebGPU', () => {
    expect(taken(gltfMaterial())).toEqual([7, 5]);
  });

  it('are more for transmission, clearcoat and specular maps', () => {
    const material = gltfMaterial();
    material.transmission = 0.5;
    expect(taken(material)).toEqual([8, 6]);
    Object.assign(material, { transmissionMap: map(), thicknessMap: map() });
    expect(taken(material)).toEqual([10, 8]);
    Object.assign(material, { specularColorMap: map(), specularIntensityMap: map(), clearcoatMap: map() });
    expect(taken(material)).toEqual([13, 11]);
  });

  it('are those of the material that takes most', () => {
    expect(taken(new MeshBasicMaterial(), gltfMaterial(), new MeshStandardMaterial())).toEqual([7, 5]);
    const mesh = new Mesh(undefined, [new MeshStandardMaterial(), gltfMaterial()]);
    expect(unitsTaken(new Scene().add(new Group().add(mesh)), 'webgl')).toBe(7);
  });

  it('are taken by an environment where a material has none of its own', () => {
    const scene = new Scene().add(new Mesh(undefined, new MeshStandardMaterial()));
    scene.environment = map();
    expect(unitsTaken(scene, 'webgl')).toBe(2);
    (scene.children[0] as Mesh<never, MeshStandardMaterial>).material.envMap = map();
    expect(unitsTaken(scene, 'webgl')).toBe(2);
  });

  it('are taken by shadows, light maps and area lights of every material', () => {
    const scene = new Scene().add(new Mesh(undefined, gltfMaterial()));
    const [sun, bulb, spot] = [new DirectionalLight(), new PointLight(), new SpotLight()];
    scene.add(sun, bulb, spot);
    expect(unitsTaken(scene, 'webgpu')).toBe(5);
    sun.castShadow = bulb.castShadow = spot.castShadow = true;
    expect(unitsTaken(scene, 'webgpu')).toBe(8);
    spot.map = map();
    expect(unitsTaken(scene, 'webgpu')).toBe(9);
    scene.add(new RectAreaLight(), new RectAreaLight());
    expect(unitsTaken(scene, 'webgpu')).toBe(11);
  });

  it('are taken by bones, morph targets and batches, which WebGL alone counts', () => {
    const morphed = new SphereGeometry();
    morphed.morphAttributes.position = [morphed.getAttribute('position')];
    const material = new MeshStandardMaterial();
    const units = (mesh: Mesh) => {
      const scene = new Scene().add(mesh);
      return [unitsTaken(scene, 'webgl'), unitsTaken(scene, 'webgpu')];
    };
    expect(units(new Mesh(morphed, material))).toEqual([2, 1]);
    expect(units(new SkinnedMesh(morphed, material))).toEqual([3, 1]);
    expect(units(new BatchedMesh(1, 3, 3, material))).toEqual([4, 1]);
  });
});
