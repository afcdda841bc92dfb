// From what is on the page to a request, and its answer back to the page.

import { associate, Problem, type Asked } from "./api";
import { noisy, takeScan } from "./geometry";
import { asStored, changed, forget, state } from "./state";
import { tellProblem } from "./verdict";

const NEAR = { radius: 1, angle: Math.PI / 6 };
let running: AbortController | null = null;
let due = 0;

const checked = (id: string) => document.querySelector<HTMLInputElement>(id)!.checked;

/** What would be sent now; null while there is no map or no scan. */
export function request(): { asked: Asked; sentTo: number[] } | null {
  if (!state.map) return null;
  const scan = state.virtual
    ? takeScan([...state.walls, ...state.boxes], state.robot, state.laser, state.laser.sigma)
    : state.scan;
  if (!scan) return null;
  const kept = state.walls.map((_, k) => k).filter((k) => !state.off.has(k));
  const map = asStored() ? { map_id: state.mapId! } : { ...state.map, segments: kept.map((k) => state.walls[k]) };
  const asked: Asked = { map, scan: noisy(scan, state.noise) };
  if (checked("#near")) asked.prior = { ...state.robot, ...NEAR };
  return { asked, sentTo: kept };
}

/** Ask the service; an answer that comes after a later question is not shown. */
export async function ask(): Promise<void> {
  clearTimeout(due);
  const made = request();
  if (!made) {
    tellProblem(state.map ? "There is no scan yet. Open one, or switch on the virtual robot." : "There is no map yet. Open one, or choose an example.");
    return;
  }
  running?.abort();
  const mine = (running = new AbortController());
  try {
    const answer = await associate(made.asked, mine.signal);
    Object.assign(state, { answer, sent: made.asked, sentTo: made.sentTo, other: -1 });
  } catch (error) {
    if (mine !== running || (error instanceof DOMException && error.name === "AbortError")) return;
    forget();
    changed();
    tellProblem(error instanceof Problem ? error.message : String(error));
    return;
  }
  changed();
}

/** Ask soon after a change, once for many; only where that is wanted. */
export function askSoon(): void {
  changed();
  if (!checked("#follow") || !request()) return;
  clearTimeout(due);
  due = window.setTimeout(() => void ask(), 60);
}
