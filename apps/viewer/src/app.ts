// All that the page knows, and what can be done with it. Panels and keys call the verbs here and listen to topics.
import { Box3, ClampToEdgeWrapping, Matrix4, MirroredRepeatWrapping, NearestFilter, Quaternion, RepeatWrapping, SRGBColorSpace, Texture, TextureLoader, Vector3 } from 'three';
import { Adding } from './adding';
import { Ahead } from './ahead';
import { keep, kept, numberOf, type Curve } from './curve';
import { Exposure } from './exposure';
import { Gizmo } from './gizmo';
import { isLamp, namesOf, raysOf, type Lamp, type Sun } from './lamps';
import { Marks } from './marks';
import { Measuring } from './measuring';
import { Navigator } from './navigate';
import { Sight } from './sight';
import { Stage } from './stage';
import { Mode, shared, Surface } from './surface';
import {
  Connection, type CameraPlace, type Edit, type Layer, type LightFrame, type LightNotice, type Lost, type MeshFrame, type Notice,
  type ObjectNotice, type SceneNotice, type StatusNotice, type TextureUse,
} from './wire';

/** What can change. */
export type Topic =
  | 'scene' | 'objects' | 'lights' | 'status' | 'bookmarks' | 'history' | 'selection' | 'probe' | 'sight' | 'grid' | 'view' | 'connection' | 'message';

/** Milliseconds between edits of one gesture: more often than light can follow is of no use. */
const GESTURE = 40;

/** Milliseconds within which steps of one field belong together. */
const STEPS = 600;

/** Milliseconds that a message is told. */
const READ = 10_000;

const WRAPS = { repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping } as const;

export class App {
  readonly stage = new Stage();
  readonly navigator = new Navigator(this.stage);
  readonly exposure = new Exposure(this.stage, () => this.tell('view'));
  readonly marks = new Marks(this.stage);
  readonly gizmo = new Gizmo(this);
  readonly sight = new Sight(this);
  readonly measuring = new Measuring(this);
  readonly adding = new Adding(this);
  readonly connection: Connection;
  scene: SceneNotice | null = null;
  /** Objects and lights as they are shown: what the server said, and what is changed here. */
  readonly objects = new Map<number, ObjectNotice>();
  readonly lights = new Map<number, LightNotice>();
  bookmarks: CameraPlace[] = [];
  status: StatusNotice | null = null;
  undoable: string | null = null;
  redoable: string | null = null;
  isConnected = false;
  isCaughtUp = false;
  /** Why it is not connected. */
  lost: Lost = 'unknown';
  /** Milliseconds from the beginning of the page to the whole scene. */
  opened: number | null = null;
  layer: Layer = 'total';
  /** Why the light of the layer does not follow changes; empty while it does. */
  resting = '';
  falseColours = false;
  curve = kept();
  edges = false;
  selected: number | null = null;
  /** A light without an object that is moved. */
  selectedLight: number | null = null;
  message = '';
  /** Whether what is said still holds. */
  private holds: () => boolean = () => true;
  private objectsAhead = new Ahead(this.objects, (object) => this.arrange(object.id));
  private lightsAhead = new Ahead(this.lights, (light) => this.shed(light));
  private listeners = new Map<Topic, (() => void)[]>();
  /** Topics that listeners are told of with the next picture. */
  private news = new Set<Topic>();
  private loosened = new Set<number>();
  private textures = new Map<string, Texture>();
  private gesture = 0;
  /** The field whose number was stepped last, of what, and when. */
  private step: { field: Element | null; of: string; since: number } = { field: null, of: '', since: 0 };
  private pending: { gesture?: number; send: () => void; timer: number } | null = null;
  private lastSent = 0;
  /** The gesture of the last edit. */
  private editing: number | undefined;
  private messageTimer = 0;
  /** How lights were dimmed before all of them were turned off. */
  private levels = new Map<number, number>();
  /** What people call lights, since one changed last. */
  private lightNames: Map<number, string> | null = null;

