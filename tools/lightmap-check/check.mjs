// What three.js shows of a lit model, as numbers:
//   node check.mjs MODEL.glb POINTS.csv [--z-up] [--reach METRES] [--chromium PATH] > OUT.csv
// POINTS.csv has the columns x,y,z,nx,ny,nz (metres, any order); the output has irradiance_r, irradiance_g and
// irradiance_b in lx, one row per point. The model is loaded with GLTFLoader and a small MOZ_lightmap plugin and drawn
// on white; pixels are read back from a float target. --z-up: the points' zenith is +Z. --reach: from how far the points
// are looked at, by default 1e-4 of the model's size; where nothing is drawn within a tenth of that, the row is NaN.
import { readFile } from 'node:fs/promises';
import { parseArgs } from 'node:util';
import { open } from './viewer.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    'z-up': { type: 'boolean', default: false },
    reach: { type: 'string' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
  },
});
if (positionals.length !== 2) {
  console.error('usage: node check.mjs MODEL.glb POINTS.csv [--z-up] [--reach METRES] [--chromium PATH]');
  process.exit(2);
}
const [model, csv] = positionals;

const [head, ...lines] = (await readFile(csv, 'utf8')).trim().split(/\r?\n/);
const names = head.split(',').map((name) => name.trim());
const columns = ['x', 'y', 'z', 'nx', 'ny', 'nz'].map((name) => names.indexOf(name));
if (columns.includes(-1)) {
  console.error(`${csv}: needs the columns x,y,z,nx,ny,nz`);
  process.exit(2);
}
const points = lines.map((line) => {
  const cells = line.split(',').map(Number);
  const [x, y, z, nx, ny, nz] = columns.map((column) => cells[column]);
  return values['z-up'] ? [x, z, -y, nx, nz, -ny] : [x, y, z, nx, ny, nz];
});

const viewer = await open(model, { executablePath: values.chromium });
try {
  const rows = await viewer.measure(points, { reach: values.reach && Number(values.reach) });
  console.log('irradiance_r,irradiance_g,irradiance_b');
  for (const row of rows) console.log(row.map((v) => v.toPrecision(7)).join(','));
} finally {
  await viewer.close();
}
