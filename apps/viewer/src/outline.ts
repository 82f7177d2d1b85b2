// A line around what is selected: its mask is drawn first, and the line is where the mask ends.
import {
  BufferAttribute, BufferGeometry, Color, GLSL3, type Camera, Mesh, type Scene, ShaderMaterial, Vector2, type WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { WIDEN } from './border';
import { shared, type Surface } from './surface';

/** The layer of three.js that selected surfaces are on. */
const LAYER = 1;

/** Width of the line, pixels to either side. */
const WIDTH = 1.5;

export class Outline {
  /** Drawn with the rest of the scene. */
  readonly line: Mesh<BufferGeometry, ShaderMaterial>;
  private mask = new WebGLRenderTarget(1, 1);
  private white = new ShaderMaterial({
    glslVersion: GLSL3,
    uniforms: { pixels: shared.pixels },
    vertexShader: /* glsl */ `
      ${WIDEN}
      void main() {
        mat4 placed = projectionMatrix * modelViewMatrix;
        gl_Position = widened(placed * vec4(position, 1.0), placed);
      }`,
    fragmentShader: /* glsl */ `
      precision highp float;
      out vec4 outColour;
      void main() { outColour = vec4(1.0); }`,
  });
  private surfaces: Surface[] = [];

  constructor(colour: number) {
    // One triangle over the whole screen.
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.line = new Mesh(geometry, new ShaderMaterial({
      glslVersion: GLSL3,
      depthTest: false,
      depthWrite: false,
      transparent: true,
      uniforms: { mask: { value: this.mask.texture }, step: { value: new Vector2() }, colour: { value: new Color(colour).convertLinearToSRGB() } },
      vertexShader: /* glsl */ `
        out vec2 at;
        void main() {
          at = 0.5 * position.xy + 0.5;
          gl_Position = vec4(position.xy, 0.0, 1.0);
        }`,
      fragmentShader: /* glsl */ `
        precision highp float;
        in vec2 at;
        uniform sampler2D mask;
        uniform vec2 step;
        uniform vec3 colour;
        out vec4 outColour;
        void main() {
          float inside = texture(mask, at).r;
          float around = 0.0;
          for (int i = 0; i < 8; i++) {
            float angle = 0.78539816 * float(i);
            around += texture(mask, at + step * vec2(cos(angle), sin(angle))).r;
          }
          around /= 8.0;
          // Full on the edge, nothing away from it.
          float edge = 1.0 - abs(2.0 * around - 1.0);
          outColour = vec4(colour, clamp(1.8 * edge, 0.0, 1.0) * (inside > 0.5 ? 0.75 : 1.0));
        }`,
    }));
    this.line.frustumCulled = false;
    this.line.renderOrder = 3;
    this.line.visible = false;
  }

  set(surfaces: Surface[]): void {
    for (const surface of this.surfaces) surface.layers.disable(LAYER);
    for (const surface of surfaces) surface.layers.enable(LAYER);
    this.surfaces = surfaces;
    this.line.visible = surfaces.length > 0;
  }

  /** Draws the mask for a picture that is drawn next. */
  prepare(renderer: WebGLRenderer, scene: Scene, camera: Camera): void {
    if (!this.line.visible) return;
    const size = renderer.getDrawingBufferSize(new Vector2());
    if (this.mask.width !== size.x || this.mask.height !== size.y) this.mask.setSize(size.x, size.y);
    this.line.material.uniforms.step.value.set(WIDTH / size.x, WIDTH / size.y);
    const layers = camera.layers.mask;
    camera.layers.set(LAYER);
    scene.overrideMaterial = this.white;
    renderer.setRenderTarget(this.mask);
    renderer.setClearColor(0, 0);
    renderer.clear();
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    scene.overrideMaterial = null;
    camera.layers.mask = layers;
  }
}
