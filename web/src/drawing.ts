// Everything on the canvas, from the state alone.

import { CODES, colourOf, drawChanges } from "./changes";
import { arrow, element, sized } from "./dom";
import { beamsOf, place, placed, pointsOf } from "./geometry";
import { drawGrid, drawPicture } from "./ground";
import { drawHeat, kindOf } from "./heat";
import { answerHere, boundsOf, state, wallOf } from "./state";
import type { Answer, Pose, Scan, Segment } from "./types";
import { FADED, passes } from "./timeline";
import { fit, toPixels, view } from "./view";
import { drawWalls } from "./walls";

const canvas = element<HTMLCanvasElement>("#plan");
const context = canvas.getContext("2d")!;
/** Everything that has a colour of its own, in the style sheet and in the legend. */
const NAMES = ["paper", "grid", "wall", "off", "added", "robot", "scan", "beam", "matched", "unmatched", "missing", "critical", "estimate", "other"];
export const KINDS = ["usable", "ambiguous", "degenerate", "no_match"];
export let colours: Record<string, string> = {};
let frame = 0;
const FRONT = 13; // px from the robot to its front
export const HANDLE = 46; // px from the robot to its handle
const SMALLEST = 14; // px; a smaller ellipse is drawn larger, which the legend states

export function readColours(): void {
  const style = getComputedStyle(document.documentElement);
  colours = Object.fromEntries([...NAMES, ...KINDS, ...CODES.map(colourOf)].map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

/** Take the size of the canvas; a map that is fitted stays so. */
export function resize(): void {
  const [{ x, y, scale }, bounds] = [view, boundsOf(state.walls)];
  fit(bounds);
  const fitted = view.x === x && view.y === y && view.scale === scale;
  Object.assign(view, { x, y, scale });
  const box = canvas.getBoundingClientRect();
  Object.assign(view, { width: box.width, height: box.height, ratio: window.devicePixelRatio || 1 });
  sized(canvas, box.width, box.height);
  if (fitted) fit(bounds);
  redraw();
}

export function redraw(): void {
  if (!frame) frame = requestAnimationFrame(draw);
}

/** The segments of the scan that was sent, in its own frame. */
export function sentSegments(): Segment[] {
  const { answer, sent } = state;
  // A scan of one view is in the frame of the robot, and its segments are one list for each view.
  const found = (answer?.segments ?? sent?.scan.segments ?? []) as Segment[] | Segment[][];
  return Array.isArray(found[0]?.[0]) ? (found as Segment[][]).flat() : (found as Segment[]);
}

function draw(): void {
  frame = 0;
  context.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  context.clearRect(0, 0, view.width, view.height);
  context.lineCap = "round";
  if (state.layers.map) drawPicture(context);
  drawHeat(context, colours);
  drawGrid(context, colours.grid);
  if (state.layers.map) drawMap();
  drawChanges(context, colours, line);
  const { answer, sent, pointed } = state;
  if (state.analysis && pointed?.similar_pose) drawSimilar(pointed.pose, pointed.similar_pose);
  if (state.log.length) drawLog();
  const scan = sent?.scan ?? state.scan;
  if (scan && !state.virtual && !state.log.length) drawScan(scan, state.robot, "robot", 0.35);
  if (answer && sent) drawAnswer(sent.scan);
  if ((scan && !state.log.length) || state.virtual) drawRobot(state.robot, "robot", true);
}

function drawMap(): void {
  drawWalls(context, colours.wall, redraw);
  drawPoints();
  for (let k = state.own; k < state.walls.length; k++) line(state.walls[k], colours.added, 3);
  for (const k of state.off) line(state.walls[k], colours.off, 4, [3, 5]);
}

function drawPoints(): void {
  const half = Math.max(0.75, (state.map?.points_sigma ?? 0.05) * view.scale); // px
  context.fillStyle = colours.wall;
  for (const [x, y] of state.map?.points ?? []) {
    const [px, py] = toPixels(x, y);
    context.fillRect(px - half, py - half, 2 * half, 2 * half);
  }
}

function line([x1, y1, x2, y2]: Segment, colour: string, width: number, dashes: number[] = []): void {
  context.setLineDash(dashes);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  context.moveTo(...toPixels(x1, y1));
  context.lineTo(...toPixels(x2, y2));
  context.stroke();
  context.setLineDash([]);
}

function drawScan(scan: Scan, pose: Pose, name: string, alpha: number): void {
  if (state.layers.beams) for (const beam of beamsOf(scan)) line(placed(pose, beam), colours.beam, 1);
  if (!state.layers.scan) return;
  context.globalAlpha = alpha;
  context.fillStyle = colours[name];
  for (const [x, y] of pointsOf(scan)) {
    const [px, py] = toPixels(...place(pose, x, y));
    context.fillRect(px - 1.2, py - 1.2, 2.4, 2.4);
  }
  for (const segment of scan.segments ?? []) line(placed(pose, segment), colours[name], 2);
  context.globalAlpha = 1;
}

/** The pose that is shown in place of the answer: an alternative, or the best on a map that is not the answer's. */
export function otherPose(): Pose | null {
  const { others, other, floors, mapId, answer } = state;
  const chosen = others[other];
  if (chosen && (!floors.length || chosen.map_id === mapId)) return chosen.pose;
  return answerHere() ? null : (answer?.maps?.find((one) => one.map_id === mapId)?.pose ?? null);
}

function drawAnswer(scan: Scan): void {
  const [other, answer] = [otherPose(), answerHere()];
  if (other) {
    drawScan({ ...scan, segments: sentSegments() }, other, "other", 0.9);
    drawRobot(other, "other", false);
  }
  if (other || !answer) return;
  const { layers, others } = state;
  const { pose } = answer;
  const segments = sentSegments();
  if (layers.correspondences) for (const k of answer.missing_map) line(state.walls[wallOf(k)], colours.missing, 4, [8, 6]);
  if (!pose) return;
  if (layers.correspondences) for (const k of answer.diagnostics?.critical_wall?.map ?? []) line(state.walls[wallOf(k)], colours.critical, 12);
  drawScan({ ...scan, segments: undefined }, pose, "scan", 0.75);
  if (layers.correspondences) {
    for (const pair of answer.correspondences) line(placed(pose, segments[pair.scan]), colours.matched, 5);
    for (const k of answer.unmatched_scan) line(placed(pose, segments[k]), colours.unmatched, 4, [2, 6]);
  }
  if (layers.alternatives) for (const one of others) if (onPlan(one)) drawRobot(one.pose, "other", false);
  drawUncertainty(answer, pose);
  drawRobot(pose, "estimate", false);
}

function drawUncertainty(answer: Answer, pose: Pose): void {
  const [px, py] = toPixels(pose.x, pose.y);
  if (answer.unobservable) {
    const [dx, dy] = answer.unobservable.map((part) => (160 / view.scale) * part);
    line([pose.x - dx, pose.y - dy, pose.x + dx, pose.y + dy], colours.estimate, 3, [10, 6]);
  }
  const c = answer.covariance;
  if (!c) return;
  const mean = (c[0][0] + c[1][1]) / 2;
  const half = Math.hypot((c[0][0] - c[1][1]) / 2, c[0][1]);
  const turn = Math.atan2(2 * c[0][1], c[0][0] - c[1][1]) / 2;
  const larger = enlarged()!;
  const [long, short] = [mean + half, Math.max(0, mean - half)].map((v) => 3 * Math.sqrt(v) * view.scale * larger);
  const fan = Math.min(Math.PI, 3 * Math.sqrt(c[2][2]) * larger);
  context.strokeStyle = context.fillStyle = colours.estimate;
  context.lineWidth = 1.5;
  context.beginPath();
  context.ellipse(px, py, long, Math.max(2, short), -turn, 0, 2 * Math.PI);
  context.stroke();
  context.globalAlpha = 0.25;
  context.beginPath();
  context.moveTo(px, py);
  context.arc(px, py, 90, -pose.theta - fan, -pose.theta + fan);
  context.fill();
  context.globalAlpha = 1;
}

/** The factor by which the ellipse and the sector of the heading are drawn larger; null where there are none. */
export function enlarged(): number | null {
  const c = otherPose() ? null : answerHere()?.covariance;
  if (!c) return null;
  const half = Math.hypot((c[0][0] - c[1][1]) / 2, c[0][1]);
  const long = 3 * Math.sqrt((c[0][0] + c[1][1]) / 2 + half) * view.scale;
  return Math.max(1, SMALLEST / Math.max(long, 1e-6));
}

function drawRobot(pose: Pose, name: string, handle: boolean): void {
  const [px, py] = toPixels(pose.x, pose.y);
  context.strokeStyle = context.fillStyle = colours[name];
  context.lineWidth = 2;
  arrow(context, px, py, pose.theta, FRONT);
  if (!handle) return context.fill();
  context.stroke();
  const [c, s] = [Math.cos(pose.theta), -Math.sin(pose.theta)];
  context.beginPath();
  context.moveTo(px + FRONT * c, py + FRONT * s);
  context.lineTo(px + (HANDLE - 5) * c, py + (HANDLE - 5) * s);
  context.stroke();
  context.beginPath();
  context.arc(px + HANDLE * c, py + HANDLE * s, 5, 0, 2 * Math.PI);
  context.fill();
}

/** Draw a line from a place to one that is similar. */
function drawSimilar(from: Pose, to: Pose): void {
  line([from.x, from.y, to.x, to.y], colours.other, 2, [6, 5]);
  drawRobot(to, "other", false);
}

const onPlan = (line: { map_id?: string | null }) => !line.map_id || line.map_id === state.mapId;

function drawLog(): void {
  state.log.forEach((one, k) => {
    if (!one?.pose || !onPlan(one)) return;
    const [px, py] = toPixels(one.pose.x, one.pose.y);
    context.fillStyle = colours[kindOf(one)];
    context.globalAlpha = passes(one) ? 1 : FADED;
    context.beginPath();
    context.arc(px, py, k === state.logAt ? 7 : 3, 0, 2 * Math.PI);
    context.fill();
    context.globalAlpha = 1;
  });
  const here = state.log[state.logAt];
  if (!here?.pose) {
    const pose = lastPose();
    if (pose) drawRobot(pose, "robot", false);
  } else if (onPlan(here) && !state.answer) drawRobot(here.pose, kindOf(here), false);
}

/** The last pose before a scan of a log that has none; null where the robot is drawn at a pose of its own. */
export function lastPose(): Pose | null {
  const { log, logAt, answer } = state;
  if (log[logAt]?.pose || answer?.pose) return null;
  for (let k = logAt - 1; k >= 0; k--) {
    const one = log[k];
    if (one?.pose && onPlan(one)) return one.pose;
  }
  return null;
}
