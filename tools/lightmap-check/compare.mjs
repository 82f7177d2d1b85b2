// Does a viewer show what was computed? Bakes scenes, reads the light back out of three.js at points of their surfaces
// and compares it with `radiosity measure` at the same points:
//   node compare.mjs [--style lightmap|vertices]... [--error 2%] [--points 2000] [--edges 500] [--seed 1]
//     [--out out/lightmap-check] [--program target/release/radiosity] [--limit 2%] [--bake="OPTIONS"] [--chromium PATH] [SCENE]...
// SCENE is what `radiosity bake` takes, options of the scene included, in quotes: "room.glb --sky overcast:10000"; an
// empty one is the built-in Cornell box. Without any: the Cornell box and stage.mjs, both styles that carry irradiance.
// --bake: more options of `bake` alone, such as --bake="--texels-per-metre 100".
//
// The measure is the relative L2 difference of illuminance, ‖shown − measured‖ / ‖measured‖, over points spread by area;
// it contains the errors of bake and of measure (1 %) besides that of the file and the viewer. p99 is of |difference| /
// max(measured, 5 % of the mean). "Even" is the L2 difference without the points where the texels (or vertices) that are
// read differ by more than a fifth: a shadow ends there, within a texel, and finer texels are all that helps. Edge
// points lie within a texel of an edge or of another surface, where texels are too wide to follow the light. "File" is ‖shown − texels‖ / ‖texels‖ with the unclipped texels of the EXR that bake writes
// beside a lightmap: what coding and viewer alone do, at all points; and its p99.
// Exit code 1 if an L2 difference over area points exceeds --limit.
import { spawnSync } from 'node:child_process';
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { basename, dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { FloatType } from 'three';
import { csv, sample } from './sample.mjs';
import { stage } from './stage.mjs';
import { open } from './viewer.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, '..', '..');
const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    style: { type: 'string', multiple: true, default: ['lightmap', 'vertices'] },
    error: { type: 'string', default: '2%' },
    points: { type: 'string', default: '2000' },
    edges: { type: 'string', default: '500' },
    seed: { type: 'string', default: '1' },
    out: { type: 'string', default: join(root, 'out', 'lightmap-check') },
    program: { type: 'string', default: join(process.env.CARGO_TARGET_DIR ?? join(root, 'target'), 'release', 'radiosity') },
    limit: { type: 'string', default: '2%' },
    bake: { type: 'string', default: '' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
  },
});
const share = (text) => (text.endsWith('%') ? Number(text.slice(0, -1)) / 100 : Number(text));
const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
await mkdir(values.out, { recursive: true });
if (positionals.length === 0) {
  const made = join(values.out, 'stage.gltf');
  await writeFile(made, stage());
  positionals.push('', made);
}

function radiosity(...rest) {
  const done = spawnSync(values.program, rest, { encoding: 'utf8' });
  if (done.status !== 0) throw new Error(`radiosity ${rest.join(' ')}: ${done.error ?? done.stderr}`);
  const verdict = done.stderr.split('\n').find((line) => line.includes('error asked')) ?? '';
  return verdict.replace(/error asked .*: (NOT reached|reached); audit says ([\d.]+ %).*/, (_, reached, error) =>
    (reached === 'reached' ? error : `${error}!`)).trim();
}

/// L2, p99, bias, worst point of the differences.
function statistics(pairs) {
  const sum = (list) => list.reduce((a, b) => a + b, 0);
  const mean = sum(pairs.map(({ e }) => e)) / pairs.length;
  const relative = pairs.map(({ e, h }) => Math.abs(h - e) / Math.max(e, 0.05 * mean)).sort((a, b) => a - b);
  return {
    count: pairs.length,
    l2: Math.sqrt(sum(pairs.map(({ e, h }) => (h - e) ** 2)) / sum(pairs.map(({ e }) => e * e))),
    p99: relative[Math.floor(0.99 * (relative.length - 1))],
    bias: sum(pairs.map(({ e, h }) => h - e)) / sum(pairs.map(({ e }) => e)),
  };
}

/// What a file holds at points that `sample` found: the illuminance looked up in the EXR pages beside it (NaN where there
/// are none), and by what share the texels or vertices that are read differ.
async function stored(stem, points) {
  const pages = new Map();
  const values = [];
  const spread = (list) => 1 - Math.min(...list) / (Math.max(...list) || 1);
  for (const { triangle, weights } of points) {
    const { uvs, light, pageName, pageSize } = triangle;
    if (!uvs) {
      values.push([NaN, light ? spread(light.map(luminance)) : 0]);
      continue;
    }
    if (!pages.has(pageName)) {
      const bytes = await readFile(`${stem}.lightmap${pageName.split(' ')[1]}.exr`);
      const loader = new EXRLoader();
      loader.type = FloatType;
      const page = loader.parse(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength));
      pages.set(pageName, { ...page, stride: page.data.length / (page.width * page.height) });
    }
    const page = pages.get(pageName);
    const at = [0, 1].map((k) => {
      const size = pageSize[k];
      const place = size * uvs.reduce((sum, uv, i) => sum + weights[i] * uv[k], 0) - 0.5;
      const low = Math.floor(place);
      const clamp = (i) => Math.min(size - 1, Math.max(0, i));
      return [[clamp(low), 1 - (place - low)], [clamp(low + 1), place - low]];
    });
    // The loader's rows run from the bottom.
    const texel = (x, y) => luminance(page.data.subarray(((page.height - 1 - y) * page.width + x) * page.stride));
    const read = at[1].flatMap(([y, v]) => at[0].map(([x, u]) => [texel(x, y), u * v])).filter(([, weight]) => weight > 1e-3);
    values.push([read.reduce((sum, [e, weight]) => sum + weight * e, 0), spread(read.map(([e]) => e))]);
  }
  return values;
}

