// The legend below the plan: only what is drawn there now.

import { CODES, colourOf } from "./changes";
import { element, made } from "./dom";
import { enlarged, KINDS, lastPose, otherPose } from "./drawing";
import { kindOf, shownOf } from "./heat";
import { answerHere, onChange, state } from "./state";

const box = element("#legend");

function entries(): [string, string][] {
  const { walls, own, off, log, layers } = state;
  const [answer, other] = [answerHere(), otherPose()];
  const parts: [string, string][] = [];
  if (layers.map) {
    if (state.picture) parts.push(["picture", "imported grid"]);
    if (walls.length) parts.push(["wall", "wall"]);
    if (walls.length > own) parts.push(["added", "added wall"]);
    if (off.size) parts.push(["off", "removed wall"]);
  }
  for (const code of CODES) if (state.proposal?.changes.some((one) => one.code === code)) parts.push([colourOf(code), code]);
  if (state.proposal?.changes.some((one) => !one.accepted)) parts.push(["refused", "refused change"]);
  if (state.virtual) parts.push(["robot", "true pose"]);
  else if (state.scan && !log.length) parts.push(["robot", "initial pose of the scan"]);
  if (other || (state.analysis && state.pointed?.similar_pose)) parts.push(["other", !other ? "similar place" : state.other < 0 ? "best pose on this map" : "alternative"]);
  if (answer && !other) {
    if (layers.correspondences && answer.missing_map.length) parts.push(["missing", "wall that the scan lacks"]);
    if (answer.pose) parts.push(...ofAnswer());
  }
  if (log.length && lastPose()) parts.push(["robot", "last pose"]);
  const kinds = new Set([
    ...(state.analysis?.places ?? []).map(shownOf).flatMap((one) => (one ? [kindOf(one)] : [])),
    ...log.flatMap((one) => (one ? [kindOf(one)] : [])),
  ]);
  for (const kind of KINDS) if (kinds.has(kind)) parts.push([kind, kind.replace("_", " ")]);
  return parts;
}

function ofAnswer(): [string, string][] {
  const { layers, others, sent } = state;
  const answer = state.answer!;
  const parts: [string, string][] = [];
  if (sent?.scan.segments === undefined) {
    if (layers.scan) parts.push(["scan", "measured point"]);
    if (layers.beams) parts.push(["beam", "beam"]);
  }
  if (layers.correspondences) {
    if (answer.correspondences.length) parts.push(["matched", "scan segment on a wall"]);
    if (answer.unmatched_scan.length) parts.push(["unmatched", "scan segment on no wall"]);
    if (answer.diagnostics?.critical_wall) parts.push(["critical", "critical wall"]);
  }
  if (layers.alternatives && others.length) parts.push(["other", "alternative"]);
  const larger = enlarged();
  const drawn = larger === null ? "" : ` with 3 sigma${larger > 1.05 ? `, drawn ${larger.toFixed(0)} times larger` : ""}`;
  parts.push(["estimate", `estimated pose${drawn}${answer.unobservable ? " with the unobservable direction" : ""}`]);
  return parts;
}

export function showLegend(): void {
  box.replaceChildren(...entries().map(([kind, text]) => key(kind, text)));
}

/** A text after a sample of its colour. */
export function key(kind: string, text: string): HTMLElement {
  const item = made("span", { className: `key ${kind}`, textContent: text });
  item.style.setProperty("--colour", `var(--${kind})`);
  return item;
}

onChange(showLegend);
