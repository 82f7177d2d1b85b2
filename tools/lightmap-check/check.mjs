// What three.js shows of a lit model, as numbers:
//   node check.mjs MODEL.glb POINTS.csv [--z-up] [--exposure X] [--reach METRES] [--chromium PATH] > OUT.csv
// POINTS.csv has the columns x,y,z,nx,ny,nz (metres, any order); the output has irradiance_r, irradiance_g and
// irradiance_b in lx, one row per point. The model is loaded with GLTFLoader and a small MOZ_lightmap plugin and drawn
// on white; pixels are read back from a float target. --z-up: the points' zenith is +Z. --exposure: of the unlit style.
import { createServer } from 'node:http';
import { mkdtemp, readFile, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { chromium } from 'playwright-core';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    'z-up': { type: 'boolean', default: false },
    exposure: { type: 'string', default: '1' },
    reach: { type: 'string', default: '0.001' },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
  },
});
if (positionals.length !== 2) {
  console.error('usage: node check.mjs MODEL.glb POINTS.csv [--z-up] [--exposure X] [--reach METRES] [--chromium PATH]');
  process.exit(2);
}
const [model, csv] = positionals;
const exposure = Number(values.exposure);

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

const here = dirname(fileURLToPath(import.meta.url));
const three = join(here, '..', 'node_modules', 'three');
const types = { '.html': 'text/html', '.js': 'text/javascript', '.glb': 'model/gltf-binary' };
const server = createServer(async (request, response) => {
  const path = normalize(new URL(request.url, 'http://localhost').pathname);
  const file = path === '/' ? join(here, 'page.html')
    : path === '/model.glb' ? model
      : path.startsWith('/three/') ? join(three, path.slice('/three/'.length)) : null;
  try {
    const body = await readFile(file);
    response.writeHead(200, { 'content-type': types[extname(file)] ?? 'application/octet-stream' }).end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));

const profile = await mkdtemp(join(tmpdir(), 'lightmap-check-'));
const browser = await chromium.launchPersistentContext(profile, {
  executablePath: values.chromium,
  headless: true,
  args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
let failed = false;
try {
  const page = await browser.newPage();
  page.on('console', (message) => {
    if (message.type() === 'error') console.error(`page: ${message.text()}`);
  });
  page.on('pageerror', (error) => { failed = true; console.error(`page: ${error}`); });
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => window.ready === true);
  const rows = await page.evaluate(([points, reach]) => window.measure(points, reach), [points, Number(values.reach)]);
  console.log('irradiance_r,irradiance_g,irradiance_b');
  for (const row of rows) console.log(row.map((v) => (v / exposure).toPrecision(7)).join(','));
} finally {
  await browser.close();
  server.close();
  await rm(profile, { recursive: true, force: true });
}
process.exitCode = failed ? 1 : 0;
