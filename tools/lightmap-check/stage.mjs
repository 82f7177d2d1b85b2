// A small closed room with everything in it that a lit file can get wrong: vertex colours, instances
// (EXT_mesh_gpu_instancing), a mirrored node, a mesh used twice, a leaf and a partition that reflect on both sides, a
// cut-out picture (alphaMode MASK), a smooth ball, a box without texture coordinates, a lamp and a point light.
//   node stage.mjs > stage.gltf
import { fileURLToPath } from 'node:url';

/// The scene as glTF text: metres, +Y up, 4 × 2.5 × 3 m.
export function stage() {
  const chunks = [];
  let size = 0;
  const json = {
    asset: { version: '2.0', generator: 'radiosity stage' },
    extensionsUsed: ['KHR_materials_emissive_strength', 'KHR_lights_punctual', 'EXT_mesh_gpu_instancing'],
    scene: 0, scenes: [{ nodes: [] }], nodes: [], meshes: [], materials: [], accessors: [], bufferViews: [], buffers: [],
    extensions: { KHR_lights_punctual: { lights: [{ type: 'point', name: 'bulb', color: [1, 0.9, 0.7], intensity: 60 }] } },
    cameras: [{ type: 'perspective', name: 'eye', perspective: { yfov: 1, znear: 0.01 } }],
    images: [{ uri: leafPicture(), name: 'leaf' }], samplers: [{ magFilter: 9728, minFilter: 9728 }], textures: [{ source: 0, sampler: 0 }],
  };
  const append = (values, Kind, width, bounds) => {
    const bytes = Buffer.from(Kind.from(values.flat()).buffer);
    const padded = Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4)]);
    json.bufferViews.push({ buffer: 0, byteOffset: size, byteLength: bytes.length });
    chunks.push(padded);
    size += padded.length;
    const accessor = {
      bufferView: json.bufferViews.length - 1, componentType: Kind === Float32Array ? 5126 : 5123,
      count: values.length, type: ['SCALAR', 'VEC2', 'VEC3', 'VEC4'][width - 1],
    };
    if (bounds) {
      const column = (k) => values.map((v) => Math.fround(v[k]));
      accessor.min = [0, 1, 2].map((k) => Math.min(...column(k)));
      accessor.max = [0, 1, 2].map((k) => Math.max(...column(k)));
    }
    return json.accessors.push(accessor) - 1;
  };
  const material = (name, color, rest = {}) => json.materials.push({
    name, pbrMetallicRoughness: { baseColorFactor: [...color, 1], metallicFactor: 0, roughnessFactor: 1 }, ...rest,
  }) - 1;
  const mesh = (name, shape, of) => {
    const attributes = { POSITION: append(shape.positions, Float32Array, 3, true), NORMAL: append(shape.normals, Float32Array, 3) };
    if (shape.colors) attributes.COLOR_0 = append(shape.colors, Float32Array, 4);
    if (shape.uvs) attributes.TEXCOORD_0 = append(shape.uvs, Float32Array, 2);
    return json.meshes.push({ name, primitives: [{ attributes, indices: append(shape.indices, Uint16Array, 1), material: of }] }) - 1;
  };
  const node = (name, rest) => json.scenes[0].nodes.push(json.nodes.push({ name, ...rest }) - 1);

  const white = material('white', [0.8, 0.8, 0.8]);
  const red = material('red', [0.7, 0.1, 0.1]);
  const lamp = material('lamp', [0, 0, 0], {
    emissiveFactor: [1, 0.9, 0.75], extensions: { KHR_materials_emissive_strength: { emissiveStrength: 900 } },
  });
  const both = material('both sides', [0.3, 0.6, 0.3], { doubleSided: true });
  const leaf = material('leaf', [0.2, 0.7, 0.1], { doubleSided: true, alphaMode: 'MASK', alphaCutoff: 0.5 });
  json.materials[leaf].pbrMetallicRoughness.baseColorTexture = { index: 0 };

  node('room', { mesh: mesh('room', box([4, 2.5, 3], true, true), white) });
  const hung = { ...quad(0.8, 0.5), uvs: undefined };
  node('lamp', { mesh: mesh('lamp', hung, lamp), translation: [2.4, 2.49, 1.4], rotation: [Math.SQRT1_2, 0, 0, Math.SQRT1_2] });
  const crate = mesh('crate', box([0.4, 0.4, 0.4]), red);
  node('crate', { mesh: crate, translation: [0.4, -0.002, 0.5], rotation: [0, Math.sin(0.3), 0, Math.cos(0.3)] });
  node('crate again, mirrored', { mesh: crate, translation: [1.5, -0.002, 0.9], scale: [-1, 1.5, 1] });
  node('balls', {
    mesh: mesh('ball', ball(0.2, 24, 12), white),
    extensions: { EXT_mesh_gpu_instancing: { attributes: {
      TRANSLATION: append([[0.6, 1.2, 2.3], [1.3, 0.5, 2.2], [3.5, 0.3, 0.4]], Float32Array, 3),
      SCALE: append([[1, 1, 1], [1, 1, 1], [1.2, 1.2, 1.2]], Float32Array, 3),
    } } },
  });
  node('partition', { mesh: mesh('partition', quad(1.6, 1.4), both), translation: [2.9, 0.7, 1.7], rotation: [0, Math.sin(0.55), 0, Math.cos(0.55)] });
  node('leaf', { mesh: mesh('leaf', quad(0.6, 0.6), leaf), translation: [1.9, 1.3, 2.2], rotation: [-0.5, 0, 0, Math.sqrt(0.75)] });
  node('bulb', { translation: [0.5, 2.2, 2.6], extensions: { KHR_lights_punctual: { light: 0 } } });
  node('eye', { camera: 0, translation: [3.7, 1.9, 2.8], rotation: [-0.1206, 0.3706, 0.0486, 0.9197] });

  const bytes = Buffer.concat(chunks);
  json.buffers.push({ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` });
  return JSON.stringify(json);
}

/// A box from 0 to `size`; inwards it is a room. With colours that differ from corner to corner if asked.
function box(size, inwards = false, coloured = false) {
  const [positions, normals, colors, indices] = [[], [], [], []];
  for (let axis = 0; axis < 3; axis++) {
    for (const high of [0, 1]) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      const base = positions.length;
      for (const [a, b] of [[0, 0], [1, 0], [1, 1], [0, 1]]) {
        const p = [0, 0, 0];
        [p[axis], p[u], p[v]] = [high, a, b];
        const n = [0, 0, 0];
        n[axis] = (high ? 1 : -1) * (inwards ? -1 : 1);
        positions.push(p.map((x, k) => x * size[k]));
        normals.push(n);
        colors.push([0.5 + 0.5 * p[0], 0.6 + 0.4 * p[1], 0.5 + 0.5 * p[2], 1]);
      }
      indices.push(...(Boolean(high) !== inwards ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2]).map((i) => base + i));
    }
  }
  return { positions, normals, indices, ...(coloured ? { colors } : {}) };
}

/// A rectangle around the origin that faces +Z.
function quad(width, height) {
  const corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
  return {
    positions: corners.map(([x, y]) => [x * width, y * height, 0]),
    normals: corners.map(() => [0, 0, 1]),
    uvs: corners.map(([x, y]) => [x + 0.5, 0.5 - y]),
    indices: [0, 1, 2, 0, 2, 3],
  };
}

/// A smooth ball around the origin.
function ball(radius, sides, rings) {
  const [normals, indices] = [[], []];
  for (let i = 0; i <= rings; i++) {
    for (let j = 0; j <= sides; j++) {
      const [theta, phi] = [(Math.PI * i) / rings, (2 * Math.PI * (j % sides)) / sides];
      normals.push([Math.sin(theta) * Math.cos(phi), Math.cos(theta), -Math.sin(theta) * Math.sin(phi)]);
      if (i === rings || j === sides) continue;
      const [a, b] = [i * (sides + 1) + j, (i + 1) * (sides + 1) + j];
      if (i > 0) indices.push(a, b, a + 1);
      if (i < rings - 1) indices.push(a + 1, b, b + 1);
    }
  }
  return { positions: normals.map((n) => n.map((x) => x * radius)), normals, indices };
}

/// An 8 × 8 picture with a round hole, as a data URI: RGBA, PNG with stored (not compressed) data.
function leafPicture() {
  const side = 8;
  const rows = [];
  for (let y = 0; y < side; y++) {
    rows.push(0);
    for (let x = 0; x < side; x++) {
      const hole = Math.hypot(x - 3.5, y - 3.5) < 2.2;
      rows.push(255, 255, 255, hole ? 0 : 255);
    }
  }
  const table = Array.from({ length: 256 }, (_, n) => {
    let c = n;
    for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
    return c >>> 0;
  });
  const crc = (bytes) => (bytes.reduce((c, b) => table[(c ^ b) & 255] ^ (c >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;
  const word = (n) => [n >>> 24, (n >>> 16) & 255, (n >>> 8) & 255, n & 255];
  const chunk = (type, data) => {
    const body = [...Buffer.from(type), ...data];
    return [...word(data.length), ...body, ...word(crc(body))];
  };
  let [a, b] = [1, 0];
  for (const byte of rows) [a, b] = [(a + byte) % 65521, (b + a + byte) % 65521];
  const [low, high] = [rows.length & 255, rows.length >> 8];
  const stored = [0x78, 0x01, 1, low, high, 255 - low, 255 - high, ...rows, ...word(((b << 16) | a) >>> 0)];
  const png = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a,
    ...chunk('IHDR', [...word(side), ...word(side), 8, 6, 0, 0, 0]), ...chunk('IDAT', stored), ...chunk('IEND', [])];
  return `data:image/png;base64,${Buffer.from(png).toString('base64')}`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) process.stdout.write(stage());
