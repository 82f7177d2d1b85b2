// Everything by keyboard alone: keys, the list of them, and the cross in the middle that stands for a pointer.
import { Vector3 } from 'three';
import type { App } from './app';
import { screenshot } from './files';
import { nextName } from './panels/cameras';
import { el, toggle } from './panels/parts';
import { shared } from './surface';

/** Keys that act on while they are held. */
const STEADY = ['j', 'k', 'u', 'o', ',', '.', 'home', 'end', 'pageup', 'pagedown', '+', '=', '-', 'c', 'l', 'p'];

/** What each key is for, as it is shown. */
const LIST: [string, [string, string][]][] = [
  ['Move', [
    ['W A S D', 'walk; in orbit, go around'],
    ['↑ ↓ ← →', 'walk and turn'],
    ['R F', 'look up, down'],
    ['Q Z', 'rise, sink'],
    ['Page ↑ ↓', 'look up, down while nothing is selected; with Shift rise, sink'],
    ['Shift', 'faster'],
    ['V', 'walk or orbit'],
    ['Y', 'look with the mouse without pressing; Esc ends'],
    ['C', 'next camera'],
    ['B', 'keep this view'],
  ]],
  ['Look', [
    ['F2', 'false colours in lux'],
    ['I', 'isolines'],
    ['L', 'next layer of light'],
    ['E', 'edges of elements'],
    ['T', 'rays of the picked element'],
    ['+ −', 'exposure'],
    ['0', 'automatic exposure'],
  ]],
  ['Measure and change', [
    ['Enter', 'measure and select what is under the cross'],
    ['P  Shift+P', 'select the next thing or lamp, the one before'],
    ['G  Shift+G', 'grid on the picked surface, on a working plane above it'],
    ['J K', 'move the selected left, right'],
    ['U O', 'move it away, towards you'],
    ['Page ↑ ↓', 'move it up, down'],
    [', .', 'turn it'],
    ['Home End', 'tilt the selected lamp, or what was added'],
    ['M', 'handles: move or turn'],
    ['Insert', 'add a lamp; with Shift a box'],
    ['Ctrl+D', 'duplicate'],
    ['Delete', 'delete'],
    ['Ctrl+Z  Ctrl+Y', 'undo, redo'],
  ]],
  ['Page', [
    ['X', 'screenshot'],
    ['N', 'show or hide the panel'],
    ['Tab', 'to the next control'],
    ['Esc', 'back to the scene; let go'],
    ['H', 'this list'],
  ]],
];

/** Metres and degrees by which a key moves what is selected; finer with Shift. */
const NUDGE = 0.1;
const TURN = 5;

/** Where it is kept that keys of one letter do nothing: who speaks to the machine would set them off (WCAG 2.1.4). */
const LETTERS = 'radiosity.letters';
let lettersAct = remembered() !== 'off';

/** Browsers may refuse to remember anything. */
function remembered(letters?: string): string | null {
  try {
    if (letters) localStorage.setItem(LETTERS, letters);
    return localStorage.getItem(LETTERS);
  } catch {
    return null;
  }
}

/** The list of keys. */
export function helpDialog(): HTMLDialogElement {
  const letters = toggle('Keys of one letter or sign (off: all that they do is in the panel and the bar)', (is) => {
    lettersAct = is;
    remembered(is ? 'on' : 'off');
  });
  letters.id = 'letters';
  letters.set(lettersAct);
  const dialog = el('dialog', { id: 'help', 'aria-label': 'Keys' },
    el('div', { class: 'row' }, el('h2', {}, 'Keys'), el('span', { class: 'grow' }), el('button', { type: 'button', class: 'icon', 'aria-label': 'Close', click: () => dialog.close() }, '×')),
    el('div', { class: 'keys' }, ...LIST.map(([title, keys]) =>
      el('section', {}, el('h3', {}, title), el('dl', {}, ...keys.flatMap(([key, does]) => [el('dt', {}, el('kbd', {}, key)), el('dd', {}, does)]))))),
    letters,
    el('p', { class: 'quiet' }, 'Drag to look around, click to measure and select, turn the wheel to step. On a touch screen: one finger looks, the stick walks.'));
  dialog.addEventListener('click', (event) => {
    if (event.target === dialog) dialog.close();
  });
  return dialog;
}