async function compare(scene, style) {
  const [file, ...options] = scene.split(/\s+/).filter(Boolean);
  const name = `${basename(file ?? 'cornell-box').replace(/\.\w+$/, '')}-${style}`;
  const at = (ending) => resolve(values.out, name + ending);
  const input = [...(file ? [file] : []), ...options];
  const how = { lightmap: [], vertices: ['--vertices'] }[style];
  if (!how) throw new Error(`--style ${style}: use lightmap or vertices`);
  const baked = radiosity('bake', ...input, '-o', at('.glb'), '--error', values.error, ...how, ...values.bake.split(/\s+/).filter(Boolean));
  const { points } = await sample(at('.glb'), Number(values.points), Number(values.edges), Number(values.seed));
  // Points of the file stand in glTF's axes; `measure` asks for those of the scene.
  const zUp = options.some((option, i) => option === '--up=z' || (option === '--up' && options[i + 1] === 'z'));
  const turned = (v) => (zUp ? [v[0], -v[2], v[1]] : v);
  await writeFile(at('.points.csv'), csv(points.map((p) => ({ ...p, point: turned(p.point), normal: turned(p.normal) }))));
  const measured = radiosity('measure', ...input, '--points', at('.points.csv'), '-o', at('.measured.csv'), '--error', '1%');

  const rows = (await readFile(at('.measured.csv'), 'utf8')).trim().split('\n').slice(1);
  const viewer = await open(at('.glb'), { executablePath: values.chromium });
  let shown;
  try {
    shown = await viewer.measure(points.map(({ point, flat }) => [...point, ...flat]));
  } finally {
    await viewer.close();
  }
  const held = await stored(at(''), points);
  const pairs = points.map(({ kind, point, normal, texel }, i) => {
    const cells = rows[i].split(',').map(Number);
    const [stored, spread] = held[i];
    return { kind, point, normal, texel, e: luminance(cells.slice(6, 9)), h: luminance(shown[i]), stored, spread };
  });
  const missing = pairs.filter(({ h }) => Number.isNaN(h));
  const whole = pairs.filter((pair) => !missing.includes(pair));
  const text = whole.map(({ kind, point, normal, texel, e, h, stored }) =>
    [...point.map((x) => x.toFixed(5)), ...normal.map((x) => x.toFixed(3)), kind, texel.toPrecision(3), e.toPrecision(5), h.toPrecision(5), stored.toPrecision(5), ((h - e) / e).toFixed(4)].join());
  await writeFile(at('.compared.csv'), ['x,y,z,nx,ny,nz,kind,texel,measured_lux,shown_lux,texels_lux,relative', ...text].join('\n') + '\n');
  const [area, edge] = ['area', 'edge'].map((kind) => statistics(whole.filter((pair) => pair.kind === kind)));
  const even = statistics(whole.filter(({ kind, spread }) => kind === 'area' && spread < 0.2));
  const coding = statistics(whole.map(({ stored, h }) => ({ e: stored, h })));
  return { name, baked, measured, area, even, edge, coding, missing: missing.length };
}

const percent = (x) => (Number.isNaN(x) ? '-' : `${(100 * x).toFixed(2)} %`);
console.log('| scene | audit of bake, of measure | points | L2 | p99 | bias | even | edge points | L2 | p99 | bias | file | p99 | not drawn |');
console.log(`|${'---|'.repeat(14)}`);
let failed = false;
for (const scene of positionals) {
  for (const style of values.style) {
    try {
      const { name, baked, measured, area, even, edge, coding, missing } = await compare(scene, style);
      const wrong = !(area.l2 <= share(values.limit));
      failed ||= wrong;
      const cells = (of) => [of.count, percent(of.l2), percent(of.p99), percent(of.bias)];
      console.log(`| ${[name + (wrong ? ' **over the limit**' : ''), `${baked}, ${measured}`, ...cells(area), percent(even.l2), ...cells(edge), percent(coding.l2), percent(coding.p99), missing].join(' | ')} |`);
    } catch (error) {
      failed = true;
      console.log(`| ${scene || 'cornell-box'}, ${style} | ${error.message} |`);
    }
  }
}
process.exitCode = failed ? 1 : 0;
