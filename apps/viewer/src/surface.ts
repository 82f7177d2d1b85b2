// A surface as the eye sees it, or as a meter does: light at vertices times reflectance at pixels.
import {
  BufferAttribute, BufferGeometry, DataUtils, Float16BufferAttribute, FrontSide, Mesh, MeshBasicMaterial, type Texture, Vector2, Vector3,
  type IUniform,
} from 'three';
import { MeshBVH } from 'three-mesh-bvh';
import { bordersOf, WIDEN } from './border';
import { kept, numberOf, TONE_MAP } from './curve';
import { WEIGHTS } from './luminance';
import { LEVELS, PALETTE } from './scale';
import type { MeshFrame } from './wire';

/** What a unit of the light attribute is, lx: half floats then reach beyond the sun. */
export const UNIT = 16;

/** What is drawn: light as it is displayed, false colours, or luminance as numbers for the exposure meter. */
export enum Mode { Eye, Lux, Meter }

/** From luminance to what is shown. */
export const DISPLAY = /* glsl */ `
  const vec3 LUMINANCE = vec3(${WEIGHTS.join(', ')});
  ${TONE_MAP}

  vec3 srgb(vec3 x) {
    x = clamp(x, 0.0, 1.0);
    return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, vec3(lessThanEqual(x, vec3(0.0031308))));
  }

  // A quarter of a step of ordered dither hides the banding of 8 bits on smooth walls.
  float dither() {
    const float bayer[16] = float[16](0., 8., 2., 10., 12., 4., 14., 6., 3., 11., 1., 9., 15., 7., 13., 5.);
    ivec2 p = ivec2(gl_FragCoord.xy) & 3;
    return ((bayer[p.y * 4 + p.x] + 0.5) / 16.0 - 0.5) * 0.9 / 255.0;
  }

  vec3 display(vec3 luminance, float exposure) {
    return srgb(toneMap(max(luminance, 0.0) * exposure)) + dither();
  }
`;

export const VERTEX = /* glsl */ `
  #include <batching_pars_vertex>
  ${WIDEN}
  in vec3 light;
  in vec3 paint;
  uniform highp sampler2D looks;
  // Read where the surface is within the pixel: in the middle of a pixel that it only touches they would be far from what it has.
  centroid out vec3 vLight;
  centroid out vec3 reflected;
  centroid out vec2 vUv;
  flat out vec3 emission;
  #ifdef SHEET
    in vec3 through;
    centroid out vec3 vThrough;
  #endif
  void main() {
    #include <batching_vertex>
    int which = int(getIndirectIndex(gl_DrawID));
    reflected = paint * texelFetch(looks, ivec2(0, which), 0).rgb;
    emission = texelFetch(looks, ivec2(1, which), 0).rgb;
    #ifdef SHEET
      vThrough = through * ${UNIT.toFixed(1)} * texelFetch(looks, ivec2(2, which), 0).rgb;
    #endif
    vLight = light * ${UNIT.toFixed(1)};
    vUv = uv;
    mat4 placed = projectionMatrix * modelViewMatrix * batchingMatrix;
    gl_Position = widened(placed * vec4(position, 1.0), placed);
  }
`;

export const FRAGMENT = /* glsl */ `
  precision highp float;
  centroid in vec3 vLight;
  centroid in vec2 vUv;
  uniform int mode;
  uniform float exposure;
  centroid in vec3 reflected;
  flat in vec3 emission;
  #ifdef SHEET
    centroid in vec3 vThrough;
  #endif
  uniform float emissionShown;
  uniform sampler2D map;
  uniform vec2 range;
  uniform vec3 palette[${PALETTE.length}];
  uniform float levels[${LEVELS}];
  uniform int levelCount;
  uniform bool isolines;
  out vec4 outColour;
  ${DISPLAY}

  vec3 falseColour(float lux) {
    float at = clamp((log(max(lux, 1e-9)) - log(range.x)) / (log(range.y) - log(range.x)), 0.0, 1.0) * ${(PALETTE.length - 1).toFixed(1)};
    int i = min(int(at), ${PALETTE.length - 2});
    return mix(palette[i], palette[i + 1], at - float(i));
  }

  // How much of the pixel a line of equal illuminance covers.
  float line(float lux) {
    float l = log(max(lux, 1e-9));
    float slope = max(fwidth(l), 1e-6);
    float nearest = 1e9;
    for (int i = 0; i < ${LEVELS}; i++) {
      if (i < levelCount) nearest = min(nearest, abs(l - log(levels[i])) / slope);
    }
    // Where light hardly changes a line would be an area.
    return slope < 1e-4 ? 0.0 : 1.0 - smoothstep(0.5, 1.3, nearest);
  }

  void main() {
    vec3 reflectance = reflected;
    #ifdef TEXTURED
      reflectance *= texture(map, vUv).rgb;
    #endif
    float lux = dot(vLight, LUMINANCE);
    vec3 lit = min(reflectance, 0.99) * vLight * 0.31830988618;
    #ifdef SHEET
      // What shines on the other side comes through.
      lit += vThrough * 0.31830988618;
    #endif
    vec3 luminance = lit + emission * emissionShown;
    if (mode == ${Mode.Meter}) {
      outColour = vec4(dot(lit, LUMINANCE), lux, dot(luminance, LUMINANCE), 1.0);
      return;
    }
    vec3 colour = mode == ${Mode.Lux} ? falseColour(lux) : display(luminance, exposure);
    if (isolines) colour = mix(colour, mode == ${Mode.Lux} ? vec3(0.02) : vec3(1.0, 0.75, 0.3), 0.8 * line(lux));
    outColour = vec4(colour, 1.0);
  }
`;

