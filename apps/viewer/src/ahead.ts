// What this page has changed and the server has not said yet. It is shown at once, what the server says meanwhile of
// earlier places of a drag does not pull it back, and it is taken back where the server refuses.

/** Milliseconds after which a change is given up that the server never told: another page's came after it. */
const PATIENCE = 3000;

/** Relative difference of numbers that are the same: the server keeps some in single precision. */
const SAME = 1e-5;

export class Ahead<T extends { id: number }> {
  /** As the server said last. */
  private said = new Map<number, T>();
  /** All that was changed and not said yet, oldest first, each with what was changed before it. */
  private own = new Map<number, { changes: Partial<T>[]; since: number }>();
  /** Shown as this page had changed them, until the server says how they are. */
  private loose = new Set<number>();
  /** The largest number shown. */
  private last = -1;

  /** Things as they are shown, and what shows one. */
  constructor(private shown: Map<number, T>, private show: (thing: T) => void) {}

  /** The server says how a thing is. */
  hear(thing: T): void {
    this.said.set(thing.id, thing);
    this.loose.delete(thing.id);
    // What was changed to and fro is said twice: the first time is not the last.
    const changes = this.own.get(thing.id)?.changes;
    const confirmed = changes?.findIndex((change) => agrees(thing, change)) ?? -1;
    changes?.splice(0, confirmed + 1);
    if (changes?.length === 0) this.own.delete(thing.id);
    this.put(thing.id);
  }

  /** This page has changed one. */
  change(id: number, change: Partial<T>): void {
    const changes = this.own.get(id)?.changes ?? [];
    changes.push({ ...changes.at(-1), ...change });
    this.own.set(id, { changes, since: performance.now() });
    this.put(id);
  }

  /** From now on things are as the server says. */
  forget(): void {
    for (const id of this.own.keys()) this.loose.add(id);
    this.own.clear();
  }

  /** What was changed here and not confirmed is as before. */
  takeBack(): void {
    const ids = new Set([...this.own.keys(), ...this.loose]);
    this.own.clear();
    this.loose.clear();
    for (const id of ids) this.put(id);
  }

  /** Takes back what nobody confirmed for long. */
  expire(): void {
    for (const [id, { since }] of this.own) {
      if (performance.now() - since < PATIENCE) continue;
      this.own.delete(id);
      this.put(id);
    }
  }

  private put(id: number): void {
    const said = this.said.get(id);
    if (!said) return;
    const thing = { ...said, ...this.own.get(id)?.changes.at(-1) };
    // What was changed last comes last to a page that is opened then; lists are by number all the same.
    const later = this.shown.has(id) || id > this.last ? [] : [...this.shown].filter(([other]) => other > id);
    for (const [other] of later) this.shown.delete(other);
    this.shown.set(id, thing);
    for (const [other, same] of later) this.shown.set(other, same);
    this.last = Math.max(this.last, id);
    this.show(thing);
  }
}

function agrees<T>(thing: T, change: Partial<T>): boolean {
  return Object.entries(change).every(([name, value]) => isSame(thing[name as keyof T], value));
}

function isSame(a: unknown, b: unknown): boolean {
  if (Array.isArray(a) && Array.isArray(b)) return a.length === b.length && a.every((x, i) => isSame(x, b[i]));
  if (typeof a === 'number' && typeof b === 'number') return Math.abs(a - b) <= SAME * Math.max(1, Math.abs(a), Math.abs(b));
  return a === b;
}
