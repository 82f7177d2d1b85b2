// What a person adds, copies and takes away: lamps, boxes and luminous panels, and the lengths of what was added.
import { Matrix4, Vector3 } from 'three';
import type { App } from './app';
import { boxAhead, panelAhead, reshaped, type Shaped, tiltOf } from './forms';
import { beside, isLamp, lampAhead, type LampKind } from './lamps';
import type { Surface } from './surface';
import type { Edit, LightNotice, NewObject, ObjectNotice, StatusNotice } from './wire';

export class Adding {
  /** Of which kind the next lamp is. */
  lampKind: LampKind | 'panel' = 'point';
  /** Where copies will be that were asked for: the first that comes is selected. */
  private awaited: number[][] = [];
  /** Which new lamp will be selected. */
  private awaitedLamp: ((light: LightNotice) => boolean) | null = null;
  /** What is said when it comes. */
  private told = '';
  /** Forms that were asked for last and have not come, how many times others were, and how many edits there will be then. */
  private wished = new Map<number, Shaped & { times: number; edits: number }>();
  /** What was added and selected last. */
  private known: (ObjectNotice & Shaped)[] = [];

  constructor(private app: App) {}

  // What the server says.

  /** What was asked for has come, where this status is of after it. */
  hearStatus({ is_following, edits: now }: StatusNotice): void {
    if (!is_following) for (const [id, { edits }] of this.wished) if (now >= edits) this.wished.delete(id);
  }

  /** What was asked for of something that has become another since is asked for of that, if it was asked for more than once; and one
   *  of the copies that were asked for is selected. */
  hearObject(object: ObjectNotice): void {
    this.pass(object);
    if (this.app.objects.has(object.id) || !this.awaited.some((matrix) => isPlace(object.matrix, matrix))) return;
    this.app.objects.set(object.id, object);
    this.choose(() => this.app.select(object.id));
  }

  private pass({ id, successor }: ObjectNotice): void {
    const wished = this.wished.get(id);
    if (!wished || successor === null) return;
    this.wished.delete(id);
    if (wished.times > 1) this.wished.set(successor, { ...wished, times: wished.times - 1 });
  }

  /** Whether a light is the new one that was asked for. */
  isAwaited(light: LightNotice): boolean {
    return !this.app.lights.has(light.id) && (this.awaitedLamp?.(light) ?? false);
  }

  /** What was asked for has come: it is selected, which is said. */
  choose(select: () => void): void {
    const { told } = this;
    select();
    this.app.sayOfSelected(told);
  }

  /** What comes is not selected by itself. */
  awaitNone(): void {
    this.awaited = [];
    this.awaitedLamp = null;
  }

  /** Nothing comes of what was asked for. */
  forget(): void {
    this.awaitNone();
    this.wished.clear();
  }

  // What a person does.

  /** A name that nothing has yet. */
  private newName(word: string): string {
    const names = new Set([...this.app.lights.values(), ...this.app.objects.values()].map(({ name }) => name));
    let number = 1;
    while (names.has(`${word} ${number}`)) number += 1;
    return `${word} ${number}`;
  }

  /** Adds a lamp where it is seen. */
  addLamp(kind = this.lampKind): void {
    const { stage, navigator, objects, lights } = this.app;
    if (kind === 'panel') {
      const shining = new Set([...lights.values()].map(({ object }) => object));
      const isLampOrAdded = (id: number) => shining.has(id) || objects.get(id)?.form !== null;
      this.addObjects(panelAhead(stage, navigator.scale, this.newName('Panel'), isLampOrAdded));
      return;
    }
    const light = lampAhead(stage, navigator.scale, kind, this.newName('Lamp'));
    this.awaitedLamp = ({ name }) => name === light.name;
    this.told = `Added: ${light.name}. It is selected.`;
    this.app.edit({ add_light: { light } });
  }

  /** Adds a box where it is seen. */
  addBox(): void {
    this.addObjects([boxAhead(this.app.stage, this.app.navigator.scale, this.newName('Box'))]);
  }

  /** Adds what belongs together. */
  private addObjects(objects: NewObject[]): void {
    this.awaited = objects.map(({ matrix }) => matrix);
    this.told = `Added: ${objects[0].name}. It is selected.`;
    this.app.editAll(objects.map((object) => ({ add: { object } })));
  }

