// What is measured: at a point, and on a grid.
import { isError, type App } from '../app';
import { savePoints } from '../files';
import { open } from '../grid';
import { luminance } from '../luminance';
import { lateness } from '../plane';
import { coordinate, readable } from '../scale';
import type { Share } from '../wire';
import { button, el, fact, fill, hex, section } from './parts';
import { layerName, unitOf } from './view';

export function meterPanel(app: App): HTMLElement {
  const none = el('p', { class: 'quiet' }, 'Click a surface, or press Enter for what is under the cross.');
  const lux = el('div', { class: 'big', id: 'lux', 'aria-live': 'polite' });
  const facts = el('div', { class: 'facts' });
  const lights = el('div', { class: 'bars' });
  const surfaces = el('div', { class: 'bars' });
  const body = el('div', {}, lux, facts, el('h3', {}, 'From which light, reflections included'), lights, el('h3', {}, 'From where it arrives'), surfaces);
  app.on('probe', () => {
    const { probed } = app.measuring;
    body.hidden = !probed;
    none.hidden = Boolean(probed);
    if (!probed) return;
    const { answer } = probed;
    if (!answer) {
      if (!lux.textContent) lux.textContent = '…';
      return;
    }
    lux.replaceChildren(readable(answer.illuminance), el('span', { class: 'unit' }, 'lx'));
    const point = app.stage.toScene(probed.hit.point);
    facts.replaceChildren(
      fact('Noise', `± ${readable(Number(answer.error.toPrecision(2)))} lx`),
      fact('Reflectance', el('span', {}, el('i', { class: 'swatch', style: `background:${hex(answer.reflectance)}` }), `${(100 * luminance(answer.reflectance)).toFixed(1)} %`)),
      fact('Radiosity', `${readable(luminance(answer.radiosity))} lm/m²`),
      fact('Luminance', `${readable(luminance(answer.radiosity) / Math.PI)} cd/m²`),
      fact('Place', `${point.toArray().map((x) => coordinate(x, 2)).join(', ')} m`),
    );
    lights.replaceChildren(...bars(answer.lights));
    surfaces.replaceChildren(...bars(answer.surfaces));
  });
  return section('meter', 'Light meter', true, none, body);
}

/** Parts of a percent that are told. */
const PARTS = 10;

/** Shares as bars. They are rounded so that what is read adds up to what they are together: what is left of those that lose most goes up. */
function bars(shares: Share[]): HTMLElement[] {
  const exact = shares.map(({ share }) => 100 * PARTS * share);
  const parts = exact.map(Math.floor);
  const missing = Math.round(exact.reduce((a, b) => a + b, 0)) - parts.reduce((a, b) => a + b, 0);
  const byLoss = exact.map((_, i) => i).sort((i, j) => exact[j] - parts[j] - (exact[i] - parts[i]));
  for (const i of byLoss.slice(0, missing)) parts[i] += 1;
  return shares.map(({ name, share }, i) => el('div', { class: 'bar' },
    el('span', { title: name }, name), el('b', {}, `${(parts[i] / PARTS).toFixed(1)} %`), el('i', { style: `width:${Math.min(100, 100 * share)}%` })));
}

/** Why a plane may have few points. */
const LITTLE = 'Most of this surface is left out, as it lies beside walls or behind them. What is one object with the walls counts as a wall: furniture needs objects of its own.';

