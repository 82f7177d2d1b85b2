// The page without a mouse.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { started } from './fixture.mjs';
import { done, pause, picture, pixels, restored, slow, state } from './program.mjs';

const { program, pages } = await started();

test('everything is reached by keyboard alone', slow, async () => {
  const page = await pages.open(program.url);
  await done(page);
  const { camera, status } = await state(page);
  await page.keyboard.down('w');
  await pause(page, 400);
  await page.keyboard.up('w');
  await page.keyboard.down('ArrowRight');
  await pause(page, 200);
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
  // Its numbers are those of the picture until its own rays have come.
  await page.waitForFunction(() => window.radiosity.app.measuring.grid.answer !== null);
  // False colours, isolines, edges and rays: what the panel shows of them, and what is drawn.
  const shown = () => page.evaluate(() => {
    const { app } = window.radiosity;
    const switches = [...document.querySelectorAll('#view [role=switch][aria-keyshortcuts]')].filter(({ ariaKeyShortcuts }) => /^[IET]$/.test(ariaKeyShortcuts));
    const lux = document.querySelector('#colours [data-value=lux]').getAttribute('aria-checked') === 'true';
    return [lux, ...switches.map(({ checked }) => checked), app.marks.wires.size, app.marks.lines?.visible ?? false];
  });
  const count = (await state(page)).objects.filter(({ deleted }) => !deleted).length;
  const steps = [
    ['F2', [true, false, false, false, 0, false]], ['i', [true, true, false, false, 0, false]],
    ['e', [true, true, true, false, count, false]], ['t', [true, true, true, true, count, true]],
    ['F2', [false, true, true, true, count, true]], ['i', [false, false, true, true, count, true]],
    ['e', [false, false, false, true, 0, true]], ['t', [false, false, false, false, 0, false]],
  ];
  const first = await pixels(page);
  let before = first;
  for (const [key, is] of steps) {
    await page.keyboard.press(key);
    // Rays are asked for.
    await page.waitForFunction((is) => is === (window.radiosity.app.marks.lines !== null), is.at(-1));
    assert.deepEqual(await shown(), is, key);
    const after = await pixels(page);
    if (is.every(Boolean)) await picture(page, 'false-colours');
    assert.ok(!before.equals(after), `${key} changes the picture`);
    before = after;
  }
  assert.ok(first.equals(before), 'as before');
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
  await page.waitForFunction(() => window.radiosity.state().lights[0].dimming === 0, undefined, { timeout: 20_000 });
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

test('groups, menus and lists are as keyboards expect them, and keys of one letter can be switched off', slow, async () => {
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
    await pause(page, 250);
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