  /** What is selected if it was added, in the forms that were asked for last; nothing else. What has just become another is as it was
   *  until that is here. */
  parts(): (ObjectNotice & Shaped)[] {
    const { selected, objects } = this.app;
    const chosen = selected === null ? undefined : objects.get(selected);
    if (chosen?.deleted) return this.known;
    const group = this.app.group().map(({ object }) => ({ ...objects.get(object)!, ...this.wished.get(object) }));
    this.known = group.every(({ form }) => form) ? group : [];
    return this.known;
  }

  /** Where a thing is, or will be in the form that was asked for. */
  matrixOf({ object, matrix }: Surface): Matrix4 {
    const wished = this.wished.get(object);
    return wished ? new Matrix4().fromArray(wished.matrix) : matrix;
  }

  /** Gives what is selected, and was added, other lengths, metres. */
  resize(size: number[]): void {
    const edits = reshaped(this.parts(), size);
    const then = Math.max(this.app.status?.edits ?? 0, ...[...this.wished.values()].map(({ edits }) => edits)) + 1;
    for (const edit of edits) {
      if (!('reshape' in edit)) continue;
      const { object: id, form, matrix } = edit.reshape;
      this.wished.set(id, { form, matrix, times: (this.wished.get(id)?.times ?? 0) + 1, edits: then });
      this.known = this.known.map((part) => (part.id === id ? { ...part, form, matrix } : part));
    }
    this.app.editAll(edits);
  }

  /** By how much what is selected, and was added, is tilted about its own x axis, radians. */
  tilt(): number {
    const [part] = this.parts();
    const [x, , z] = this.axes(part);
    return tiltOf(part.form!, x, z);
  }

  /** The axes of something in the world. */
  axes({ matrix }: Shaped): Vector3[] {
    return [0, 4, 8].map((first) => new Vector3().fromArray(matrix, first).applyQuaternion(this.app.stage.root.quaternion).normalize());
  }

  /** The selected lamp without area, if it is one that can be placed. */
  private lamp(): LightNotice | null {
    const { selectedLight, lights } = this.app;
    const light = selectedLight === null ? undefined : lights.get(selectedLight);
    return light && isLamp(light) ? light : null;
  }

  /** Whether what is selected can be duplicated and deleted. */
  get isCopyable(): boolean {
    return this.app.selected !== null || this.lamp() !== null;
  }

  private duplicateLamp({ id, matrix, position }: LightNotice): void {
    const { stage, navigator } = this.app;
    // Parallel light has no place to be beside.
    const way = position ? beside(stage, navigator.scale, stage.toWorld(position)) : new Vector3();
    const motion = this.app.inScene(new Matrix4().makeTranslation(way));
    const copy = motion.multiply(new Matrix4().fromArray(matrix)).toArray();
    this.awaitedLamp = (light) => isLamp(light) && isPlace(light.matrix, copy);
    this.told = 'Duplicated: the copy is selected.';
    this.app.edit({ copy_light: { light: id, matrix: copy } });
  }

  duplicate(): void {
    const lamp = this.lamp();
    if (lamp) this.duplicateLamp(lamp);
    if (this.app.group().length === 0) return;
    // Beside the first, to the right of who looks, so that one sees that there are two.
    const right = new Vector3(1, 0, 0).applyQuaternion(this.app.stage.camera.quaternion).setY(0).normalize();
    const size = this.app.box().getSize(new Vector3());
    const way = right.multiplyScalar(0.6 * Math.max(size.x, size.z));
    const copies = this.app.placed(new Matrix4().makeTranslation(way)).map(([{ object }, matrix]) => ({ object, matrix: matrix.toArray() }));
    this.awaited = copies.map(({ matrix }) => matrix);
    this.told = 'Duplicated: the copy is selected.';
    this.app.editAll(copies.map((copy) => ({ copy })));
  }

  delete(): void {
    const lamp = this.lamp();
    const group = this.app.group();
    const name = lamp ? this.app.lightName(lamp) : group.length > 0 ? this.app.objects.get(group[0].object)!.name : '';
    const edits: Edit[] = lamp ? [{ delete_light: { light: lamp.id } }] : group.map(({ object }) => ({ delete: { object } }));
    // It is told until the next change, or until this one is undone.
    if (this.app.editAll(edits)) this.app.say(`Deleted: ${name || 'it'}. Undo brings it back.`);
  }
}

/** Whether a place is the one that was asked for. */
function isPlace(matrix: number[], asked: number[]): boolean {
  return asked.every((x, i) => Math.abs(x - matrix[i]) < 1e-9 * Math.max(1, Math.abs(x)));
}
