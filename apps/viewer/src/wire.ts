// What page and server say to each other. JSON in both directions; triangles and light come as binary frames.
import { crossed } from './lattice';

/** The scene as a whole. */
export interface SceneNotice {
  kind: 'scene';
  name: string;
  version: string;
  up: [number, number, number];
  low: [number, number, number];
  high: [number, number, number];
  cameras: CameraPlace[];
  /** Luminance of the sky, cd/m², a small picture: rows from the zenith down, columns by azimuth about +Y; none if black. */
  sky: { width: number; height: number; luminance: number[] } | null;
}

/** A place to look from, in the scene's axes; matrix by columns, looking along −Z. */
export interface CameraPlace {
  name: string;
  matrix: number[];
  /** Vertical angle of view, radians. */
  fov: number;
}

/** A picture on an object. */
export interface TextureUse {
  index: number;
  wrap: ['repeat' | 'mirror' | 'clamp', 'repeat' | 'mirror' | 'clamp'];
  nearest: boolean;
}

/** An object. */
export interface ObjectNotice {
  kind: 'object';
  id: number;
  name: string;
  /** Objects of one group are one thing to people. */
  group: number;
  /** From its place in the file to where it is now. */
  matrix: number[];
  /** Mean reflectance, for people. */
  reflectance: [number, number, number];
  /** Reflectance; with a picture, what that is multiplied with. */
  tint: [number, number, number];
  /** What passes through to the other side, of light that falls on it. */
  transmittance: [number, number, number];
  texture: TextureUse | null;
  /** cd/m². */
  emission: [number, number, number];
  deleted: boolean;
  movable: boolean;
  /** Of what was added, in the axes that the matrix carries from; none of what the file has. */
  form: Form | null;
  /** What it became when it got another form. */
  successor: number | null;
}

/** A form about its middle, metres: a box along x, y and z, or a rectangle along x and y whose front is that of +z. */
export type Form = { box: { size: number[] } } | { rectangle: { size: number[] } };

/** A light. */
export interface LightNotice {
  kind: 'light';
  id: number;
  name: string;
  type: 'object' | 'point' | 'spot' | 'directional' | 'sky';
  dimming: number;
  colour: [number, number, number];
  /** Candela, or lux of parallel light, before it is dimmed and coloured; none with area. */
  intensity: number[] | null;
  /** Lumens of an object, before it is dimmed and coloured. */
  flux: number[] | null;
  /** Lux before it is dimmed and coloured: of the sky on open level ground, of parallel light across its rays. */
  illuminance: number[] | null;
  /** Half angles of a spot, radians: full within the first, nothing beyond the second. */
  cone: number[] | null;
  /** From its place in the file to where it is now. */
  matrix: number[];
  position: number[] | null;
  /** Where spots and parallel light shine to, in the scene's axes. */
  direction: number[] | null;
  object: number | null;
  deleted: boolean;
  /** How many lights are shown together, itself among them. */
  sharing: number;
}

/** How far the solution is. */
export interface StatusNotice {
  kind: 'status';
  doing: string;
  /** Whether an edit is not seen yet. */
  is_following: boolean;
  rays: number;
  most_rays: number;
  /** Share of all rays that are there. */
  share: number;
  /** Relative error of irradiance, estimated over all surfaces; none before there is one. */
  error: number | null;
  seconds: number;
  /** Seconds to the target, about. */
  left: number | null;
  rays_traced: number;
  elements: number;
  /** Milliseconds that the last edit took to its first complete update. */
  latency: number | null;
  is_done: boolean;
  /** Edits so far, of all pages. */
  edits: number;
}

/** A share of the illuminance of a place. */
export interface Share {
  name: string;
  share: number;
}