export function gridPanel(app: App): HTMLElement {
  const element = section('grid', 'Measuring grid', false);
  const facts = el('div', { class: 'facts' });
  const warning = el('p', { class: 'warning' });
  const metres = (sides: number[]) => `${sides.map((side) => side.toFixed(2)).join(' × ')} m`;
  const clear = button('Take away', () => app.measuring.clearGrid());
  const csv = button('Save points as CSV', () => savePoints(app));
  const length = (label: string) => el('input', { type: 'number', min: 0, step: 0.05, 'aria-label': `${label}, metres`, change: () => set() });
  const [height, border] = [length('Height of the working plane'), length('Zone along walls that is left out')];
  const set = () => {
    const lengths = [height, border].map((input) => input.valueAsNumber);
    if (lengths.every((metres) => metres >= 0 && metres <= 1000)) app.measuring.setPlane(lengths[0], lengths[1]);
    else {
      app.refuse('Height and zone are metres, 0 or more and at most 1000.');
      app.tell('grid');
    }
  };
  const field = (label: string, input: HTMLElement) =>
    el('label', { class: 'row' }, el('span', { class: 'quiet' }, label), el('span', { class: 'grow' }), input, el('span', { class: 'unit' }, 'm'));
  /** What was laid last, once its numbers have been shown. */
  let shown: object | null = null;
  app.on('grid', () => {
    const { grid, plane } = app.measuring;
    for (const [input, value] of [[height, app.measuring.planeHeight], [border, app.measuring.planeBorder]] as const) {
      fill(input, String(value));
    }
    clear.hidden = !grid && !plane;
    const answer = plane?.answer;
    const isLittle = answer && answer.points.length + answer.covered < answer.walled + answer.beyond;
    warning.textContent = grid && app.layer !== 'total'
      ? `Not all light, but the layer that is shown: ${layerName(app, app.layer)}.`
      : [lateness(app), plane && app.layer !== 'total' ? 'Of all light, whichever layer is shown.' : '', isLittle ? LITTLE : ''].filter(Boolean).join(' ');
    warning.hidden = !warning.textContent;
    const told = grid
      ? { ...grid, covered: grid.points.length - open(grid).length }
      : answer && { ...answer, largest: answer.most, isCoarse: answer.is_coarse };
    csv.hidden = facts.hidden = !told;
    if (!told) return;
    const unit = grid ? unitOf(app.layer) : 'lx';
    const noise = (!grid ? answer : app.layer === 'total' ? grid.answer : null)?.error;
    const { least, mean, largest, uniformity, points, covered, cell, size, isCoarse } = told;
    facts.replaceChildren(
      fact('Mean', `${readable(mean)} ${unit}`),
      fact('Least', `${readable(least)} ${unit}`),
      fact('Most', `${readable(largest)} ${unit}`),
      ...(grid && isError(app.layer) ? [] : [fact('Uniformity', uniformity.toFixed(2))]),
      fact('Points', String(grid ? points.length - covered : points.length)),
      ...(covered > 0 ? [fact('Covered, left out', String(covered))] : []),
      ...(answer?.walled ? [fact('Along walls and what is high or fixed, left out', String(answer.walled))] : []),
      ...(answer?.beyond ? [fact('Behind walls, left out', String(answer.beyond))] : []),
      ...(noise === undefined ? [] : [fact('Noise of a point', `± ${(100 * noise).toPrecision(2)} %`)]),
      fact('Cells', metres(cell) + (isCoarse ? ', coarser than the standard' : '')),
      fact(answer ? 'Plane' : 'Surface', metres(size)),
    );
    const laid = grid ?? plane;
    if (laid === shown) return;
    shown = laid;
    element.open = true;
    element.scrollIntoView({ block: 'nearest' });
  });
  for (const topic of ['view', 'status'] as const) app.on(topic, () => { if (app.measuring.grid || app.measuring.plane) app.tell('grid'); });
  element.lastElementChild!.append(
    el('p', { class: 'quiet' }, 'Cells are no larger than EN 12464-1 asks. A grid stays until another is laid.'),
    el('div', { class: 'row' }, button('Lay over the picked surface', () => app.measuring.measure(), { key: 'G', title: 'Over the whole plane that was picked, each point with rays of its own; layers other than all light as they are shown. Points beneath things are left out' })),
    el('div', { class: 'row' }, button('Working plane above it', () => app.measuring.measurePlane(), { key: 'Shift+G', title: 'In the air above the picked floor, as far as the room goes; points within things are left out' })),
    field('Height above it', height), field('Left out along walls', border),
    warning, facts, el('div', { class: 'row' }, csv, clear));
  return element;
}
