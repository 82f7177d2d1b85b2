// What is selected: its paint, its place, copies of it.
import { Vector3 } from 'three';
import type { App } from '../app';
import { sizeOf } from '../forms';
import { turnOf } from '../gizmo';
import { brighter, LAMPS, type LampKind, remade, solidAngle, sunOf } from '../lamps';
import { luminance } from '../luminance';
import { coordinate } from '../scale';
import { button, choice, el, fill, fillNumber, hex, linear, section } from './parts';

/** The most that a surface may reflect: with 1 in a closed room light would never end. */
const MOST = 0.99;

/** A reflectance, or as much of its colour as there may be. */
const most = (reflectance: number[]) => {
  const peak = Math.max(...reflectance);
  return peak > MOST ? reflectance.map((r) => (r * MOST) / peak) : reflectance;
};

/** Ways over the size of the scene that are not asked for: long before, what is moved would be too far from its middle. */
const FAR = 10;

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
    app.paint(app.selected, most(linear(paint.value)), gesture);
    if (isLast) gesture = null;
  };
  const reflectance = el('input', { type: 'number', min: 0, max: 99, step: 1, 'aria-label': 'Mean reflectance, percent', change: () => rescale() });
  const rescale = () => {
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    const wanted = Math.max(0, reflectance.valueAsNumber / 100);
    if (!object) return;
    const now = luminance(object.reflectance);
    const scaled = now > 1e-4 ? object.reflectance.map((r) => (r * wanted) / now) : [wanted, wanted, wanted];
    const painted = most(scaled);
    app.paint(object.id, painted);
    const reached = luminance(painted);
    // One of its bands is full before the mean is.
    if (wanted > reached + 1e-3) app.refuse(`No surface reflects more than 99 % of any colour: ${(100 * reached).toFixed(0)} % is the most of this one. A paler one can have more.`);
    if (reflectance.valueAsNumber < 0) app.refuse('No surface reflects less than nothing: it is black.');
    show();
  };
  const places = ['X', 'Y', 'Z'].map((axis, k) => el('input', {
    type: 'number', step: 0.05, 'aria-label': `${axis}, metres`, title: `${axis}, metres; the middle of its foot`, change: () => put(k),
  }));
  const turn = el('input', { type: 'number', step: 5, 'aria-label': 'Turn about the zenith, degrees', change: () => put(null) });
  const mode = choice('Handles', [['translate', 'Move', 'M'], ['rotate', 'Turn', 'M']], (value) => app.gizmo.setMode(value));
  const copy = button('Duplicate', () => app.adding.duplicate(), { key: 'Ctrl+D' });
  const remove = button('Delete', () => app.adding.delete(), { key: 'Delete', kind: 'danger' });
  const put = (axis: number | null) => {
    const [placed, spot] = [chosen(), app.spot()];
    if (!placed || !spot || !app.scene) return;
    if (axis !== null) {
      const way = new Vector3().setComponent(axis, places[axis].valueAsNumber - app.stage.toScene(spot).getComponent(axis));
      if (way.length() < FAR * app.stage.bounds.getSize(new Vector3()).length()) return app.nudge(way.applyQuaternion(app.stage.root.quaternion), 0, 0, app.stepped());
      app.refuse(`That is far outside of the scene: ${'XYZ'[axis]} is as before.`);
      show();
    } else {
      const angle = ((turn.valueAsNumber - turnOf(placed.matrix, new Vector3(...app.scene.up))) * Math.PI) / 180;
      if (Number.isFinite(angle)) app.nudge(new Vector3(), angle, 0, app.stepped());
    }
  };
  // What makes a lamp without area what it is.
  const lamp = () => (app.selectedLight === null ? undefined : app.lights.get(app.selectedLight));
  const kind = el('select', {
    id: 'kind', 'aria-label': 'Kind of the lamp', title: 'Of another kind it keeps its lumens; parallel light begins with 10 000 lx',
    change: () => { if (lamp()) app.changeLamp(lamp()!, remade(lamp()!, kind.value as LampKind)); },
  }, ...LAMPS.map(([value, text]) => el('option', { value }, text)));
  /** A number that changes the lamp; what is no number is as before. */
  const number = (label: string, title: string, act: (value: number) => void) => {
    const input = el('input', {
      type: 'number', min: 0, step: 'any', 'aria-label': label, title,
      change: () => (lamp() && Number.isFinite(input.valueAsNumber) ? act(input.valueAsNumber) : show()),
    });
    return input;
  };
  const brighten = (intensity: number) => app.changeLamp(lamp()!, { intensity: brighter(lamp()!.intensity!, intensity) });
  const intensity = number('Intensity', 'In the middle of its light, before it is dimmed', brighten);
  const flux = number('Luminous flux, lumens', 'All its light, before it is dimmed', (value) => brighten(value / solidAngle(lamp()!.cone)));
  const unit = el('span', { class: 'unit' });
  const fluxes = el('span', { class: 'pair' }, flux, el('span', { class: 'unit' }, 'lm'));
  const cone = [['Inner', 'As bright as it gets within this angle from its axis'], ['Outer', 'No light beyond this angle from its axis']]
    .map(([name, title], k) => number(`${name} half angle of the cone, degrees`, title, (value) => {
      const angles = [...lamp()!.cone!];
      angles[k] = (value * Math.PI) / 180;
      app.changeLamp(lamp()!, { cone: angles });
    }));
  const cones = el('div', { class: 'field' }, el('span', { class: 'quiet' }, 'Cone'),
    el('span', { class: 'pair' }, cone[0], el('span', { class: 'unit' }, '° to'), cone[1], el('span', { class: 'unit' }, '°')));
  const lighting = el('div', {},
    el('label', { class: 'field' }, el('span', { class: 'quiet' }, 'Kind'), kind),
    el('div', { class: 'field' }, el('span', { class: 'quiet' }, 'Intensity'), el('span', { class: 'pair' }, intensity, unit, fluxes)),
    cones);
  /** Where parallel light comes from, degrees. */
  const sun = () => sunOf(new Vector3().fromArray(lamp()!.direction!).applyQuaternion(app.stage.root.quaternion).normalize());
  const angles = ([
    ['altitude', 'Altitude', 'How high the light stands above the horizon, degrees'],
    ['azimuth', 'Azimuth', 'Where it comes from, degrees clockwise from above: from −Z, or from +Y where +Z is up'],
  ] as const).map(([angle, name, title]) => [angle, name, number(`${name}, degrees`, title, (value) => {
    app.shineFrom(lamp()!, { ...sun(), [angle]: (value * Math.PI) / 180 });
    if (angle === 'altitude' && Math.abs(value) > 90) app.refuse('Light stands at most 90° above the horizon, or below it.');
  })] as const);
  [angles[0][2].min, angles[0][2].max] = ['-90', '90'];
  angles[1][2].removeAttribute('min');
  const standing = el('div', { class: 'numbers' }, ...angles.map(([, name, input]) => el('label', {}, el('span', { class: 'quiet' }, `${name} °`), input)));
  // Lengths of what was added.
  const lengths = ['Width', 'Depth', 'Height'].map((label, k) => el('input', {
    type: 'number', min: 0, step: 0.05, 'aria-label': `${label}, metres`, title: `${label}, metres`, change: () => {
      if (app.adding.parts().length === 0) return;
      const size = sizeOf(app.adding.parts());
      size[k] = lengths[k].valueAsNumber;
      if (size[k] > 0) return app.adding.resize(size);
      app.refuse('A length is more than nothing: it is as before.');
      show();
    },
  }));
  const tilt = el('input', {
    type: 'number', step: 5, 'aria-label': 'Tilt about its own width, degrees', title: 'Tilt about its own width, degrees',
    change: () => (Number.isFinite(tilt.valueAsNumber) && app.adding.parts().length > 0 ? app.nudge(new Vector3(), 0, (tilt.valueAsNumber * Math.PI) / 180 - app.adding.tilt(), app.stepped()) : show()),
  });
  const sizing = el('div', { class: 'numbers' }, ...lengths.map((input, k) => el('label', {}, el('span', { class: 'quiet' }, 'WDH'[k]), input)),
    el('label', {}, el('span', { class: 'quiet' }, 'Tilt °'), tilt));
  /** The thing or the lamp that is selected. */
  const chosen = () => (app.selectedLight !== null ? app.lights.get(app.selectedLight) : app.selected !== null ? app.objects.get(app.selected) : undefined);

  // A list to select from, for those who do not point.
  const list = el('select', {
    id: 'things', 'aria-label': 'Select a thing or a lamp', 'aria-keyshortcuts': 'P Shift+P', change: () => {
      const [kind, id] = list.value.split(' ');
      if (kind === 'object') app.select(Number(id));
      else if (kind === 'light') app.selectLight(Number(id));
      else app.select(null);
    },
  });
  let names = '';
  const offer = () => {
    const things = app.things();
    const now = JSON.stringify(things);
    if (now !== names) {
      const seen = new Map<string, number>();
      list.replaceChildren(el('option', { value: '' }, 'Nothing selected'), ...things.map(({ name, object, light }) => {
        const count = (seen.get(name) ?? 0) + 1;
        seen.set(name, count);
        return el('option', { value: object === undefined ? `light ${light}` : `object ${object}` }, count > 1 ? `${name} (${count})` : name);
      }));
    }
    names = now;
    const group = app.selected === null ? undefined : app.objects.get(app.selected)?.group;
    const first = things.find(({ object }) => object !== undefined && app.objects.get(object)!.group === group);
    list.value = app.selectedLight !== null ? `light ${app.selectedLight}` : first ? `object ${first.object}` : '';
  };
  const moving = el('div', {},
    el('div', { class: 'row' }, mode),
    el('div', { class: 'numbers' }, ...places.map((input, k) => el('label', {}, el('span', { class: 'quiet' }, 'XYZ'[k]), input)),
      el('label', {}, el('span', { class: 'quiet' }, '°'), turn)));
  const fixed = el('div', { class: 'row' }, el('span', { class: 'quiet grow' }, 'Part of the building, so it stays put.'), button('Let it move', () => app.loosen()));
  const painting = el('div', { class: 'row' }, el('span', { class: 'quiet grow' }, 'Reflectance'), paint, reflectance, el('span', { class: 'unit' }, '%'));
  const copying = el('div', { class: 'row' }, copy, remove);
  const body = el('div', {}, name, painting, lighting, standing, sizing, moving, fixed, copying);
  const none = el('p', { class: 'quiet' }, 'Click a thing, press Enter for what is under the cross, or P for one after the other.');

  const show = () => {
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    const light = app.selectedLight === null ? undefined : app.lights.get(app.selectedLight);
    // What it became is on its way: a person may be writing into a field.
    if (object?.deleted) return;
    offer();
    const placed = object ?? light;
    body.hidden = !placed;
    none.hidden = Boolean(placed);
    if (!placed) return;
    name.textContent = object ? object.name || `Object ${object.id + 1}` : app.lightName(light!);
    // The list tells the name of the whole already.
    name.hidden = name.textContent === list.selectedOptions[0]?.text;
    painting.hidden = !object;
    copying.hidden = !app.adding.isCopyable;
    if (object) {
      fill(paint, hex(object.reflectance));
      fill(reflectance, String(Math.round(1000 * luminance(object.reflectance)) / 10));
    }
    standing.hidden = light?.type !== 'directional';
    if (!standing.hidden) {
      const now = sun();
      for (const [angle, , input] of angles) fill(input, String(Number(((now[angle] * 180) / Math.PI).toFixed(1))));
    }
    const parts = app.adding.parts();
    const size = parts.length > 0 ? sizeOf(parts) : [];
    sizing.hidden = size.length === 0;
    if (!sizing.hidden) fill(tilt, String(Math.round((1800 * app.adding.tilt()) / Math.PI) / 10 || 0));
    lengths.forEach((input, k) => {
      input.parentElement!.hidden = k >= size.length;
      if (k < size.length) fillNumber(input, size[k]);
    });
    lighting.hidden = !light?.intensity;
    if (light?.intensity) {
      const candela = luminance(light.intensity);
      kind.value = light.type;
      fillNumber(intensity, candela);
      fillNumber(flux, candela * solidAngle(light.cone));
      unit.textContent = light.type === 'directional' ? 'lx' : 'cd';
      intensity.setAttribute('aria-label', light.type === 'directional' ? 'Illuminance, lux' : 'Intensity, candela');
      // A spot that has no width has no lumens, either.
      fluxes.hidden = light.type === 'directional' || solidAngle(light.cone) === 0;
      cones.hidden = !light.cone;
      light.cone?.forEach((angle, k) => fillNumber(cone[k], (angle * 180) / Math.PI));
    }
    const spot = app.spot();
    // Parallel light has no place.
    moving.hidden = !spot || light?.type === 'directional';
    fixed.hidden = !object || spot !== null;
    if (!spot) return;
    const at = app.stage.toScene(spot);
    places.forEach((input, k) => {
      fill(input, coordinate(at.getComponent(k), 3));
    });
    fill(turn, String(Math.round(10 * turnOf(placed.matrix, new Vector3(...(app.scene?.up ?? [0, 1, 0])))) / 10));
    mode.set(app.gizmo.mode);
  };
  app.on('selection', show);
  app.on('objects', show);
  app.on('lights', offer);
  const add = button('Add a box', () => app.adding.addBox(), { key: 'Shift+Insert', title: 'Add a box, half a metre wide in rooms for people, below the middle of the picture' });
  return section('thing', 'Selected', true, el('div', { class: 'row' }, list, add), none, body);
}
