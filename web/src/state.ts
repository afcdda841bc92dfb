// What is on the page. Modules read it; `changed` says that something is to be drawn anew.

import type { Analysis, Answer, Example, LogLine, MapDocument, Pose, Scan, Segment } from "./types";

export interface State {
  map: MapDocument | null;
  mapId: string | null; // where the map is a stored one, as long as no wall was taken off
  walls: Segment[]; // all walls of the map, those taken off too
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
  log: LogLine[];
  logAt: number;
}

export const state: State = {
  map: null,
  mapId: null,
  walls: [],
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
  Object.assign(state, { map, mapId, walls: map.segments, off: new Set(), boxes: [], log: [], logAt: 0 });
  forget();
  state.analysis = null;
  const box = boundsOf(map.segments);
  state.robot = { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, theta: 0 };
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
