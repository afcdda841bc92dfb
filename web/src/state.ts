// What is on the page. Modules read it; `changed` says that something is to be drawn anew.

import type { Analysis, Answer, Example, LogLine, MapDocument, Place, Pose, Scan, Segment } from "./types";

export interface State {
  map: MapDocument | null;
  mapId: string | null; // where the map is a stored one, as long as no wall was taken off
  walls: Segment[]; // all walls of the map, those taken off too, and after them those that were put up
  own: number; // how many of them are the map's
  off: Set<number>; // indices of walls that were taken off
  boxes: Segment[]; // what a virtual robot sees and no map shows
  scan: Scan | null; // as brought, without the page's noise
  robot: Pose; // where the virtual robot stands, or where the scan was put
  virtual: boolean;
  laser: Example["laser"];
  noise: number; // m
  sent: { map: MapDocument | { map_id: string }; scan: Scan } | null; // what the answer is about
  answer: Answer | null;
  sentTo: number[]; // index of each wall that was sent, among all walls
  other: number; // which other place is shown, -1 for none
  analysis: Analysis | null;
  show: Shown; // of the analysis
  pointed: Place | null; // at which place of the analysis the mouse is
  log: LogLine[];
  logAt: number;
}

export type Shown = "now" | "driven" | "landmark";

export const state: State = {
  map: null,
  mapId: null,
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
  answer: null,
  sentTo: [],
  other: -1,
  analysis: null,
  show: "now",
  pointed: null,
  log: [],
  logAt: 0,
};

const listeners: (() => void)[] = [];

export function onChange(listener: () => void): void {
  listeners.push(listener);
}

export function changed(): void {
  for (const listener of listeners) listener();
}

/** Put another map on the page; what was about the one before goes. */
export function setMap(map: MapDocument, mapId: string | null = null): void {
  const own = map.segments.length;
  Object.assign(state, { map, mapId, walls: map.segments, own, off: new Set(), boxes: [], log: [], logAt: 0 });
  forget();
  state.analysis = state.pointed = null;
  const box = boundsOf(map.segments);
  state.robot = { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, theta: 0 };
}

/** The walls that count, of the map's own and of those that were put up. */
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

/** Put up walls, in the building and on the map. */
export function putUp(walls: Segment[]): void {
  state.walls = [...state.walls, ...walls];
}

/** Have the map as it came. */
export function restore(): void {
  state.off = new Set();
  if (state.walls.length === state.own) return;
  forget(); // the answer names walls that go
  state.walls = state.walls.slice(0, state.own);
}

/** Forget the answer: it is about something else. */
export function forget(): void {
  Object.assign(state, { answer: null, sent: null, sentTo: [], other: -1 });
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
