// Elements in which light has an edge: drawn again over the whole ones, cut into parts whose corners have light of their own.
import { DataUtils } from 'three';
import type { Batches } from './batch';
import { unbordered } from './border';
import { Surface } from './surface';
import { crossed, isLit, row } from './lattice';
import type { CutElement, CutsFrame, MeshFrame } from './wire';

/** The places of an element that is cut, and its parts. */
interface Cutting {
  /** Weights of the corners at the places, row by row as the server counts them; after these two for each crossing of an edge, on the side
   *  of its line's first place and on the other. */
  weights: number[][];
  /** The parts as triples of places. */
  triangles: number[];
}

function cutting({ parts, edge }: CutElement): Cutting {
  const weights: number[][] = [];
  for (let j = 0; j <= parts; j += 1) {
    for (let i = 0; i <= parts - j; i += 1) weights.push([1 - (i + j) / parts, i / parts, j / parts]);
  }
  const whole: number[] = [];
  for (let j = 0; j < parts; j += 1) {
    for (let i = 0; i < parts - j; i += 1) {
      const [here, above] = [row(parts, j) + i, row(parts, j + 1) + i];
      whole.push(here, here + 1, above);
      if (i + j < parts - 1) whole.push(here + 1, above + 1, above);
    }
  }
  if (!edge) return { weights, triangles: whole };
  const size = weights.length;
  const crossings = new Map<number, number>();
  crossed(parts, edge.isLit).forEach(([a, b], m) => {
    const share = edge.shares[m] / 65535;
    const place = weights[a].map((weight, k) => weight + share * (weights[b][k] - weight));
    crossings.set(a * size + b, weights.length);
    weights.push(place, place);
  });
  /** The place on a line to another place where it meets the edge, on its own side. */
  const near = (from: number, to: number) => crossings.get(Math.min(from, to) * size + Math.max(from, to))! + (from > to ? 1 : 0);
  const triangles: number[] = [];
  for (let k = 0; k < whole.length; k += 3) {
    const corners = whole.slice(k, k + 3);
    const lit = corners.map((place) => isLit(edge.isLit, place));
    // Of three places one is unlike the others.
    const odd = [0, 1, 2].find((k) => lit[k] !== lit[(k + 1) % 3] && lit[k] !== lit[(k + 2) % 3]);
    if (odd === undefined) triangles.push(...corners);
    else {
      const [a, b, c] = [0, 1, 2].map((k) => corners[(odd + k) % 3]);
      triangles.push(a, near(a, b), near(a, c), near(b, a), b, c, near(b, a), c, near(c, a));
    }
  }
  return { weights, triangles };
}

/** Those of elements without an edge, which are many alike. */
const plain = new Map<number, Cutting>();

function cuttingOf(cut: CutElement): Cutting {
  if (cut.edge) return cutting(cut);
  let found = plain.get(cut.parts);
  if (!found) {
    found = cutting(cut);
    plain.set(cut.parts, found);
  }
  return found;
}

/** The elements of a surface that are cut, as a surface of their own that nothing else meets. */
class CutElements extends Surface {
  override readonly isOfParts = true;

  constructor(whole: Surface, frame: CutsFrame) {
    const { position, uv, paint } = whole.geometry.attributes;
    const index = whole.geometry.index!;
    const cuttings = frame.cuts.map(cuttingOf);
    const places = cuttings.reduce((sum, { weights }) => sum + weights.length, 0);
    const of = (from: ArrayLike<number>, size: number) => ({ from, size, to: new Float32Array(size * places) });
    const light = Float32Array.from(whole.light.array, (half) => DataUtils.fromHalfFloat(half));
    const values = [...[position, uv, paint].map(({ array, itemSize }) => of(array, itemSize)), of(light, 3)];
    const indices = new Uint32Array(cuttings.reduce((sum, { triangles }) => sum + triangles.length, 0));
    const firsts = new Map<number, [number, Cutting]>();
    let [first, corner] = [0, 0];
    for (const [k, { weights, triangles }] of cuttings.entries()) {
      const { element } = frame.cuts[k];
      firsts.set(element, [first, cuttings[k]]);
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

  /** The first place of each element, and how it is cut. */
  private readonly firsts: Map<number, [number, Cutting]>;

  override around(element: number, [v, w]: [number, number]): [number, number][] | null {
    const own = this.firsts.get(element);
    if (own === undefined) return null;
    const [first, { weights, triangles }] = own;
    type Place = readonly [number, number];
    const across = (a: Place, b: Place, c: Place) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    const at: Place = [v, w];
    let [most, found]: [number, [number, number][]] = [-Infinity, []];
    // The part that has it most within.
    for (let k = 0; k < triangles.length; k += 3) {
      const places = triangles.slice(k, k + 3);
      const [a, b, c] = places.map((place) => [weights[place][1], weights[place][2]] as const);
      const area = across(a, b, c);
      if (area <= 0) continue;
      const shares = [across(at, b, c) / area, across(a, at, c) / area, across(a, b, at) / area];
      const least = Math.min(...shares);
      if (least <= most) continue;
      most = least;
      const whole = shares.reduce((sum, share) => sum + Math.max(0, share), 0);
      found = places.map((place, i) => [first + place, Math.max(0, shares[i]) / whole]);
    }
    return found;
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
