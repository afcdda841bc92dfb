// The analysis as a heat map: the free part of each place's square, in the colour of its verdict.

import { state } from "./state";
import type { Answer, Place, Pose, Segment } from "./types";
import { toPixels } from "./view";

const ASIDE = 1e-4; // rad; rays pass an end of a wall on both sides
let drawn: { of: Place[]; walls: Segment[]; parts: [number, number][][] } | null = null;

export function drawHeat(context: CanvasRenderingContext2D, colours: Record<string, string>): void {
  if (!state.analysis) return;
  const { places, spacing } = state.analysis;
  if (drawn?.of !== places || drawn.walls !== state.walls)
    drawn = { of: places, walls: state.walls, parts: places.map((one) => freePart(one.pose, spacing / 2, state.walls)) };
  // A scanner that does not see all round has a verdict for each heading.
  const directed = hasHeadings(places);
  context.globalAlpha = 0.55;
  places.forEach((one, k) => {
    const shown = shownOf(one);
    if (!shown) return;
    context.save();
    if (directed) sector(context, one.pose, spacing);
    context.fillStyle = colours[kindOf(shown)];
    context.beginPath();
    for (const [x, y] of drawn!.parts[k]) context.lineTo(...toPixels(x, y));
    context.fill();
    context.restore();
  });
  context.globalAlpha = 1;
}

export const hasHeadings = (places: Place[]) => places.some((one) => one.pose.theta !== places[0].pose.theta);

function sector(context: CanvasRenderingContext2D, { x, y, theta }: Pose, reach: number): void {
  context.beginPath();
  context.moveTo(...toPixels(x, y));
  for (const turn of [-Math.PI / 4, 0, Math.PI / 4])
    context.lineTo(...toPixels(x + reach * Math.cos(theta + turn), y + reach * Math.sin(theta + turn)));
  context.clip();
}

/** The part of a square about a place that is visible from there, as a polygon; metres. */
function freePart({ x, y }: Pose, half: number, walls: Segment[]): [number, number][] {
  const corners: Segment[] = [[-half, -half, half, -half], [half, -half, half, half], [half, half, -half, half], [-half, half, -half, -half]];
  const near = walls
    .filter(([a, b, c, d]) => Math.min(a, c) < x + half && Math.max(a, c) > x - half && Math.min(b, d) < y + half && Math.max(b, d) > y - half)
    .map(([a, b, c, d]): Segment => [a - x, b - y, c - x, d - y]);
  const lines = [...corners, ...near];
  const angles = lines.flatMap(([a, b, c, d]) => [Math.atan2(b, a), Math.atan2(d, c)].flatMap((at) => [at - ASIDE, at + ASIDE]));
  // The outline also bends at a wall that leaves the square.
  for (const wall of near) for (const side of corners) angles.push(...crossing(wall, side));
  return angles.sort((a, b) => a - b).map((at) => {
    const [dx, dy] = [Math.cos(at), Math.sin(at)];
    const range = Math.min(...lines.map((line) => along(line, dx, dy)));
    return [x + range * dx, y + range * dy];
  });
}

/** The distance from the origin to a line along a ray, infinite where the ray misses it. */
function along([a, b, c, d]: Segment, dx: number, dy: number): number {
  const [ex, ey] = [c - a, d - b];
  const cross = dx * ey - dy * ex;
  const range = (a * ey - b * ex) / cross;
  const fraction = (a * dy - b * dx) / cross;
  return cross !== 0 && range > 0 && fraction >= 0 && fraction <= 1 ? range : Infinity;
}

/** The direction of the point where two lines cross; empty where they do not. */
function crossing([a, b, c, d]: Segment, [e, f, g, h]: Segment): number[] {
  const cross = (c - a) * (h - f) - (d - b) * (g - e);
  const t = ((e - a) * (h - f) - (f - b) * (g - e)) / cross;
  const u = ((e - a) * (d - b) - (f - b) * (c - a)) / cross;
  return cross !== 0 && t > 0 && t < 1 && u > 0 && u < 1 ? [Math.atan2(b + t * (d - b), a + t * (c - a))] : [];
}

/** The verdict that is shown of a place: from one scan, after a drive, or with the boxes; null where no robot can stand then. */
export function shownOf(one: Place): { status: Answer["status"]; usable: boolean; probability: number | null } | null {
  if (state.show === "landmark") return one.with_landmark;
  if (state.show === "driven" && one.resolved_after !== null) return { ...one, status: "ok", usable: true };
  return one;
}

/** The colour of a verdict; one that is ok but not usable counts as ambiguous. */
export function kindOf(one: { status: string; usable: boolean }): string {
  return one.usable ? "usable" : one.status === "ok" ? "ambiguous" : one.status;
}
