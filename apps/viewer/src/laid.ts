// What was laid in this tab is there again when the page is loaded anew: where it was picked is kept, and it is laid and measured again.

/** A grid over the picked place, or a working plane above it. */
export interface Laid {
  object: number;
  triangle: number;
  uv: [number, number];
  /** Of a plane, metres. */
  plane?: { height: number; border: number };
}

/** Where it is kept, for the program that this page is of. */
const KEPT = 'radiosity.laid';

/** Keeps what is laid, or that nothing is. */
export function keepLaid(laid: Laid | null): void {
  try {
    if (laid) sessionStorage.setItem(KEPT, JSON.stringify({ ...laid, of: location.pathname }));
    else sessionStorage.removeItem(KEPT);
  } catch {
    // Where nothing may be kept, it is laid until the page is left.
  }
}

/** What was laid last. */
export function keptLaid(): Laid | null {
  try {
    const laid = JSON.parse(sessionStorage.getItem(KEPT) ?? 'null') as (Laid & { of: string }) | null;
    return laid?.of === location.pathname ? laid : null;
  } catch {
    return null;
  }
}
