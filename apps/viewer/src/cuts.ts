// Elements in which light has an edge: drawn again over the whole ones, cut into parts whose corners have light of their own.
import { DataUtils } from 'three';
import type { Batches } from './batch';
import { unbordered } from './border';
import { Surface } from './surface';
import type { CutsFrame, MeshFrame } from './wire';

/** Where a row of places begins. */
const row = (parts: number, j: number) => j * (parts + 1) - (j * (j - 1)) / 2;

const count = (parts: number) => row(parts, parts + 1);

/** An element that is cut into so many parts along each side. */
class Cutting {
  /** Weights of the corners at the places, row by row as the server counts them. */
  readonly weights: number[][] = [];
  /** The parts as triples of places. */
  readonly triangles: number[] = [];

  constructor(parts: number) {
    for (let j = 0; j <= parts; j += 1) {
      for (let i = 0; i <= parts - j; i += 1) {
        this.weights.push([1 - (i + j) / parts, i / parts, j / parts]);
        const [here, above] = [row(parts, j) + i, row(parts, j + 1) + i];
        if (i + j < parts) this.triangles.push(here, here + 1, above);
        if (i + j < parts - 1) this.triangles.push(here + 1, above + 1, above);
      }
    }
  }
}

const cuttings = new Map<number, Cutting>();

function cutting(parts: number): Cutting {
  let found = cuttings.get(parts);
  if (!found) {
    found = new Cutting(parts);
    cuttings.set(parts, found);
  }
  return found;
}

/** The elements of a surface that are cut, as a surface of their own that nothing else meets. */
class CutElements extends Surface {
  override readonly isOfParts = true;

  constructor(whole: Surface, frame: CutsFrame) {
    const { position, uv, paint } = whole.geometry.attributes;
    const index = whole.geometry.index!;
    const places = frame.cuts.reduce((sum, [, parts]) => sum + count(parts), 0);
    const of = (from: ArrayLike<number>, size: number) => ({ from, size, to: new Float32Array(size * places) });
    const light = Float32Array.from(whole.light.array, (half) => DataUtils.fromHalfFloat(half));
    const values = [...[position, uv, paint].map(({ array, itemSize }) => of(array, itemSize)), of(light, 3)];
    const indices = new Uint32Array(frame.cuts.reduce((sum, [, parts]) => sum + 3 * parts * parts, 0));
    const firsts = new Map<number, [number, number]>();
    let [first, corner] = [0, 0];
    for (const [element, parts] of frame.cuts) {
      firsts.set(element, [first, parts]);
      const { weights, triangles } = cutting(parts);
      const corners = [0, 1, 2].map((k) => index.getX(3 * element + k));
      weights.forEach((weight, place) => {
        for (const { from, size, to } of values) {
          for (let k = 0; k < size; k += 1) {
            let sum = 0;
            for (let c = 0; c < 3; c += 1) sum += weight[c] * from[size * corners[c] + k];
            to[size * (first + place) + k] = sum;
          }
        }
      });
      for (const place of triangles) {
        indices[corner] = first + place;
        corner += 1;
      }
      first += weights.length;
    }
    const mesh: MeshFrame = { object: whole.object, positions: values[0].to, uvs: values[1].to, colours: values[2].to, indices };
    // The whole ones beneath reach beyond borders already.
    super(whole.object, mesh, unbordered(places));
    values[3].to.forEach((lux, k) => { this.light.array[k] = DataUtils.toHalfFloat(lux); });
    this.firsts = firsts;
    this.look = whole.look;
    this.matrix = whole.matrix;
    this.visible = whole.visible;
  }

  /** The first place of each element, and its parts. */
  private readonly firsts: Map<number, [number, number]>;

  override around(element: number, [v, w]: [number, number]): [number, number][] | null {
    const own = this.firsts.get(element);
    if (own === undefined) return null;
    const [first, parts] = own;
    const [x, y] = [v, w].map((weight) => Math.min(1, Math.max(0, weight)) * parts);
    const j = Math.min(Math.floor(y), parts - 1);
    const i = Math.min(Math.floor(x), parts - 1 - j);
    const at = (i: number, j: number) => first + row(parts, j) + i;
    const [a, b] = [x - i, y - j];
    // Of the two halves of a cell the upper is not there at the slanting side.
    const isLower = a + b <= 1 || i + j + 2 > parts;
    const third: [number, number] = isLower ? [at(i, j), 1 - a - b] : [at(i + 1, j + 1), a + b - 1];
    return [third, [at(i + 1, j), isLower ? a : 1 - b], [at(i, j + 1), isLower ? b : 1 - a]];
  }
}

