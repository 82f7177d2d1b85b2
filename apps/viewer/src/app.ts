// All that the page knows, and what can be done with it. Panels and keys call the verbs here and listen to topics.
import { Box3, ClampToEdgeWrapping, Matrix4, MirroredRepeatWrapping, NearestFilter, RepeatWrapping, SRGBColorSpace, Texture, TextureLoader, Vector3 } from 'three';
import { Exposure } from './exposure';
import { Gizmo } from './gizmo';
import { grid, type Grid } from './grid';
import { Marks } from './marks';
import { Navigator } from './navigate';
import { corners, Stage, type Hit } from './stage';
import { Mode, shared, Surface } from './surface';
import {
  Connection, type CameraPlace, type Edit, type Layer, type LightFrame, type LightNotice, type MeshFrame, type Notice,
  type ObjectNotice, type ProbeAnswer, type SceneNotice, type StatusNotice, type TextureUse,
} from './wire';

/** What can change. */
export type Topic =
  | 'scene' | 'objects' | 'lights' | 'status' | 'bookmarks' | 'history' | 'selection' | 'probe' | 'grid' | 'view' | 'connection' | 'message';

/** Milliseconds between edits of one gesture: more often than light can follow is of no use. */
const GESTURE = 40;

const WRAPS = { repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping } as const;

/** What was measured at a point, and where it is. */
export interface Probed {
  hit: Hit;
  answer: ProbeAnswer | null;
}

export class App {
  readonly stage = new Stage();
  readonly navigator = new Navigator(this.stage);
  readonly exposure = new Exposure(this.stage, () => this.tell('view'));
  readonly marks = new Marks(this.stage);
  readonly gizmo = new Gizmo(this);
  readonly connection: Connection;
  scene: SceneNotice | null = null;
  readonly objects = new Map<number, ObjectNotice>();
  readonly lights = new Map<number, LightNotice>();
  bookmarks: CameraPlace[] = [];
  status: StatusNotice | null = null;
  undoable: string | null = null;
  redoable: string | null = null;
  isConnected = false;
  isCaughtUp = false;
  /** Milliseconds from the beginning of the page to the whole scene. */
  opened: number | null = null;
  layer: Layer = 'total';
  falseColours = false;
  edges = false;
  raysShown = false;
  selected: number | null = null;
  /** A light without an object that is moved. */
  selectedLight: number | null = null;
  probed: Probed | null = null;
  grid: Grid | null = null;
  message = '';
  private listeners = new Map<Topic, (() => void)[]>();
  private loosened = new Set<number>();
  private textures = new Map<string, Texture>();
  private question = 0;
  private gesture = 0;
  private pending: { gesture?: number; send: () => void; timer: number } | null = null;
  private lastSent = 0;

  constructor() {
    this.connection = new Connection({
      notice: (notice) => this.notice(notice),
      mesh: (frame) => this.mesh(frame),
      light: (frame) => this.shine(frame),
      connected: (is) => this.connected(is),
    });
    setInterval(() => this.refresh(), 500);
  }

  on(topic: Topic, listener: () => void): void {
    this.listeners.set(topic, [...(this.listeners.get(topic) ?? []), listener]);
    listener();
  }

  tell(topic: Topic): void {
    for (const listener of this.listeners.get(topic) ?? []) listener();
  }

  /** A line for the person. */
  say(message: string): void {
    this.message = message;
    this.tell('message');
  }

  // What the server says.

