// The few parts that panels are made of.

type Child = Node | string | null;
type Attributes = Record<string, string | number | boolean | ((event: never) => void) | undefined>;

/** An element with attributes and children; functions listen, `false` and `undefined` are left out. */
export function el<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function') element.addEventListener(name, value as EventListener);
    else if (value === true) element.setAttribute(name, '');
    else if (value !== false && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** A key as it is shown to people, as `aria-keyshortcuts` names it. */
function shortcut(key?: string): string | undefined {
  return key?.replace('Ctrl', 'Control').replace('+ −', 'Plus Minus');
}

/** Whether a person is writing in a field: what is not yet said stays. */
function isOpen(input: HTMLInputElement): boolean {
  return input.dataset.open !== undefined;
}

/** What stands in a field, unless a person is writing in it. Browsers put the cursor behind what is put there: in the field that a
 *  person has entered, all of it is selected again, so that what is written next is not added to it. */
export function fill(input: HTMLInputElement, text: string): void {
  if (isOpen(input) || input.value === text) return;
  input.value = text;
  if (document.activeElement === input && input.type === 'number') input.select();
}

/** The same with a number, of so many digits. */
export function fillNumber(input: HTMLInputElement, value: number, digits = 4): void {
  fill(input, String(Number(value.toPrecision(digits))));
}

// A field is open from the first letter until it is said or left.
addEventListener('input', ({ target }) => { (target as HTMLElement).dataset.open = ''; }, { capture: true });
for (const end of ['change', 'focusout']) addEventListener(end, ({ target }) => { delete (target as HTMLElement).dataset?.open; }, { capture: true });

// A number that was emptied, or is none, is what it was: nothing is changed by it.
const numbers = new WeakMap<EventTarget, string>();
const KNOWS_COMMA = (0.5).toLocaleString().includes(',');
const isNumber = (target: EventTarget | null): target is HTMLInputElement => target instanceof HTMLInputElement && target.type === 'number';
addEventListener('beforeinput', (event) => {
  const { target, data } = event;
  if (!isNumber(target)) return;
  if (!isOpen(target)) numbers.set(target, target.value);
  // Where numbers are written with a point browsers drop a comma, and 0,5 would be 5. Of 1.234,5 none knows what it is: nothing is pasted.
  if (KNOWS_COMMA || !data?.includes(',')) return;
  event.preventDefault();
  if (!/[.,].*[.,]/.test(data)) document.execCommand('insertText', false, data.replace(',', '.'));
}, { capture: true });
addEventListener('change', (event) => {
  const { target } = event;
  if (!isNumber(target) || Number.isFinite(target.valueAsNumber)) return;
  target.value = numbers.get(target) ?? '';
  event.stopImmediatePropagation();
}, { capture: true });

/** A button; `key` is the key that does the same. */
export function button(label: string, act: () => void, { key, title, kind = '' }: { key?: string; title?: string; kind?: string } = {}): HTMLButtonElement {
  const help = [title ?? label, key ? `(${key})` : ''].filter(Boolean).join(' ');
  return el('button', { type: 'button', class: kind, title: help, 'aria-keyshortcuts': shortcut(key), click: () => act() }, label);
}

/** A switch. */
export function toggle(label: string, act: (is: boolean) => void, key?: string): HTMLLabelElement & { set(is: boolean): void } {
  const input = el('input', { type: 'checkbox', role: 'switch', 'aria-keyshortcuts': shortcut(key), change: () => act(input.checked) });
  const made = el('label', { class: 'toggle', title: key ? `${label} (${key})` : label }, input, el('i'), el('span', {}, label), key ? el('kbd', {}, key) : null);
  return Object.assign(made, { set: (is: boolean) => { input.checked = is; } });
}

/** A part of the panel that folds. */
export function section(id: string, title: string, open: boolean, ...children: Child[]): HTMLDetailsElement {
  return el('details', { id, open }, el('summary', {}, title), el('div', { class: 'body' }, ...children));
}

/** A slider with a number beside it, in which may be written what the slider does not show. `act` says what the value is then. */
export function slider(
  label: string,
  { min, max, step, unit = '' }: { min: number; max: number; step: number; unit?: string },
  act: (value: number, isLast: boolean) => number,
): HTMLDivElement & { set(value: number): void } {
  const range = el('input', { type: 'range', min, max, step, 'aria-label': label, input: () => give(range, false), change: () => give(range, true) });
  const number = el('input', { type: 'number', step, 'aria-label': `${label}${unit ? `, ${unit}` : ''}`, change: () => give(number, true) });
  const set = (value: number) => {
    const text = String(Number(value.toFixed(2)));
    fill(number, text);
    fill(range, text);
    const share = (100 * (Math.min(max, Math.max(min, value)) - min)) / (max - min);
    range.style.setProperty('--share', `${share}%`);
  };
  const give = (input: HTMLInputElement, isLast: boolean) => set(act(input.valueAsNumber, isLast));
  return Object.assign(el('div', { class: 'slider' }, range, el('span', { class: 'number' }, number, unit ? el('span', { class: 'unit' }, unit) : null)), { set });
}

/** A choice of one of a few, all in sight. */
export function choice<T extends string>(label: string, options: [T, string, string?][], act: (value: T) => void): HTMLDivElement & { set(value: T): void } {
  const buttons = options.map(([value, text, key]) =>
    el('button', {
      type: 'button', role: 'radio', title: key ? `${text} (${key})` : text, 'aria-keyshortcuts': shortcut(key), 'data-value': value, click: () => act(value),
    }, text));
  // One of them is in the order of Tab, and arrows lead to the others, as in every group of radio buttons.
  const set = (value: T) => {
    for (const one of buttons) {
      const is = one.dataset.value === value;
      one.setAttribute('aria-checked', String(is));
      one.tabIndex = is ? 0 : -1;
    }
  };
  const group = el('div', { class: 'choice', role: 'radiogroup', 'aria-label': label }, ...buttons);
  group.addEventListener('keydown', (event) => {
    const way = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!way) return;
    const at = (buttons.indexOf(event.target as HTMLButtonElement) + way + buttons.length) % buttons.length;
    buttons[at].focus();
    act(options[at][0]);
    event.preventDefault();
    event.stopPropagation();
  });
  return Object.assign(group, { set });
}

/** A name and a value. */
export function fact(name: string, value: Child): HTMLDivElement {
  return el('div', { class: 'fact' }, el('span', { class: 'quiet' }, name), el('b', {}, value ?? '–'));
}

/** Linear light to what a colour field holds, and back. */
export function hex(linear: number[]): string {
  const byte = (x: number) => {
    const c = Math.min(1, Math.max(0, x));
    return Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055)).toString(16).padStart(2, '0');
  };
  return `#${linear.map(byte).join('')}`;
}

export function linear(hexadecimal: string): [number, number, number] {
  const one = (at: number) => {
    const s = parseInt(hexadecimal.slice(at, at + 2), 16) / 255;
    return s <= 0.04045 ? s / 12.92 : ((s + 0.055) / 1.055) ** 2.4;
  };
  return [one(1), one(3), one(5)];
}
