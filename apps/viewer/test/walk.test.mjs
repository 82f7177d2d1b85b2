// Walking, on a page whose pictures are drawn by nobody: `update` of the navigator is called with the seconds of each frame.
import assert from 'node:assert/strict';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { browser, endAll, folder, SMALL, view } from './program.mjs';

/** A room of 6 × 3 × 6 m about the origin with things on its floor: a step of 17 cm, a seat of 45 cm, a cupboard of 80 cm and a pillar. */
function scene() {
  const lines = [];
  let count = 0;
  const add = (name, [x0, y0, z0], [x1, y1, z1], isRoom = false) => {
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1 ? x1 : x0, k & 2 ? y1 : y0, k & 4 ? z1 : z0]);
    const faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    lines.push(`o ${name}`, ...corners.map((corner) => `v ${corner.join(' ')}`));
    faces.forEach((face) => lines.push(`f ${(isRoom ? [...face].reverse() : face).map((k) => count + 1 + k).join(' ')}`));
    count += 8;
  };
  add('room', [-3, 0, -3], [3, 3, 3], true);
  add('step', [-3, 0, -3], [-1, 0.17, 3]);
  add('seat', [1.5, 0, -3], [3, 0.45, 0]);
  add('cupboard', [0, 0, 2.4], [1.2, 0.8, 3]);
  add('pillar', [-0.2, 0, -1.4], [0.2, 3, -1]);
  return lines.join('\n');
}

let chromium;
let program;
let page;
before(async () => {
  chromium = await browser();
  await folder(async (path) => {
    writeFileSync(join(path, 'room.obj'), scene());
    program = await view(join(path, 'room.obj'), '--sky', 'uniform:1000', ...SMALL);
    page = await chromium.open(program.url);
  });
});
after(async () => {
  await program?.end();
  await chromium?.close();
  endAll();
});

/** Where one is after walking from a place, looking that many degrees to the left of −z, in frames of so many seconds. */
const walked = (from, degrees, frames, fast = false) => page.evaluate(({ from, degrees, frames, fast }) => {
  const { navigator, stage } = window.radiosity.app;
  navigator.set('walk');
  stage.camera.position.set(...from);
  stage.camera.quaternion.set(0, Math.sin((degrees * Math.PI) / 360), 0, Math.cos((degrees * Math.PI) / 360));
  navigator.drive = { right: 0, up: 0, back: -1, yaw: 0, pitch: 0, fast };
  frames.forEach((seconds) => navigator.update(seconds));
  navigator.drive = { right: 0, up: 0, back: 0, yaw: 0, pitch: 0, fast: false };
  return stage.camera.position.toArray();
}, { from, degrees, frames, fast });

const frames = (seconds, rate) => Array(Math.round(seconds * rate)).fill(1 / rate);
const apart = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

test('few pictures a second lead where many do', async () => {
  let worst = 0;
  for (let k = 0; k < 36; k += 1) {
    const way = (rate) => walked([0.6, 1.6, 0.9], 10 * k + 3, frames(3, rate));
    worst = Math.max(worst, apart(await way(60), await way(3)));
  }
  // Measured: up to 3 cm, in corners.
  assert.ok(worst < 0.05, `${worst} m apart`);
});

test('one steps on steps, not on seats', async () => {
  for (const rate of [60, 3]) {
    const [x, y] = await walked([0, 1.6, 0], 90, frames(1.5, rate));
    assert.ok(x < -1.8 && Math.abs(y - 1.77) < 0.005, `on the step: ${x} ${y}`);
    const [before, level] = await walked([0.5, 1.6, -1], -90, frames(2, rate));
    assert.ok(before > 1.2 && before < 1.3 && level === 1.6, `before the seat: ${before} ${level}`);
  }
});

test('walls are kept at a distance, and gone along', async () => {
  const [x, , z] = await walked([2, 1.6, 1], -45, frames(2, 60), true);
  // The wall at the right stops one a quarter of a metre before it, the seat in front further on.
  assert.ok(x > 2.6 && x < 2.83, `${x}`);
  assert.ok(z > 0.15 && z < 0.3, `${z}`);
});

test('one comes out of what one stands in', async () => {
  for (const rate of [60, 3]) {
    // Above the cupboard, at the eye's height over the floor.
    const out = await walked([0.6, 1.6, 2.7], 0, frames(1, rate));
    assert.ok(out[2] < 1.4, `cupboard, ${rate} pictures a second: ${out}`);
    // The eyes within the pillar.
    const free = await walked([0.05, 1.6, -1.1], 180, frames(1, rate));
    assert.ok(free[2] > 0.2, `pillar, ${rate} pictures a second: ${free}`);
  }
});
