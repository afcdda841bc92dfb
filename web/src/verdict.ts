// The verdict in words and numbers, and the alternatives.

import { element, made } from "./dom";
import { degrees } from "./geometry";
import { changed, onChange, state, wallOf } from "./state";
import type { Answer, LogLine, Pose } from "./types";
import { list, sentenceOf, write } from "./words";

const card = element("#verdict");
let notice: { kind: "problem" | "waiting"; message: string } | null = null;

export const showProblem = (message: string) => showNotice("problem", message);
/** Show why the service cannot search yet; the page repeats its request. */
export const showWaiting = (message: string) => showNotice("waiting", message);

function showNotice(kind: "problem" | "waiting", message: string): void {
  notice = { kind, message };
  show();
  notice = null;
}

function show(): void {
  const { answer, log, logAt } = notice ? { answer: null, log: [], logAt: 0 } : state;
  const verdict = answer ?? log[logAt]; // a line of a replay has no answer
  card.dataset.state = notice ? notice.kind : verdict ? (verdict.usable ? "usable" : verdict.status) : "none";
  element("#verdict-title").textContent = notice ? (notice.kind === "problem" ? "Error" : "The service is starting") : verdict ? titleOf(verdict) : "Verdict";
  write(element("#message"), notice?.message ?? (answer ? messageOf(answer) : verdict ? "" : MISSING[state.map ? "search" : state.scan ? "map" : "both"]));
  list(element("#reasons"), [...reasonsOf(verdict), ...(answer?.warnings ?? []).map((one) => sentenceOf(one.code, one.message))]);
  numbers();
  others();
}

const MISSING = { search: "No search yet.", map: "There is a scan and no map yet. Open its map.", both: "Open a map and a scan, or choose an example." };

export const titleOf = ({ status, usable }: { status: string; usable: boolean }) => `${status.replace("_", " ")}, ${usable ? "usable" : "not usable"}`;

/** The sentences of the reasons of an answer, or of a line of a replay, which may have codes alone. */
const reasonsOf = (one: Answer | LogLine | null | undefined) =>
  (one?.reasons ?? []).map((each) => (typeof each === "string" ? sentenceOf(each, each.replaceAll("_", " ")) : sentenceOf(each.code, each.message)));

/** The message of an answer; its reasons are below it. */
const messageOf = ({ message }: Answer) => message.replace(": see `reasons`", "");

function numbers(): void {
  const answer = notice ? null : state.answer;
  const rows: [string, string][] = [];
  if (answer) {
    if (answer.probability !== null) rows.push(["probability", percent(answer.probability)]);
    if (answer.maps && answer.map) rows.push(["map", answer.map.map_id]);
    if (answer.pose) rows.push(["pose", poseText(answer.pose)]);
    const c = answer.covariance;
    if (c) {
      const [x, y, theta] = [0, 1, 2].map((k) => Math.sqrt(Math.max(0, c[k][k])));
      rows.push(["standard deviation", `${(1000 * x).toFixed(1)} mm, ${(1000 * y).toFixed(1)} mm, ${degrees(theta).toFixed(3)}°`]);
    }
    const critical = answer.diagnostics?.critical_wall;
    if (critical) {
      const walls = critical.map.map(wallOf).join(", ");
      rows.push(["critical wall", `${walls}: without it the pose may move by ${critical.displacement.toFixed(2)} m`]);
    }
    const corrections = answer.diagnostics?.corrections;
    if (corrections) {
      const strain = corrections.strain.map((part) => `${(100 * part).toFixed(1)} %`).join(", ");
      rows.push(["corrections", `scale ${corrections.scale.toFixed(4)}, offset ${(100 * corrections.offset).toFixed(1)} cm, strain ${strain}`]);
    }
    const rate = answer.diagnostics?.turn_rate ?? null;
    if (rate !== null) rows.push(["turn rate", `${degrees(rate).toFixed(1)}°/s`]);
    const seen = answer.correspondences.length + answer.unmatched_scan.length;
    rows.push(["correspondences", `${answer.correspondences.length} of ${seen} scan segments`]);
    rows.push(["missing map", `${answer.missing_map.length} walls`]);
    rows.push(["time", `${answer.timing_ms.total.toFixed(1)} ms`]);
  }
  element("#numbers").replaceChildren(...rows.flatMap(([name, value]) => [made("dt", { textContent: name }), made("dd", { textContent: value })]));
}

function others(): void {
  const count = notice ? 0 : state.others.length;
  const shown = state.others[state.other];
  element("#others").hidden = count === 0;
  element("#other").textContent = shown
    ? `Alternative ${state.other + 1} of ${count}: ${shown.map_id ? `map ${shown.map_id}, ` : ""}${shown.probability === null ? "" : `probability ${percent(shown.probability)}, `}pose ${poseText(shown.pose)}`
    : `${count} ${count === 1 ? "alternative" : "alternatives"}`;
}

/** Show the next of the alternatives, and after the last the answer itself. */
export function step(by: number): void {
  const count = state.others.length;
  if (count) state.other = ((state.other + 1 + by + count + 1) % (count + 1)) - 1;
}

for (const [id, by] of [["#before-other", -1], ["#next-other", 1]] as const)
  element(id).addEventListener("click", () => {
    step(by);
    changed();
  });

export const percent = (probability: number) => `${(100 * probability).toFixed(2)} %`;
const poseText = ({ x, y, theta }: Pose) => `${x.toFixed(3)} m, ${y.toFixed(3)} m, ${degrees(theta).toFixed(2)}°`;

onChange(show);
