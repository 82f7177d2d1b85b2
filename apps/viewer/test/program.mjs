// The program and pages that look at it, for tests. RADIOSITY and CHROMIUM say where the programs are, PAGE a page that was
// just built, to be tried in place of the one that the program carries; screenshots go to out/viewer of the repository.
import { spawn, spawnSync } from 'node:child_process';
import { randomBytes } from 'node:crypto';
import { once } from 'node:events';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { createInterface } from 'node:readline';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const root = join(dirname(fileURLToPath(import.meta.url)), '..', '..', '..');
const radiosity = process.env.RADIOSITY ?? join(root, 'target', 'debug', 'radiosity');
export const pictures = join(root, 'out', 'viewer');
mkdirSync(pictures, { recursive: true });

/** Pixels drawn for one of the page, along each side: without graphics hardware drawing takes most of the time. Whoever wants to look at the pictures says SHARP=1. */
const SHARE = process.env.SHARP ? 1 : 0.5;

/** Options of tests that take ten seconds and more, most of which look closer at what others look at, too: SLOW=1 runs them. */
export const slow = { skip: process.env.SLOW ? false : 'slow; `cargo xtask viewer --test-all` runs it' };

/** A scene that is done in a second: few elements, few rays. */
export const SMALL = ['--elements', '6000', '--rays', '64'];

/** Farthest that light on the page may be from a batch solve that was audited to 3 %: elements of this size blur the edges of
 *  shadows. Measured: up to 0.046. An edit that is missed makes it 0.2 and more. */
export const NEAR = 0.05;

/** Programs that run. */
const running = new Set();

/** Ends what tests that failed have left: nobody would end before it does. */
export const endAll = () => running.forEach((program) => program.kill('SIGKILL'));