/** What stands at a point. */
export interface ProbeAnswer {
  illuminance: number;
  /** One standard error of it by the rays of the place, lx. */
  error: number;
  irradiance: [number, number, number];
  reflectance: [number, number, number];
  radiosity: [number, number, number];
  /** What each light brings, its reflections too. */
  lights: Share[];
  /** From where it arrives: straight from lights, or from surfaces that reflect it. */
  surfaces: Share[];
}

/** What was measured on a working plane. */
export interface PlaneAnswer {
  /** Place in the scene's axes, metres, and illuminance, lx. */
  points: [number, number, number, number][];
  /** Sides of the plane and of a cell, metres, and unit vectors along them. */
  size: [number, number];
  cell: [number, number];
  axes: [number[], number[]];
  /** Whether cells are larger than the standard has them. */
  is_coarse: boolean;
  least: number;
  mean: number;
  most: number;
  uniformity: number;
  /** Points that are left out, as they are within things. */
  covered: number;
  /** Points that are left out, as they lie in the zone along walls. */
  walled: number;
  /** Points that are left out, as walls stand between: of other rooms, or within what is taken for walls. */
  beyond: number;
  /** Standard error of a point by its rays, over the mean. */
  error: number;
  /** Edits that are in it. */
  edits: number;
  /** Whether the light will stay as it is. */
  is_done: boolean;
}

/** What was measured at the places of a grid. */
export interface SurveyAnswer {
  /** Illuminance at each place, lx; none where there is no such place any more. */
  lux: (number | null)[];
  /** Unit normal of the places, in the scene's axes. */
  normal: [number, number, number] | null;
  /** Standard error of a place by its rays, over the mean. */
  error: number;
  /** Edits that are in it. */
  edits: number;
  /** Whether the light will stay as it is. */
  is_done: boolean;
}

/** What was refused: a change of the scene, a camera to keep, to follow changes in the layer that is shown, or a message
 *  that is none. The message is for people. */
export interface RefusedNotice {
  kind: 'refused';
  code: 'edit' | 'camera' | 'layer' | 'message';
  message: string;
}

/** Everything that the server says in JSON. */
export type Notice =
  | SceneNotice
  | ObjectNotice
  | LightNotice
  | StatusNotice
  | { kind: 'bookmarks'; cameras: CameraPlace[] }
  | { kind: 'history'; undo: string | null; redo: string | null }
  | { kind: 'caught_up' }
  | { kind: 'probe'; question: number; answer: ProbeAnswer | null }
  | { kind: 'plane'; question: number; answer: PlaneAnswer | null; why: string | null }
  | ({ kind: 'survey'; question: number } & SurveyAnswer)
  | { kind: 'in_sight'; question: number; error: number | null }
  | { kind: 'rays'; question: number; rays: number[][][] }
  | RefusedNotice;

/** What a layer shows. */
export type Layer = 'total' | 'direct' | 'indirect' | 'error' | 'relative_error' | { bounce: number } | { light: number };

/** Kinds of lights without area. */
export type LampForm = 'point' | 'directional' | { spot: { inner: number; outer: number } };

/** A light without area that is to be added. Without a direction it shines down. */
export interface NewLight {
  name: string;
  kind: LampForm;
  position?: number[];
  direction?: number[];
  /** cd, or lx of parallel light. */
  intensity: number[];
}

/** An object that is to be added; the matrix carries from its own axes. */
export interface NewObject {
  name: string;
  form: Form;
  reflectance: number[];
  /** lm/m²; none unless it is a lamp. */
  emission?: number[];
  matrix: number[];
}

/** A change of the scene. */
export type Edit =
  | { light: { light: number; dimming: number; colour: number[] } }
  | { reflectance: { object: number; reflectance: number[] } }
  | { move: { object: number; matrix: number[] } }
  | { move_light: { light: number; matrix: number[] } }
  | { add_light: { light: NewLight } }
  | { change_light: { light: number; kind: LampForm; intensity: number[] } }
  | { copy_light: { light: number; matrix: number[] } }
  | { delete_light: { light: number } }
  | { add: { object: NewObject } }
  | { reshape: { object: number; form: Form; matrix: number[] } }
  | { copy: { object: number; matrix: number[] } }
  | { delete: { object: number } }
  | { several: Edit[] };

