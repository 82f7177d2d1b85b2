// Lights: on and off, dimming, colour, and new ones.
import type { App } from '../app';
import { LAMPS, type LampKind, solidAngle } from '../lamps';
import { luminance } from '../luminance';
import { readable } from '../scale';
import type { LightNotice } from '../wire';
import { button, el, fill, fillNumber, hex, linear, section, slider } from './parts';

const KINDS = { object: 'Luminous surface', point: 'Point', spot: 'Spot', directional: 'Parallel', sky: 'Sky' };

export function lightsPanel(app: App): HTMLElement {
  const list = el('div', { class: 'list' });
  const rows = new Map<number, Row>();
  const none = el('p', { class: 'quiet' }, 'This scene has no light.');
  const all = el('div', { class: 'row' },
    button('All on', () => app.turnOn(), { title: 'Turn all lights on; after “All off” as they were' }),
    button('All off', () => app.turnOff(), { title: 'Turn all lights off' }));
  const kind = el('select', {
    id: 'lamp-kind', 'aria-label': 'Kind of lamp to add', change: () => { app.adding.lampKind = kind.value as LampKind | 'panel'; },
  }, ...[...LAMPS, ['panel', 'Panel']].map(([value, text]) => el('option', { value }, text)));
  const add = el('div', { class: 'row new-lamp' }, kind, button('Add a lamp', () => app.adding.addLamp(), { key: 'Insert', title: 'Add a lamp where you look: 1000 lm, in rooms for people a panel of 4000 lm on the ceiling above, parallel light of 10 000 lx' }));
  const count = () => {
    const there = [...app.lights.values()].filter(({ deleted }) => !deleted).length;
    // While the scene comes, some may come still.
    none.hidden = there > 0 || !app.isCaughtUp;
    all.hidden = there < 2;
  };
  app.on('lights', () => {
    let next: HTMLElement | null = null;
    for (const light of [...app.lights.values()].reverse()) {
      const old = rows.get(light.id);
      // A copy has another name when the first is gone.
      if (old?.name !== app.lightName(light)) {
        rows.set(light.id, row(app, light.id));
        old?.element.remove();
        list.insertBefore(rows.get(light.id)!.element, next);
      }
      next = rows.get(light.id)!.element;
      rows.get(light.id)!.set(light);
    }
    count();
  });
  app.on('connection', count);
  return section('lights', 'Lights', true, none, add, all, list);
}

/** A light in the list. */
interface Row {
  name: string;
  element: HTMLElement;
  set(light: LightNotice): void;
}

function row(app: App, id: number): Row {
  const light = () => app.lights.get(id)!;
  let gesture: number | null = null;
  let last = 1;
  const during = (isLast: boolean) => {
    gesture ??= app.nextGesture();
    const now = gesture;
    if (isLast) gesture = null;
    return now;
  };
  const name = app.lightName(light());
  /** Dims or turns up as far as lights can be; gives percent. */
  const dim = (wanted: number, gesture?: number) => {
    const dimming = Math.min(MOST_DIMMING, Math.max(0, wanted));
    app.setLight(light(), { dimming }, gesture);
    const most = MOST_DIMMING * undimmed(light());
    if (wanted > dimming) app.refuse(`At most ${MOST_DIMMING} times what the lamp gives before it is dimmed${most > 0 ? `: ${readable(most)} ${measureOf(light())[1]}` : ''}.`);
    if (wanted < dimming) app.refuse('There is no light below 0: it is off.');
    return 100 * dimming;
  };
  const on = el('input', {
    type: 'checkbox', role: 'switch', 'aria-label': `${name} on`,
    change: () => app.setLight(light(), { dimming: on.checked ? last || 1 : 0 }),
  });
  const dimming = slider(`Dimming of ${name}`, { min: 0, max: 200, step: 1, unit: '%' }, (value, isLast) => dim(value / 100, during(isLast)));
  const amount = el('input', {
    type: 'number', min: 0, step: 'any',
    change: () => {
      dim(amount.valueAsNumber / undimmed(light()));
      // What is too much is as much as there can be.
      app.tell('lights');
    },
  });
  const [what, unit] = [el('span', { class: 'quiet grow' }), el('span', { class: 'unit' })];
  const absolute = el('label', { class: 'slider' }, what, el('span', { class: 'number' }, amount, unit));
  const colour = el('input', {
    type: 'color', 'aria-label': `Colour of ${name}, relative to its own`, title: 'Colour, relative to its own; its light in lumens stays',
    input: () => app.setLight(light(), { colour: filter(colour.value) }, during(false)),
    change: () => app.setLight(light(), { colour: filter(colour.value) }, during(true)),
  });
  const find = el('button', {
    type: 'button', class: 'name',
    click: () => (light().object !== null ? app.select(light().object) : app.selectLight(id)),
  }, el('b', {}, name));
  const element = el('div', { class: 'light' },
    el('div', { class: 'row' }, el('label', { class: 'toggle bare' }, on, el('i')), find, colour), dimming, absolute);
  return {
    name,
    element,
    set(now) {
      if (now.dimming > 0) last = now.dimming;
      on.checked = now.dimming > 0;
      find.title = `${KINDS[now.type]}; select it in the scene`;
      element.hidden = now.deleted;
      element.classList.toggle('off', now.dimming === 0);
      dimming.set(100 * now.dimming);
      // A lamp may have become one of another kind.
      [what.textContent, unit.textContent] = measureOf(now);
      amount.setAttribute('aria-label', unit.textContent === 'lm' ? `Luminous flux of ${name}, lumens` : `Illuminance by ${name}, lux`);
      // What gives no light at all cannot be turned up.
      absolute.hidden = undimmed(now) <= 0;
      amount.max = String(MOST_DIMMING * undimmed(now));
      fillNumber(amount, now.dimming * undimmed(now));
      const peak = Math.max(...now.colour, 1e-9);
      fill(colour, hex(now.colour.map((c) => c / peak)));
    },
  };
}

/** As far as lights can be turned up. */
const MOST_DIMMING = 100;

/** Daylight is known by its lux, and what shines by its lumens. */
function measureOf({ type }: LightNotice): [string, string] {
  if (type === 'sky') return ['On open ground', 'lx'];
  return type === 'directional' ? ['Across its rays', 'lx'] : ['All its light', 'lm'];
}

/** Lux by daylight or lumens of what shines in its colour as it is now, before it is dimmed. */
function undimmed({ illuminance, flux, intensity, cone, colour }: LightNotice): number {
  const own = illuminance ?? flux ?? intensity?.map((band) => band * solidAngle(cone));
  return own ? luminance(own.map((band, k) => band * colour[k])) : 0;
}

/** The factor by band that tints light and keeps its luminance. */
function filter(value: string): [number, number, number] {
  const [r, g, b] = linear(value);
  const whole = luminance([r, g, b]);
  return whole > 1e-3 ? [r / whole, g / whole, b / whole] : [1, 1, 1];
}