/** Starts `radiosity view`; gives the address, and the way to end it as Ctrl-C does, which gives the exit code. */
export async function view(...options) {
  const program = spawn(radiosity, ['view', '--json', '--no-open', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
  running.add(program);
  const ended = new Promise((done) => program.on('close', done)).finally(() => running.delete(program));
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
    async open(url, { width = 1000, height = 660, touch = false, share = SHARE } = {}) {
      const context = await own.newContext({ viewport: { width, height }, deviceScaleFactor: share, hasTouch: touch, isMobile: touch, acceptDownloads: true });
      if (process.env.PAGE) await context.route(url, instead);
      const page = await context.newPage();
      // A machine that others use is slow.
      page.setDefaultTimeout(120_000);
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
  if (route.request().method() === 'HEAD') return route.continue();
  const response = await route.fetch();
  const [nonce] = /(?<=nonce-)[0-9a-f]+/.exec(response.headers()['content-security-policy']);
  await route.fulfill({ response, body: readFileSync(process.env.PAGE, 'utf8').replaceAll('nonce="NONCE"', `nonce="${nonce}"`) });
}

export const state = (page) => page.evaluate(() => window.radiosity.state());

export async function caughtUp(page) {
  await page.waitForFunction(() => window.radiosity?.state().isCaughtUp, undefined, { timeout: 60_000 });
}

/** A page whose connection ends, by what is done, and which finds none until `online`. */
export async function offline(page, end = () => page.evaluate(() => window.radiosity.app.connection.drop())) {
  await page.evaluate(() => {
    window.Line ??= window.WebSocket;
    window.WebSocket = class {
      static OPEN = 1;
      constructor() { setTimeout(() => this.onclose(), 50); }
      close() {}
    };
  });
  await end();
  await page.waitForFunction(() => !window.radiosity.state().isConnected);
}

/** It finds one again, and has what it missed. */
export async function online(page) {
  await page.evaluate(() => { window.WebSocket = window.Line; });
  await caughtUp(page);
}

/** Waits until nothing is left to do, after at least so many edits, and all light has come. */
export async function done(page, edits = 0) {
  await page.waitForFunction((edits) => {
    const { status } = window.radiosity.state();
    return status && status.is_done && status.edits >= edits;
  }, edits, { timeout: 180_000 });
  await quiet(page);
}

/** Undoes everything, so that tests do not depend on each other. */
export async function restored(page) {
  await page.evaluate(async () => {
    const { app, state } = window.radiosity;
    const until = async (is) => {
      while (!is()) await new Promise((done) => { setTimeout(done, 5); });
    };
    while (app.undoable !== null) {
      const { edits } = state().status;
      app.undo();
      // What can be undone next has been told by then.
      await until(() => state().status.edits > edits);
    }
  });
  await done(page);
}

/** Waits so many milliseconds, and for five turns of the page: what is told in one is drawn in the next, and shown, and asked anew one or two later, which are
 *  late on a slow machine. */
export const pause = (page, milliseconds) => page.evaluate((milliseconds) => new Promise((done) => {
  const begin = performance.now();
  let left = 5;
  const tick = () => {
    left -= 1;
    if (left < 0 && performance.now() - begin >= milliseconds) done();
    else requestAnimationFrame(tick);
  };
  tick();
}), milliseconds);

/** Waits until nothing has come for a while. */
async function quiet(page) {
  let last = -1;
  for (;;) {
    const { received } = await state(page);
    if (received === last) return;
    last = received;
    await page.waitForTimeout(200);
  }
}

/** The picture, once nothing has been drawn for a while: exposure has arrived, and a slow machine shows all pixels again. */
export async function pixels(page) {
  const drawn = () => page.evaluate(() => window.radiosity.app.stage.frames);
  const deadline = Date.now() + 120_000;
  for (let last = -1, now = await drawn(); now !== last; now = await drawn()) {
    if (Date.now() > deadline) throw new Error('the page never rests');
    last = now;
    await pause(page, 700);
  }
  return page.locator('canvas').first().screenshot();
}

/** The scene that a page would save. */
export async function saved(page) {
  const glb = await page.evaluate(async () => [...new Uint8Array(await (await fetch('scene.glb')).arrayBuffer())]);
  return Buffer.from(glb);
}

/** A folder for what a test writes; it goes when the test is over. */
export async function folder(use) {
  const path = mkdtempSync(join(tmpdir(), 'radiosity-view-'));
  try {
    return await use(path);
  } finally {
    rmSync(path, { recursive: true });
  }
}

/** Runs the program on the scene that a page would save, as `scene.glb` in a folder that goes; gives what is made of the folder. */
export async function batch(page, verb, options, use, files = {}) {
  const glb = await saved(page);
  return folder((path) => {
    for (const [name, content] of Object.entries({ 'scene.glb': glb, ...files })) writeFileSync(join(path, name), content);
    const run = spawnSync(radiosity, [verb, 'scene.glb', '--error', '3%', '--quiet', ...options], { cwd: path, encoding: 'utf8' });
    if (run.status !== 0) throw new Error(`radiosity ${verb}: ${run.stderr}`);
    return use((name) => readFileSync(join(path, name)));
  });
}

/** Illuminance at points [x, y, z, nx, ny, nz] of the scene that a page would save, by `radiosity measure`, lx. */
export function measured(page, points) {
  const table = ['x,y,z,nx,ny,nz', ...points.map((point) => point.join(','))].join('\n');
  return batch(page, 'measure', ['--points', 'points.csv', '-o', 'light.csv'], (file) => {
    const [names, ...rows] = file('light.csv').toString().trim().split('\n');
    const column = names.split(',').indexOf('illuminance_lux');
    return rows.map((row) => Number(row.split(',')[column]));
  }, { 'points.csv': table });
}

/** What the page shows, by `radiosity render`: a PNG of the scene that it would save, from where it looks. */
export async function rendered(page, exposure) {
  const [eye, target, fov, size] = await page.evaluate(() => {
    const { stage } = window.radiosity.app;
    const { matrix: m, fov } = stage.place('');
    return [m.slice(12, 15), [0, 1, 2].map((k) => m[12 + k] - m[8 + k]), (180 / Math.PI) * fov, [stage.canvas.clientWidth, stage.canvas.clientHeight].map((side) => Math.floor(side * devicePixelRatio))];
  });
  const options = ['--eye', eye, '--target', target, '--fov', fov, '--size', size.join('x'), '--exposure', exposure, '-o', 'picture.png'].map(String);
  return batch(page, 'render', options, (file) => file('picture.png'));
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
  const off = difference(pairs.map(([lux]) => lux), pairs.map(([, lux]) => lux));
  if (off >= NEAR) await explain(page, points, shown, truth);
  return off;
}

/** Says where the page is farthest from a batch solve, whether it still is after a while, and whether another batch solve says so, too. */
async function explain(page, points, shown, truth) {
  await page.waitForTimeout(2000);
  const later = await page.evaluate((points) => points.map((point) => window.radiosity.lux(point)), points);
  const again = await measured(page, points);
  const { status, objects } = await state(page);
  console.log(`far from a batch solve; ${JSON.stringify(status)}`);
  const off = (i) => Math.abs((shown[i] ?? truth[i]) - truth[i]);
  const worst = points.map((_, i) => i).sort((a, b) => off(b) - off(a)).slice(0, 10);
  for (const i of worst) console.log(`at ${points[i]}: shown ${shown[i]}, later ${later[i]}; batch ${truth[i]}, again ${again[i]} lx`);
  for (const { name, matrix, deleted } of objects) console.log(`${deleted ? 'deleted ' : ''}${name}: ${matrix}`);
}

/** A page that never reads what it is sent, and asks for all light again and again, some 30 MB of it: more than the buffers
 *  of both ends hold. `end` closes it. */
export async function stuck(url) {
  const { host, hostname, port, pathname, origin } = new URL(url);
  const socket = connect(Number(port), hostname);
  await once(socket, 'connect');
  socket.write(`GET ${pathname}socket HTTP/1.1\r\nHost: ${host}\r\nOrigin: ${origin}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n` +
    `Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ${randomBytes(16).toString('base64')}\r\n\r\n`);
  const [answer] = await once(socket, 'data');
  if (!String(answer).startsWith('HTTP/1.1 101')) throw new Error(`no socket: ${answer}`);
  socket.pause();
  // A frame of text with a mask of zeros.
  const text = Buffer.from(JSON.stringify({ kind: 'layer', layer: 'total', epoch: 1 }));
  const frame = Buffer.concat([Buffer.from([0x81, 0x80 | text.length, 0, 0, 0, 0]), text]);
  for (let i = 0; i < 400; i += 1) socket.write(frame);
  socket.on('error', () => {});
  return { end: () => socket.destroy() };
}

/** A picture for people. */
export const picture = (page, name) => page.screenshot({ path: join(pictures, `${name}.png`) });

/** Points of the surfaces, as many as asked or those given, and the illuminance that the page shows there. */
export const luxOf = (page, asked) => page.evaluate((asked) => {
  const { radiosity } = window;
  const points = Array.isArray(asked) ? asked : radiosity.points(asked);
  return { points, lux: points.map((point) => radiosity.lux(point) ?? 0) };
}, asked);

/** The picture at places of the canvas, and what is known of the light there. */
export const pixelsOf = (page, places) => page.evaluate((places) => window.radiosity.seen(places), places);

/** Where the handle is that moves what is selected along the world's x, in pixels of the page. */
export const handleOf = (page) => page.evaluate(() => {
  const { app } = window.radiosity;
  const { camera, canvas } = app.stage;
  const spot = app.spot();
  // As TransformControls scales its handles; 0.45 of that is on the shaft.
  const size = spot.distanceTo(camera.position) * Math.min(1.9 * Math.tan((Math.PI * camera.fov) / 360), 7) * (0.8 / 4);
  const at = app.stage.project(spot.clone().setX(spot.x + 0.45 * size));
  const box = canvas.getBoundingClientRect();
  return [box.left + at.x, box.top + at.y];
});

/** A PNG as its sides and the colour at a place (shares of its sides, from above left). */
export async function decoded(page, png) {
  const { width, height, bytes } = await page.evaluate(async (base64) => {
    const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))]), { colorSpaceConversion: 'none' });
    const { width, height } = picture;
    const pen = new OffscreenCanvas(width, height).getContext('2d');
    pen.drawImage(picture, 0, 0);
    return { width, height, bytes: [...pen.getImageData(0, 0, width, height).data] };
  }, png.toString('base64'));
  const at = ([x, y]) => {
    const first = 4 * (Math.floor(y * height) * width + Math.floor(x * width));
    return bytes.slice(first, first + 3);
  };
  return { width, height, at };
}
