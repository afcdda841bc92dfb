// The state of the page. Modules read it; `changed` draws the page again.

import type { Alternative, Analysis, Answer, Example, LogLine, MapDocument, Place, Pose, Proposal, Scan, Segment } from "./types";

export interface State {
  map: MapDocument | null;
  mapId: string | null; // of a stored map
  floors: string[]; // the stored maps that are searched together, of which `map` is shown; else empty
  picture: Picture | null; // of the grid that the map was imported from
  example: string; // name of the example that is shown, empty for none
  walls: Segment[]; // all walls of the map, also those that were removed, and after them the walls of added boxes
  own: number; // how many of them are the map's
  off: Set<number>; // indices of walls that were removed
  boxes: Segment[]; // what the simulated scan contains and the map does not
  scan: Scan | null; // as opened, without the page's noise
  robot: Pose; // the true pose of the simulated robot, or the initial pose of the scan
  virtual: boolean; // whether the scan is simulated
  laser: Example["laser"];
  noise: number; // m
  sent: { scan: Scan } | null; // the request that was answered
  answered: Scan | null; // its scan as it was opened
  answer: Answer | null;
  sentTo: number[]; // index of each wall that was sent, among all walls
  others: Alternative[]; // the alternatives that are counted and shown
  other: number; // index of the one that is shown, -1 for none
  analysis: Analysis | null;
  show: Shown; // of the analysis
  pointed: Place | null; // the place of the analysis under the mouse
  proposal: Proposal | null; // of changes of the map
  change: number; // index of the change that is looked at, -1 for none
  log: (LogLine | null)[]; // null: not searched yet
  scans: Scan[]; // of a log whose scans are searched here
  logAt: number;
  filter: string; // of the scans of the log: empty for all, or what they have in common
  layers: Record<Layer, boolean>;
}

/** The picture of a grid; `pose` is that of its lower left corner. */
export interface Picture {
  image: HTMLImageElement;
  pose: Pose;
  resolution: number; // m
}

export type Layer = "map" | "scan" | "beams" | "correspondences" | "alternatives";
export type Shown = "now" | "driven" | "landmark";

export const state: State = {
  map: null,
  mapId: null,
  floors: [],
  picture: null,
  example: "",
  walls: [],
  own: 0,
  off: new Set(),
  boxes: [],
  scan: null,
  robot: { x: 0, y: 0, theta: 0 },
  virtual: false,
  laser: { fov: 2 * Math.PI, beams: 720, range_max: 20, sigma: 0.02 },
  noise: 0,
  sent: null,
  answered: null,
  answer: null,
  sentTo: [],
  others: [],
  other: -1,
  analysis: null,
  show: "now",
  pointed: null,
  proposal: null,
  change: -1,
  log: [],
  scans: [],
  logAt: 0,
  filter: "",
  layers: { map: true, scan: true, beams: false, correspondences: true, alternatives: true },
};

const listeners: (() => void)[] = [];

export function onChange(listener: () => void): void {
  listeners.push(listener);
}

export function changed(): void {
  for (const listener of listeners) listener();
}

/** Show another map, and forget what belongs to the one before; a log stays. */
export function setMap(map: MapDocument, mapId: string | null = null): void {
  take(map, mapId);
  state.floors = [];
  if (state.scans.length) state.log = state.scans.map(() => null);
  else Object.assign(state, { log: [], logAt: 0 });
  forget();
  const box = boundsOf(map.segments);
  state.robot = { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, theta: 0 };
}

/** Show another of the maps that are searched together; their answer stays. */
export function showFloor(map: MapDocument, mapId: string): void {
  take(map, mapId);
}

function take(map: MapDocument, mapId: string | null): void {
  Object.assign(state, { map, mapId, walls: map.segments, own: map.segments.length, off: new Set(), boxes: [] });
  Object.assign(state, { picture: null, example: "", analysis: null, pointed: null, proposal: null, change: -1 });
}

/** The answer, where its pose is on the map that is shown. */
export function answerHere(): Answer | null {
  const { answer, floors, mapId } = state;
  return answer && floors.length && answer.map?.map_id !== mapId ? null : answer;
}

/** The wall on the plan that has an index in the answer. */
export const wallOf = (k: number) => state.sentTo[k] ?? k;

/** Show no map: an example's is not that of a scan which is opened. */
export function forgetMap(): void {
  setMap({ segments: [] });
  state.map = null;
}

/** The walls that were not removed: the map's own, and those of added boxes. */
export function kept(): { own: Segment[]; landmark: Segment[] } {
  const on = (_: Segment, k: number) => !state.off.has(k);
  const left = state.walls.filter(on);
  const landmark = state.walls.slice(state.own).filter((_, k) => !state.off.has(state.own + k));
  return { own: left.slice(0, left.length - landmark.length), landmark };
}

/** Whether the map is the stored one, as it is stored. */
export function asStored(): boolean {
  return state.mapId !== null && !state.off.size && state.walls.length === state.own;
}

/** Add walls, to the building and to the map. */
export function addWalls(walls: Segment[]): void {
  state.walls = [...state.walls, ...walls];
}

/** Restore the map as it was opened. */
export function restore(): void {
  state.off = new Set();
  if (state.walls.length === state.own) return;
  forget(); // the answer names walls that go
  state.walls = state.walls.slice(0, state.own);
}

/** Forget the answer, which belongs to another request. */
export function forget(): void {
  Object.assign(state, { answer: null, sent: null, answered: null, sentTo: [], others: [], other: -1 });
}

export function boundsOf(segments: Segment[]): Segment {
  const box: Segment = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x1, y1, x2, y2] of segments) {
    box[0] = Math.min(box[0], x1, x2);
    box[1] = Math.min(box[1], y1, y2);
    box[2] = Math.max(box[2], x1, x2);
    box[3] = Math.max(box[3], y1, y2);
  }
  return segments.length ? box : [-5, -5, 5, 5];
}