/** Everything that the page says. */
export type Request =
  | { kind: 'edit'; edit: Edit; gesture?: number }
  | { kind: 'undo' }
  | { kind: 'redo' }
  | { kind: 'layer'; layer: Layer; epoch: number }
  | { kind: 'probe'; question: number; object: number; triangle: number; uv: [number, number] }
  | { kind: 'plane'; question: number; about: { object: number; triangle: number; uv: [number, number]; height: number; border: number } }
  | { kind: 'survey'; question: number; object: number; places: [number, number, number][] }
  | { kind: 'in_sight'; question: number; matrix: number[]; fov: number; aspect: number }
  | { kind: 'rays'; question: number; object: number; triangle: number }
  | { kind: 'bookmark'; camera: CameraPlace }
  | { kind: 'forget'; name: string };

/** Triangles of an object. */
export interface MeshFrame {
  object: number;
  positions: Float32Array;
  uvs: Float32Array | null;
  /** Colours that the author gave to vertices. */
  colours: Float32Array | null;
  indices: Uint32Array;
}

/** An element that is cut, as light has an edge in it, into so many parts along each side. */
export interface CutElement {
  element: number;
  parts: number;
  /** The edge of a shadow, if a sharp one goes through it. */
  edge: Edge | null;
}

/** The edge of a shadow among the places of an element. */
export interface Edge {
  /** Whether places see the lamp, a bit each, row by row. */
  isLit: Uint32Array;
  /** Where the edge crosses lines, over 65535 of the way: of each place in turn those to the next one of its row, the one above, and the one before that. */
  shares: Uint16Array;
}

/** Which elements of an object are cut. */
export interface CutsFrame {
  object: number;
  /** Their light begins with it. */
  number: number;
  cuts: CutElement[];
}

/** Light of some vertices, three half floats each in units of 16 lx; after the vertices follow the number of the
 *  object's cuts, its lower and its upper half, and the places of these. */
export interface LightFrame {
  object: number;
  first: number;
  values: Uint16Array;
}

const MESH = 1;
const LIGHT = 2;
const CUTS = 3;
const HAS_EDGE = 1 << 31;
const HAS_UVS = 1;
const HAS_COLOURS = 2;

function readMesh(buffer: ArrayBuffer): MeshFrame {
  const [, object, vertices, triangles, flags] = new Uint32Array(buffer, 0, 5);
  let at = 20;
  const floats = (count: number) => {
    const values = new Float32Array(buffer, at, count);
    at += 4 * count;
    return values;
  };
  const positions = floats(3 * vertices);
  const uvs = flags & HAS_UVS ? floats(2 * vertices) : null;
  const colours = flags & HAS_COLOURS ? floats(3 * vertices) : null;
  return { object, positions, uvs, colours, indices: new Uint32Array(buffer, at, 3 * triangles) };
}

function readCuts(buffer: ArrayBuffer): CutsFrame {
  const [, object, number] = new Uint32Array(buffer, 0, 3);
  const words = new Uint32Array(buffer, 12);
  const cuts: CutElement[] = [];
  for (let at = 0; at < words.length;) {
    const [element, parts] = [words[at], words[at + 1] & ~HAS_EDGE];
    const hasEdge = parts !== words[at + 1];
    at += 2;
    const cut: CutElement = { element, parts, edge: null };
    if (hasEdge) {
      const isLit = words.subarray(at, at + Math.ceil(((parts + 1) * (parts + 2)) / 64));
      at += isLit.length;
      const count = crossed(parts, isLit).length;
      cut.edge = { isLit, shares: new Uint16Array(buffer, 12 + 4 * at, count) };
      at += Math.ceil(count / 2);
    }
    cuts.push(cut);
  }
  return { object, number, cuts };
}

