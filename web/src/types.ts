// The shapes that the page reads: those of the contract, and of files that a user opens.

import type * as contract from "./contract";

/** An answer whose segments without a correspondence are indices, as of a scan of one view. */
export type Answer = Omit<Required<contract.AssociateAnswer>, "unmatched_scan"> & { unmatched_scan: number[] };
export type Status = Answer["status"];
export type Alternative = contract.AlternativeAnswer;
export type MapVerdict = contract.MapVerdictAnswer;
export type Reason = contract.ReasonAnswer;
export type Analysis = contract.AnalyzeAnswer;
export type Place = contract.AnalyzedPlaceAnswer;
export type MapDocument = contract.MapDocument;
export type Segment = MapDocument["segments"][number];
export type Pose = contract.PoseAnswer;
export type Laser = contract.Laser;
export type Note = contract.NoteAnswer;
export type Report = contract.ReportAnswer;
export type Imported = contract.ImportAnswer;
export type ImportedScans = Omit<contract.ScansAnswer, "scans"> & { scans: Scan[] };
export type Change = contract.ChangeAnswer;
export type ChangeCode = Change["code"];
/** The answer of an update; of a map in a file, `linefix map update` writes no map that it is based on. */
export type Proposal = Omit<contract.UpdateAnswer, "based_on"> & { based_on: contract.UpdateAnswer["based_on"] | null };

/** A request for a pose, with a scan as it was opened. */
export type Asked = Omit<contract.AssociateRequest, "scan" | "maps"> & { maps?: (contract.NamedMap | contract.StoredMap)[]; scan: Scan };

/** A scan of any kind, as it was opened. */
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

export interface Example {
  title: string;
  about: string;
  map: MapDocument;
  boxes: Segment[];
  pose: Pose;
  laser: { fov: number; beams: number; range_max: number; sigma: number };
}

/** A line of a replay. */
export interface LogLine {
  map_id?: string | null; // of several maps
  stamp: unknown;
  status: Status;
  usable: boolean;
  probability: number | null; // null: degenerate
  pose: Pose | null;
  reasons: (Reason | string)[];
}
