// What people keep: views and pictures.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { started } from './fixture.mjs';
import { caughtUp, decoded, done, pixels, pixelsOf, slow, state } from './program.mjs';

const { program, pages } = await started();

test('a view is kept, gone back to from elsewhere and on another page, and forgotten', slow, async () => {
  const [one, two] = await Promise.all([pages.open(program.url), pages.open(program.url)]);
  await Promise.all([done(one), done(two)]);
  const cameras = (page) => page.locator('#cameras');
  const unfold = (page) => page.evaluate(() => { document.querySelector('#cameras').open = true; });
  const is = (page, count) => page.waitForFunction((count) => window.radiosity.state().bookmarks.length === count, count);
  const turn = async (page) => {
    await page.evaluate(() => {
      const { stage } = window.radiosity.app;
      stage.camera.position.x += 0.07;
      stage.camera.rotateY(0.4);
      stage.change();
    });
    return (await state(page)).camera;
  };
  await Promise.all([unfold(one), unfold(two)]);
  const corner = await turn(one);
  await one.getByLabel('Name of the camera to keep').fill('The corner');
  await one.keyboard.press('Enter');
  await is(one, 1);
  const other = await turn(one);
  await one.locator('canvas').first().focus();
  await one.keyboard.press('b');
  await is(two, 2);

  // Each goes where it was kept, on both pages; numbers may be rounded on their way.
  for (const [page, name, kept] of [[one, 'The corner', corner], [two, 'View 1', other], [two, 'The corner', corner]]) {
    await turn(page);
    await cameras(page).getByRole('button', { name, exact: true }).click();
    const { camera } = await state(page);
    camera.forEach((x, k) => assert.ok(Math.abs(x - kept[k]) < 1e-5, `${name}: ${camera} ${kept}`));
  }
  await cameras(two).getByRole('button', { name: 'Forget The corner' }).click();
  await is(one, 1);
  assert.equal(await cameras(one).getByRole('button', { name: 'The corner', exact: true }).count(), 0);
  assert.deepEqual((await state(one)).bookmarks.map(({ name }) => name), ['View 1']);
  await cameras(one).getByRole('button', { name: 'Forget View 1' }).click();
  await Promise.all([is(one, 0), is(two, 0)]);
  for (const page of [one, two]) {
    assert.deepEqual(page.faults, []);
    await page.context().close();
  }
});

test('a grid and a working plane are there again when the page is loaded anew', slow, async () => {
  const page = await pages.open(program.url);
  await done(page);
  const again = async () => {
    await page.reload();
    await caughtUp(page);
    const { grid, plane } = await state(page);
    return { grid, plane };
  };
  await page.evaluate(() => window.radiosity.app.measuring.pick(0, -0.9));
  await page.keyboard.press('g');
  const { first, size, count, covered } = (await state(page)).grid;
  const { grid } = await again();
  assert.deepEqual([grid.first, grid.size, grid.count, grid.covered], [first, size, count, covered]);
  await page.waitForFunction(() => window.radiosity.app.measuring.grid.answer?.is_done);
  await page.evaluate(() => {
    const { measuring } = window.radiosity.app;
    measuring.pick(0, -0.9);
    measuring.setPlane(0.1, 0.04);
    measuring.measurePlane();
    measuring.setPlane(0.2, 0.04);
  });
  const { plane } = await again();
  assert.deepEqual([plane.height, plane.border], [0.2, 0.04]);
  await page.waitForFunction(() => window.radiosity.state().plane.is_done);
  assert.equal(await page.getByLabel('Height of the working plane').inputValue(), '0.2');
  const kept = await page.evaluate(() => {
    window.radiosity.app.measuring.clearGrid();
    return [sessionStorage.getItem('radiosity.laid'), localStorage.getItem('radiosity.laid')];
  });
  assert.deepEqual(kept, [null, null]);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});

test('a screenshot is the picture that is seen, with all pixels, and each is a file of its own', slow, async () => {
  const page = await pages.open(program.url);
  await done(page);
  await pixels(page);
  await page.evaluate(() => window.radiosity.app.exposure.set(window.radiosity.state().exposure));
  const files = [];
  for (const number of [1, 2]) {
    const download = page.waitForEvent('download');
    await page.keyboard.press('x');
    const file = await download;
    assert.ok(file.suggestedFilename().endsWith(`-${number}.png`));
    files.push(readFileSync(await file.path()));
  }
  assert.ok(files[0].equals(files[1]));
  const { width, height, at } = await decoded(page, files[0]);
  const size = await page.evaluate(() => ['clientWidth', 'clientHeight'].map((side) => Math.floor(window.radiosity.app.stage.canvas[side] * devicePixelRatio)));
  assert.deepEqual([width, height], size);
  const places = Array.from({ length: 400 }, (_, i) => [((i % 25) + 0.5) / 25, (Math.floor(i / 25) + 0.5) / 16]);
  const seen = (await pixelsOf(page, places)).flatMap((place, i) => (place ? [[place.pixel, at(places[i])]] : []));
  assert.ok(seen.length > 200 && new Set(seen.map(([pixel]) => pixel.join())).size > 50, `${seen.length} places`);
  for (const [pixel, saved] of seen) assert.deepEqual(saved, pixel);
  assert.deepEqual(page.faults, []);
  await page.context().close();
});
