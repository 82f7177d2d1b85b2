// How long pages wait, without one: [THING=NAME] node --experimental-websocket latency.mjs PROGRAM [SCENE and options of `view`]...
// Milliseconds from the start of the program and from each change to the first complete update, as a page would receive it.
// What a scene lacks, a lamp or a thing that can be moved, is said and left out. The program ends with this one, whatever happens.
import { spawn } from 'node:child_process';
import { createInterface } from 'node:readline';

const [program, ...options] = process.argv.slice(2);
if (!program) {
  console.error('Which program? node --experimental-websocket latency.mjs PROGRAM [SCENE and options of `view`]...');
  process.exit(2);
}
const begin = performance.now();
const child = spawn(program, ['view', '--json', '--no-open', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
// Whatever ends this, an interrupt too.
process.on('exit', () => child.kill('SIGKILL'));
for (const signal of ['SIGINT', 'SIGTERM']) process.on(signal, () => process.exit(1));

/** Fails when the program or the connection ends. */
let fail;
const broken = new Promise((_, failed) => { fail = (what) => failed(new Error(what)); });
broken.catch(() => {});
child.on('error', (error) => fail(`${program} did not start: ${error.message}`));
child.on('close', (code) => fail(`${program} view ended with ${code}`));

const [objects, lights] = [new Map(), new Map()];
let status = null;
let bytes = 0;
let wake = () => {};
let opened = null;
let lit = null;

/** The connection of a page that looks at all light. */
function connect(url) {
  const socket = new WebSocket(`ws://${url.host}${url.pathname}socket`, { headers: { origin: url.origin } });
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => socket.send(JSON.stringify({ kind: 'layer', layer: 'total', epoch: 1 }));
  socket.onclose = () => fail('the connection was lost');
  socket.onmessage = ({ data }) => {
    if (typeof data === 'string') {
      const notice = JSON.parse(data);
      if (notice.kind === 'object') objects.set(notice.id, notice);
      if (notice.kind === 'light') lights.set(notice.id, notice);
      if (notice.kind === 'caught_up') opened = performance.now() - begin;
      if (notice.kind === 'refused') fail(notice.message);
      if (notice.kind === 'status') {
        status = notice;
        if (status.rays > 0) lit ??= performance.now() - begin;
      }
    } else {
      bytes += data.byteLength;
    }
    wake();
  };
  return socket;
}

const until = async (is) => {
  while (!is()) await Promise.race([new Promise((done) => { wake = done; }), broken]);
};

async function measure() {
  const url = await Promise.race([broken, new Promise((found) => {
    createInterface(child.stdout).on('line', (line) => {
      const event = JSON.parse(line);
      if (event.event === 'listening') found(new URL(event.url));
    });
  })]);
  const listening = performance.now() - begin;
  const socket = connect(url);
  await until(() => opened !== null);
  console.log(`listening after ${listening.toFixed(0)} ms, scene there after ${opened.toFixed(0)} ms`);
  await until(() => status?.is_done);
  const converged = performance.now() - begin;
  console.log(`${status.elements} elements; first light after ${lit.toFixed(0)} ms, done after ${(converged / 1000).toFixed(1)} s`);

  /** Makes changes one after the other; the median of milliseconds that each took, and of bytes that came. */
  const changes = async (name, count, edit) => {
    const [times, sizes, own] = [[], [], []];
    for (let i = 0; i < count; i += 1) {
      await until(() => status.is_done);
      const [before, edits, came] = [performance.now(), status.edits, bytes];
      socket.send(JSON.stringify({ kind: 'edit', edit: edit(i) }));
      await until(() => status.edits > edits && !status.is_following);
      times.push(performance.now() - before);
      sizes.push(bytes - came);
      own.push(status.latency);
    }
    const median = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)];
    console.log(`${name}: ${median(times).toFixed(0)} ms (${Math.min(...times).toFixed(0)} to ${Math.max(...times).toFixed(0)}), ${median(own).toFixed(0)} of them until it is posted, ${(median(sizes) / 1000).toFixed(0)} kB`);
  };

  const light = [...lights.values()].find((light) => !light.deleted);
  if (light) await changes(`dimming '${light.name}'`, 11, (i) => ({ light: { light: light.id, dimming: 0.3 + 0.05 * i, colour: [1, 1, 1] } }));
  else console.log('dimming: there is no light');
  // Walls are painted where there is nothing else; what is large is not moved, as on the page.
  const all = [...objects.values()].filter((object) => !object.deleted);
  const movable = all.filter((object) => object.movable);
  const { THING: wanted } = process.env;
  const named = (list) => list.find((object) => object.name === wanted) ?? list[0];
  if (wanted && !all.some((object) => object.name === wanted)) console.log(`there is no thing '${wanted}'`);
  const painted = named(movable.length > 0 ? movable : all);
  await changes(`painting '${painted.name}'`, 11, (i) => ({ reflectance: { object: painted.id, reflectance: [0.2, 0.3 + 0.03 * i, 0.4] } }));
  const moved = named(movable);
  if (!moved) return console.log('moving: there is no thing that can be moved');
  const group = movable.filter((object) => object.group === moved.group);
  await changes(`moving '${moved.name}'`, 11, (i) => ({
    several: group.map(({ id }) => ({ move: { object: id, matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.02 * (i + 1), 0, 0.01 * (i + 1), 1] } })),
  }));
}

try {
  await measure();
} catch (error) {
  const known = status ? `${status.elements} elements, ${status.rays} of ${status.most_rays} rays, ${status.edits} changes` : 'no light yet';
  console.error(`after ${((performance.now() - begin) / 1000).toFixed(1)} s, ${known}: ${error.message}`);
  process.exitCode = 1;
}
child.kill('SIGINT');
// One that does not end by that is ended with this one.
await Promise.race([new Promise((done) => { child.on('close', done); }), new Promise((done) => { setTimeout(done, 5000); })]);
process.exit();
