// What is measured: at a point, and on a grid.
import type { App } from '../app';
import { luminance } from '../luminance';
import { readable } from '../scale';
import type { Share } from '../wire';
import { button, el, fact, hex, section } from './parts';
import { layerName } from './view';

export function meterPanel(app: App): HTMLElement {
  const none = el('p', { class: 'quiet' }, 'Click a surface, or press Enter for what is under the cross.');
  const lux = el('div', { class: 'big', id: 'lux', 'aria-live': 'polite' });
  const facts = el('div', { class: 'facts' });
  const lights = el('div', { class: 'bars' });
  const surfaces = el('div', { class: 'bars' });
  const body = el('div', {}, lux, facts, el('h3', {}, 'From which light, reflections included'), lights, el('h3', {}, 'From where it arrives'), surfaces);
  app.on('probe', () => {
    const { probed } = app;
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
      fact('Reflectance', el('span', {}, el('i', { class: 'swatch', style: `background:${hex(answer.reflectance)}` }), `${(100 * luminance(answer.reflectance)).toFixed(1)} %`)),
      fact('Radiosity', `${readable(luminance(answer.radiosity))} lm/m²`),
      fact('Luminance', `${readable(luminance(answer.radiosity) / Math.PI)} cd/m²`),
      fact('Place', point.toArray().map((x) => x.toFixed(2)).join(', ') + ' m'),
    );
    lights.replaceChildren(...answer.lights.map(bar));
    surfaces.replaceChildren(...answer.surfaces.map(bar));
  });
  return section('meter', 'Light meter', true, none, body);
}

function bar({ name, share }: Share): HTMLElement {
  return el('div', { class: 'bar' }, el('span', {}, name), el('b', {}, `${(100 * share).toFixed(1)} %`), el('i', { style: `width:${Math.min(100, 100 * share)}%` }));
}

export function gridPanel(app: App): HTMLElement {
  const facts = el('div', { class: 'facts' });
  const layer = el('p', { class: 'warning' });
  const metres = (sides: number[]) => `${sides.map((side) => side.toFixed(2)).join(' × ')} m`;
  const clear = button('Take away', () => app.clearGrid());
  app.on('grid', () => {
    clear.hidden = !app.grid;
    facts.hidden = !app.grid;
    layer.hidden = !app.grid || app.layer === 'total';
    if (!app.grid) return;
    layer.textContent = `Not all light, but the layer that is shown: ${layerName(app, app.layer)}.`;
    const { least, mean, largest, uniformity, points, cell, size, isCoarse } = app.grid;
    facts.replaceChildren(
      fact('Mean', `${readable(mean)} lx`),
      fact('Least', `${readable(least)} lx`),
      fact('Most', `${readable(largest)} lx`),
      fact('Uniformity', uniformity.toFixed(2)),
      fact('Points', String(points.length)),
      fact('Cells', metres(cell) + (isCoarse ? ', coarser than the standard' : '')),
      fact('Surface', metres(size)),
    );
  });
  app.on('view', () => { if (app.grid) app.tell('grid'); });
  return section('grid', 'Measuring grid', false,
    el('p', { class: 'quiet' }, 'Over the whole plane that was picked, in cells no larger than EN 12464-1 asks. It stays there until another is laid.'),
    el('div', { class: 'row' }, button('Lay over the picked surface', () => app.measure(), { key: 'G' }), clear), layer, facts);
}
