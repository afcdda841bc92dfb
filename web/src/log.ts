// A log that was replayed: its poses and verdicts along the way.

import { changed, forget, onChange, state } from "./state";
import type { LogLine } from "./types";

const play = document.querySelector<HTMLButtonElement>("#play")!;
const at = document.querySelector<HTMLInputElement>("#at")!;
const told = document.querySelector<HTMLElement>("#scan-of-log")!;
const PACE = 120; // ms from scan to scan
let timer = 0;

/** Take a file for a log if every line of it is one of a replay; tell whether it is. */
export function openLog(text: string): boolean {
  const lines = text.split("\n").filter((line) => line.trim());
  let found: LogLine[];
  try {
    found = lines.map((line) => JSON.parse(line) as LogLine);
  } catch {
    return false;
  }
  const is_one = (line: LogLine) => line !== null && typeof line === "object" && "status" in line && "stamp" in line && "pose" in line;
  if (!found.length || !found.every(is_one)) return false;
  forget();
  Object.assign(state, { log: found, logAt: 0, scan: null, virtual: false });
  document.querySelector<HTMLDetailsElement>("#log")!.open = true;
  changed();
  return true;
}

function stop(): void {
  clearInterval(timer);
  timer = 0;
  changed();
}

play.addEventListener("click", () => {
  if (timer) return stop();
  if (state.logAt === state.log.length - 1) state.logAt = 0;
  timer = window.setInterval(() => {
    if (state.logAt >= state.log.length - 1) return stop();
    state.logAt += 1;
    changed();
  }, PACE);
  changed();
});
at.addEventListener("input", () => {
  state.logAt = Number(at.value);
  changed();
});

onChange(() => {
  const count = state.log.length;
  play.disabled = at.disabled = count === 0;
  play.textContent = timer ? "Pause" : "Play";
  at.max = String(Math.max(0, count - 1));
  at.value = String(state.logAt);
  const line = state.log[state.logAt];
  if (!line) {
    told.textContent = "";
    return;
  }
  const usable = state.log.filter((one) => one.usable).length;
  const why = line.reasons.map((one) => (typeof one === "string" ? one : one.message)).join(" ");
  told.textContent =
    `Scan ${state.logAt + 1} of ${count}: ${line.status.replace("_", " ")}, ${line.usable ? "usable" : "not usable"}` +
    `${line.probability === null ? "" : `, ${(100 * line.probability).toFixed(1)} %`}. ${why} (${usable} of ${count} are usable.)`;
});