  constructor() {
    this.connection = new Connection({
      notice: (notice) => this.notice(notice),
      mesh: (frame) => this.mesh(frame),
      cuts: (frame) => this.stage.cut(frame),
      light: (frame) => this.shine(frame),
      connected: (is) => this.connected(is),
      lost: (why) => {
        this.lost = why;
        this.tell('connection');
      },
    });
    // A picture as the eye sees it leaves the scale to a working plane.
    this.exposure.coloured = () => {
      const answer = this.falseColours || shared.isolines.value || isError(this.layer) ? null : this.measuring.plane?.answer;
      return answer ? answer.points.map(([, , , lux]) => lux) : null;
    };
    // Once for all that comes between two pictures, however many objects that are.
    this.on('selection', () => {
      this.marks.outline(this.group());
      this.gizmo.place();
    });
    this.on('objects', () => { if (this.edges) this.marks.edges(this.stage.surfaces); });
    setInterval(() => this.refresh(), 500);
  }

  on(topic: Topic, listener: () => void): void {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
    listener();
  }

  tell(topic: Topic): void {
    for (const listener of this.listeners.get(topic) ?? []) listener();
    if (topic !== 'message' && !this.holds()) this.say(this.resting);
  }

  /** Tells with the next picture: hundreds of notices come together. */
  private tellSoon(topic: Topic): void {
    this.news.add(topic);
  }

  /** Tells what has waited. */
  tellNews(): void {
    const topics = [...this.news];
    this.news.clear();
    topics.forEach((topic) => this.tell(topic));
  }

  /** A line for the person, no longer than it takes to read, and than it holds where that is known. */
  say(message: string, holds: () => boolean = () => true): void {
    this.message = message;
    this.holds = holds;
    clearTimeout(this.messageTimer);
    // What a layer waits for is said as long as it does.
    if (message && message !== this.resting) this.messageTimer = setTimeout(() => this.say(this.resting), READ);
    this.tell('message');
  }

  /** Says something about what is selected, as long as that is. */
  sayOfSelected(message: string): void {
    this.say(message, this.whileSelected());
  }

  /** Whether what is selected now still is. */
  private whileSelected(): () => boolean {
    const { selected, selectedLight } = this;
    return () => this.selected === selected && this.selectedLight === selectedLight;
  }

  /** Says why something is not as it was asked for, until something else is changed or selected. */
  refuse(message: string): void {
    this.say(message, this.whileSelected());
  }

  /** What was said of changes before this one is told no longer. */
  forgive(): void {
    if (this.message !== this.resting) this.say(this.resting);
  }

  // What the server says.

  private connected(is: boolean): void {
    if (is === this.isConnected) return;
    this.isConnected = is;
    this.isCaughtUp = false;
    this.lost = 'unknown';
    // The server did not hear what waited to be said.
    if (!is) this.drop();
    if (is) {
      this.say('');
      this.adding.forget();
      this.objectsAhead.forget();
      this.lightsAhead.forget();
    }
    this.tell('connection');
  }

  private notice(notice: Notice): void {
    switch (notice.kind) {
      case 'scene': {
        const isFirst = this.scene === null;
        this.scene = notice;
        this.stage.begin(notice);
        this.navigator.begin();
        if (isFirst && notice.cameras.length > 0) this.stage.look(notice.cameras[0]);
        this.tell('scene');
        break;
      }
      case 'object':
        this.hold();
        this.adding.hearObject(notice);
        this.objectsAhead.hear(notice);
        break;
      case 'light':
        this.hold();
        this.hearLight(notice);
        break;
      case 'status':
        if (this.status && notice.edits !== this.status.edits) this.hold();
        this.adding.hearStatus(notice);
        this.status = notice;
        this.tell('status');
        break;
      case 'bookmarks':
        this.bookmarks = notice.cameras;
        this.tell('bookmarks');
        break;
      case 'history':
        this.undoable = notice.undo;
        this.redoable = notice.redo;
        this.tell('history');
        break;
      case 'caught_up':
        if (!this.isCaughtUp) this.begin();
        break;
      case 'probe':
        this.measuring.hearProbe(notice.question, notice.answer);
        break;
      case 'plane':
        this.measuring.hearPlane(notice.question, notice.answer, notice.why);
        break;
      case 'survey':
        this.measuring.hearSurvey(notice.question, notice);
        break;
      case 'in_sight':
        this.sight.hear(notice.question, notice.error);
        break;
      case 'rays':
        this.measuring.hearRays(notice.question, notice.rays);
        break;
      case 'refused':
        if (notice.code === 'layer') this.rest(notice.message);
        this.say(notice.message);
        // A message that could not be read may have been a change.
        if (notice.code !== 'layer' && notice.code !== 'camera') this.takeBack();
        break;
    }
  }

