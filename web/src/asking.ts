// From what is on the page to a request, and its answer back to the page.

import { associate, Problem } from "./api";
import { noisy, takeScan } from "./geometry";
import { asStored, changed, forget, state } from "./state";
import type { Alternative, Answer, Asked } from "./types";
import { showProblem, showWaiting } from "./verdict";

const NEAR = { radius: 1, angle: Math.PI / 6 };
const AS_WELL = 5; // nats, as in association/messages.py: within them another pose fits about as well
const AGAIN = 1000; // ms until the next request to a service that is not ready yet
let running: AbortController | null = null;
let due = 0;

const input = (id: string) => document.querySelector<HTMLInputElement>(id)!;
const options = () => ({ on_map: Number(input("#on-map").value), usable_from: Number(input("#usable-from").value) });

/** The request for what is on the page; null without a map or without a scan. */
export function request(): { asked: Asked; sentTo: number[] } | null {
  if (!state.map) return null;
  const scan = state.virtual
    ? takeScan([...state.walls, ...state.boxes], state.robot, state.laser, state.laser.sigma)
    : state.scan;
  if (!scan) return null;
  const kept = state.walls.map((_, k) => k).filter((k) => !state.off.has(k));
  const map = asStored() ? { map_id: state.mapId! } : { ...state.map, segments: kept.map((k) => state.walls[k]) };
  const several = state.floors.map((map_id) => (map_id === state.mapId ? { ...map, map_id } : { map_id }));
  const asked: Asked = { ...(several.length ? { maps: several } : { map }), scan: noisy(scan, state.noise), options: options() };
  if (input("#near").checked) asked.prior = { ...state.robot, ...NEAR, ...(several.length ? { map_id: state.mapId! } : {}) };
  return { asked, sentTo: kept };
}

/** The alternatives that the message counts; where it counts none, all of them. */
function countedOf({ alternatives, diagnostics }: Answer): Alternative[] {
  const least = (diagnostics?.score ?? Infinity) - AS_WELL;
  const equal = alternatives.filter((one) => one.score >= least);
  return equal.length ? equal : alternatives;
}

/** Send the request; an answer to an earlier request is dropped. Returns whether this one was answered. */
export async function ask(): Promise<boolean> {
  clearTimeout(due);
  const made = request();
  if (!made) {
    showProblem(state.map ? "There is no scan yet. Open one, or simulate one." : "There is no map yet. Open one, or choose an example.");
    return false;
  }
  running?.abort();
  const mine = (running = new AbortController());
  const { mapId: of, scan } = state;
  try {
    const found = await associate(made.asked, mine.signal);
    const answer: Answer = { ...found, unmatched_scan: found.unmatched_scan.map((one) => (typeof one === "number" ? one : one.scan)) };
    const sentTo = state.floors.length && answer.map?.map_id !== of ? [] : made.sentTo;
    Object.assign(state, { answer, sent: made.asked, answered: scan, sentTo, others: countedOf(answer), other: -1 });
  } catch (error) {
    if (mine !== running || (error instanceof DOMException && error.name === "AbortError")) return false;
    forget();
    changed();
    if (error instanceof Problem && error.code === "not_ready") {
      showWaiting(error.message);
      due = window.setTimeout(() => void ask(), AGAIN);
    } else showProblem(error instanceof Problem ? error.message : String(error));
    return false;
  }
  changed();
  return true;
}

/** Send the request soon after a change, once for many; only where this is switched on. */
export function askSoon(): void {
  changed();
  if (!input("#follow").checked || !request()) return;
  clearTimeout(due);
  due = window.setTimeout(() => void ask(), 60);
}
