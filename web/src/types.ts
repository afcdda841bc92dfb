// The contract's shapes, as far as the page reads them.

export type Segment = [number, number, number, number];

export interface Pose {
  x: number;
  y: number;
  theta: number;
}

export interface MapDocument {
  segments: Segment[];
  sigma?: number | null;
  oriented?: boolean | null;
  frame_id?: string;
  points?: [number, number][]; // too small for a wall; metres
  points_sigma?: number | null;
  meta?: unknown;
}

export interface Laser {
  angle_min: number;
  angle_increment: number;
  ranges: (number | null)[];
  range_min?: number;
  range_max?: number;
}

export interface Scan {
  laser?: Laser;
  segments?: Segment[];
  points?: [number, number][];
  views?: View[];
  sigma?: number | null;
  [other: string]: unknown;
}

/** The scan of one sensor, and its pose on the robot. */
export interface View extends Scan {
  pose: Pose;
  flipped?: boolean;
}

export interface Correspondence {
  scan: number;
  map: number;
  overlap: number;
  offset: number;
  angle: number;
}

export interface CriticalWall {
  scan: number[];
  map: number[];
  direction: [number, number];
  displacement: number;
}

/** Numbers next to the pose. */
export interface Diagnostics {
  score: number;
  critical_wall: CriticalWall | null;
  corrections: { scale: number; offset: number; strain: number[] } | null;
  turn_rate: number | null; // rad/s
}

export interface Reason {
  code: string;
  message: string;
}

export interface Alternative {
  pose: Pose;
  map_id?: string | null; // of several maps
  score: number;
  probability: number | null;
}

/** Of several maps: the best pose on one of them. */
export interface MapVerdict {
  map_id: string;
  status: Answer["status"];
  probability: number | null;
  pose: Pose | null;
}

export interface Answer {
  status: "ok" | "ambiguous" | "degenerate" | "no_match";
  usable: boolean;
  probability: number | null; // null: degenerate
  message: string;
  pose: Pose | null;
  covariance: number[][] | null;
  unobservable: [number, number] | null;
  correspondences: Correspondence[];
  unmatched_scan: number[]; // of a scan of one view, as `ask` puts them
  missing_map: number[];
  segments: Segment[] | Segment[][] | null;
  diagnostics: Diagnostics | null;
  reasons: Reason[];
  warnings: Reason[];
  alternatives: Alternative[];
  map: { map_id: string } | null; // of a stored map, and of several maps that of the pose
  maps?: MapVerdict[] | null; // of several maps, the best first
  timing_ms: Record<string, number>;
}

export interface Place {
  pose: Pose;
  status: Answer["status"];
  usable: boolean;
  probability: number | null; // null: degenerate
  similar_pose: Pose | null;
  reasons: string[];
  resolved_after: number | null;
  with_landmark: { status: Answer["status"]; usable: boolean; probability: number | null } | null;
}

export interface Analysis {
  places: Place[];
  summary: Record<string, number> & { resolved_within: number | null; usable_with_landmark: number | null };
  spacing: number;
  complete: boolean;
}

export interface Example {
  title: string;
  about: string;
  map: MapDocument;
  boxes: Segment[];
  pose: Pose;
  laser: { fov: number; beams: number; range_max: number; sigma: number };
}

export interface LogLine {
  map_id?: string | null; // of several maps
  stamp: unknown;
  status: Answer["status"];
  usable: boolean;
  probability: number | null; // null: degenerate
  pose: Pose | null;
  reasons: (Reason | string)[];
}

export interface Note {
  code: string;
  message: string;
  count: number;
}

/** The report on the import of a map or of scans. */
export interface Report {
  format: string;
  files: string[];
  read: Note[];
  merged: Note[];
  dropped: Note[];
  assumed: Note[];
}

export interface Imported {
  map: MapDocument;
  report: Report;
  picture: { png: string; pose: Pose; resolution: number } | null;
  check: { findings: { code: string; message: string; count: number }[] };
}

export interface ImportedScans {
  scans: Scan[];
  count: number;
  report: Report;
}

export type ChangeCode = "removed" | "added" | "moved" | "extended" | "shortened";

/** A proposed change of a map. */
export interface Change {
  code: ChangeCode;
  segments: number[]; // of the old map
  new: { segment: Segment; sigma: number }[];
  evidence: { beams_through: number; beams_on: number; poses: number; visits: number; from: string; to: string };
  confidence: number;
  accepted: boolean;
}

/** The answer of an update of a map. */
export interface Proposal {
  map: MapDocument;
  based_on: { map_id: string; revision: number } | null; // null: of a map in a file
  changes: Change[];
  scans: number;
  usable_before: number;
  usable_after: number;
  sharpened: { segments: number[]; ends: Segment[]; sigma: number[] };
  refused_visits: { visit: string; message: string }[];
  complete: boolean;
}

export interface StoredMap {
  map_id: string;
  revision: number;
  segment_count: number;
}
