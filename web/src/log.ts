// A log: the verdicts of a replay, or scans that are searched here one after the other.

import { ask } from "./asking";
import { changed, forget, forgetMap, onChange, state } from "./state";
import type { ImportedScans, LogLine } from "./types";

const box = document.querySelector<HTMLElement>("#log")!;
const play = document.querySelector<HTMLButtonElement>("#play")!;
const at = document.querySelector<HTMLInputElement>("#at")!;
const text = document.querySelector<HTMLElement>("#scan-of-log")!;
const PACE = 120; // ms from scan to scan
let playing = false;

/** Take a file for a log if every line of it is one of a replay; return whether it is. */
export function openLog(content: string): boolean {
  const lines = content.split("\n").filter((line) => line.trim());
  let found: LogLine[];
  try {
    found = lines.map((line) => JSON.parse(line) as LogLine);
  } catch {
    return false;
  }
  const is_one = (line: LogLine) => line !== null && typeof line === "object" && "status" in line && "stamp" in line && "pose" in line;
  if (!found.length || !found.every(is_one)) return false;
  show({ log: found, scans: [], scan: null });
  return true;
}

/** Show the scans of a log; the first one is searched as soon as there is a map. */
export function openScans({ scans, count, report }: ImportedScans): void {
  show({ log: scans.map(() => null), scans, scan: scans[0] });
  document.querySelector("#about")!.textContent = `${scans.length} of the ${count} scans in ${report.files.join(", ")}. Now open its map.`;
}

function show(log: Partial<typeof state>): void {
  playing = false;
  if (state.example) forgetMap();
  forget();
  Object.assign(state, { ...log, logAt: 0, virtual: false });
  changed();
}

/** Show a scan of the log; where it comes as a scan, search it. */
async function goTo(index: number): Promise<void> {
  state.logAt = index;
  if (state.scans.length) {
    state.scan = state.scans[index];
    forget();
    await ask();
  }
  changed();
}

async function run(): Promise<void> {
  const of = state.log;
  if (state.logAt === of.length - 1) state.logAt = -1;
  while (playing && state.log === of && state.logAt < of.length - 1) {
    await Promise.all([goTo(state.logAt + 1), new Promise((done) => setTimeout(done, PACE))]);
    if (state.scans.length && !state.answer) break; // the verdict card says why
  }
  playing = false;
  changed();
}

play.addEventListener("click", () => {
  playing = !playing;
  if (playing) void run();
  changed();
});
at.addEventListener("input", () => void goTo(Number(at.value)));

/** Note the verdict on the scan that is shown, for the trail of poses. */
function note(): void {
  const { answer, log, logAt, scans } = state;
  if (!answer || !scans.length) return;
  const { status, usable, probability, pose, reasons } = answer;
  log[logAt] = { map_id: state.floors.length ? answer.map?.map_id : null, stamp: scans[logAt].stamp, status, usable, probability, pose, reasons };
}

onChange(() => {
  note();
  const { log, logAt } = state;
  const count = log.length;
  box.hidden = count === 0;
  play.textContent = playing ? "Pause" : "Play";
  at.max = String(Math.max(0, count - 1));
  at.value = String(logAt);
  const line = log[logAt];
  const usable = log.filter((one) => one?.usable).length;
  const searched = log.filter((one) => one).length;
  const verdict = line
    ? `${line.status.replace("_", " ")}, ${line.usable ? "usable" : "not usable"}` +
      `${line.probability === null ? "" : `, ${(100 * line.probability).toFixed(1)} %`}. ` +
      line.reasons.map((one) => (typeof one === "string" ? one : one.message)).join(" ")
    : "not searched yet.";
  text.textContent = `Scan ${logAt + 1} of ${count}: ${verdict} (${usable} of ${searched} are usable.)`;
});
