// Boxes and luminous panels that a person adds, and what they become when they get another size.
import { DoubleSide, Matrix4, Vector3 } from 'three';
import { hung, inSight } from './lamps';
import type { Stage } from './stage';
import type { Form, LightNotice, NewObject, ObjectNotice } from './wire';

/** Sides of a box, metres: a stool. */
const BOX = 0.5;

/** Sides of a panel, metres, and what it gives, lm: one in a ceiling of tiles, as offices have them. */
const PANEL = 0.6;
const FLUX = 4000;

/** Reflectance of what is added. */
const GREY = 0.5;

/** Metres along its axes: width and depth, and height of a box. */
export const sizeOf = (form: Form) => ('box' in form ? form.box.size : form.rectangle.size);

/** Square metres that shine, where it does. */
function areaOf(form: Form): number {
  const [x, y, z] = sizeOf(form);
  return 'box' in form ? 2 * (x * y + y * z + z * x) : x * y;
}

/** From own axes to the scene's: x and y are level, and z goes up, or down as a lamp shines. */
function standing(stage: Stage, place: Vector3, isDown: boolean): number[] {
  const [x, y, z] = [new Vector3(1, 0, 0), new Vector3(0, 0, isDown ? 1 : -1), new Vector3(0, isDown ? -1 : 1, 0)].map((axis) => stage.toScene(axis));
  return new Matrix4().makeBasis(x, y, z).setPosition(stage.toScene(place)).toArray();
}

/** A box on the floor where who looks sees it. `metre` is as long as a metre is to people who fit into the scene. */
export function boxAhead(stage: Stage, metre: number, name: string): NewObject {
  const side = BOX * metre;
  const place = inSight(stage, metre);
  const floor = stage.cast(place, new Vector3(0, -1, 0), Infinity, DoubleSide);
  if (floor) place.y -= floor.distance - 0.5 * side;
  return { name, form: { box: { size: [side, side, side] } }, reflectance: [GREY, GREY, GREY], matrix: standing(stage, place, false) };
}

/** A panel below the ceiling that shines down. */
export function panelAhead(stage: Stage, metre: number, name: string): NewObject {
  const side = PANEL * metre;
  const form = { rectangle: { size: [side, side] } };
  const exitance = FLUX / areaOf(form);
  const matrix = standing(stage, hung(stage, metre, inSight(stage, metre)), true);
  return { name, form, reflectance: [GREY, GREY, GREY], emission: [exitance, exitance, exitance], matrix };
}

/** The same with other lengths: a box stands where it stood, and a lamp keeps its lumens. */
export function resized({ name, form, reflectance, matrix }: ObjectNotice, lamp: LightNotice | undefined, size: number[]): NewObject {
  const other: Form = 'box' in form! ? { box: { size } } : { rectangle: { size } };
  const rise = 'box' in form! ? 0.5 * (size[2] - form.box.size[2]) : 0;
  const raised = new Matrix4().fromArray(matrix).multiply(new Matrix4().makeTranslation(0, 0, rise));
  const emission = lamp?.flux?.map((flux) => flux / areaOf(other));
  return { name, form: other, reflectance, ...(emission && { emission }), matrix: raised.toArray() };
}
