// What is selected: its paint, its place, copies of it.
import { Vector3 } from 'three';
import type { App } from '../app';
import { turnOf } from '../gizmo';
import { button, choice, el, hex, linear, section } from './parts';

export function thingPanel(app: App): HTMLElement {
  let gesture: number | null = null;
  const name = el('b', { class: 'title' });
  const paint = el('input', {
    type: 'color', 'aria-label': 'Reflectance as a colour',
    input: () => repaint(false), change: () => repaint(true),
  });
  const repaint = (isLast: boolean) => {
    if (app.selected === null) return;
    gesture ??= app.nextGesture();
    app.paint(app.selected, linear(paint.value), gesture);
    if (isLast) gesture = null;
  };
  const reflectance = el('input', { type: 'number', min: 0, max: 99, step: 1, 'aria-label': 'Mean reflectance, percent', change: () => rescale() });
  const rescale = () => {
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    const wanted = reflectance.valueAsNumber / 100;
    if (!object || !(wanted >= 0)) return;
    const now = luminance(object.reflectance);
    const scaled = now > 1e-4 ? object.reflectance.map((r) => (r * wanted) / now) : [wanted, wanted, wanted];
    app.paint(object.id, scaled.map((r) => Math.min(0.99, r)));
  };
  const places = ['X', 'Y', 'Z'].map((axis, k) => el('input', {
    type: 'number', step: 0.05, 'aria-label': `${axis}, metres`, title: `${axis}, metres; the middle of its foot`, change: () => put(k),
  }));
  const turn = el('input', { type: 'number', step: 5, 'aria-label': 'Turn about the zenith, degrees', change: () => put(null) });
  const mode = choice('Handles', [['translate', 'Move', 'M'], ['rotate', 'Turn', 'M']], (value) => app.gizmo.setMode(value));
  const copy = button('Duplicate', () => app.duplicate(), { key: 'Ctrl+D' });
  const remove = button('Delete', () => app.delete(), { key: 'Delete', kind: 'danger' });
  const spot = (): Vector3 => app.stage.toScene(app.middle());
  const put = (axis: number | null) => {
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    if (!object || !app.scene) return;
    if (axis !== null) {
      const way = new Vector3().setComponent(axis, places[axis].valueAsNumber - spot().getComponent(axis));
      if (Number.isFinite(way.lengthSq())) app.nudge(way.applyQuaternion(app.stage.root.quaternion), 0);
    } else {
      const angle = ((turn.valueAsNumber - turnOf(object.matrix, new Vector3(...app.scene.up))) * Math.PI) / 180;
      if (Number.isFinite(angle)) app.nudge(new Vector3(), angle);
    }
  };
  const moving = el('div', {},
    el('div', { class: 'row' }, mode),
    el('div', { class: 'numbers' }, ...places.map((input, k) => el('label', {}, el('span', { class: 'quiet' }, 'XYZ'[k]), input)),
      el('label', {}, el('span', { class: 'quiet' }, '°'), turn)));
  const fixed = el('div', { class: 'row' }, el('span', { class: 'quiet grow' }, 'Large, so it stays put.'), button('Let it move', () => app.loosen()));
  const painting = el('div', { class: 'row' }, el('span', { class: 'quiet grow' }, 'Reflectance'), paint, reflectance, el('span', { class: 'unit' }, '%'));
  const body = el('div', {}, name, painting, moving, fixed, el('div', { class: 'row' }, copy, remove));
  const none = el('p', { class: 'quiet' }, 'Click a thing, or press Enter for what is under the cross.');

  const show = () => {
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    const light = app.selectedLight === null ? undefined : app.lights.get(app.selectedLight);
    body.hidden = !object;
    none.hidden = Boolean(object);
    none.textContent = light ? `${light.name || 'The light'}: drag its handles to move it.` : 'Click a thing, or press Enter for what is under the cross.';
    if (!object) return;
    name.textContent = object.name || `Object ${object.id + 1}`;
    const editing = document.activeElement;
    if (editing !== paint) paint.value = hex(object.reflectance);
    if (editing !== reflectance) reflectance.value = String(Math.round(1000 * luminance(object.reflectance)) / 10);
    moving.hidden = !app.isMovable;
    fixed.hidden = app.isMovable;
    const at = spot();
    places.forEach((input, k) => {
      if (editing !== input) input.value = at.getComponent(k).toFixed(3);
    });
    if (editing !== turn) turn.value = String(Math.round(10 * turnOf(object.matrix, new Vector3(...(app.scene?.up ?? [0, 1, 0])))) / 10);
    mode.set(app.gizmo.mode);
  };
  app.on('selection', show);
  app.on('objects', show);
  return section('thing', 'Selected', true, none, body);
}

function luminance([r, g, b]: number[]): number {
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
