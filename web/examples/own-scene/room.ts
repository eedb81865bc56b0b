import {
  BoxGeometry,
  Color,
  type ColorRepresentation,
  Mesh,
  MeshStandardMaterial,
  PointLight,
  Scene,
  Vector3,
} from 'three';

/** A room four metres wide with a lamp in it. Names are what the server knows the objects by. */
export function buildRoom(): { scene: Scene; lamp: PointLight } {
  const scene = new Scene();
  const add = (name: string, color: ColorRepresentation, size: Vector3, position: Vector3) => {
    const material = new MeshStandardMaterial({ color: new Color(color), roughness: 1 });
    const box = new Mesh(new BoxGeometry(...size.toArray()), material);
    box.name = name;
    box.position.copy(position);
    scene.add(box);
  };
  const at = (x: number, y: number, z: number) => new Vector3(x, y, z);
  add('floor', '#ccc', at(4.2, 0.1, 4.2), at(0, -0.05, 0));
  add('ceiling', '#ccc', at(4.2, 0.1, 4.2), at(0, 3.05, 0));
  add('back wall', '#ccc', at(4.2, 3, 0.1), at(0, 1.5, -2.05));
  add('left wall', '#b21', at(0.1, 3, 4), at(-2.05, 1.5, 0));
  add('right wall', '#182', at(0.1, 3, 4), at(2.05, 1.5, 0));
  add('screen', '#ccc', at(1.6, 1.2, 0.1), at(0, 0.6, 0.3));

  const lamp = new PointLight('#fff', 12);
  lamp.name = 'lamp';
  lamp.position.set(0, 0.8, -0.8);
  scene.add(lamp);
  return { scene, lamp };
}