  private begin(): void {
    this.isCaughtUp = true;
    // Who has looked around goes on as before when the connection is back.
    if (this.opened === null) this.navigator.choose();
    this.opened ??= performance.now();
    this.measuring.begin();
    this.sight.begin();
    this.tell('view');
    this.tell('connection');
  }

  private mesh(frame: MeshFrame): void {
    const surface = new Surface(frame.object, frame);
    this.stage.put(surface);
    this.measuring.replace(surface);
    this.arrange(frame.object);
  }

  /** An object and its triangles come apart. */
  private arrange(id: number): void {
    const [object, surface] = [this.objects.get(id), this.stage.surfaces.get(id)];
    this.tellSoon('objects');
    if (!object || !surface) return;
    surface.visible = !object.deleted;
    this.stage.dress(surface, {
      tint: object.tint, emission: object.emission, transmittance: object.transmittance,
      texture: object.texture ? this.texture(object.texture) : null,
    });
    surface.matrix.fromArray(object.matrix);
    this.stage.moved(surface);
    this.measuring.follow(surface);
    const chosen = this.selected === null ? undefined : this.objects.get(this.selected);
    if (!this.inherit() && object.group === chosen?.group) this.tellSoon('selection');
    if (object.deleted) this.measuring.lose(surface);
    this.stage.change();
  }

  /** A light is shown as it is now. */
  private shed(light: LightNotice): void {
    this.lightNames = null;
    this.marks.light(light);
    if (light.type === 'sky') this.stage.dimSky(light.colour.map((band) => band * light.dimming));
    if (light.id === this.selectedLight) {
      if (light.deleted) this.selectLight(null);
      else this.gizmo.place();
      this.tellSoon('selection');
    }
    if (light.deleted && typeof this.layer === 'object' && 'light' in this.layer && this.layer.light === light.id) this.showLayer('total');
    this.tellSoon('lights');
  }

  /** What is gone is selected no longer, but what it became, once that is here; whether it was so. */
  private inherit(): boolean {
    const chosen = this.selected === null ? undefined : this.objects.get(this.selected);
    if (!chosen?.deleted) return false;
    const heir = this.heir(chosen);
    if (heir === null || (this.objects.has(heir) && this.stage.surfaces.has(heir))) this.mark(heir);
    return true;
  }

  /** What something that is gone has become, as far as that is known: what became of that may not have been heard yet. */
  private heir({ successor }: ObjectNotice): number | null {
    let heir = successor;
    const seen = new Set<number>();
    while (heir !== null && this.objects.get(heir)?.deleted && !seen.has(heir)) {
      seen.add(heir);
      heir = this.objects.get(heir)!.successor;
    }
    return heir !== null && seen.has(heir) ? successor : heir;
  }

  /** The server says how a light is; a new one that was asked for is selected. */
  private hearLight(light: LightNotice): void {
    const isAwaited = this.adding.isAwaited(light);
    this.lightsAhead.hear(light);
    if (isAwaited) this.adding.choose(() => this.selectLight(light.id));
  }

  /** Light of the layer stays as it is, or follows again. */
  private rest(message: string): void {
    if (message === this.resting) return;
    const wasSaid = this.message === this.resting;
    this.resting = message;
    if (wasSaid) this.say('');
    this.tell('view');
  }

  /** What was refused is as before, here too. */
  private takeBack(): void {
    this.adding.forget();
    this.objectsAhead.takeBack();
    this.lightsAhead.takeBack();
    for (const topic of ['objects', 'lights', 'selection'] as const) this.tell(topic);
  }