/** Values that all surfaces share. */
export const shared = {
  mode: { value: Mode.Eye },
  /** Dark until the light has been metered: rooms with daylight would be white till then. */
  exposure: { value: 0 },
  /** The tone curve, by its number. */
  curve: { value: numberOf(kept()) },
  emissionShown: { value: 1 },
  range: { value: [10, 1000] },
  palette: { value: PALETTE.map((c) => new Vector3(...c)) },
  levels: { value: new Array<number>(LEVELS).fill(1) },
  levelCount: { value: 0 },
  isolines: { value: false },
  /** Of the picture that is drawn, each way. */
  pixels: { value: new Vector2(1, 1) },
} satisfies Record<string, IUniform>;

/** How a surface looks, apart from its light. */
export interface Look {
  tint: readonly number[];
  /** cd/m². */
  emission: readonly number[];
  /** What passes through to the other side. */
  transmittance: readonly number[];
  texture: Texture | null;
}

/** What rays take the side from; the stage draws surfaces together, with a material of their own. */
const PLAIN = new MeshBasicMaterial({ side: FrontSide });

/** Backs follow the fronts, with corners 1 and 2 exchanged. */
function countFronts({ positions, indices }: MeshFrame): number {
  const [all, half] = [indices.length / 3, indices.length / 6];
  const at = (corner: number) => positions.subarray(3 * indices[corner], 3 * indices[corner] + 3).join();
  const hasBacks = Number.isInteger(half) && [0, 1, 2].every((k) => at(k) === at(3 * half + [0, 2, 1][k]));
  return hasBacks ? half : all;
}

/** An object on the stage. By itself only its outline is drawn. */
export class Surface extends Mesh<BufferGeometry, MeshBasicMaterial> {
  readonly light: Float16BufferAttribute;
  /** How many of its triangles are fronts: all of them, or half where backs have light of their own. */
  readonly fronts: number;
  look: Look = { tint: [1, 1, 1], emission: [0, 0, 0], transmittance: [0, 0, 0], texture: null };
  /** For each vertex that on the other side of a sheet. */
  private others: Uint32Array | null = null;
  /** Its tree of boxes, once a ray needed it. */
  private boxes: MeshBVH | null = null;

  constructor(readonly object: number, frame: MeshFrame, borders = bordersOf(frame.positions, frame.indices)) {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(frame.positions, 3));
    geometry.setAttribute('uv', new BufferAttribute(frame.uvs ?? new Float32Array((2 * frame.positions.length) / 3), 2));
    geometry.setAttribute('paint', new BufferAttribute(frame.colours ?? new Float32Array(frame.positions.length).fill(1), 3));
    geometry.setAttribute('before', new BufferAttribute(borders.before, 3, true));
    geometry.setAttribute('after', new BufferAttribute(borders.after, 3, true));
    geometry.setIndex(new BufferAttribute(frame.indices, 1));
    const light = new Float16BufferAttribute(new Uint16Array(frame.positions.length), 3);
    geometry.setAttribute('light', light);
    super(geometry, PLAIN);
    this.light = light;
    this.fronts = countFronts(frame);
    this.matrixAutoUpdate = false;
    this.layers.disableAll();
  }

  /** Whether it is of parts of elements, drawn over the whole ones of another surface. */
  readonly isOfParts: boolean = false;

  /** Whether light passes through. */
  get isSheet(): boolean {
    return this.look.transmittance.some((tau) => tau > 0);
  }

  /** For each vertex that on the other side: elements of backs follow those of the fronts, with corners 1 and 2 exchanged. */
  get otherSide(): Uint32Array {
    if (this.others) return this.others;
    const index = this.geometry.index!.array;
    this.others = Uint32Array.from({ length: this.light.count }, (_, vertex) => vertex);
    const half = index.length / 2;
    for (let corner = 0; corner < half; corner += 1) {
      const [front, back] = [index[corner], index[half + corner - (corner % 3) + [0, 2, 1][corner % 3]]];
      this.others[front] = back;
      this.others[back] = front;
    }
    return this.others;
  }

  /** Whether its tree of boxes is there. */
  get isReady(): boolean {
    return this.boxes !== null;
  }

  /** Its tree of boxes, built where it is missing. The order of triangles stays. */
  get tree(): MeshBVH {
    this.boxes ??= new MeshBVH(this.geometry, { indirect: true });
    return this.boxes;
  }

  /** The vertices around a place of a triangle, and their weights. */
  around(triangle: number, [v, w]: [number, number]): [number, number][] | null {
    const index = this.geometry.index!;
    return [1 - v - w, v, w].map((weight, k) => [index.getX(3 * triangle + k), weight]);
  }

  /** Irradiance between vertices, lux per band. */
  between(around: [number, number][]): number[] {
    const values = this.light.array as Uint16Array;
    const light = [0, 0, 0];
    for (const [vertex, weight] of around) {
      for (let band = 0; band < 3; band += 1) light[band] += weight * UNIT * DataUtils.fromHalfFloat(values[3 * vertex + band]);
    }
    return light;
  }

  dispose(): void {
    this.geometry.dispose();
  }
}

