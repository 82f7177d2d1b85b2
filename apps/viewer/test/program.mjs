// The program and pages that look at it, for tests. RADIOSITY and CHROMIUM say where the programs are, PAGE a page that was
// just built, to be tried in place of the one that the program carries; screenshots go to out/viewer of the repository.
import { spawn, spawnSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const root = join(dirname(fileURLToPath(import.meta.url)), '..', '..', '..');
const radiosity = process.env.RADIOSITY ?? join(root, 'target', 'debug', 'radiosity');
export const pictures = join(root, 'out', 'viewer');
mkdirSync(pictures, { recursive: true });

/** Starts `radiosity view`; gives the address, and the way to end it as Ctrl-C does, which gives the exit code. */
export async function view(...options) {
  const program = spawn(radiosity, ['view', '--json', '--no-open', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
  const ended = new Promise((done) => program.on('close', done));
  const url = await new Promise((found, failed) => {
    createInterface(program.stdout).on('line', (line) => {
      const event = JSON.parse(line);
      if (event.event === 'listening') found(event.url);
    });
    ended.then((code) => failed(new Error(`radiosity view ended with ${code}`)));
    program.on('error', failed);
  });
  return {
    url,
    end() {
      program.kill('SIGINT');
      return ended;
    },
  };
}

/** A browser; every page of it keeps what went wrong in `faults` and where it asked in `asked`. */
export async function browser() {
  const own = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: true,
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
      '--disable-background-networking', '--disable-component-update', '--disable-sync',
      // A page that is put in the place of another has no address, and so no way to this machine.
      ...(process.env.PAGE ? ['--disable-features=LocalNetworkAccessChecks'] : [])],
  });
  return {
    close: () => own.close(),
    async open(url, { width = 1400, height = 900, touch = false } = {}) {
      const context = await own.newContext({ viewport: { width, height }, hasTouch: touch, isMobile: touch, acceptDownloads: true });
      if (process.env.PAGE) await context.route(url, instead);
      const page = await context.newPage();
      page.faults = [];
      page.asked = [];
      page.on('console', (message) => {
        if (message.type() === 'error') page.faults.push(message.text());
      });
      page.on('pageerror', (error) => page.faults.push(String(error)));
      page.on('request', (request) => page.asked.push(request.url()));
      page.on('websocket', (socket) => page.asked.push(socket.url()));
      await page.goto(url);
      await caughtUp(page);
      return page;
    },
  };
}

/** Answers with `PAGE`, under the policy of the program. */
async function instead(route) {
  const response = await route.fetch();
  const [nonce] = /(?<=nonce-)[0-9a-f]+/.exec(response.headers()['content-security-policy']);
  await route.fulfill({ response, body: readFileSync(process.env.PAGE, 'utf8').replaceAll('nonce="NONCE"', `nonce="${nonce}"`) });
}

export const state = (page) => page.evaluate(() => window.radiosity.state());

export async function caughtUp(page) {
  await page.waitForFunction(() => window.radiosity?.state().isCaughtUp, undefined, { timeout: 20_000 });
}

/** Waits until nothing is left to do, after at least so many edits, and all light has come. */
export async function done(page, edits = 0) {
  await page.waitForFunction((edits) => {
    const { status } = window.radiosity.state();
    return status && status.is_done && status.edits >= edits;
  }, edits, { timeout: 60_000 });
  await quiet(page);
}

/** Waits until nothing has come for a while. */
async function quiet(page) {
  let last = -1;
  for (;;) {
    const { received } = await state(page);
    if (received === last) return;
    last = received;
    await page.waitForTimeout(300);
  }
}

/** Illuminance at points [x, y, z, nx, ny, nz] of the scene that a page would save, by `radiosity measure`, lx. */
export async function measured(page, points) {
  const folder = mkdtempSync(join(tmpdir(), 'radiosity-view-'));
  try {
    const glb = await page.evaluate(async () => {
      const response = await fetch('scene.glb');
      return [...new Uint8Array(await response.arrayBuffer())];
    });
    writeFileSync(join(folder, 'scene.glb'), Buffer.from(glb));
    writeFileSync(join(folder, 'points.csv'), ['x,y,z,nx,ny,nz', ...points.map((point) => point.join(','))].join('\n'));
    const run = spawnSync(radiosity, ['measure', 'scene.glb', '--points', 'points.csv', '--error', '3%', '-o', 'light.csv', '--quiet'],
      { cwd: folder, encoding: 'utf8' });
    if (run.status !== 0) throw new Error(`radiosity measure: ${run.stderr}`);
    const [names, ...rows] = readFileSync(join(folder, 'light.csv'), 'utf8').trim().split('\n');
    const column = names.split(',').indexOf('illuminance_lux');
    return rows.map((row) => Number(row.split(',')[column]));
  } finally {
    rmSync(folder, { recursive: true });
  }
}

/** The relative L2 difference of two lists. */
export function difference(shown, truth) {
  const squares = (list) => list.reduce((sum, x) => sum + x * x, 0);
  return Math.sqrt(squares(shown.map((x, i) => x - truth[i])) / squares(truth));
}

/** What the page shows at points spread over its surfaces, and how far that is from a batch solve of what it would save. */
export async function compared(page, count = 150) {
  const points = await page.evaluate((count) => window.radiosity.points(count), count);
  const shown = await page.evaluate((points) => points.map((point) => window.radiosity.lux(point)), points);
  const truth = await measured(page, points);
  // Floor under things gets no light at all and is not seen.
  const pairs = shown.map((lux, i) => [lux, truth[i]]).filter(([lux, true_lux]) => lux !== null && true_lux > 0);
  if (pairs.length < 0.9 * count) throw new Error(`${pairs.length} of ${count} points were found on the page`);
  return difference(pairs.map(([lux]) => lux), pairs.map(([, lux]) => lux));
}

/** A picture for people. */
export const picture = (page, name) => page.screenshot({ path: join(pictures, `${name}.png`) });
