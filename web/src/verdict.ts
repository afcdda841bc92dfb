// The verdict in words and numbers, and the other poses.

import { enlarged } from "./drawing";
import { changed, onChange, state } from "./state";

const element = <T extends HTMLElement>(id: string) => document.querySelector<T>(id)!;
const card = element("#verdict");
let problem = "";

export function tellProblem(message: string): void {
  problem = message;
  show();
  problem = "";
}

function show(): void {
  const { answer } = state;
  card.dataset.state = problem ? "problem" : answer ? (answer.usable ? "usable" : answer.status) : "none";
  element("#verdict-title").textContent = problem ? "Error" : answer ? title() : "Verdict";
  if (problem || answer) element("#message").textContent = problem || answer!.message;
  else if (state.map) element("#message").textContent = "No search yet.";
  list(element("#reasons"), answer && !problem ? [...answer.reasons, ...answer.warnings].map((one) => one.message) : []);
  numbers();
  others();
  legend();
}

function title(): string {
  const { answer } = state;
  return `${answer!.status.replace("_", " ")}, ${answer!.usable ? "usable" : "not usable"}`;
}

export function list(into: HTMLElement, lines: string[]): void {
  into.replaceChildren(
    ...[...new Set(lines)].map((line) => {
      const item = document.createElement("li");
      item.textContent = line;
      return item;
    }),
  );
}

function numbers(): void {
  const { answer } = state;
  const rows: [string, string][] = [];
  if (answer && !problem) {
    if (answer.probability !== null) rows.push(["probability", `${(100 * answer.probability).toFixed(2)} %`]);
    if (answer.pose) {
      const { x, y, theta } = answer.pose;
      rows.push(["pose", `${x.toFixed(3)} m, ${y.toFixed(3)} m, ${degrees(theta).toFixed(2)}°`]);
    }
    const c = answer.covariance;
    if (c) {
      const [x, y, theta] = [0, 1, 2].map((k) => Math.sqrt(Math.max(0, c[k][k])));
      rows.push(["deviation", `${(1000 * x).toFixed(1)} mm, ${(1000 * y).toFixed(1)} mm, ${degrees(theta).toFixed(3)}°`]);
    }
    const critical = answer.diagnostics?.critical_wall;
    if (critical) {
      const walls = critical.map.map((k) => state.sentTo[k]).join(", ");
      rows.push(["critical wall", `${walls}: without it the pose may move by ${critical.displacement.toFixed(2)} m`]);
    }
    const seen = answer.correspondences.length + answer.unmatched_scan.length;
    rows.push(["matched", `${answer.correspondences.length} of ${seen} segments, ${answer.missing_map.length} walls missing`]);
    rows.push(["took", `${answer.timing_ms.total.toFixed(1)} ms`]);
  }
  element("#numbers").replaceChildren(
    ...rows.flatMap(([name, value]) => {
      const [term, description] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = name;
      description.textContent = value;
      return [term, description];
    }),
  );
}

function others(): void {
  const count = state.answer?.alternatives.length ?? 0;
  element("#others").hidden = count === 0 || problem !== "";
  element("#other").textContent =
    state.other < 0 ? `${count} other ${count === 1 ? "pose" : "poses"}` : `other pose ${state.other + 1} of ${count}${share()}`;
}

function share(): string {
  const [best, one] = [state.answer?.diagnostics?.score, state.answer?.alternatives[state.other]];
  return best && one ? `: score ${Math.round((100 * one.score) / best)} % of the best` : "";
}

/** Show the next of the other poses, and after the last the answer itself. */
export function step(by: number): void {
  const count = state.answer?.alternatives.length ?? 0;
  if (count) state.other = ((state.other + 1 + by + count + 1) % (count + 1)) - 1;
}

for (const [id, by] of [["#before-other", -1], ["#next-other", 1]] as const)
  element(id).addEventListener("click", () => {
    step(by);
    changed();
  });

export function legend(): void {
  const larger = enlarged();
  const parts: [string, string][] = [];
  if (state.answer?.pose) {
    parts.push(["pair", "scan segment on a wall"]);
    if (state.answer.unmatched_scan.length) parts.push(["unmatched", "scan segment on no wall"]);
    if (state.answer.missing_map.length) parts.push(["missing", "wall missing in the scan"]);
    if (state.answer.diagnostics?.critical_wall) parts.push(["critical", "critical wall: without it the pose may move"]);
    parts.push([state.answer.usable ? "ok" : state.answer.status, "estimated pose"]);
    parts.push(state.virtual ? ["robot", "true pose"] : ["before", "initial pose of the scan"]);
    if (state.answer.unobservable) parts.push(["degenerate", "unobservable direction"]);
    if (larger !== null) parts.push(["sigma", `3 sigma${larger > 1.05 ? `, drawn ${larger.toFixed(0)} times larger` : ""}`]);
  }
  if (state.other >= 0) parts.push(["ghost", "other pose"]);
  if (state.analysis || state.log.length)
    for (const kind of ["ok", "ambiguous", "degenerate", "no_match"]) parts.push([kind, kind.replace("_", " ")]);
  element("#legend").replaceChildren(
    ...parts.map(([kind, text]) => {
      const item = document.createElement("span");
      item.className = `key ${kind}`;
      item.textContent = text;
      return item;
    }),
  );
}

const degrees = (radians: number) => (180 / Math.PI) * radians;

onChange(show);
