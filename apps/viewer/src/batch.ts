// Surfaces are drawn together: those with the same picture are ranges of one large mesh, and one call draws all of it that
// is in sight. What differs between them, place, tint and emission, lies in tables that the vertex shader reads.
import { BatchedMesh, type BufferAttribute, DataTexture, Float16BufferAttribute, FloatType, FrontSide, GLSL3, type Group, RGBAFormat, ShaderMaterial, type Texture } from 'three';
import { FRAGMENT, shared, type Surface, VERTEX } from './surface';

/** Texels of the table for each surface: tint, emission, transmittance. */
const TEXELS = 3;

/** Room for later: copies of things are added a few at a time. */
const SPARE = 1.25;

class Batch {
  private mesh: BatchedMesh | null = null;
  private looks = new DataTexture(new Float32Array(4 * TEXELS), TEXELS, 1, RGBAFormat, FloatType);
  private material: ShaderMaterial;
  private instances = new Map<Surface, { instance: number; geometry: number }>();
  private hasHoles = false;

  constructor(private root: Group, map: Texture | null, private isOfSheets: boolean, isOfParts: boolean) {
    const defines = { ...(map ? { TEXTURED: '' } : {}), ...(isOfSheets ? { SHEET: '' } : {}) };
    this.material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: FrontSide,
      // Parts lie where the whole is.
      polygonOffset: isOfParts,
      polygonOffsetFactor: -0.5,
      polygonOffsetUnits: -4,
      defines,
      uniforms: { ...shared, map: { value: map }, looks: { value: this.looks } },
    });
  }

  /** Adds surfaces, with room for all of them at once. */
  add(surfaces: Surface[]): void {
    if (this.hasHoles) this.mesh?.optimize();
    this.hasHoles = false;
    const count = (of: (surface: Surface) => number) => surfaces.reduce((sum, surface) => sum + of(surface), 0);
    const [vertices, indices] = [count((s) => s.geometry.attributes.position.count), count((s) => s.geometry.index!.count)];
    const most = this.instances.size + surfaces.length;
    if (!this.mesh) {
      this.mesh = new BatchedMesh(surfaces.length, vertices, indices, this.material);
      // Each of them is looked at by itself whether it is in sight.
      this.mesh.frustumCulled = false;
      this.root.add(this.mesh);
    }
    const { mesh } = this;
    if (mesh.maxInstanceCount < most) mesh.setInstanceCount(Math.ceil(SPARE * most));
    if (mesh.unusedVertexCount < vertices || mesh.unusedIndexCount < indices) {
      const size = (name: 'position' | 'index') => (name === 'index' ? mesh.geometry.index! : mesh.geometry.attributes.position).count;
      mesh.setGeometrySize(Math.ceil(SPARE * (size('position') - mesh.unusedVertexCount + vertices)), Math.ceil(SPARE * (size('index') - mesh.unusedIndexCount + indices)));
    }
    if (this.looks.image.height < mesh.maxInstanceCount) {
      const old = this.looks;
      this.looks = new DataTexture(new Float32Array(4 * TEXELS * mesh.maxInstanceCount), TEXELS, mesh.maxInstanceCount, RGBAFormat, FloatType);
      (this.looks.image.data as Float32Array).set(old.image.data as Float32Array);
      this.material.uniforms.looks.value = this.looks;
      old.dispose();
    }
    for (const surface of surfaces) {
      if (this.isOfSheets) surface.geometry.setAttribute('through', new Float16BufferAttribute(new Uint16Array(surface.light.array.length), 3));
      const geometry = mesh.addGeometry(surface.geometry);
      this.instances.set(surface, { geometry, instance: mesh.addInstance(geometry) });
      this.place(surface);
      this.paint(surface);
      if (this.isOfSheets) this.shine(surface, 0, surface.light.count);
    }
    // The mesh was made with plain words; these are half floats.
    for (const name of ['light', 'through']) Object.assign(mesh.geometry.attributes[name] ?? {}, { isFloat16BufferAttribute: true });
  }

  remove(surface: Surface): void {
    const there = this.instances.get(surface);
    if (!there) return;
    this.mesh!.deleteGeometry(there.geometry);
    this.instances.delete(surface);
    this.hasHoles = true;
  }

  /** Where it is, and whether it is there. */
  place(surface: Surface): void {
    const { instance } = this.instances.get(surface)!;
    this.mesh!.setMatrixAt(instance, surface.matrix);
    this.mesh!.setVisibleAt(instance, surface.visible);
  }

  paint(surface: Surface): void {
    const { instance } = this.instances.get(surface)!;
    const { tint, emission, transmittance } = surface.look;
    (this.looks.image.data as Float32Array).set([...tint, 0, ...emission, 0, ...transmittance, 0], 4 * TEXELS * instance);
    this.looks.needsUpdate = true;
  }

  /** Light of some of its vertices has come. */
  shine(surface: Surface, first: number, count: number): void {
    const { geometry } = this.instances.get(surface)!;
    const { vertexStart } = this.mesh!.getGeometryRangeAt(geometry)!;
    const source = surface.light.array as Uint16Array;
    const own = source.subarray(3 * first, 3 * (first + count));
    const { light, through } = this.mesh!.geometry.attributes as Record<string, BufferAttribute>;
    (light.array as Uint16Array).set(own, 3 * (vertexStart + first));
    light.addUpdateRange(3 * (vertexStart + first), own.length);
    light.needsUpdate = true;
    if (!through) return;
    // What falls on one side of a sheet is seen on the other.
    let [low, high] = [Infinity, 0];
    for (let vertex = first; vertex < first + count; vertex += 1) {
      const other = surface.otherSide[vertex];
      [low, high] = [Math.min(low, other), Math.max(high, other + 1)];
      for (let band = 0; band < 3; band += 1) through.array[3 * (vertexStart + other) + band] = source[3 * vertex + band];
    }
    through.addUpdateRange(3 * (vertexStart + low), 3 * (high - low));
    through.needsUpdate = true;
  }
}

