// Lamps without area that a person adds: how bright they are, and where one looks for them.
import { DoubleSide, Ray, Vector3 } from 'three';
import { luminance } from './luminance';
import type { Stage } from './stage';
import type { LightNotice, NewLight } from './wire';

/** Kinds of lamps that can be added, and what people call them. */
export const LAMPS = [['point', 'Point'], ['spot', 'Spot'], ['directional', 'Parallel']] as const;
export type LampKind = (typeof LAMPS)[number][0];

/** What a lamp gives, lm: a bulb of 75 W in the days of filaments, or an LED of 9 W. */
const FLUX = 1000;

/** Half angles of a spot, radians: full within 15°, nothing beyond 30°, as lamps for accents have it. */
const [INNER, OUTER] = [Math.PI / 12, Math.PI / 6];

/** Parallel light, lx: a low or veiled sun. A clear one at noon is ten times that. */
const SUN = 10_000;

/** Metres ahead, in rooms that people are made for. */
const AHEAD = 2;

/** Metres below the ceiling: light that falls on it at an angle would need a finer mesh than is there. */
const BELOW = 0.1;

/** Metres from surfaces, where there is room: nearer, all of its light would be one spot on a wall. */
const CLEAR = 0.3;

/** Share of the picture's height, from its middle, up to which a lamp is well seen. */
const SEEN = 0.85;

/** Whether a light is a lamp without area, which can be placed by itself. */
export function isLamp({ object, type }: LightNotice): boolean {
  return object === null && type !== 'sky';
}

/** What people call lights, by their numbers: copies have the name of the first that is there, and numbers. */
export function namesOf(lights: Iterable<LightNotice>): Map<number, string> {
  const names = new Map<number, string>();
  const counts = new Map<string, number>();
  for (const { id, name, type, deleted } of lights) {
    const before = counts.get(name) ?? 0;
    if (type === 'sky') names.set(id, 'Sky');
    else if (!name) names.set(id, `Light ${id + 1}`);
    else names.set(id, before > 0 ? `${name} (${before + 1})` : name);
    if (!deleted) counts.set(name, before + 1);
  }
  return names;
}

/** Solid angle that a lamp fills as if it were as bright everywhere as in its middle. A spot fades by the square of what is
 *  left of the cosine between both angles, as glTF has it. */
export function solidAngle(cone: number[] | null): number {
  if (!cone) return 4 * Math.PI;
  const [inner, outer] = cone.map(Math.cos);
  return 2 * Math.PI * (1 - inner + (inner - outer) / 3);
}

/** What makes a lamp what it is, but for its place. */
export type Lamp = Pick<LightNotice, 'type' | 'cone' | 'intensity'>;

/** A lamp made one of another kind. It keeps its lumens; what was or becomes parallel light is as bright as one that is added. */
export function remade({ type, cone, intensity }: Lamp, kind: LampKind): Lamp {
  if (kind === type) return { type, cone, intensity };
  const other = kind === 'spot' ? [INNER, OUTER] : null;
  const now = luminance(intensity!);
  const flux = type !== 'directional' && now * solidAngle(cone) > 0 ? now * solidAngle(cone) : FLUX;
  return { type: kind, cone: other, intensity: brighter(intensity!, kind === 'directional' ? SUN : flux / solidAngle(other)) };
}

/** A colour of light, as bright as asked. */
export function brighter(intensity: number[], wanted: number): number[] {
  const now = luminance(intensity);
  return intensity.map((band) => (now > 0 ? (band * wanted) / now : wanted));
}

/** Where parallel light comes from, radians: how high it stands, and clockwise from above from −Z of the page's world, which is +Y
 *  of scenes whose zenith is +Z: north, where the scene says nothing else. */
export interface Sun {
  altitude: number;
  azimuth: number;
}

/** Where the sun stands whose rays go along a unit vector of the world, and the rays of a sun. */
export function sunOf({ x, y, z }: Vector3): Sun {
  return { altitude: Math.asin(Math.min(1, Math.max(-1, -y))), azimuth: (Math.atan2(-x, z) + 2 * Math.PI) % (2 * Math.PI) };
}
export function raysOf({ altitude, azimuth }: Sun): Vector3 {
  const level = Math.cos(altitude);
  return new Vector3(-level * Math.sin(azimuth), -Math.sin(altitude), level * Math.cos(azimuth));
}

