// The page without a mouse.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { started } from './fixture.mjs';
import { done, picture, restored, state } from './program.mjs';

const { program, pages } = await started();

test('everything is reached by keyboard alone', async () => {
  const page = await pages.open(program.url);
  await done(page);
  const { camera, status } = await state(page);
  await page.keyboard.down('w');
  await page.waitForTimeout(400);
  await page.keyboard.up('w');
  await page.keyboard.down('ArrowRight');
  await page.waitForTimeout(200);
  await page.keyboard.up('ArrowRight');
  assert.notDeepEqual((await state(page)).camera, camera, 'walks and turns');

  // The first camera again: the cross is on the back wall or a block.
  await page.keyboard.press('c');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => window.radiosity.state().probe !== null);
  const { probe, selected } = await state(page);
  assert.ok(probe.illuminance > 0 && selected !== null);
  assert.ok(probe.lights.length > 0 && probe.surfaces.length > 0);
  await page.keyboard.press('g');
  assert.ok((await state(page)).grid.count > 4, 'a grid');
  for (const key of ['F2', 'i', 'e', 't']) await page.keyboard.press(key);
  await page.waitForTimeout(1500);
  await picture(page, 'false-colours');
  for (const key of ['F2', 'i', 'e', 't']) await page.keyboard.press(key);
  await page.keyboard.press('b');
  await page.waitForFunction(() => window.radiosity.state().bookmarks.length === 1);
  await page.keyboard.press('h');
  assert.equal(await page.locator('#help').isVisible(), true);
  await picture(page, 'keys');
  await page.keyboard.press('Escape');
  assert.equal(await page.locator('#help').isVisible(), false);

  // Tab leads through all controls and back; the lamp is switched off with the space bar.
  const seen = new Set();
  for (let i = 0; i < 80; i += 1) {
    await page.keyboard.press('Tab');
    const label = await page.evaluate(() => document.activeElement.getAttribute('aria-label') ?? document.activeElement.textContent);
    if (seen.size > 5 && label === [...seen][0]) break;
    seen.add(label);
    if (/^light on$/i.test(label)) {
      await page.keyboard.press('Space');
      break;
    }
  }
  await page.waitForFunction(() => window.radiosity.state().lights[0].dimming === 0, undefined, { timeout: 5000 });
  await page.keyboard.press('Escape');
  await page.keyboard.press('Control+z');
  await page.waitForFunction(() => window.radiosity.state().lights[0].dimming === 1);

  // A thing is found by keys, duplicated, moved and deleted: the copy, for that is selected.
  const { objects } = await state(page);
  const block = objects.find((object) => object.name === 'short block');
  for (let i = 0; i < objects.length && (await state(page)).selected !== block.id; i += 1) await page.keyboard.press('p');
  assert.equal((await state(page)).selected, block.id);
  await page.keyboard.press('Control+d');
  await page.waitForFunction((count) => window.radiosity.state().objects.length > count, objects.length);
  const copy = (await state(page)).objects.at(-1);
  await page.keyboard.press('k');
  await page.keyboard.press('.');
  await page.waitForFunction(([id, x]) => window.radiosity.state().objects.find((object) => object.id === id).matrix[12] !== x, [copy.id, copy.matrix[12]]);
  await page.keyboard.press('Delete');
  await page.waitForFunction((id) => window.radiosity.state().objects.find((object) => object.id === id).deleted, copy.id);
  assert.equal((await state(page)).objects.find(({ id }) => id === block.id).deleted, false);
  assert.ok((await state(page)).status.edits > status.edits);
  await restored(page);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('groups, menus and lists are as keyboards expect them, and keys of one letter can be switched off', async () => {
  const page = await pages.open(program.url);
  await done(page);
  const focused = () => page.evaluate(() => document.activeElement.textContent);

  // Of a group one is in the order of Tab, and arrows choose.
  await page.locator('#colours [data-value=eye]').focus();
  await page.keyboard.press('ArrowRight');
  assert.equal(await focused(), 'Lux');
  assert.equal(await page.locator('#colours [data-value=lux]').getAttribute('aria-checked'), 'true');
  assert.deepEqual(await page.locator('#colours button').evaluateAll((all) => all.map((one) => one.tabIndex)), [-1, 0]);
  await page.keyboard.press('ArrowRight');
  assert.equal(await focused(), 'As seen');

  // The menu opens on its first item, arrows go around, Escape goes back and Tab goes on; both close it.
  const isOpen = () => page.locator('#saves').isVisible();
  await page.locator('#save').focus();
  await page.keyboard.press('Enter');
  assert.match(await focused(), /^Screenshot/);
  await page.keyboard.press('ArrowUp');
  assert.match(await focused(), /^Edited scene/);
  await page.keyboard.press('Escape');
  assert.equal(await isOpen(), false);
  assert.equal(await focused(), 'Save');
  await page.keyboard.press('Enter');
  await page.keyboard.press('Tab');
  assert.equal(await isOpen(), false);
  assert.equal(await focused(), '?');

  // Shortcuts are named as the standard names them.
  const names = await page.locator('[aria-keyshortcuts]').evaluateAll((all) => all.map((one) => one.getAttribute('aria-keyshortcuts')));
  assert.ok(names.includes('Control+Z'));
  for (const name of names) for (const key of name.split(' ')) assert.match(key, /^((Control|Shift)\+)*([A-Z0-9]|F2|Delete|Insert)$/, name);

  // A thing is chosen from the list.
  const block = (await state(page)).objects.find((object) => object.name === 'tall block');
  await page.locator('#things').selectOption({ label: 'tall block' });
  assert.equal((await state(page)).selected, block.id);
  assert.equal(await page.locator('#things').inputValue(), `object ${block.id}`);

  // Letters switched off do nothing, other keys do what they did; and it is remembered.
  await page.keyboard.press('Escape');
  await page.keyboard.press('h');
  await page.locator('#letters input').focus();
  await page.keyboard.press('Space');
  await page.keyboard.press('Escape');
  const letters = async () => {
    const { camera } = await state(page);
    await page.keyboard.down('w');
    await page.waitForTimeout(250);
    await page.keyboard.up('w');
    await page.keyboard.press('l');
    return JSON.stringify((await state(page)).camera) !== JSON.stringify(camera) || (await state(page)).layer !== 'total';
  };
  assert.equal(await letters(), false);
  await page.keyboard.press('F2');
  assert.equal(await page.locator('#colours [data-value=lux]').getAttribute('aria-checked'), 'true');
  await page.keyboard.press('F2');
  await page.reload();
  await done(page);
  assert.equal(await letters(), false);
  await page.locator('header button[title^=Keys]').click();
  await page.locator('#letters').click();
  await page.keyboard.press('Escape');
  assert.equal(await letters(), true);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('walking leads as far where few pictures are drawn, climbs nothing, and comes out of things', async () => {
  const page = await pages.open(program.url);
  await done(page);
  const walks = await page.evaluate(() => {
    const { app } = window.radiosity;
    const { camera } = app.stage;
    const { navigator } = app;
    const start = camera.position.clone();
    /** Where one comes to, and how high at most, going in a direction for a time. */
    const walk = (from, drive, seconds, frame) => {
      camera.position.copy(from);
      Object.assign(navigator.drive, drive);
      let highest = -Infinity;
      for (let k = 0; k < seconds / frame; k += 1) {
        navigator.update(frame);
        highest = Math.max(highest, camera.position.y);
      }
      Object.assign(navigator.drive, { right: 0, back: 0 });
      return { at: camera.position.toArray(), highest, way: camera.position.distanceTo(from) };
    };
    const forward = { right: 0, back: -1 };
    const [short, long] = [1 / 60, 0.35].map((frame) => walk(start, forward, 0.69, frame));
    // Right before the back wall, as near as nobody walks to it, and at every block.
    const onto = [-1, -0.5, 0, 0.5, 1].map((right) => walk(start, { right, back: -1 }, 8, 0.35));
    const wall = camera.position.clone();
    const hit = app.stage.cast(wall, wall.clone().set(0, 0, -1));
    if (hit) wall.z -= hit.distance - 0.01 * navigator.scale;
    const out = walk(wall, { right: 0, back: 1 }, 1.4, 0.35);
    camera.position.copy(start);
    return { short, long, onto, out, scale: navigator.scale, eye: short.at[1] };
  });
  // Feet come to the floor by and by: on the level alone.
  const apart = Math.hypot(...[0, 2].map((k) => walks.short.at[k] - walks.long.at[k]));
  assert.ok(walks.short.way > 0.5 * walks.scale && apart < 0.1 * walks.scale, `${walks.short.way} ${apart}`);
  for (const { highest } of walks.onto) assert.ok(highest < walks.eye + 0.3 * walks.scale, `${highest}`);
  assert.ok(walks.out.way > 0.5 * walks.scale, `${walks.out.way}`);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