/** What is known of the cuts of an object. */
interface Known {
  /** Its elements that are drawn cut. */
  drawn: CutElements | null;
  /** Light of places as it came, behind the number of the cuts whose it is. */
  light: Uint16Array;
  /** Cuts whose light has not come. */
  coming: CutsFrame | null;
}

/** The elements that are cut, of all surfaces. */
export class Cuts {
  private known = new Map<number, Known>();

  constructor(private batches: Batches) {}

  private of(object: number): Known {
    let known = this.known.get(object);
    if (!known) {
      known = { drawn: null, light: new Uint16Array(0), coming: null };
      this.known.set(object, known);
    }
    return known;
  }

  /** Other elements of a surface are cut than before. They are drawn when their light comes. */
  cut(surface: Surface, frame: CutsFrame): void {
    const known = this.of(surface.object);
    known.coming = frame;
    if (frame.cuts.length === 0) this.reveal(surface, known);
  }

  /** Light has come, beyond that of the vertices: the number of the cuts, and then that of their places. */
  shine(surface: Surface, first: number, values: Uint16Array): void {
    const known = this.of(surface.object);
    if (known.light.length < 3 * first + values.length) {
      const old = known.light;
      known.light = new Uint16Array(3 * first + values.length);
      known.light.set(old);
    }
    const { light, coming, drawn } = known;
    light.set(values, 3 * first);
    // The light of a layer may be that of other cuts still.
    if (first === 0 && coming?.number === light[0] + 65536 * light[1]) return this.reveal(surface, known);
    if (!drawn) return;
    const [from, to] = [Math.max(first, 1), Math.min(first + values.length / 3, drawn.light.count + 1)];
    if (to <= from) return;
    (drawn.light.array as Uint16Array).set(light.subarray(3 * from, 3 * to), 3 * (from - 1));
    this.batches.shine(drawn, from - 1, to - from);
  }

  /** Draws the elements that are cut now. Light that is what it was does not come again, and what is yet to come is even till then. */
  private reveal(surface: Surface, known: Known): void {
    this.hide(known);
    if (known.coming!.cuts.length > 0) {
      const drawn = new CutElements(surface, known.coming!);
      (drawn.light.array as Uint16Array).set(known.light.subarray(3, 3 + 3 * drawn.light.count));
      this.batches.put(drawn);
      known.drawn = drawn;
    }
    known.coming = null;
  }

  private hide(known: Known): void {
    if (!known.drawn) return;
    this.batches.remove(known.drawn);
    known.drawn.dispose();
    known.drawn = null;
  }

  /** Of a surface that is there no longer nothing is cut. */
  remove({ object }: Surface): void {
    const known = this.known.get(object);
    if (known) this.hide(known);
    this.known.delete(object);
  }

  /** Vertices of light that came beyond those of a surface. */
  count({ object }: Surface): number {
    return (this.known.get(object)?.light.length ?? 0) / 3;
  }

  /** The surface looks otherwise. */
  dress({ object, look }: Surface): void {
    const drawn = this.known.get(object)?.drawn;
    if (!drawn) return;
    drawn.look = look;
    this.batches.put(drawn);
  }

  /** The surface is elsewhere, or hidden. */
  place({ object, visible }: Surface): void {
    const drawn = this.known.get(object)?.drawn;
    if (!drawn) return;
    drawn.visible = visible;
    this.batches.place(drawn);
  }

  /** Irradiance at a point of a triangle, lux per band; none where it is not cut. */
  light({ object }: Surface, triangle: number, uv: [number, number]): number[] | null {
    const drawn = this.known.get(object)?.drawn;
    const around = drawn?.around(triangle, uv);
    return around ? drawn!.between(around) : null;
  }
}