/** A lamp of a kind where who looks sees it. `metre` is as long as a metre is to people who fit into the scene. */
export function lampAhead(stage: Stage, metre: number, kind: LampKind, name: string): NewLight {
  const white = (intensity: number) => [intensity, intensity, intensity];
  const level = (x: number, y: number, z: number) => new Vector3(x, y, z).applyQuaternion(stage.camera.quaternion).setY(0).normalize();
  const at = (place: Vector3) => stage.toScene(place).toArray();
  const place = inSight(stage, metre);
  if (kind === 'directional') {
    // Over the left shoulder, 45° high: what one sees is lit, and its shadows are seen.
    const direction = level(0.5, 0, -1).add(new Vector3(0, -1, 0));
    // It has a place only when it becomes another kind of lamp.
    return { name, kind, position: at(place), direction: stage.toScene(direction).toArray(), intensity: white(SUN) };
  }
  if (kind === 'point') return { name, kind, position: at(place), intensity: white(FLUX / solidAngle(null)) };
  return { name, kind: { spot: { inner: INNER, outer: OUTER } }, position: at(hung(stage, metre, place)), intensity: white(FLUX / solidAngle([INNER, OUTER])) };
}

/** The place above one that is below the ceiling, or as high as the picture shows. */
export function hung(stage: Stage, metre: number, place: Vector3): Vector3 {
  const ceiling = stage.cast(place, new Vector3(0, 1, 0), Infinity, DoubleSide);
  let rise = ceiling ? Math.max(0.5 * ceiling.distance, ceiling.distance - BELOW * metre) : metre;
  const above = () => place.clone().setY(place.y + rise);
  const isSeen = () => {
    const at = stage.project(above());
    return at !== null && at.y > (0.5 - 0.5 * SEEN) * stage.canvas.clientHeight;
  };
  for (let tries = 0; tries < 16 && !isSeen(); tries += 1) rise *= 0.8;
  return above();
}

/** A place in the air in the middle of the picture, clear of what is near. */
export const inSight = (stage: Stage, metre: number) => cleared(stage, metre, ahead(stage, metre));

/** A place in the air in the middle of the picture, no farther than half way to what is seen there. */
function ahead(stage: Stage, metre: number): Vector3 {
  const { bounds, camera } = stage;
  const hit = stage.pick(0, 0);
  const ray = new Ray(camera.position, camera.getWorldDirection(new Vector3()));
  // Who looks from outside looks for it inside.
  const entry = bounds.containsPoint(camera.position) ? camera.position : ray.intersectBox(bounds, new Vector3());
  if (!entry) return bounds.getCenter(new Vector3());
  const before = entry.distanceTo(camera.position);
  return ray.at(before + Math.min(AHEAD * metre, hit ? 0.5 * Math.max(0, hit.distance - before) : Infinity), new Vector3());
}

/** The place, or one beside it that is farther from what is near, as far as there is room on the other side; in front of who looks. */
function cleared(stage: Stage, metre: number, place: Vector3): Vector3 {
  const axes = [new Vector3(1, 0, 0), new Vector3(0, 1, 0), new Vector3(0, 0, 1)];
  return clearOf(stage, place, Math.min(CLEAR * metre, 0.5 * place.distanceTo(stage.camera.position)), axes);
}

/** The place moved along axes until it is so far from what is near, as far as there is room on the other side. */
export function clearOf(stage: Stage, place: Vector3, clear: number, axes: Vector3[]): Vector3 {
  for (const axis of axes) {
    const [up, down] = [axis, axis.clone().negate()].map((way) => stage.cast(place, way, 2 * clear, DoubleSide)?.distance ?? 2 * clear);
    const [near, far] = [Math.min(up, down), Math.max(up, down)];
    const way = Math.min(Math.max(0, clear - near), 0.5 * (far - near));
    place.addScaledVector(axis, up < down ? -way : way);
  }
  return place;
}

/** Half a metre to the side of a lamp, on the right of who looks, or where there is more room: no wall is between them. */
export function beside(stage: Stage, metre: number, place: Vector3): Vector3 {
  const right = new Vector3(1, 0, 0).applyQuaternion(stage.camera.quaternion).setY(0).normalize();
  const [free, back] = [right, right.clone().negate()].map((way) => stage.cast(place, way, metre, DoubleSide)?.distance ?? metre);
  return right.multiplyScalar(free >= back ? 0.5 * free : -0.5 * back);
}
