// A small scene with what the Cornell box lacks: lamps without area, a sheet that lets light through, and colours at vertices.
const quads = {
  // Corners counter-clockwise as seen from where the normal points.
  floor: { corners: [[-2, 0, 2], [2, 0, 2], [2, 0, -2], [-2, 0, -2]], colours: [[0.9, 0.1, 0.1], [0.1, 0.1, 0.9], [0.1, 0.1, 0.9], [0.9, 0.1, 0.1]] },
  wall: { corners: [[-2, 0, -2], [2, 0, -2], [2, 3, -2], [-2, 3, -2]] },
  sheet: { corners: [[-0.6, 0.5, 0], [0.6, 0.5, 0], [0.6, 1.7, 0], [-0.6, 1.7, 0]], material: 1 },
};

/** The scene as .gltf. */
export function studio() {
  const floats = [];
  const accessors = [];
  const accessor = (vectors) => {
    const low = [0, 1, 2].map((k) => Math.min(...vectors.map((v) => v[k])));
    const high = [0, 1, 2].map((k) => Math.max(...vectors.map((v) => v[k])));
    accessors.push({ bufferView: 0, byteOffset: 4 * floats.length, componentType: 5126, count: vectors.length, type: 'VEC3', min: low, max: high });
    floats.push(...vectors.flat());
    return accessors.length - 1;
  };
  const meshes = Object.values(quads).map(({ corners, colours, material = 0 }) => {
    const triangles = (list) => [0, 1, 2, 0, 2, 3].map((k) => list[k]);
    const attributes = { POSITION: accessor(triangles(corners)) };
    if (colours) attributes.COLOR_0 = accessor(triangles(colours));
    return { primitives: [{ attributes, material }] };
  });
  const bytes = Buffer.from(new Float32Array(floats).buffer);
  const lamp = (name, light, translation, rotation) => ({ name, translation, rotation, extensions: { KHR_lights_punctual: { light } } });
  const nodes = [
    ...Object.keys(quads).map((name, mesh) => ({ name, mesh })),
    lamp('bulb', 0, [0, 1.2, -0.8]),
    // Straight down.
    lamp('spot', 1, [1.2, 2.5, 0.5], [-Math.SQRT1_2, 0, 0, Math.SQRT1_2]),
    { name: 'front', camera: 0, translation: [0.5, 1.4, 4.2] },
  ];
  return JSON.stringify({
    asset: { version: '2.0' },
    extensionsUsed: ['KHR_lights_punctual', 'KHR_materials_diffuse_transmission'],
    extensions: { KHR_lights_punctual: { lights: [
      { type: 'point', name: 'bulb', intensity: 200 }, { type: 'spot', name: 'spot', intensity: 300, spot: { innerConeAngle: 0.3, outerConeAngle: 0.5 } },
    ] } },
    scene: 0,
    scenes: [{ nodes: nodes.map((_, i) => i) }],
    nodes,
    cameras: [{ type: 'perspective', perspective: { yfov: 0.8, znear: 0.1 } }],
    meshes,
    materials: [
      { pbrMetallicRoughness: { baseColorFactor: [0.8, 0.8, 0.8, 1], metallicFactor: 0 } },
      {
        pbrMetallicRoughness: { baseColorFactor: [0.8, 0.8, 0.8, 1], metallicFactor: 0 },
        extensions: { KHR_materials_diffuse_transmission: { diffuseTransmissionFactor: 0.5, diffuseTransmissionColorFactor: [1, 0.7, 0.4] } },
      },
    ],
    accessors,
    bufferViews: [{ buffer: 0, byteLength: bytes.length }],
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
  });
}
