// The page of `radiosity view`: puts its parts together and keeps time.
import './style.css';
import { App } from './app';
import { helpDialog, listen } from './keys';
import { gridNumbers, legend, lineNumbers } from './legend';
import { bar, remaining } from './panels/bar';
import { camerasPanel } from './panels/cameras';
import { lightsPanel } from './panels/lights';
import { gridPanel, meterPanel } from './panels/meter';
import { el } from './panels/parts';
import { thingPanel } from './panels/thing';
import { viewPanel } from './panels/view';
import { reading } from './reading';
import { stick } from './stick';
import { tests } from './tests';

/** Farther than this a press is a drag, CSS pixels. */
const CLICK = 5;

/** What is said while there is no connection. */
const LOST = {
  unknown: 'The connection was lost; what is seen is from before. Trying again …',
  silent: 'The program does not answer; what is seen is from before. If it has ended, start it again and open the address that it prints.',
  strange: 'The program of this page has ended, and another was started since: open the address that it printed.',
};

/** On narrower pages the panel begins folded. */
const NARROW = 760;

function start(): void {
  const app = new App();
  const help = helpDialog();
  const fold = () => {
    const isFolded = document.body.classList.toggle('folded');
    document.querySelector('#fold')?.setAttribute('aria-expanded', String(!isFolded));
  };
  const meter = meterPanel(app);
  const panel = el('aside', { class: 'panel', 'aria-label': 'Tools' },
    viewPanel(app), meter, thingPanel(app), lightsPanel(app), gridPanel(app), camerasPanel(app));
  // Who writes another number has read what was said of the last.
  panel.addEventListener('change', ({ target }) => { if ((target as HTMLInputElement).type === 'number') app.say(app.resting); }, { capture: true });
  const doing = el('span', { id: 'doing' });
  // What is read out: only that the solution begins anew or is ready, and not each step of it.
  const told = el('span', { id: 'told', class: 'unseen', role: 'status' });
  const message = el('span', { id: 'message', role: 'alert' });
  const numbers = gridNumbers(app);
  const lines = lineNumbers(app);
  const read = reading(app);
  const cross = el('div', { class: 'cross', 'aria-hidden': 'true' });
  const veil = el('div', { class: 'veil' }, el('p', {}, 'Opening …'));
  const view = el('main', {}, app.stage.canvas, cross, numbers.element, lines.element, read.element, legend(app), stick(app), veil);
  document.body.append(bar(app, { help: () => help.showModal(), fold }), view, panel, el('footer', {}, doing, told, el('span', { class: 'grow' }), message), help);
  if (innerWidth < NARROW) fold();
  listen(app, { help, fold });

  const follow = () => {
    const { status } = app;
    if (!status) return;
    if (!app.isConnected) {
      doing.textContent = LOST[app.lost];
      if (told.textContent !== doing.textContent) told.textContent = doing.textContent;
      return;
    }
    const left = status.is_done ? '' : remaining(status);
    doing.textContent = left ? `${status.doing} · about ${left}` : status.doing;
    const milestone = status.is_done ? 'The light is up to date.' : 'The light is being computed.';
    if (told.textContent !== milestone) told.textContent = milestone;
  };
  app.on('status', follow);
  app.on('connection', follow);
  app.on('message', () => { message.textContent = app.message; });
  app.on('connection', () => {
    veil.hidden = app.isCaughtUp || (app.scene !== null && app.isConnected);
    veil.firstElementChild!.textContent = app.scene && !app.isConnected ? LOST[app.lost] : 'Opening …';
    document.body.classList.toggle('lost', !app.isConnected);
  });

  let pressed: [number, number] | null = null;
  const { canvas } = app.stage;
  canvas.addEventListener('pointerdown', (event) => {
    pressed = event.button === 0 && !app.gizmo.isOver ? [event.clientX, event.clientY] : null;
  });
  canvas.addEventListener('pointerup', (event) => {
    if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > CLICK) return;
    const box = canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const lamp = app.marks.lampAt(x, y);
    // A pointer that is locked points to the middle.
    if (document.pointerLockElement === canvas) app.measuring.pick(0, 0);
    else if (lamp !== null) app.selectLight(lamp);
    else app.measuring.pick((2 * x) / box.width - 1, 1 - (2 * y) / box.height);
    if (lamp === null && app.measuring.probed) meter.scrollIntoView({ block: 'nearest' });
  });
  // The cross shows where a keyboard measures; a pointer has its own.
  addEventListener('keydown', () => document.body.classList.add('by-keys'));
  addEventListener('pointerdown', () => document.body.classList.remove('by-keys'));

  document.addEventListener('pointerlockchange', () => document.body.classList.toggle('locked', document.pointerLockElement === canvas));

  let last = performance.now();
  const tick = (now: number) => {
    // Of a pause no more than this is gone on: one would come out far away.
    const passed = Math.min(350, now - last);
    last = now;
    app.tellNews();
    app.navigator.update(passed / 1000);
    app.exposure.update(now, passed);
    app.stage.draw(now);
    numbers.update();
    lines.update();
    read.update();
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
  canvas.focus();
  Object.assign(window, { radiosity: tests(app) });
}

/** Whether the browser draws in three dimensions. */
function canDraw(): boolean {
  const context = document.createElement('canvas').getContext('webgl2');
  context?.getExtension('WEBGL_lose_context')?.loseContext();
  return context !== null;
}

if (canDraw()) {
  start();
} else {
  document.body.classList.add('folded');
  const asked = 'This browser does not draw in three dimensions here, and the page needs it: switch hardware acceleration or WebGL 2 on in the settings of the browser, or open the address in another one.';
  document.body.append(el('main', {}, el('div', { class: 'veil' }, el('p', { role: 'alert' }, asked))));
}