  private connected(is: boolean): void {
    if (is === this.isConnected) return;
    this.isConnected = is;
    this.isCaughtUp = false;
    if (is) this.say('');
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
        this.objects.set(notice.id, notice);
        this.arrange(notice.id);
        this.tell('objects');
        break;
      case 'light':
        this.lights.set(notice.id, notice);
        this.marks.light(notice);
        this.tell('lights');
        break;
      case 'status':
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
        if (this.probed && notice.question === this.question) {
          this.probed.answer = notice.answer;
          this.tell('probe');
        }
        break;
      case 'rays':
        if (notice.question === this.question) this.marks.rays(notice.rays);
        break;
      case 'refused':
        this.say(notice.message);
        break;
    }
  }

  private begin(): void {
    this.isCaughtUp = true;
    this.opened ??= performance.now();
    if (this.selected === null) this.navigator.choose();
    this.tell('view');
    this.tell('connection');
  }

  private mesh(frame: MeshFrame): void {
    this.stage.put(new Surface(frame.object, frame));
    this.arrange(frame.object);
  }

  /** An object and its triangles come apart. */
  private arrange(id: number): void {
    const [object, surface] = [this.objects.get(id), this.stage.surfaces.get(id)];
    if (!object || !surface) return;
    surface.visible = !object.deleted;
    surface.material.uniforms.tint.value.fromArray(object.tint);
    surface.material.uniforms.emission.value.fromArray(object.emission);
    surface.dress(object.texture ? this.texture(object.texture) : null);
    // What is dragged here is ahead of what the server has seen.
    if (!this.gizmo.isDragging || !this.group().includes(surface)) {
      surface.matrix.fromArray(object.matrix);
      this.stage.moved(surface);
      this.followed(surface);
    }
    if (object.deleted && this.selected === id) this.select(null);
    else if (this.group().includes(surface)) {
      this.marks.outline(this.group());
      if (!this.gizmo.isDragging) this.gizmo.place();
    }
    if (this.edges) this.marks.edges(this.stage.surfaces);
    this.stage.change();
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

  private shine(frame: LightFrame): void {
    const surface = this.stage.surfaces.get(frame.object);
    surface?.shine(frame.first, frame.values);
    this.exposure.lit();
    this.stage.change();
  }

  /** What depends on light is asked again while light changes. */
  private refresh(): void {
    if (!this.isCaughtUp || !this.status) return;
    const now = `${this.status.rays} ${this.status.edits} ${this.status.is_done} ${JSON.stringify(this.layer)}`;
    if (now === this.asked) return;
    this.asked = now;
    this.askProbe();
    if (this.grid) this.measure();
  }

  private asked = '';

  // What a person does.

  /** Changes the scene. Edits of one gesture, such as a drag, are sent at a steady pace and undone together. */
  edit(edit: Edit, gesture?: number): void {
    // What waits is outdated by an edit of the same gesture, and comes first before any other.
    if (this.pending && this.pending.gesture === gesture) this.drop();
    else this.flush();
    const wait = gesture === undefined ? 0 : this.lastSent + GESTURE - performance.now();
    const send = () => {
      this.pending = null;
      this.lastSent = performance.now();
      if (!this.connection.send({ kind: 'edit', edit, gesture })) this.say('Not connected: the change was not made.');
    };
    if (wait > 0) this.pending = { gesture, send, timer: setTimeout(send, wait) };
    else send();
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

  undo(): void {
    this.flush();
    this.connection.send({ kind: 'undo' });
  }

  redo(): void {
    this.flush();
    this.connection.send({ kind: 'redo' });
  }

  setLight(light: LightNotice, change: { dimming?: number; colour?: number[] }, gesture?: number): void {
    const { dimming = light.dimming, colour = light.colour } = change;
    light.dimming = dimming;
    light.colour = colour as [number, number, number];
    this.edit({ light: { light: light.id, dimming, colour } }, gesture);
    this.tell('lights');
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

  /** Lets what is selected be moved, though it is large. */
  loosen(): void {
    const object = this.selected === null ? undefined : this.objects.get(this.selected);
    if (object) this.loosened.add(object.group);
    this.gizmo.place();
    this.tell('selection');
  }

  /** Places of what is selected after a motion of the world. */
  private placed(motion: Matrix4, from = (surface: Surface) => surface.matrix): [Surface, Matrix4][] {
    const { matrixWorld } = this.stage.root;
    const inScene = matrixWorld.clone().invert().multiply(motion).multiply(matrixWorld);
    return this.group().map((surface) => [surface, inScene.clone().multiply(from(surface))]);
  }

  /** Moves what is selected by a motion of the world, from where it is or from given places. */
  move(motion: Matrix4, gesture?: number, from?: (surface: Surface) => Matrix4): void {
    const edits: Edit[] = [];
    for (const [surface, matrix] of this.placed(motion, from)) {
      const object = this.objects.get(surface.object)!;
      object.matrix = matrix.toArray();
      surface.matrix.copy(matrix);
      this.stage.moved(surface);
      this.followed(surface);
      edits.push({ move: { object: object.id, matrix: object.matrix } });
    }
    if (edits.length === 0) return;
    this.edit(edits.length === 1 ? edits[0] : { several: edits }, gesture);
    this.tell('selection');
  }

  /** Moves by a way and turns by an angle about the zenith through the middle of the thing. */
  nudge(way: Vector3, angle: number): void {
    if (!this.isMovable) return;
    const middle = this.middle();
    this.move(new Matrix4().makeTranslation(way.clone().add(middle))
      .multiply(new Matrix4().makeRotationY(angle))
      .multiply(new Matrix4().makeTranslation(middle.clone().negate())));
    this.gizmo.place();
  }

  private box(): Box3 {
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

  duplicate(): void {
    if (this.group().length === 0) return;
    // Beside the first, to the right of who looks, so that one sees that there are two.
    const right = new Vector3(1, 0, 0).applyQuaternion(this.stage.camera.quaternion).setY(0).normalize();
    const size = this.box().getSize(new Vector3());
    const way = right.multiplyScalar(0.6 * Math.max(size.x, size.z));
    const copies: Edit[] = this.placed(new Matrix4().makeTranslation(way))
      .map(([surface, matrix]) => ({ copy: { object: surface.object, matrix: matrix.toArray() } }));
    this.edit(copies.length === 1 ? copies[0] : { several: copies });
    this.say('Duplicated: the copy stands beside it.');
  }

  delete(): void {
    const deletions: Edit[] = this.group().map((surface) => ({ delete: { object: surface.object } }));
    if (deletions.length > 0) this.edit(deletions.length === 1 ? deletions[0] : { several: deletions });
  }

  /** Turns lights on or off together. */
  setLights(dimming: number): void {
    const lights = [...this.lights.values()].filter((light) => !light.deleted);
    this.edit({ several: lights.map(({ id, colour }) => ({ light: { light: id, dimming, colour } })) });
  }

  select(object: number | null): void {
    this.selected = object;
    this.selectedLight = null;
    this.marks.outline(this.group());
    this.gizmo.place();
    this.tell('selection');
  }

  selectLight(light: number | null): void {
    this.select(null);
    this.selectedLight = light;
    this.gizmo.place();
    this.tell('selection');
  }

  /** Measures what is at a place of the canvas (−1..1 right and up) and selects its object. */
  pick(x: number, y: number): void {
    const hit = this.stage.pick(x, y);
    if (!hit) {
      this.probed = null;
      this.marks.point(null);
      this.select(null);
      this.tell('probe');
      return;
    }
    this.probed = { hit, answer: null };
    this.marks.point(hit);
    this.select(hit.surface.object);
    this.askProbe();
    this.tell('probe');
  }

  /** What is marked on a surface goes with it. */
  private followed(surface: Surface): void {
    this.marks.follow(surface);
    const hit = this.probed?.hit;
    if (hit?.surface !== surface) return;
    const [a, b, c] = corners(surface, hit.triangle).map((corner) => corner.applyMatrix4(surface.matrixWorld));
    const [v, w] = hit.uv;
    hit.point.copy(a).multiplyScalar(1 - v - w).addScaledVector(b, v).addScaledVector(c, w);
    hit.normal.copy(b.sub(a).cross(c.sub(a)).normalize());
    this.marks.point(hit);
  }

  private askProbe(): void {
    if (!this.probed) return;
    const { surface, triangle, uv } = this.probed.hit;
    if (!this.stage.surfaces.has(surface.object)) return;
    this.question += 1;
    const about = { question: this.question, object: surface.object, triangle };
    this.connection.send({ kind: 'probe', ...about, uv });
    if (this.raysShown) this.connection.send({ kind: 'rays', ...about });
  }

  showRays(is: boolean): void {
    this.raysShown = is;
    if (!is) this.marks.rays([]);
    else if (this.probed) this.askProbe();
    else this.say('Pick a point first: its rays are drawn then.');
    this.tell('view');
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
    // Light of the last layer would be taken for that of this one.
    for (const surface of this.stage.surfaces.values()) surface.shine(0, new Uint16Array(surface.light.array.length));
    shared.emissionShown.value = layer === 'total' || layer === 'direct' ? 1 : 0;
    this.connection.look(layer);
    this.paintMode();
  }

  showFalseColours(is: boolean): void {
    this.falseColours = is;
    this.paintMode();
  }

  private paintMode(): void {
    shared.mode.value = this.falseColours || this.layer === 'error' ? Mode.Lux : Mode.Eye;
    this.exposure.meter();
    this.tell('view');
    this.stage.change();
  }

  showIsolines(is: boolean): void {
    shared.isolines.value = is;
    this.exposure.meter();
    this.tell('view');
    this.stage.change();
  }

  /** Lays a grid of measuring points over the surface that was picked. */
  measure(): void {
    if (!this.probed) return this.say('Pick a point of a surface first: the grid is laid over it.');
    this.grid = grid(this.probed.hit);
    this.marks.grid(this.grid);
    this.tell('grid');
  }

  clearGrid(): void {
    this.grid = null;
    this.marks.grid(null);
    this.tell('grid');
  }

  look(place: CameraPlace): void {
    this.stage.look(place);
    this.navigator.choose();
    this.tell('view');
    this.say(place.name ? `Camera “${place.name}”.` : '');
  }

  keepCamera(name: string): void {
    this.connection.send({ kind: 'bookmark', camera: this.stage.place(name) });
  }

  forgetCamera(name: string): void {
    this.connection.send({ kind: 'forget', name });
  }

  walk(mode: 'walk' | 'orbit'): void {
    this.navigator.set(mode);
    this.tell('view');
  }
}

