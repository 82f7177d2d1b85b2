// Places to look from: those of the scene and those that people keep.
import type { App } from '../app';
import { button, el, section } from './parts';

export function camerasPanel(app: App): HTMLElement {
  const list = el('div', { class: 'list' });
  const name = el('input', { type: 'text', maxlength: 80, placeholder: 'Name', 'aria-label': 'Name of the camera to keep' });
  const keep = () => {
    app.keepCamera(name.value.trim() || nextName(app));
    name.value = '';
  };
  const show = () => {
    const rows = [...(app.scene?.cameras ?? []).map((camera) => ({ camera, own: false })), ...app.bookmarks.map((camera) => ({ camera, own: true }))];
    list.replaceChildren(...rows.map(({ camera, own }, i) => el('div', { class: 'row' },
      el('button', { type: 'button', class: 'name', title: 'Look from there', click: () => app.look(camera) }, camera.name || `Camera ${i + 1}`),
      own ? el('button', { type: 'button', class: 'icon', 'aria-label': `Forget ${camera.name}`, title: 'Forget it', click: () => app.forgetCamera(camera.name) }, '×') : null)));
  };
  app.on('scene', show);
  app.on('bookmarks', show);
  return section('cameras', 'Cameras', false, list,
    el('form', { class: 'row', submit: (event: Event) => { event.preventDefault(); keep(); } }, name, button('Keep this view', keep, { key: 'B' })));
}

export function nextName(app: App): string {
  for (let n = 1; ; n += 1) {
    if (!app.bookmarks.some((camera) => camera.name === `View ${n}`)) return `View ${n}`;
  }
}
