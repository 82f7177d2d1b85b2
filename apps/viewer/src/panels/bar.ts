// The bar above: what is open, how far the solution is, and what is needed most.
import type { App } from '../app';
import { screenshot } from '../files';
import { readable } from '../scale';
import type { StatusNotice } from '../wire';
import { button, choice, el } from './parts';

export function bar(app: App, { help, fold }: { help(): void; fold(): void }): HTMLElement {
  const title = el('b', { class: 'scene' });
  const progress = el('i', { class: 'progress', role: 'progressbar', 'aria-label': 'Solution', 'aria-valuemin': 0, 'aria-valuemax': 100 });
  const sight = el('span', { id: 'in-sight', title: 'How far the picture is off where one looks, edges of shadows and all: measured at 160 places with rays of their own, over the light there, root mean square; smaller elements make it less (--elements). The light meter and grids measure at their own points and are as exact as those' });
  const error = el('span', { class: 'wide', id: 'error', title: 'Noise of the rays of all light together (L2); that elements have a size is not in it' });
  const rays = el('span', { class: 'wide', id: 'rays', title: 'Rays that each element of the surfaces has sent, of those that it will send (--rays)' });
  const left = el('span', { class: 'wide', id: 'left' });
  const mode = choice('How to move', [['walk', 'Walk', 'V'], ['orbit', 'Orbit', 'V']], (value) => app.walk(value));
  const undo = button('↶', () => app.undo(), { key: 'Ctrl+Z', title: 'Undo', kind: 'icon' });
  const redo = button('↷', () => app.redo(), { key: 'Ctrl+Y', title: 'Redo', kind: 'icon' });
  undo.setAttribute('aria-label', 'Undo');
  redo.setAttribute('aria-label', 'Redo');
  const menu = el('div', { class: 'menu', id: 'saves', role: 'menu', 'aria-labelledby': 'save', hidden: true },
    el('button', { type: 'button', role: 'menuitem', tabindex: -1, click: () => { screenshot(app); open(false); } }, 'Screenshot', el('span', { class: 'quiet' }, '.png')),
    download(app, 'Lit model', 'lit.glb', 'Surfaces with the light at their vertices (_IRRADIANCE, lx), for other programs', () => open(false)),
    download(app, 'Edited scene', 'scene.glb', 'The scene as it is now, with its lamps, to be opened and lit again; a sky is not in it', () => open(false)));
  const save = button('Save', () => open(menu.hidden !== false), { title: 'Screenshot, lit model, edited scene' });
  save.id = 'save';
  save.setAttribute('aria-haspopup', 'menu');
  save.setAttribute('aria-expanded', 'false');
  save.setAttribute('aria-controls', 'saves');
  const open = (is: boolean) => {
    menu.hidden = !is;
    save.setAttribute('aria-expanded', String(is));
    if (is) (menu.firstElementChild as HTMLElement).focus();
  };
  document.addEventListener('pointerdown', (event) => {
    if (!menu.hidden && !menu.parentElement!.contains(event.target as Node)) open(false);
  });
  // Whoever goes on with Tab leaves it.
  menu.addEventListener('focusout', ({ relatedTarget }) => {
    if (relatedTarget !== save && !menu.contains(relatedTarget as Node | null)) open(false);
  });
  menu.addEventListener('keydown', (event) => {
    const items = [...menu.children] as HTMLElement[];
    const at = items.indexOf(document.activeElement as HTMLElement);
    if (event.key === 'ArrowDown') items[(at + 1) % items.length].focus();
    else if (event.key === 'ArrowUp') items[(at + items.length - 1) % items.length].focus();
    else if (event.key === 'Home') items[0].focus();
    else if (event.key === 'End') items[items.length - 1].focus();
    else if (event.key === 'Escape' || event.key === 'Tab') {
      // From the button Tab goes on to what comes next.
      save.focus();
      open(false);
      if (event.key === 'Tab') return;
    } else return;
    event.preventDefault();
    event.stopPropagation();
  });
  const panel = button('Panel', fold, { key: 'N', title: 'Show or hide the panel' });
  panel.id = 'fold';

  app.on('scene', () => {
    title.textContent = app.scene?.name ?? '';
    document.title = app.scene ? `${app.scene.name} – radiosity` : 'radiosity';
  });
  app.on('view', () => mode.set(app.navigator.mode));
  app.on('history', () => {
    undo.disabled = app.undoable === null;
    redo.disabled = app.redoable === null;
    undo.title = app.undoable ? `Undo: ${app.undoable} (Ctrl+Z)` : 'Nothing to undo';
    redo.title = app.redoable ? `Redo: ${app.redoable} (Ctrl+Y)` : 'Nothing to redo';
  });
  app.on('sight', () => {
    sight.textContent = app.sight.error === null ? '' : `picture ± ${percent(app.sight.error)}`;
  });
  app.on('status', () => {
    const { status } = app;
    if (!status) return;
    const share = status.is_done ? 100 : Math.min(99, 100 * status.share);
    progress.style.width = `${share}%`;
    progress.setAttribute('aria-valuenow', share.toFixed(0));
    progress.classList.toggle('done', status.is_done);
    rays.textContent = `${status.rays} of ${status.most_rays} rays`;
    // After a change it is known again when all rays are there; the bar does not jump meanwhile.
    const unknown = status.edits > 0 ? 'noise ± …' : 'error not known yet';
    error.textContent = status.error === null ? unknown : `noise ± ${percent(status.error)}`;
    // The time is that of all changes together: of the last alone it would be wrong.
    const took = status.edits > 0 ? 'done' : `done in ${duration(status.seconds)}`;
    left.textContent = status.is_done ? took : remaining(status);
  });
  return el('header', {},
    el('div', { class: 'track' }, progress),
    el('span', { class: 'brand', 'aria-hidden': 'true' }),
    title,
    el('span', { class: 'figures' }, sight, error, rays, left),
    el('span', { class: 'grow' }),
    mode, undo, redo, el('span', { class: 'anchor' }, save, menu),
    button('?', help, { key: 'H', title: 'Keys', kind: 'icon' }),
    panel);
}

/** An error in percent: two digits of it are known. */
export function percent(share: number): string {
  return `${readable(Number((100 * share).toPrecision(2)))} %`;
}

/** How long it will take to where that is known: edges of shadows come after all rays. */
export function remaining({ left, rays, most_rays }: StatusNotice): string {
  return left === null ? '' : `${duration(left)} ${rays < most_rays ? 'to all rays' : 'left'}`;
}

export function duration(seconds: number): string {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 90) return `${Math.round(seconds)} s`;
  return `${Math.round(seconds / 60)} min`;
}

/** A file that the program makes. */
function download(app: App, label: string, file: string, title: string, close: () => void): HTMLElement {
  const click = (event: Event) => {
    close();
    if (app.isConnected) return app.say(`${label}: the program makes the file; the browser says when it is there.`);
    event.preventDefault();
    app.refuse(`${label}: nothing was saved, as the connection to the program was lost.`);
  };
  return el('a', { role: 'menuitem', tabindex: -1, href: file, download: '', title, click }, label, el('span', { class: 'quiet' }, file.slice(file.indexOf('.'))));
}
