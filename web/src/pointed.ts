// The text for the object under the mouse.

import { changeAt, evidenceOf, titleOf } from "./changes";
import { otherPose, sentSegments } from "./drawing";
import { degrees, distance, placed, wrap } from "./geometry";
import { answerHere, state, wallOf } from "./state";
import type { Place, Pose } from "./types";
import { toMetres, view } from "./view";

/** Describe what is there; empty where nothing is. */
export function describe(px: number, py: number): string {
  const [x, y] = toMetres(px, py);
  const near = 8 / view.scale;
  const change = changeAt(x, y, near);
  if (change >= 0) {
    const one = state.proposal!.changes[change];
    return `change ${change}, ${one.accepted ? "accepted" : "refused"}: ${titleOf(one)}. ${evidenceOf(one)}`;
  }
  const answer = answerHere();
  const pose = answer?.pose;
  if (answer && pose && !otherPose()) {
    const segments = sentSegments();
    for (const pair of answer.correspondences)
      if (distance(x, y, placed(pose, segments[pair.scan])) < near)
        return (
          `scan segment ${pair.scan}, wall ${wallOf(pair.map)}: offset ${(1000 * pair.offset).toFixed(1)} mm, ` +
          `angle ${degrees(pair.angle).toFixed(2)}°, overlap ${Math.round(100 * pair.overlap)} %`
        );
    for (const k of answer.unmatched_scan)
      if (distance(x, y, placed(pose, segments[k])) < near) return `scan segment ${k}: without a correspondence`;
    for (const k of answer.missing_map)
      if (distance(x, y, state.walls[wallOf(k)]) < near) return `wall ${wallOf(k)}: should be visible, but the scan lacks it`;
  }
  const place = placeAt(x, y);
  if (place) return describePlace(place);
  const wall = wallAt(x, y, near);
  return wall < 0 ? "" : `wall ${wall}${wall >= state.own ? ", added" : ""}${state.off.has(wall) ? ", removed" : ""}`;
}

/** The place of the analysis that is there; of several headings that which looks there. */
export function placeAt(x: number, y: number): Place | null {
  const half = (state.analysis?.spacing ?? 0) / 2;
  const here = (state.analysis?.places ?? []).filter((one) => Math.max(Math.abs(one.pose.x - x), Math.abs(one.pose.y - y)) < half);
  const away = (one: Place) => Math.abs(wrap(Math.atan2(y - one.pose.y, x - one.pose.x) - one.pose.theta));
  return here.length > 1 ? here.reduce((a, b) => (away(b) < away(a) ? b : a)) : (here[0] ?? null);
}

function describePlace(one: Place): string {
  const at = ({ x, y }: Pose) => `(${x.toFixed(1)}, ${y.toFixed(1)})`;
  const verdict = ({ status, usable, probability }: { status: string; usable: boolean; probability: number | null }) =>
    `${status.replace("_", " ")}, ${usable ? "" : "not "}usable${probability === null ? "" : `, ${(100 * probability).toFixed(1)} %`}`;
  const similar = one.similar_pose ? `, similar place at ${at(one.similar_pose)}` : "";
  const drive = one.resolved_after ? `; resolved after ${one.resolved_after} m` : "";
  const landmark = one.with_landmark ? `; with the boxes: ${verdict(one.with_landmark)}` : "";
  return `${at(one.pose)}: ${verdict(one)}${similar}${drive}${landmark}`;
}

/** The index of the nearest wall within some metres, -1 for none. */
export function wallAt(x: number, y: number, near: number): number {
  let [found, least] = [-1, near];
  state.walls.forEach((wall, k) => {
    const away = distance(x, y, wall);
    if (away < least) [found, least] = [k, away];
  });
  return found;
}