export function listen(app: App, { help, fold }: { help: HTMLDialogElement; fold(): void }): void {
  const down = new Set<string>();
  const is = (...keys: string[]) => (keys.some((key) => down.has(key)) ? 1 : 0);
  // While nothing is selected that they would move.
  const page = () => is('pageup') - is('pagedown');
  const drive = () => {
    app.navigator.drive = {
      right: is('d') - is('a'),
      up: is('q') - is('z') + (down.has('shift') ? page() : 0),
      back: is('s', 'arrowdown') - is('w', 'arrowup'),
      yaw: is('arrowright') - is('arrowleft'),
      pitch: is('r') - is('f') + (down.has('shift') ? 0 : page()),
      fast: down.has('shift'),
    };
  };
  const held = new Set(['w', 'a', 's', 'd', 'q', 'z', 'r', 'f', 'shift', 'arrowup', 'arrowdown', 'arrowleft', 'arrowright']);
  const right = () => new Vector3(1, 0, 0).applyQuaternion(app.stage.camera.quaternion).setY(0).normalize();
  const away = () => right().cross(new Vector3(0, -1, 0)).negate();

  const acts: Record<string, (event: KeyboardEvent) => void> = {
    v: () => app.walk(app.navigator.mode === 'walk' ? 'orbit' : 'walk'),
    c: () => nextCamera(app),
    b: () => app.keepCamera(nextName(app)),
    f2: () => app.showFalseColours(!app.falseColours),
    i: () => app.showIsolines(!shared.isolines.value),
    l: () => nextLayer(app),
    e: () => app.showEdges(!app.edges),
    t: () => app.measuring.showRays(!app.measuring.raysShown),
    '+': () => app.exposure.set(app.exposure.value + 0.25),
    '=': () => app.exposure.set(app.exposure.value + 0.25),
    '-': () => app.exposure.set(app.exposure.value - 0.25),
    '0': () => app.exposure.automatic(),
    enter: () => app.measuring.pick(0, 0),
    g: (event) => (event.shiftKey ? app.measuring.measurePlane() : app.measuring.measure()),
    p: (event) => app.selectNext(event.shiftKey ? -1 : 1),
    y: () => app.lookFreely(),
    m: () => app.gizmo.setMode(app.gizmo.mode === 'translate' ? 'rotate' : 'translate'),
    delete: () => app.adding.delete(),
    backspace: () => app.adding.delete(),
    insert: (event) => (event.shiftKey ? app.adding.addBox() : app.adding.addLamp()),
    x: () => screenshot(app),
    n: () => fold(),
    h: () => help.showModal(),
    '?': () => help.showModal(),
    escape: () => app.select(null),
    j: (event) => nudge(event, right().multiplyScalar(-size(event))),
    k: (event) => nudge(event, right().multiplyScalar(size(event))),
    u: (event) => nudge(event, away().multiplyScalar(size(event))),
    o: (event) => nudge(event, away().multiplyScalar(-size(event))),
    pageup: (event) => nudge(event, new Vector3(0, size(event), 0)),
    pagedown: (event) => nudge(event, new Vector3(0, -size(event), 0)),
    ',': (event) => nudge(event, new Vector3(), angle(event)),
    '.': (event) => nudge(event, new Vector3(), -angle(event)),
    home: (event) => tilt(event, angle(event)),
    end: (event) => tilt(event, -angle(event)),
  };
  const size = (event: KeyboardEvent) => (event.shiftKey ? 0.1 : 1) * NUDGE * Math.min(1, app.stage.bounds.getSize(new Vector3()).length() / 5);
  // A key that is held is one gesture.
  let gesture = 0;
  const nudge = (event: KeyboardEvent, way: Vector3, turn = 0, tilt = 0) => {
    if (!event.repeat) gesture = app.nextGesture();
    app.nudge(way, turn, tilt, gesture);
  };
  const tilt = (event: KeyboardEvent, by: number) => {
    if (app.selectedLight === null && app.adding.parts().length === 0) app.sayOfSelected('Lamps without area can be tilted, and what was added: select one first.');
    else nudge(event, new Vector3(), 0, by);
  };
  const angle = (event: KeyboardEvent) => ((event.shiftKey ? 0.2 : 1) * TURN * Math.PI) / 180;

  addEventListener('keydown', (event) => {
    const target = event.target as HTMLElement;
    const key = event.key.toLowerCase();
    if (help.open) return;
    const isField = target.matches('input:not([type=checkbox]), select, textarea');
    if (key === 'escape' && target !== app.stage.canvas) {
      app.stage.canvas.focus();
      return;
    }
    // What is held adds, copies and saves once; it moves, tunes and undoes on.
    const goesOn = event.ctrlKey || event.metaKey ? key === 'z' || key === 'y' : held.has(key) || STEADY.includes(key);
    if (event.repeat && !goesOn && !isField) {
      if (event.ctrlKey || event.metaKey ? key === 'd' : acts[key]) event.preventDefault();
      return;
    }
    if (event.ctrlKey || event.metaKey) {
      if (isField && target.matches('[type=text], [type=number]') && (key === 'z' || key === 'y')) return;
      if (key === 'z') (event.shiftKey ? app.redo() : app.undo());
      else if (key === 'y') app.redo();
      else if (key === 'd') app.adding.duplicate();
      else return;
      event.preventDefault();
      return;
    }
    if (isField || event.altKey || (key.length === 1 && key !== ' ' && !lettersAct)) return;
    // What a focused control does itself.
    if (target !== app.stage.canvas && target !== document.body && ['enter', ' ', 'home', 'end', 'pageup', 'pagedown', 'arrowup', 'arrowdown', 'arrowleft', 'arrowright'].includes(key)) return;
    if (held.has(key) || (key.startsWith('page') && app.selected === null && app.selectedLight === null)) {
      down.add(key);
      drive();
      if (key.length > 1 && key !== 'shift') event.preventDefault();
      return;
    }
    const act = acts[key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });
  addEventListener('keyup', (event) => {
    down.delete(event.key.toLowerCase());
    drive();
  });
  addEventListener('blur', () => {
    down.clear();
    drive();
  });
}

let camera = -1;

function nextCamera(app: App): void {
  const all = [...(app.scene?.cameras ?? []), ...app.bookmarks];
  if (all.length === 0) return app.say('There is no camera; B keeps this view as one.', () => app.bookmarks.length === 0);
  camera = (camera + 1) % all.length;
  app.look(all[camera]);
}

function nextLayer(app: App): void {
  const select = document.querySelector<HTMLSelectElement>('#layer')!;
  select.selectedIndex = (select.selectedIndex + 1) % select.options.length;
  app.showLayer(JSON.parse(select.value));
  const { layer } = app;
  app.say(`Layer: ${select.selectedOptions[0].text}.`, () => app.layer === layer);
}
