// A lit GLB as triangles in the world. Each has its corners, its face normal (counter-clockwise seen from the side
// that is meant), the normals that it is lit with, and what carries its light at the corners: lightmap coordinates and
// the size of their page in texels, or the attribute. Plain attributes only, which is all that lit files hold.
import { readFile } from 'node:fs/promises';

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const mul = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.sqrt(dot(a, a));
export const unit = (a) => mul(a, 1 / (length(a) || 1));
/// The weighted mean of three vectors.
export const mix = ([a, b, c], [u, v, w]) => add(add(mul(a, u), mul(b, v)), mul(c, w));

/// Column-major 4 × 4.
const identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const times = (a, b) => Array.from({ length: 16 }, (_, i) =>
  [0, 1, 2, 3].reduce((sum, k) => sum + a[4 * k + (i % 4)] * b[4 * Math.floor(i / 4) + k], 0));

function own({ matrix, translation: t = [0, 0, 0], rotation: [x, y, z, w] = [0, 0, 0, 1], scale: s = [1, 1, 1] }) {
  if (matrix) return matrix;
  return [
    (1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + z * w) * s[0], 2 * (x * z - y * w) * s[0], 0,
    2 * (x * y - z * w) * s[1], (1 - 2 * (x * x + z * z)) * s[1], 2 * (y * z + x * w) * s[1], 0,
    2 * (x * z + y * w) * s[2], 2 * (y * z - x * w) * s[2], (1 - 2 * (x * x + y * y)) * s[2], 0,
    ...t, 1,
  ];
}

export async function readGlb(path) {
  const bytes = await readFile(path);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const jsonLength = view.getUint32(12, true);
  const json = JSON.parse(bytes.subarray(20, 20 + jsonLength).toString('utf8'));
  const binary = 20 + jsonLength + 8;
  const widths = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4 };
  const kinds = { 5121: [1, 'getUint8'], 5123: [2, 'getUint16'], 5125: [4, 'getUint32'], 5126: [4, 'getFloat32'] };
  const read = (index) => {
    const accessor = json.accessors[index];
    const place = json.bufferViews[accessor.bufferView];
    const [width, [size, get]] = [widths[accessor.type], kinds[accessor.componentType]];
    const stride = place.byteStride ?? width * size;
    const start = binary + (place.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
    const element = (i) => Array.from({ length: width }, (_, k) => view[get](start + i * stride + k * size, true));
    return Array.from({ length: accessor.count }, (_, i) => element(i));
  };

  // Width and height stand at a fixed place of a PNG (its IHDR).
  const pages = (json.textures ?? []).map(({ source }) => {
    const image = json.bufferViews[json.images?.[source]?.bufferView];
    const start = image && binary + (image.byteOffset ?? 0);
    return image && [view.getUint32(start + 16), view.getUint32(start + 20)];
  });

  const triangles = [];
  const visit = (index, above) => {
    const node = json.nodes[index];
    const world = times(above, own(node));
    for (const primitive of node.mesh === undefined ? [] : json.meshes[node.mesh].primitives) {
      addPrimitive(json, primitive, world, read, pages, triangles);
    }
    for (const child of node.children ?? []) visit(child, world);
  };
  for (const root of json.scenes[json.scene ?? 0].nodes) visit(root, identity);

  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const corner of triangles.flatMap((t) => t.corners)) {
    for (let k = 0; k < 3; k++) {
      low[k] = Math.min(low[k], corner[k]);
      high[k] = Math.max(high[k], corner[k]);
    }
  }
  return { json, triangles, low, high, size: length(sub(high, low)) };
}

function addPrimitive(json, primitive, world, read, pages, triangles) {
  if ((primitive.mode ?? 4) !== 4) return;
  const material = json.materials?.[primitive.material] ?? {};
  const lightmap = material.extensions?.MOZ_lightmap;
  const { attributes } = primitive;
  const direction = (m, [x, y, z]) => [0, 1, 2].map((k) => m[k] * x + m[4 + k] * y + m[8 + k] * z);
  // Normals turn with the cofactors of the matrix.
  const column = (k) => world.slice(4 * k, 4 * k + 3);
  const [a, b, c] = [cross(column(1), column(2)), cross(column(2), column(0)), cross(column(0), column(1))];
  const sign = Math.sign(dot(column(0), a)) || 1;
  const cofactors = [...a, 0, ...b, 0, ...c, 0];
  const positions = read(attributes.POSITION).map((p) => add(direction(world, p), world.slice(12, 15)));
  const normals = attributes.NORMAL === undefined ? null
    : read(attributes.NORMAL).map((n) => unit(mul(direction(cofactors, n), sign)));
  const set = lightmap && attributes[`TEXCOORD_${lightmap.texCoord ?? 1}`];
  const uvs = set === undefined ? null : read(set);
  const light = attributes._IRRADIANCE === undefined ? null : read(attributes._IRRADIANCE);
  const indices = primitive.indices === undefined ? positions.map((_, i) => i) : read(primitive.indices).flat();
  for (let i = 0; i + 2 < indices.length; i += 3) {
    let at = indices.slice(i, i + 3);
    // A mirrored node turns the faces round; viewers turn them back.
    if (sign < 0) at = [at[0], at[2], at[1]];
    const corners = at.map((k) => positions[k]);
    const normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    const area = 0.5 * length(normal);
    if (!(area > 0)) continue;
    triangles.push({
      corners,
      area,
      normal: unit(normal),
      normals: normals && at.map((k) => normals[k]),
      uvs: uvs && at.map((k) => uvs[k]),
      light: light && at.map((k) => light[k]),
      page: lightmap?.index,
      pageName: lightmap && json.textures[lightmap.index].name,
      pageSize: lightmap && pages[lightmap.index],
      doubleSided: material.doubleSided === true,
    });
  }
}
