// Proposed changes on the plan: old walls dashed, new walls solid, each kind in its colour.

import { distance } from "./geometry";
import { state } from "./state";
import { toPixels, view } from "./view";
import type { Change, ChangeCode, Segment } from "./types";

export const CODES: ChangeCode[] = ["removed", "added", "moved", "extended", "shortened"];
/** The name of the colour of a kind of change, in the style sheet and in the legend. */
export const colourOf = (code: ChangeCode) => `change-${code}`;
const REFUSED = 0.3; // opacity
const [WIDTH, HALO] = [4, 13]; // px
const DASHES = [8, 6];
const LETTERS = 14; // px

type Line = (segment: Segment, colour: string, width: number, dashes?: number[]) => void;

const oldWalls = (one: Change) => one.segments.map((k) => state.walls[k]);
const newWalls = (one: Change) => one.new.map((each) => each.segment);
const lengthOf = ([x1, y1, x2, y2]: Segment) => Math.hypot(x2 - x1, y2 - y1);

/** The mean of the ends of its walls, old and new. */
function middleOf(one: Change): [number, number] {
  const ends = [...oldWalls(one), ...newWalls(one)];
  const middle = (axis: number) => ends.reduce((sum, wall) => sum + wall[axis] + wall[axis + 2], 0) / (2 * ends.length);
  return [middle(0), middle(1)];
}

export function drawChanges(context: CanvasRenderingContext2D, colours: Record<string, string>, line: Line): void {
  state.proposal?.changes.forEach((one, k) => {
    const colour = colours[colourOf(one.code)];
    if (k === state.change) for (const wall of [...oldWalls(one), ...newWalls(one)]) line(wall, colours.critical, HALO);
    context.globalAlpha = one.accepted ? 1 : REFUSED;
    if (one.code !== "extended") for (const wall of oldWalls(one)) line(wall, colour, WIDTH, DASHES);
    for (const wall of newWalls(one)) line(wall, colour, WIDTH);
    context.globalAlpha = 1;
  });
  drawNumbers(context, colours);
}

/** Write the number of each change in the middle of its walls, above small ones, and below the numbers that are there. */
function drawNumbers(context: CanvasRenderingContext2D, colours: Record<string, string>): void {
  const written: [number, number][] = [];
  Object.assign(context, { font: `600 ${LETTERS}px sans-serif`, textAlign: "center", textBaseline: "middle", lineWidth: 4, strokeStyle: colours.paper });
  state.proposal?.changes.forEach((one, k) => {
    const longest = Math.max(...[...oldWalls(one), ...newWalls(one)].map(lengthOf));
    let [x, y] = toPixels(...middleOf(one));
    if (longest * view.scale < 2 * LETTERS) y -= LETTERS;
    while (written.some(([a, b]) => Math.abs(a - x) < LETTERS && Math.abs(b - y) < LETTERS)) y += LETTERS;
    written.push([x, y]);
    context.fillStyle = colours[colourOf(one.code)];
    context.strokeText(`${k}`, x, y);
    context.fillText(`${k}`, x, y);
  });
}

/** The index of the change that is nearest, within some metres; -1 for none. */
export function changeAt(x: number, y: number, near: number): number {
  let [found, least] = [-1, near];
  state.proposal?.changes.forEach((one, k) => {
    for (const wall of [...oldWalls(one), ...newWalls(one)]) {
      const away = distance(x, y, wall);
      if (away < least) [found, least] = [k, away];
    }
  });
  return found;
}

export const counted = (count: number, what: string) => `${count} ${what}${count === 1 ? "" : "s"}`;

/** What has changed, where its number is on the plan, and the lengths of its walls. */
export function titleOf(one: Change): string {
  const [x, y] = middleOf(one).map((part) => part.toFixed(1));
  const metres = (walls: Segment[]) => `${walls.reduce((sum, wall) => sum + lengthOf(wall), 0).toFixed(2)} m`;
  const parts = [one.segments.length ? `${metres(oldWalls(one))} before` : "", one.new.length ? `${metres(newWalls(one))} after` : ""];
  return `${one.code} near (${x}, ${y}): ${parts.filter(Boolean).join(", ")}`;
}

/** 4 digits above 99 %, as 99.99 % and 99.9 % are not the same. */
export const confidenceOf = ({ confidence }: Change) => `${(100 * confidence).toFixed(confidence > 0.99 ? 2 : 0)} %`;

/** The evidence for a change, in a sentence. */
export function evidenceOf(one: Change): string {
  const { beams_through, beams_on, poses, visits, from, to } = one.evidence;
  const beams = [
    beams_through ? `${counted(beams_through, "beam")} pass through the old walls` : "",
    beams_on ? `${counted(beams_on, "beam")} end on the new walls` : "",
  ];
  return `${beams.filter(Boolean).join(", ")}; from ${counted(poses, "place")} on ${counted(visits, "visit")}, ${from} to ${to}. Confidence ${confidenceOf(one)}.`;
}

/** Accept a change that was refused, or refuse one that was accepted. */
export function toggle(k: number): void {
  const one = state.proposal!.changes[k];
  one.accepted = !one.accepted;
}