/** What surfaces have in common that are drawn together. */
function keyOf(surface: Surface): string {
  return `${surface.look.texture?.uuid ?? ''} ${surface.isSheet} ${surface.isOfParts}`;
}

/** All surfaces, by what they have to share to be drawn together. */
export class Batches {
  private batches = new Map<string, Batch>();
  private places = new Map<Surface, Batch>();
  /** Surfaces that are not drawn yet: they are added together. */
  private waiting = new Set<Surface>();

  constructor(private root: Group) {}

  /** A surface is to be drawn, or has become another. */
  put(surface: Surface): void {
    const batch = this.places.get(surface);
    if (!batch) this.waiting.add(surface);
    else if (batch === this.batches.get(keyOf(surface))) batch.paint(surface);
    else {
      this.remove(surface);
      this.waiting.add(surface);
    }
  }

  remove(surface: Surface): void {
    this.waiting.delete(surface);
    this.places.get(surface)?.remove(surface);
    this.places.delete(surface);
  }

  place(surface: Surface): void {
    this.places.get(surface)?.place(surface);
  }

  shine(surface: Surface, first: number, count: number): void {
    this.places.get(surface)?.shine(surface, first, count);
  }

  /** Adds what waits, before a picture is drawn. */
  settle(): void {
    if (this.waiting.size === 0) return;
    const together = new Map<Batch, Surface[]>();
    for (const surface of this.waiting) {
      const key = keyOf(surface);
      let batch = this.batches.get(key);
      if (!batch) {
        batch = new Batch(this.root, surface.look.texture, surface.isSheet, surface.isOfParts);
        this.batches.set(key, batch);
      }
      if (!together.has(batch)) together.set(batch, []);
      together.get(batch)!.push(surface);
      this.places.set(surface, batch);
    }
    this.waiting.clear();
    for (const [batch, surfaces] of together) batch.add(surfaces);
  }
}
