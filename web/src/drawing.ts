// Everything on the canvas, from the state alone.

import { distance, place, placed, pointsOf, wrap } from "./geometry";
import { state } from "./state";
import type { Answer, Place, Pose, Scan, Segment } from "./types";
import { toMetres, toPixels, view } from "./view";
import { drawWalls } from "./walls";

const canvas = document.querySelector<HTMLCanvasElement>("#plan")!;
const context = canvas.getContext("2d")!;
const NAMES = ["wall", "off", "before", "point", "unmatched", "missing", "ghost", "robot", "critical", "ok", "ambiguous", "degenerate", "no_match"];
let colours: Record<string, string> = {};
let frame = 0;
export const HANDLE = 46; // px from the robot to its handle
const SMALLEST = 14; // px; an ellipse that is smaller is drawn larger, and says so

export function readColours(): void {
  const style = getComputedStyle(document.documentElement);
  colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

export function resize(): void {
  const box = canvas.getBoundingClientRect();
  Object.assign(view, { width: box.width, height: box.height, ratio: window.devicePixelRatio || 1 });
  canvas.width = Math.round(box.width * view.ratio);
  canvas.height = Math.round(box.height * view.ratio);
  redraw();
}

export function redraw(): void {
  if (!frame) frame = requestAnimationFrame(draw);
}

/** Which colour a pair has: neighbours differ. */
export function pairColour(index: number): string {
  return `hsl(${(index * 137.5) % 360} 70% var-l)`.replace("var-l", matchMedia("(prefers-color-scheme: dark)").matches ? "62%" : "42%");
}

/** The segments of the scan that was sent, in its own frame. */
export function sentSegments(): Segment[] {
  return state.answer?.segments ?? state.sent?.scan.segments ?? [];
}

/** The pose that is shown: the answer's, or that of another place. */
export function shownPose(): Pose | null {
  const { answer, other } = state;
  if (!answer) return null;
  return other >= 0 ? answer.alternatives[other].pose : answer.pose;
}

function draw(): void {
  frame = 0;
  context.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  context.clearRect(0, 0, view.width, view.height);
  context.lineCap = "round";
  if (state.analysis) drawAnalysis(state.analysis.places, state.analysis.spacing);
  drawWalls(context, colours.wall, redraw);
  drawPutUp();
  if (state.analysis && state.pointed?.similar_pose) drawLikeness(state.pointed.pose, state.pointed.similar_pose);
  drawTakenOff();
  if (state.log.length) drawLog();
  const { answer, sent } = state;
  const scan = sent?.scan ?? state.scan;
  if (scan && !state.virtual) drawScan(scan, state.robot, "before", 0.5);
  if (answer && sent) drawAnswer(answer, sent.scan);
  if (scan || state.virtual) drawRobot(state.robot, "robot", true);
}

function drawPutUp(): void {
  for (let k = state.own; k < state.walls.length; k++) line(state.walls[k], colours.robot, 3);
}

function drawTakenOff(): void {
  context.setLineDash([3, 5]);
  for (const k of state.off) line(state.walls[k], colours.off, 4);
  context.setLineDash([]);
}

function line([x1, y1, x2, y2]: Segment, colour: string, width: number): void {
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(...toPixels(x1, y1));
  context.lineTo(...toPixels(x2, y2));
  context.stroke();
}

function drawScan(scan: Scan, pose: Pose, name: string, alpha: number): void {
  context.globalAlpha = alpha;
  context.fillStyle = colours[name];
  for (const [x, y] of pointsOf(scan)) {
    const [px, py] = toPixels(...place(pose, x, y));
    context.fillRect(px - 1.2, py - 1.2, 2.4, 2.4);
  }
  for (const segment of scan.segments ?? []) line(placed(pose, segment), colours[name], 2);
  context.globalAlpha = 1;
}

function drawAnswer(answer: Answer, scan: Scan): void {
  const pose = shownPose();
  for (const k of answer.missing_map) {
    context.setLineDash([8, 6]);
    line(state.walls[state.sentTo[k]], colours.missing, 4);
    context.setLineDash([]);
  }
  if (!pose) return;
  if (state.other >= 0) {
    drawScan({ ...scan, segments: sentSegments() }, pose, "ghost", 0.9);
    drawRobot(pose, "ghost", false);
    return;
  }
  drawScan({ ...scan, segments: undefined }, pose, "point", 0.75);
  const segments = sentSegments();
  for (const k of answer.diagnostics?.critical_wall?.map ?? []) line(state.walls[state.sentTo[k]], colours.critical, 11);
  answer.correspondences.forEach((pair, index) => {
    line(state.walls[state.sentTo[pair.map]], pairColour(index), 2.5);
    line(placed(pose, segments[pair.scan]), pairColour(index), 5);
  });
  for (const k of answer.unmatched_scan) {
    context.setLineDash([2, 6]);
    line(placed(pose, segments[k]), colours.unmatched, 4);
    context.setLineDash([]);
  }
  drawUncertainty(answer, pose);
  drawRobot(pose, answer.usable ? "ok" : answer.status, false);
}

function drawUncertainty(answer: Answer, pose: Pose): void {
  const [px, py] = toPixels(pose.x, pose.y);
  if (answer.unobservable) {
    const [dx, dy] = answer.unobservable;
    context.strokeStyle = colours.degenerate;
    context.lineWidth = 3;
    context.setLineDash([10, 6]);
    context.beginPath();
    context.moveTo(px - 160 * dx, py + 160 * dy);
    context.lineTo(px + 160 * dx, py - 160 * dy);
    context.stroke();
    context.setLineDash([]);
  }
  const c = answer.covariance;
  if (!c) return;
  const mean = (c[0][0] + c[1][1]) / 2;
  const half = Math.hypot((c[0][0] - c[1][1]) / 2, c[0][1]);
  const turn = Math.atan2(2 * c[0][1], c[0][0] - c[1][1]) / 2;
  const [long, short] = [mean + half, Math.max(0, mean - half)].map((v) => 3 * Math.sqrt(v) * view.scale);
  const larger = Math.max(1, SMALLEST / Math.max(long, 1e-6));
  const fan = Math.min(Math.PI, 3 * Math.sqrt(c[2][2]) * larger);
  context.strokeStyle = context.fillStyle = colours.robot;
  context.lineWidth = 1.5;
  context.beginPath();
  context.ellipse(px, py, long * larger, Math.max(2, short * larger), -turn, 0, 2 * Math.PI);
  context.stroke();
  context.globalAlpha = 0.25;
  context.beginPath();
  context.moveTo(px, py);
  context.arc(px, py, 90, -pose.theta - fan, -pose.theta + fan);
  context.fill();
  context.globalAlpha = 1;
}

/** How many times larger than they are the ellipse and the fan are drawn; null where there are none. */
export function enlarged(): number | null {
  const c = state.other < 0 ? state.answer?.covariance : null;
  if (!c) return null;
  const half = Math.hypot((c[0][0] - c[1][1]) / 2, c[0][1]);
  const long = 3 * Math.sqrt((c[0][0] + c[1][1]) / 2 + half) * view.scale;
  return Math.max(1, SMALLEST / Math.max(long, 1e-6));
}

function drawRobot(pose: Pose, name: string, handle: boolean): void {
  const [px, py] = toPixels(pose.x, pose.y);
  const [c, s] = [Math.cos(pose.theta), -Math.sin(pose.theta)];
  context.strokeStyle = context.fillStyle = colours[name];
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(px + 13 * c, py + 13 * s);
  context.lineTo(px - 8 * c - 8 * s, py - 8 * s + 8 * c);
  context.lineTo(px - 8 * c + 8 * s, py - 8 * s - 8 * c);
  context.closePath();
  if (handle) context.stroke();
  else context.fill();
  if (!handle) return;
  context.beginPath();
  context.moveTo(px + 13 * c, py + 13 * s);
  context.lineTo(px + (HANDLE - 5) * c, py + (HANDLE - 5) * s);
  context.stroke();
  context.beginPath();
  context.arc(px + HANDLE * c, py + HANDLE * s, 5, 0, 2 * Math.PI);
  context.fill();
}

function drawAnalysis(places: Place[], spacing: number): void {
  const side = Math.max(2, spacing * view.scale);
  // One that does not see all round has a verdict for each direction that it looks in.
  const directed = places.some((one) => one.pose.theta !== places[0].pose.theta);
  context.globalAlpha = 0.55;
  for (const one of places) {
    const shown = shownOf(one);
    if (!shown) continue;
    const [px, py] = toPixels(one.pose.x, one.pose.y);
    context.fillStyle = colours[kindOf(shown)];
    if (directed) {
      context.beginPath();
      context.moveTo(px, py);
      context.arc(px, py, side / 2, -one.pose.theta - Math.PI / 4, -one.pose.theta + Math.PI / 4);
      context.fill();
    } else context.fillRect(px - side / 2, py - side / 2, side, side);
  }
  context.globalAlpha = 1;
}

/** From a place to another that looks like it. */
function drawLikeness(from: Pose, to: Pose): void {
  context.setLineDash([6, 5]);
  line([from.x, from.y, to.x, to.y], colours.ghost, 2);
  context.setLineDash([]);
  drawRobot(to, "ghost", false);
}

/** What is shown of a place: at once, after a drive, or with what was put up; null where no robot can stand then. */
export function shownOf(one: Place): { status: Answer["status"]; usable: boolean; probability: number | null } | null {
  if (state.show === "landmark") return one.with_landmark;
  if (state.show === "driven" && one.resolved_after !== null) return { ...one, status: "ok", usable: true };
  return one;
}

/** How a place is told; one that is ok but not usable is as good as ambiguous. */
export function kindOf(one: { status: string; usable: boolean }): string {
  return one.status === "ok" && !one.usable ? "ambiguous" : one.status;
}

function drawLog(): void {
  state.log.forEach((one, k) => {
    if (!one.pose) return;
    const [px, py] = toPixels(one.pose.x, one.pose.y);
    context.fillStyle = colours[kindOf(one)];
    context.beginPath();
    context.arc(px, py, k === state.logAt ? 7 : 3, 0, 2 * Math.PI);
    context.fill();
  });
  const here = state.log[state.logAt];
  if (here?.pose) drawRobot(here.pose, kindOf(here), false);
}

/** What is under the mouse, in words; empty where nothing is. */
export function toldAt(px: number, py: number): string {
  const [x, y] = toMetres(px, py);
  const near = 8 / view.scale;
  const { answer } = state;
  const pose = answer?.pose;
  if (answer && pose && state.other < 0) {
    const segments = sentSegments();
    for (const pair of answer.correspondences)
      if (distance(x, y, placed(pose, segments[pair.scan])) < near)
        return (
          `scan ${pair.scan} on wall ${state.sentTo[pair.map]}: ${(1000 * pair.offset).toFixed(1)} mm off, ` +
          `${((180 / Math.PI) * pair.angle).toFixed(2)}° turned, ${Math.round(100 * pair.overlap)} % on it`
        );
    for (const k of answer.unmatched_scan)
      if (distance(x, y, placed(pose, segments[k])) < near) return `scan ${k}: on no wall of the map`;
    for (const k of answer.missing_map)
      if (distance(x, y, state.walls[state.sentTo[k]]) < near) return `wall ${state.sentTo[k]}: should have been seen, and was not`;
  }
  const place = placeAt(x, y);
  if (place) return toldOf(place);
  const wall = wallAt(x, y, near);
  return wall < 0 ? "" : `wall ${wall}${wall >= state.own ? ", put up" : ""}${state.off.has(wall) ? ", taken off" : ""}`;
}

/** Which place of the analysis is there; of several headings that which looks there. */
export function placeAt(x: number, y: number): Place | null {
  const half = (state.analysis?.spacing ?? 0) / 2;
  const here = (state.analysis?.places ?? []).filter((one) => Math.max(Math.abs(one.pose.x - x), Math.abs(one.pose.y - y)) < half);
  const away = (one: Place) => Math.abs(wrap(Math.atan2(y - one.pose.y, x - one.pose.x) - one.pose.theta));
  return here.length > 1 ? here.reduce((a, b) => (away(b) < away(a) ? b : a)) : (here[0] ?? null);
}

function toldOf(one: Place): string {
  const at = ({ x, y }: Pose) => `(${x.toFixed(1)}, ${y.toFixed(1)})`;
  const told = ({ status, usable, probability }: { status: string; usable: boolean; probability: number | null }) =>
    `${status.replace("_", " ")}, ${usable ? "" : "not "}usable${probability === null ? "" : `, ${(100 * probability).toFixed(1)} %`}`;
  const like = one.similar_pose ? `, similar place at ${at(one.similar_pose)}` : "";
  const drive = one.resolved_after ? `; resolved after ${one.resolved_after} m` : "";
  const landmark = one.with_landmark ? `; with the boxes: ${told(one.with_landmark)}` : "";
  return `${at(one.pose)}: ${told(one)}${like}${drive}${landmark}`;
}

/** Which wall is within some metres of a place, -1 for none. */
export function wallAt(x: number, y: number, near: number): number {
  let [found, least] = [-1, near];
  state.walls.forEach((wall, k) => {
    const away = distance(x, y, wall);
    if (away < least) [found, least] = [k, away];
  });
  return found;
}