function* readLight(buffer: ArrayBuffer): Generator<LightFrame> {
  const view = new DataView(buffer);
  let at = 8;
  while (at < buffer.byteLength) {
    const [object, first, count] = [0, 4, 8].map((offset) => view.getUint32(at + offset, true));
    yield { object, first, values: new Uint16Array(buffer, at + 12, 3 * count) };
    at += 12 + 4 * Math.ceil((6 * count) / 4);
  }
}

/** What is known of why there is no connection: nobody answers at the address; somebody does who knows it not; or nothing. */
export type Lost = 'silent' | 'strange' | 'unknown';

/** Who listens to a connection. */
export interface Listener {
  notice(notice: Notice): void;
  mesh(frame: MeshFrame): void;
  cuts(frame: CutsFrame): void;
  light(frame: LightFrame): void;
  connected(is: boolean): void;
  lost(why: Lost): void;
}

/** Milliseconds before a lost connection is tried again: first, and at most. */
const PATIENCE = [250, 4000];

/** Milliseconds within which whoever is there answers. */
const ANSWERED = 3000;

/** The socket, opened again when it closes. */
export class Connection {
  private socket: WebSocket | null = null;
  private patience = PATIENCE[0];
  private layer: Layer = 'total';
  private epoch = 0;
  /** Bytes received, for those who measure. */
  received = 0;

  constructor(private listener: Listener) {
    this.open();
  }

  get isOpen(): boolean {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  /** Says something; nothing is kept for later, since the scene may have changed by then. */
  send(request: Request): boolean {
    if (!this.isOpen) return false;
    this.socket!.send(JSON.stringify(request));
    return true;
  }

  /** Looks at another layer: its light is sent from now on. */
  look(layer: Layer): void {
    this.layer = layer;
    this.epoch += 1;
    this.send({ kind: 'layer', layer, epoch: this.epoch });
  }

  /** Closes as a broken line would. */
  drop(): void {
    this.socket?.close();
  }

  /** Sends text as it is, for tests of what is malformed. */
  sendRaw(text: string): void {
    this.socket?.send(text);
  }

  private open(): void {
    const address = new URL('socket', location.href);
    address.protocol = 'ws:';
    const socket = new WebSocket(address);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    let wasOpen = false;
    socket.onopen = () => {
      wasOpen = true;
      this.patience = PATIENCE[0];
      this.listener.connected(true);
      this.look(this.layer);
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => this.receive(data);
    socket.onclose = () => {
      this.listener.connected(false);
      if (!wasOpen) void this.find();
      setTimeout(() => this.open(), this.patience);
      this.patience = Math.min(2 * this.patience, PATIENCE[1]);
    };
  }

  /** Finds out why there is no connection, which sockets do not tell: a program that was started anew at the same port has another
   *  token, and refuses that of this page for ever. */
  private async find(): Promise<void> {
    let why: Lost = 'silent';
    try {
      const { status } = await fetch(location.href, { method: 'HEAD', cache: 'no-store', signal: AbortSignal.timeout(ANSWERED) });
      why = status === 403 ? 'strange' : 'unknown';
    } catch {
      // Nobody is there, or nobody who answers in time.
    }
    if (!this.isOpen) this.listener.lost(why);
  }

  private receive(data: string | ArrayBuffer): void {
    if (typeof data === 'string') {
      this.received += data.length;
      this.listener.notice(JSON.parse(data) as Notice);
      return;
    }
    this.received += data.byteLength;
    const [kind, epoch] = new Uint32Array(data, 0, 2);
    if (kind === MESH) this.listener.mesh(readMesh(data));
    if (kind === CUTS) this.listener.cuts(readCuts(data));
    // Light of a layer that was looked at before is still under way when another is chosen.
    if (kind === LIGHT && epoch === this.epoch) for (const frame of readLight(data)) this.listener.light(frame);
  }
}
