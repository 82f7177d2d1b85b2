// What each file of tests begins with: one program with a small scene and one browser, which end with it.
import assert from 'node:assert/strict';
import { after } from 'node:test';
import { browser, endAll, SMALL, view } from './program.mjs';

/** The program and the browser of a file's tests. */
export async function started() {
  process.on('exit', endAll);
  const [program, pages] = await Promise.all([view(...SMALL), browser()]);
  after(async () => {
    await pages.close();
    const code = await program.end();
    endAll();
    assert.equal(code, 0, 'Ctrl-C ends it with 0');
  });
  return { program, pages };
}
