// A tree of boxes over triangles (median split, at most four in a leaf): the first hit of a ray, and what comes within
// a distance of a point. Plain and double precision; for a few hundred thousand queries.
import { cross, dot, length, mul, sub, unit, add } from './glb.mjs';

export class Tree {
  constructor(triangles) {
    this.triangles = triangles;
    const boxes = triangles.map(({ corners }) => [0, 1, 2].flatMap((k) => {
      const values = corners.map((p) => p[k]);
      return [Math.min(...values), Math.max(...values)];
    }));
    const build = (list) => {
      const box = [0, 1, 2].flatMap((k) => list.reduce(
        ([low, high], i) => [Math.min(low, boxes[i][2 * k]), Math.max(high, boxes[i][2 * k + 1])], [Infinity, -Infinity]));
      if (list.length <= 4) return { box, list };
      const axis = [0, 1, 2].reduce((best, k) => (box[2 * k + 1] - box[2 * k] > box[2 * best + 1] - box[2 * best] ? k : best), 0);
      const middle = (i) => boxes[i][2 * axis] + boxes[i][2 * axis + 1];
      list.sort((i, j) => middle(i) - middle(j));
      const half = list.length >> 1;
      return { box, children: [build(list.slice(0, half)), build(list.slice(half))] };
    };
    this.root = build(triangles.map((_, i) => i));
  }

  /// 'nothing', 'front' or 'back', whichever a ray meets first. Of two sides at one place the front counts: the layers
  /// of a double-sided surface lie on each other.
  first(origin, direction, least) {
    let nearest = Infinity;
    let kind = 'nothing';
    const stack = [this.root];
    while (stack.length > 0) {
      const node = stack.pop();
      if (!(entry(node.box, origin, direction) <= nearest)) continue;
      if (node.children) {
        stack.push(...node.children);
        continue;
      }
      for (const i of node.list) {
        const triangle = this.triangles[i];
        const t = distance(triangle, origin, direction);
        if (!(t > least) || t > nearest + least) continue;
        const front = triangle.doubleSided || dot(triangle.normal, direction) < 0;
        const same = Math.abs(t - nearest) <= least;
        if (!same) kind = front ? 'front' : 'back';
        else if (front) kind = 'front';
        nearest = Math.min(nearest, t);
      }
    }
    return kind;
  }

  /// Whether anything for which `counts` is true comes nearer to a point than `reach`.
  near(point, reach, counts) {
    const stack = [this.root];
    while (stack.length > 0) {
      const node = stack.pop();
      const outside = [0, 1, 2].map((k) => Math.max(node.box[2 * k] - point[k], point[k] - node.box[2 * k + 1], 0));
      if (length(outside) >= reach) continue;
      if (node.children) stack.push(...node.children);
      else if (node.list.some((i) => counts(i) && toTriangle(point, this.triangles[i]) < reach)) return true;
    }
    return false;
  }
}

function entry(box, origin, direction) {
  let [from, to] = [0, Infinity];
  for (let k = 0; k < 3; k++) {
    const [a, b] = [(box[2 * k] - origin[k]) / direction[k], (box[2 * k + 1] - origin[k]) / direction[k]];
    if (Number.isNaN(a) || Number.isNaN(b)) continue;
    from = Math.max(from, Math.min(a, b));
    to = Math.min(to, Math.max(a, b));
  }
  // A little wider, so that rounding closes no box.
  return from <= to * (1 + 1e-12) + 1e-12 ? from * (1 - 1e-12) : NaN;
}

/// Distance along a ray to a triangle (Möller & Trumbore 1997), NaN where it misses.
function distance({ corners: [a, b, c] }, origin, direction) {
  const [ab, ac, from] = [sub(b, a), sub(c, a), sub(origin, a)];
  const p = cross(direction, ac);
  const determinant = dot(ab, p);
  const u = dot(from, p) / determinant;
  const q = cross(from, ab);
  const v = dot(direction, q) / determinant;
  return u >= 0 && v >= 0 && u + v <= 1 ? dot(ac, q) / determinant : NaN;
}

/// Distance of a point from a segment.
export function toSegment(point, a, b) {
  const along = sub(b, a);
  const t = Math.min(1, Math.max(0, dot(sub(point, a), along) / (dot(along, along) || 1)));
  return length(sub(point, add(a, mul(along, t))));
}

function toTriangle(point, { corners: [a, b, c], normal }) {
  const inside = [[a, b], [b, c], [c, a]].every(([from, to]) => dot(cross(sub(to, from), sub(point, from)), normal) >= 0);
  if (inside) return Math.abs(dot(sub(point, a), normal));
  return Math.min(toSegment(point, a, b), toSegment(point, b, c), toSegment(point, c, a));
}

/// A direction around `normal` with density cosine/π, from two numbers in 0..1.
export function cosineDirection(normal, u, v) {
  const side = unit(cross(normal, Math.abs(normal[0]) < 0.5 ? [1, 0, 0] : [0, 1, 0]));
  const up = cross(normal, side);
  const [radius, angle] = [Math.sqrt(u), 2 * Math.PI * v];
  return add(add(mul(side, radius * Math.cos(angle)), mul(up, radius * Math.sin(angle))), mul(normal, Math.sqrt(1 - u)));
}