  private texture(use: TextureUse): Texture {
    const key = JSON.stringify([use.index, use.wrap, use.nearest]);
    let texture = this.textures.get(key);
    if (!texture) {
      texture = new TextureLoader().load(`texture/${use.index}.png`, () => this.stage.change());
      texture.colorSpace = SRGBColorSpace;
      texture.flipY = false;
      [texture.wrapS, texture.wrapT] = use.wrap.map((wrap) => WRAPS[wrap]);
      texture.anisotropy = 8;
      if (use.nearest) texture.magFilter = NearestFilter;
      this.textures.set(key, texture);
    }
    return texture;
  }

  /** Another page may have changed something. */
  private hold(): void {
    if (this.isCaughtUp) this.exposure.hold();
  }

  private shine(frame: LightFrame): void {
    const surface = this.stage.surfaces.get(frame.object);
    if (surface) this.stage.shine(surface, frame.first, frame.values);
    this.stage.begun();
    this.rest('');
    this.measuring.outdate();
    this.exposure.lit();
  }

  /** What depends on light is asked again while light changes. */
  private refresh(): void {
    this.objectsAhead.expire();
    this.lightsAhead.expire();
    // The camera moves without a word.
    if (!this.holds()) this.say(this.resting);
    if (!this.isCaughtUp || !this.status) return;
    this.measuring.refresh(`${this.status.rays} ${this.status.edits} ${this.status.is_done} ${JSON.stringify(this.layer)}`);
  }

  // What a person does.

  /** Changes the scene, unless the connection is lost. Edits of one gesture, such as a drag, are sent at a steady pace and undone together. */
  edit(edit: Edit, gesture?: number): boolean {
    // Of a gesture that is refused each edit may be: told once, it stays.
    if (gesture === undefined || gesture !== this.editing) this.forgive();
    this.editing = gesture;
    this.exposure.hold();
    // What waits is outdated by an edit of the same gesture, and comes first before any other.
    if (this.pending && this.pending.gesture === gesture) this.drop();
    else this.flush();
    const wait = gesture === undefined ? 0 : this.lastSent + GESTURE - performance.now();
    const send = () => {
      this.pending = null;
      this.lastSent = performance.now();
      if (this.connection.send({ kind: 'edit', edit, gesture })) return true;
      this.say('Not connected: the change was not made.');
      this.takeBack();
      return false;
    };
    if (wait <= 0) return send();
    this.pending = { gesture, send, timer: setTimeout(send, wait) };
    return true;
  }

  /** Changes together what belongs together. */
  editAll(edits: Edit[], gesture?: number): boolean {
    return edits.length > 0 && this.edit(edits.length === 1 ? edits[0] : { several: edits }, gesture);
  }

  private drop(): void {
    if (this.pending) clearTimeout(this.pending.timer);
    this.pending = null;
  }

  private flush(): void {
    const send = this.pending?.send;
    this.drop();
    send?.();
  }

  /** The number of a new gesture. */
  nextGesture(): number {
    this.gesture += 1;
    return this.gesture;
  }

  /** The gesture of the field that is written in: steps of its number that follow each other at once are one. */
  stepped(): number {
    const { activeElement } = document;
    const step = { field: activeElement, of: `${this.selected} ${this.selectedLight}`, since: performance.now() };
    const { field, of, since } = this.step;
    if (field !== step.field || of !== step.of || step.since - since > STEPS) this.nextGesture();
    this.step = step;
    return this.gesture;
  }

  undo(): void {
    this.goBack('undo');
  }

  redo(): void {
    this.goBack('redo');
  }

  private goBack(kind: 'undo' | 'redo'): void {
    // What is held in the hand is put down first.
    if (this.gizmo.isDragging) return;
    this.flush();
    this.forgive();
    this.exposure.hold();
    this.objectsAhead.forget();
    this.lightsAhead.forget();
    if (!this.connection.send({ kind })) this.say('Not connected: nothing was changed.');
  }

