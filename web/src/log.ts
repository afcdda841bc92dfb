// A log: the verdicts of a replay, or scans that are searched here one after the other.

import { ask } from "./asking";
import { changed, forget, forgetMap, onChange, state } from "./state";
import { codesOf, matching, showFilter } from "./timeline";
import type { ImportedScans, LogLine } from "./types";
import { percent, titleOf } from "./verdict";
import { keepVisible } from "./view";

const box = document.querySelector<HTMLElement>("#log")!;
const play = document.querySelector<HTMLButtonElement>("#play")!;
const at = document.querySelector<HTMLInputElement>("#at")!;
const text = document.querySelector<HTMLElement>("#scan-of-log")!;
const origin = document.querySelector<HTMLElement>("#origin")!;
const PACE = 120; // ms from scan to scan
let playing = false;

/** Take a file for a log if every line of it is one of a replay; return whether it is. */
export function openLog(name: string, content: string): boolean {
  const lines = content.split("\n").filter((line) => line.trim());
  let found: LogLine[];
  try {
    found = lines.map((line) => JSON.parse(line) as LogLine);
  } catch {
    return false;
  }
  const is_one = (line: LogLine) => line !== null && typeof line === "object" && "status" in line && "stamp" in line && "pose" in line;
  if (!found.length || !found.every(is_one)) return false;
  show({ log: found, scans: [], scan: null }, `${found.length} verdicts of ${name}`);
  return true;
}

/** Show the scans of a log; the first one is searched as soon as there is a map. */
export function openScans(name: string, { scans, count }: ImportedScans, most: number): void {
  const some = scans.length < count ? `${scans.length} of the ${count} scans of ${name}, evenly spread: the page reads at most ${most}` : `${count} scans of ${name}`;
  show({ log: scans.map(() => null), scans, scan: scans[0] }, some);
}

function show(log: Partial<typeof state>, from: string): void {
  playing = false;
  if (state.example) forgetMap();
  forget();
  Object.assign(state, { ...log, logAt: 0, filter: "", virtual: false });
  origin.textContent = from;
  if (!state.map) document.querySelector("#about")!.textContent = "Now open the map of the log.";
  changed();
}

/** Show a scan of the log; where it comes as a scan, search it. Returns whether there is a verdict. */
async function goTo(index: number): Promise<boolean> {
  state.logAt = index;
  let answered = true;
  if (state.scans.length) {
    state.scan = state.scans[index];
    answered = await ask();
  }
  const { pose } = state.log[state.logAt] ?? {};
  if (pose) keepVisible(pose.x, pose.y);
  changed();
  return answered;
}

async function run(): Promise<void> {
  const of = state.log;
  let next = matching(state.logAt + 1, 1) ?? matching(0, 1);
  while (playing && state.log === of && next !== null) {
    const [answered] = await Promise.all([goTo(next), new Promise((done) => setTimeout(done, PACE))]);
    if (!answered) break; // the verdict card says why
    next = matching(state.logAt + 1, 1);
  }
  playing = false;
  changed();
}

play.addEventListener("click", () => {
  playing = !playing;
  document.querySelector("aside")!.scrollTop = 0; // to the verdict
  if (playing) void run();
  changed();
});
at.addEventListener("input", () => {
  const [wanted, way] = [Number(at.value), Number(at.value) < state.logAt ? -1 : 1];
  void goTo(matching(wanted, way) ?? matching(wanted, -way) ?? wanted);
});

/** Store the verdict on the scan that is shown. */
function note(): void {
  const { answer, answered, log, logAt, scans } = state;
  if (!answer || !answered || answered !== scans[logAt]) return;
  const { status, usable, probability, pose, reasons } = answer;
  log[logAt] = { map_id: state.floors.length ? answer.map?.map_id : null, stamp: scans[logAt].stamp, status, usable, probability, pose, reasons };
}

/** Show which scan of the log it is, and its verdict in a line. */
function showScan(): void {
  const { log, logAt } = state;
  at.max = String(Math.max(0, log.length - 1));
  at.value = String(logAt);
  const line = log[logAt];
  const verdict = line ? `${titleOf(line)}${line.probability === null ? "" : `, ${percent(line.probability)}`}` : "not searched yet";
  at.setAttribute("aria-valuetext", `scan ${logAt + 1} of ${log.length}: ${verdict}`);
  const usable = log.filter((one) => one?.usable).length;
  const searched = log.filter((one) => one).length;
  const reasons = line?.reasons.length ? `: ${codesOf(line).join(", ").replaceAll("_", " ")}` : "";
  text.textContent = `Scan ${logAt + 1} of ${log.length}: ${verdict}${reasons}. (${usable} of ${searched} are usable.)`;
}

onChange(() => {
  note();
  box.hidden = state.log.length === 0;
  play.textContent = playing ? "Pause" : "Play";
  showScan();
  showFilter();
});
