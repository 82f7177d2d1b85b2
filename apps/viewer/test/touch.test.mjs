// The page by fingers.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { started } from './fixture.mjs';
import { done, handleOf, pause, picture, pixels, restored, state } from './program.mjs';

const { program, pages } = await started();

/** Fingers that are put down at some places, go ways of some pixels, and are lifted; `meanwhile` is before that. */
async function gesture(page, from, ways, meanwhile = async () => {}) {
  const hand = await page.context().newCDPSession(page);
  const at = (share) => from.map(([x, y], id) => ({ id, x: x + share * ways[id][0], y: y + share * ways[id][1] }));
  await hand.send('Input.dispatchTouchEvent', { type: 'touchStart', touchPoints: at(0) });
  for (let step = 1; step <= 8; step += 1) {
    await hand.send('Input.dispatchTouchEvent', { type: 'touchMove', touchPoints: at(step / 8) });
    await page.waitForTimeout(30);
  }
  await meanwhile();
  await hand.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] });
  await hand.detach();
}

test('a thumb walks by the stick, a finger turns the head, and two fingers come nearer', async () => {
  const page = await pages.open(program.url, { width: 844, height: 390, touch: true });
  await done(page);
  const camera = () => page.evaluate(() => {
    const { app } = window.radiosity;
    const { position, quaternion } = app.stage.camera;
    return { place: position.toArray(), turn: quaternion.toArray(), ahead: position.clone().set(0, 0, -1).applyQuaternion(quaternion).toArray(),
      reach: app.navigator.orbit.target.distanceTo(position) };
  });
  const along = (from, to) => to.place.reduce((sum, x, k) => sum + (x - from.place[k]) * from.ahead[k], 0);
  await page.evaluate(() => window.radiosity.app.walk('walk'));

  // Up is ahead, as long as the thumb is there.
  const first = await camera();
  const box = await page.locator('.stick').boundingBox();
  const middle = [box.x + box.width / 2, box.y + box.height / 2];
  await gesture(page, [middle], [[0, -40]], () => page.waitForFunction((place) =>
    window.radiosity.app.stage.camera.position.toArray().some((x, k) => Math.abs(x - place[k]) > 0.02), first.place));
  const walked = await camera();
  assert.ok(along(first, walked) > 0.01, `${first.place} ${walked.place}`);
  assert.deepEqual(walked.turn, first.turn);
  await pause(page, 300);
  assert.deepEqual((await camera()).place, walked.place, 'lifted, it stands');
  // Down is back.
  await gesture(page, [middle], [[0, 40]], () => page.waitForFunction((place) =>
    window.radiosity.app.stage.camera.position.toArray().some((x, k) => Math.abs(x - place[k]) > 0.02), walked.place));
  assert.ok(along(walked, await camera()) < -0.01);

  // The picture goes with the finger: to the right, and one looks to the left. Nothing is picked by that.
  const before = await camera();
  await gesture(page, [[300, 150]], [[80, 0]]);
  const turned = await camera();
  assert.deepEqual(turned.place, before.place);
  const across = before.ahead[2] * turned.ahead[0] - before.ahead[0] * turned.ahead[2];
  assert.ok(Math.abs(across - Math.sin(80 * 0.0042)) < 0.01, `${across}`);
  assert.equal((await state(page)).probe, null);

  // Two of them do nothing that either alone would.
  await gesture(page, [[300, 150], [380, 150]], [[-60, 0], [60, 0]]);
  assert.deepEqual(await camera(), turned);

  await page.evaluate(() => window.radiosity.app.walk('orbit'));
  await page.locator('.stick').waitFor({ state: 'hidden' });
  const far = await camera();
  await gesture(page, [[300, 200], [360, 200]], [[-60, 0], [60, 0]]);
  const near = await camera();
  assert.ok(near.reach < 0.6 * far.reach, `${far.reach} ${near.reach}`);
  await gesture(page, [[300, 200]], [[80, 0]]);
  const around = await camera();
  assert.ok(Math.abs(around.reach - near.reach) < 1e-3 * near.reach && around.turn.some((x, k) => Math.abs(x - near.turn[k]) > 0.02));
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a thing is dragged by a finger, and light follows', async () => {
  const page = await pages.open(program.url, { width: 844, height: 390, touch: true });
  await done(page);
  const { edits } = (await state(page)).status;
  const block = await page.evaluate(() => {
    const { app } = window.radiosity;
    const { id } = [...app.objects.values()].find(({ name }) => name === 'short block');
    app.select(id);
    return id;
  });
  // What can be taken hold of is where it was drawn last.
  await pixels(page);
  const handle = await handleOf(page);
  await gesture(page, [handle], [[-50, 0]], async () => assert.ok((await state(page)).isDragging, 'the handle is held'));
  await done(page, edits + 1);
  const { matrix } = (await state(page)).objects.find(({ id }) => id === block);
  assert.ok(Math.abs(matrix[12]) > 0.02 && Math.abs(matrix[13]) + Math.abs(matrix[14]) < 1e-6, `moved along x alone: ${matrix}`);
  await restored(page);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a narrow screen that is touched', async () => {
  const page = await pages.open(program.url, { width: 390, height: 844, touch: true });
  await done(page);
  await page.touchscreen.tap(200, 300);
  await page.waitForFunction(() => window.radiosity.state().selected !== null);
  // The panel is folded: what a tap measures stands over the picture, at the place.
  await page.locator('#reading').waitFor();
  const [text, box] = [await page.locator('#reading').innerText(), await page.locator('#reading').boundingBox()];
  assert.match(text, /^[\d.,]+ lx$/);
  assert.ok(box.x < 200 && box.x + box.width > 200 && box.y + box.height < 300 && box.y > 200, JSON.stringify(box));
  // All of the bar is there, and can be hit.
  for (const name of ['Walk', 'Orbit', 'Undo', 'Redo', 'Save', '?', 'Panel']) {
    const box = await page.locator('header').getByText(name, { exact: true }).or(page.locator(`header [aria-label="${name}"]`)).boundingBox();
    assert.ok(box && box.x >= 0 && box.x + box.width <= 390 && Math.min(box.width, box.height) >= 24, `${name}: ${JSON.stringify(box)}`);
  }
  await picture(page, 'narrow');
  const { edits } = (await state(page)).status;
  await page.evaluate(() => window.radiosity.app.setLight(window.radiosity.app.lights.get(0), { dimming: 0.5 }));
  await done(page, edits + 1);
  await page.locator('header [aria-label=Undo]').tap();
  await done(page, edits + 2);
  assert.equal((await state(page)).lights[0].dimming, 1);
  await page.locator('header [aria-label=Redo]').tap();
  await done(page, edits + 3);
  assert.equal((await state(page)).lights[0].dimming, 0.5);
  await restored(page);
  await page.locator('header button[title^=Keys]').tap();
  assert.equal(await page.locator('#help').isVisible(), true);
  await picture(page, 'narrow-help');
  await page.locator('#help button[aria-label=Close]').tap();
  await page.locator('#save').tap();
  await picture(page, 'narrow-menu');
  await page.keyboard.press('Escape');
  await page.locator('#fold').tap();
  await pause(page, 600);
  await picture(page, 'narrow-panel');
  const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  assert.ok(overflow <= 0, `${overflow}`);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