  setLight({ id }: LightNotice, change: { dimming?: number; colour?: [number, number, number] }, gesture?: number): void {
    this.lightsAhead.change(id, change);
    const { dimming, colour } = this.lights.get(id)!;
    this.edit({ light: { light: id, dimming, colour } }, gesture);
  }

  /** Lets parallel light come from a height and a direction about the zenith, radians. */
  shineFrom({ id, direction }: LightNotice, { altitude, azimuth }: Sun): void {
    const sun = { altitude: Math.min(Math.PI / 2, Math.max(-Math.PI / 2, altitude)), azimuth };
    const now = new Vector3().fromArray(direction!).applyQuaternion(this.stage.root.quaternion).normalize();
    this.moveLight(id, new Matrix4().makeRotationFromQuaternion(new Quaternion().setFromUnitVectors(now, raysOf(sun))));
  }

  /** Moves a light without area by a motion of the world, from where it is or from a given place. */
  moveLight(id: number, motion: Matrix4, gesture?: number, from: Pick<LightNotice, 'matrix' | 'position' | 'direction'> = this.lights.get(id)!): void {
    const inScene = this.inScene(motion);
    const matrix = inScene.clone().multiply(new Matrix4().fromArray(from.matrix)).toArray();
    const position = from.position && new Vector3().fromArray(from.position).applyMatrix4(inScene).toArray();
    const direction = from.direction && new Vector3().fromArray(from.direction).transformDirection(inScene).toArray();
    this.lightsAhead.change(id, { matrix, position, direction });
    this.edit({ move_light: { light: id, matrix } }, gesture);
  }

  /** Makes a lamp without area one of another kind, cone or intensity. */
  changeLamp({ id }: LightNotice, change: Partial<Lamp>): void {
    this.lightsAhead.change(id, change);
    const { type, cone, intensity } = this.lights.get(id)!;
    const kind = cone ? { spot: { inner: cone[0], outer: cone[1] } } : (type as 'point' | 'directional');
    this.edit({ change_light: { light: id, kind, intensity: intensity! } }, this.stepped());
  }

  paint(object: number, reflectance: number[], gesture?: number): void {
    this.edit({ reflectance: { object, reflectance } }, gesture);
  }

  /** The surfaces of what is selected: all that belong to one thing. */
  group(): Surface[] {
    const selected = this.selected === null ? undefined : this.objects.get(this.selected);
    if (!selected) return [];
    const members = [...this.objects.values()].filter((object) => object.group === selected.group && !object.deleted);
    return members.flatMap((object) => this.stage.surfaces.get(object.id) ?? []);
  }

  /** Whether what is selected has handles: furniture has, walls only where that is asked for. */
  get isMovable(): boolean {
    const group = this.group();
    return group.length > 0 && group.every((surface) => {
      const object = this.objects.get(surface.object)!;
      return object.movable || this.loosened.has(object.group);
    });
  }

  /** Lets what is selected be moved, though it is part of the building. */
  loosen(): void {
    const object = this.selected === null ? undefined : this.objects.get(this.selected);
    if (object) this.loosened.add(object.group);
    this.tell('selection');
  }

  /** A motion of the world in the scene's axes. */
  inScene(motion: Matrix4): Matrix4 {
    const { matrixWorld } = this.stage.root;
    return matrixWorld.clone().invert().multiply(motion).multiply(matrixWorld);
  }

  /** Places of what is selected after a motion of the world. */
  placed(motion: Matrix4, from = (surface: Surface) => this.adding.matrixOf(surface)): [Surface, Matrix4][] {
    const inScene = this.inScene(motion);
    return this.group().map((surface) => [surface, inScene.clone().multiply(from(surface))]);
  }

  /** Moves what is selected by a motion of the world, from where it is or from given places. */
  move(motion: Matrix4, gesture?: number, from?: (surface: Surface) => Matrix4): void {
    const edits: Edit[] = [];
    for (const [surface, matrix] of this.placed(motion, from)) {
      const place = matrix.toArray();
      this.objectsAhead.change(surface.object, { matrix: place });
      edits.push({ move: { object: surface.object, matrix: place } });
    }
    this.editAll(edits, gesture);
  }

