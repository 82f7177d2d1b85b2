// Boxes and luminous panels that a person adds, and what they become when they get another size.
import { DoubleSide, Matrix4, Vector3 } from 'three';
import { clearOf, hung, inSight } from './lamps';
import type { Stage } from './stage';
import type { Edit, Form, NewObject, ObjectNotice } from './wire';

/** Sides of a box, metres: a stool. */
const BOX = 0.5;

/** Least side of what is added, over the extent of the scene: smaller ones could not be seen in it, and far smaller ones are refused. */
const LEAST = 1e-3;

/** A panel, metres: its sides, its thickness, how far its rim goes around what shines, how far it hangs below the ceiling. As those
 *  in ceilings of tiles, and what it gives, lm, in rooms that are made for people. */
const [PANEL, THICK, RIM, BELOW] = [0.6, 0.04, 0.01, 0.05];
const FLUX = 4000;

/** Metres that what shines stands out of its housing. */
const OUT = 0.002;

/** Reflectance of what is added. */
const GREY = 0.5;
const WHITE = 0.8;

/** Where panels go when there is one already, in steps of half as much again as its side. */
const BESIDE = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1], [2, 0], [-2, 0], [0, 2], [0, -2]];

/** Where what is above a panel is looked at, over its side. */
const ACROSS = [-0.5, -0.25, 0, 0.25, 0.5];

const UP = new Vector3(0, 1, 0);

/** Something that was added, as far as its place and form matter. */
export type Shaped = Pick<ObjectNotice, 'form' | 'matrix'>;

/** Metres along its axes. */
const lengths = (form: Form) => ('box' in form ? form.box.size : form.rectangle.size);

/** Width and depth, and height of a box, of what belongs together: a panel is as large as its housing. */
export function sizeOf(parts: Shaped[]): number[] {
  const [lamp, box] = [parts.find(({ form }) => 'rectangle' in form!), parts.find(({ form }) => 'box' in form!)];
  const size = lengths((box ?? lamp)!.form!);
  return size.slice(0, lamp ? 2 : 3);
}

/** From own axes to the scene's: x and y are level, and z goes up, or down as a lamp shines. */
function standing(stage: Stage, place: Vector3, isDown: boolean): Matrix4 {
  const [x, y, z] = [new Vector3(1, 0, 0), new Vector3(0, 0, isDown ? 1 : -1), new Vector3(0, isDown ? -1 : 1, 0)].map((axis) => stage.toScene(axis));
  return new Matrix4().makeBasis(x, y, z).setPosition(stage.toScene(place));
}

/** A box on the floor where who looks sees it. `metre` is as long as a metre is to people who fit into the scene. */
export function boxAhead(stage: Stage, metre: number, name: string): NewObject {
  const side = Math.max(BOX * metre, LEAST * stage.bounds.getSize(new Vector3()).length());
  const place = inSight(stage, metre);
  const floor = stage.cast(place, UP.clone().negate(), Infinity, DoubleSide);
  if (floor) place.y -= floor.distance - 0.5 * side;
  return { name, form: { box: { size: [side, side, side] } }, reflectance: [GREY, GREY, GREY], matrix: standing(stage, place, false).toArray() };
}

/** A panel that shines down from the ceiling above what one looks at, clear of walls, of lamps and of other things that were
 *  added: what shines, and its housing. */
export function panelAhead(stage: Stage, metre: number, name: string, isLampOrAdded: (object: number) => boolean): NewObject[] {
  const side = Math.max(PANEL * metre, LEAST * stage.bounds.getSize(new Vector3()).length());
  const scale = side / PANEL;
  const hit = stage.pick(0, 0);
  // Who looks out of a window has the ceiling of the room.
  const starts = [...(hit ? [hit.point.clone().addScaledVector(hit.normal, BELOW * scale)] : []), inSight(stage, scale)];
  const found = starts.map((from) => onCeiling(stage, from, side, scale, isLampOrAdded)).find((place) => place !== null);
  const place = found ?? hung(stage, metre, inSight(stage, metre));
  const matrix = standing(stage, place, true);
  const shining = side - 2 * RIM * scale;
  const exitance = (FLUX * scale * scale) / shining ** 2;
  const behind = new Matrix4().makeTranslation(0, 0, -(OUT + 0.5 * THICK) * scale);
  return [
    { name, form: { rectangle: { size: [shining, shining] } }, reflectance: [GREY, GREY, GREY], emission: [exitance, exitance, exitance], matrix: matrix.toArray() },
    { name, form: { box: { size: [side, side, THICK * scale] } }, reflectance: [WHITE, WHITE, WHITE], matrix: matrix.clone().multiply(behind).toArray() },
  ];
}

/** The place of a panel above another place, if something is there. */
function onCeiling(stage: Stage, from: Vector3, side: number, scale: number, isLampOrAdded: (object: number) => boolean): Vector3 | null {
  const first = stage.cast(from, UP, Infinity, DoubleSide);
  if (!first) return null;
  from.y += Math.max(0.5 * first.distance, first.distance - 2 * BELOW * scale);
  const level = [new Vector3(1, 0, 0), new Vector3(0, 0, 1)];
  for (const [x, z] of BESIDE) {
    const way = new Vector3(1.5 * side * x, 0, 1.5 * side * z);
    if (way.length() > 0 && stage.cast(from, way.clone().normalize(), way.length() + 0.5 * side, DoubleSide)) continue;
    const at = clearOf(stage, from.clone().add(way), 0.6 * side, level);
    const above = (x: number, z: number) => stage.cast(at.clone().add(new Vector3(x * side, 0, z * side)), UP, Infinity, DoubleSide);
    const ceiling = above(0, 0);
    const hits = ACROSS.flatMap((x) => ACROSS.map((z) => above(x, z))).filter((hit) => hit !== null);
    const [low, high] = [Math.min(...hits.map(({ distance }) => distance)), Math.max(...hits.map(({ distance }) => distance))];
    // As low as the lowest of what is above, but not beneath a beam or half beneath a gallery.
    const isTaken = high - low > 0.5 * side || hits.some((hit) => isLampOrAdded(hit.surface.object));
    if (ceiling && !isTaken) return at.setY(at.y + low - BELOW * scale);
  }
  return null;
}

/** What gives what belongs together another size: a box stands where it stood, and a panel keeps its rim, which is at most half of it. */
export function reshaped(parts: (Shaped & { id: number })[], size: number[]): Edit[] {
  const lamp = parts.find(({ form }) => 'rectangle' in form!);
  const old = sizeOf(parts);
  return parts.map(({ id, form, matrix }) => {
    const own = lengths(form!);
    if (!lamp) {
      const raised = new Matrix4().fromArray(matrix).multiply(new Matrix4().makeTranslation(0, 0, 0.5 * (size[2] - own[2])));
      return { reshape: { object: id, form: { box: { size } }, matrix: raised.toArray() } };
    }
    const [x, y] = [0, 1].map((k) => size[k] - Math.min(old[k] - own[k], 0.5 * size[k]));
    return { reshape: { object: id, form: 'box' in form! ? { box: { size: [x, y, own[2]] } } : { rectangle: { size: [x, y] } }, matrix } };
  });
}

/** By how much something that was added is tilted about its own x axis, radians; its axes are in the world. */
export function tiltOf(form: Form, x: Vector3, z: Vector3): number {
  const nominal = 'box' in form ? z : z.clone().negate();
  return Math.atan2(nominal.dot(x.clone().cross(UP)), nominal.dot(UP));
}
