// Which points of a grid lie beneath things: under a rug or a cupboard no light falls on a floor, and nobody asks for it there.
// Covered is what something lies upon, and what is within something closed that stands there, with a base or without.
import { Box3, DoubleSide, Ray, Vector3 } from 'three';
import type { App } from './app';
import type { Grid } from './grid';
import type { Surface } from './surface';

/** Metres above a surface up to which something lies upon it: rugs, mats and what has low feet. Beneath desks and shelves one works. */
const LYING = 0.05;

/** Metres above the surface that points are looked at: within rugs, and clear of the surface. */
const CLEAR = 1e-3;

/** Surfaces that belong together, and what is around them in the world. */
interface Thing {
  surfaces: Surface[];
  box: Box3;
  isMovable: boolean;
}

/** Marks the points that are covered now. */
export function cover(app: App, grid: Grid, picked: Vector3): void {
  const { stage, navigator: { scale } } = app;
  const { normal } = grid;
  const along = new Vector3(normal.y, normal.z, normal.x).cross(normal).normalize();
  const things = new Map<number, Thing>();
  const around = new Box3().setFromPoints(grid.points.map(({ point }) => point)).expandByScalar(2 * LYING * scale);
  const near: Surface[] = [];
  for (const surface of stage.surfaces.values()) {
    if (!surface.visible) continue;
    if (stage.box(surface).intersectsBox(around)) near.push(surface);
    // What has just been added is there before its name is.
    const group = app.objects.get(surface.object)?.group;
    if (group === undefined) continue;
    const thing = things.get(group) ?? { surfaces: [], box: new Box3(), isMovable: app.objects.get(surface.object)!.movable };
    thing.surfaces.push(surface);
    thing.box.union(stage.box(surface));
    things.set(group, thing);
  }
  const above = (point: Vector3) => point.clone().addScaledVector(normal, CLEAR * scale);
  // Of what is closed a ray leaves once more than it enters, to every side. One side alone would take a storey above for a cover.
  const isWithin = ({ surfaces, box }: Thing, from: Vector3) =>
    box.containsPoint(from) && [normal, along].every((way) => leaves(surfaces, from, way) > 0);
  // What is around the picked place is the room, or the house that it is in, unless it is furniture that came to stand there.
  const start = above(picked);
  const covers = [...things.values()].filter((thing) => thing.box.intersectsBox(around) && (thing.isMovable || !isWithin(thing, start)));
  for (const point of grid.points) {
    const from = above(point.point);
    const lying = stage.cast(from, normal, LYING * scale, DoubleSide, near);
    point.isCovered = lying !== null || covers.some((thing) => isWithin(thing, from));
  }
}

/** How many times more a ray leaves a thing than it enters it. */
function leaves(surfaces: Surface[], from: Vector3, way: Vector3): number {
  let count = 0;
  for (const surface of surfaces) {
    const ray = new Ray(from.clone(), way.clone()).applyMatrix4(surface.matrixWorld.clone().invert());
    for (const { face, faceIndex } of surface.tree.raycast(ray, DoubleSide)) {
      if (faceIndex! < surface.fronts) count += Math.sign(face!.normal.dot(ray.direction));
    }
  }
  return count;
}