  /** Moves by a way and turns: by an angle about the zenith, and lamps about the right of who looks, what was added about its own
   *  x axis. */
  nudge(way: Vector3, angle: number, tilt: number, gesture: number): void {
    const spot = this.spot();
    if (!spot) {
      if (this.selected !== null) this.sayOfSelected('It is part of the building and stays put, unless “Let it move” is pressed in the panel.');
      return;
    }
    const right = new Vector3(1, 0, 0).applyQuaternion(this.stage.camera.quaternion).setY(0).normalize();
    const motion = new Matrix4().makeTranslation(way.clone().add(spot))
      .multiply(new Matrix4().makeRotationY(angle))
      .multiply(new Matrix4().makeTranslation(spot.clone().negate()));
    const [part] = this.adding.parts();
    if (this.selectedLight !== null) this.moveLight(this.selectedLight, motion.multiply(about(spot, right, tilt)), gesture);
    else if (!part) this.move(motion, gesture);
    else this.move(motion.multiply(about(this.stage.toWorld(part.matrix.slice(12, 15)), this.adding.axes(part)[0], tilt)), gesture);
  }

  /** About what the selected thing or lamp turns, in the world; none if it cannot be moved. */
  spot(): Vector3 | null {
    const light = this.selectedLight === null ? undefined : this.lights.get(this.selectedLight);
    if (light) return light.type === 'sky' ? null : this.stage.root.localToWorld(new Vector3().fromArray(light.position ?? [0, 0, 0]));
    return this.isMovable ? this.middle() : null;
  }

  /** What is around what is selected, in the world. */
  box(): Box3 {
    const box = new Box3();
    for (const surface of this.group()) box.union(surface.geometry.boundingBox!.clone().applyMatrix4(surface.matrixWorld));
    return box;
  }

  /** The middle of the floor plan of what is selected, at its foot, in the world. */
  middle(): Vector3 {
    const box = this.box();
    const middle = box.getCenter(new Vector3());
    middle.y = box.min.y;
    return middle;
  }

  /** Turns all lights off. */
  turnOff(): void {
    const lit = this.present().filter(({ dimming }) => dimming > 0);
    if (lit.length > 0) this.levels = new Map(this.present().map(({ id, dimming }) => [id, dimming]));
    this.dimAll(() => 0);
  }

  /** Turns lights on: those that are off as they were before all of them were turned off, else all of them fully. */
  turnOn(): void {
    const before = ({ id, dimming }: LightNotice) => dimming || (this.levels.get(id) ?? 0);
    const isBack = this.present().every((light) => before(light) === light.dimming);
    this.dimAll(isBack ? () => 1 : before);
    this.levels.clear();
  }

  private present(): LightNotice[] {
    return [...this.lights.values()].filter((light) => !light.deleted);
  }

  private dimAll(level: (light: LightNotice) => number): void {
    this.edit({ several: this.present().map((light) => ({ light: { light: light.id, dimming: level(light), colour: light.colour } })) });
  }

  select(object: number | null): void {
    this.adding.awaitNone();
    this.mark(object);
  }

  /** Selects; what is awaited will be, when it comes. */
  private mark(object: number | null): void {
    this.selected = object;
    this.selectedLight = null;
    this.tell('selection');
  }

  selectLight(light: number | null): void {
    this.select(null);
    this.selectedLight = light;
    this.tell('selection');
  }

  /** What people call a light. */
  lightName({ id }: LightNotice): string {
    this.lightNames ??= namesOf(this.lights.values());
    return this.lightNames.get(id)!;
  }

  /** Things and lamps that are there, by name: what can be selected. */
  things(): { name: string; object?: number; light?: number }[] {
    const groups = new Map<number, ObjectNotice>();
    for (const object of this.objects.values()) if (!object.deleted && !groups.has(object.group)) groups.set(object.group, object);
    const lamps = [...this.lights.values()].filter((light) => !light.deleted && isLamp(light));
    return [
      ...[...groups.values()].map(({ id, name }) => ({ name: name || `Object ${id + 1}`, object: id })),
      ...lamps.map((lamp) => ({ name: this.lightName(lamp), light: lamp.id })),
    ];
  }

  /** Selects the next thing, or the one before. */
  selectNext(by: 1 | -1): void {
    const things = this.things();
    if (things.length === 0) return;
    const group = this.selected === null ? undefined : this.objects.get(this.selected)?.group;
    const now = things.findIndex(({ object, light }) =>
      (light !== undefined && light === this.selectedLight) || (object !== undefined && this.objects.get(object)!.group === group));
    const next = things[now < 0 ? (by > 0 ? 0 : things.length - 1) : (now + by + things.length) % things.length];
    if (next.object !== undefined) this.select(next.object);
    else this.selectLight(next.light!);
    this.sayOfSelected(`Selected: ${next.name}.`);
  }

  showEdges(is: boolean): void {
    this.edges = is;
    this.marks.edges(is ? this.stage.surfaces : new Map());
    this.tell('view');
    this.stage.change();
  }

  showLayer(layer: Layer): void {
    if (JSON.stringify(layer) === JSON.stringify(this.layer)) return;
    this.layer = layer;
    this.resting = '';
    // Light of the last layer would be taken for that of this one.
    this.stage.await();
    shared.emissionShown.value = layer === 'total' || layer === 'direct' ? 1 : 0;
    this.connection.look(layer);
    this.exposure.isBlind = isError(layer);
    this.exposure.show();
    this.paintMode();
  }

  showFalseColours(is: boolean): void {
    this.falseColours = is;
    this.paintMode();
  }

  private paintMode(): void {
    shared.mode.value = this.falseColours || isError(this.layer) ? Mode.Lux : Mode.Eye;
    this.exposure.meter();
    this.tell('view');
    this.stage.change();
  }

  /** Shows light by another tone curve, on this machine from now on. */
  setCurve(curve: Curve): void {
    this.curve = curve;
    keep(curve);
    shared.curve.value = numberOf(curve);
    this.tell('view');
    this.stage.change();
  }

  showIsolines(is: boolean): void {
    shared.isolines.value = is;
    this.exposure.meter();
    this.tell('view');
    this.stage.change();
  }

  look(place: CameraPlace): void {
    this.stage.look(place);
    this.navigator.choose();
    this.tell('view');
    const { camera } = this.stage;
    const [at, turned] = [camera.position.clone(), camera.quaternion.clone()];
    // On foot one comes to stand on the floor.
    const isThere = () => at.distanceTo(camera.position) < this.navigator.scale && turned.angleTo(camera.quaternion) < 0.1;
    this.say(place.name ? `Camera “${place.name}”.` : '', isThere);
  }

  keepCamera(name: string): void {
    this.connection.send({ kind: 'bookmark', camera: this.stage.place(name) });
  }

  forgetCamera(name: string): void {
    this.connection.send({ kind: 'forget', name });
  }

  /** On foot one looks where the pointer goes, until Escape. */
  lookFreely(): void {
    if (this.navigator.mode !== 'walk') this.walk('walk');
    const { canvas } = this.stage;
    canvas.focus();
    Promise.resolve(canvas.requestPointerLock())
      .then(() => this.say('The mouse looks around; click measures what is under the cross, Esc ends.', () => document.pointerLockElement === canvas))
      .catch(() => this.say('The browser did not give the mouse away; drag to look around.'));
  }

  walk(mode: 'walk' | 'orbit'): void {
    if (mode === 'orbit' && document.pointerLockElement) document.exitPointerLock();
    this.navigator.set(mode);
    this.tell('view');
  }
}

/** Whether a layer shows no light, but how far it is known. */
export function isError(layer: Layer): boolean {
  return layer === 'error' || layer === 'relative_error';
}

/** A turn about an axis through a point. */
function about(point: Vector3, axis: Vector3, angle: number): Matrix4 {
  return new Matrix4().makeTranslation(point)
    .multiply(new Matrix4().makeRotationAxis(axis, angle))
    .multiply(new Matrix4().makeTranslation(point.clone().negate()));
}
