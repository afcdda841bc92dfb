// Requests to the service that this page comes from.

import type * as contract from "./contract";
import { sentenceOf } from "./words";
import type { Asked, Imported, ImportedScans, MapDocument, Proposal, Scan } from "./types";

export class Problem extends Error {
  constructor(
    message: string,
    readonly status: number,
    readonly code: string,
  ) {
    super(message);
  }
}

let key = "";

export function setKey(value: string): void {
  key = value.trim();
}

async function call<T>(method: string, path: string, body?: BodyInit, type?: string, signal?: AbortSignal, more: Record<string, string> = {}): Promise<T> {
  const headers: Record<string, string> = { ...more };
  if (key) headers.Authorization = `Bearer ${key}`;
  if (type) headers["Content-Type"] = type;
  let response: Response;
  try {
    response = await fetch(path, { method, headers, body, signal });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Problem("The service does not respond. Check that it is running.", 0, "no_connection");
  }
  if (response.status === 204) return undefined as T;
  const text = await response.text();
  let answer: unknown;
  try {
    answer = JSON.parse(text);
  } catch {
    throw new Problem(`The service returned status ${response.status} with a body that is not JSON. Check the address, and proxies in between.`, response.status, "no_json");
  }
  if (!response.ok) throw problemOf(response.status, answer);
  return answer as T;
}

function problemOf(status: number, answer: unknown): Problem {
  const { detail, code } = answer as { detail?: string; code?: string };
  const stated = sentenceOf(code ?? "", detail ?? `The service rejected the request with status ${status}.`);
  return new Problem(stated + (status === 403 ? " (see Key below)." : ""), status, code ?? "");
}

const JSON_TYPE = "application/json";
const post = <T>(path: string, body: unknown, signal?: AbortSignal) => call<T>("POST", path, JSON.stringify(body), JSON_TYPE, signal);

export const associate = (asked: Asked, signal: AbortSignal) => post<Required<contract.AssociateAnswer>>("/v1/associate", asked, signal);
export const analyze = (asked: contract.MapAnalyzeRequest) => post<contract.AnalyzeAnswer>("/v1/analyze", asked);
export const example = <T>(name: string) => call<T>("GET", `/page/examples/${name}.json`);

const pathOf = (id: string) => `/v1/maps/${encodeURIComponent(id)}`;
export const listMaps = (cursor: string, limit = 50) =>
  call<contract.MapList>("GET", `/v1/maps?limit=${limit}&cursor=${encodeURIComponent(cursor)}`);
export const getMap = (id: string) => call<MapDocument>("GET", pathOf(id));
/** Store a map; with a revision, only in place of that one. */
export const putMap = (id: string, map: MapDocument, revision: number | null = null) =>
  call<contract.MapSummaryAnswer>("PUT", pathOf(id), JSON.stringify(map), JSON_TYPE, undefined, revision === null ? {} : { "If-Match": `"${revision}"` });
export const deleteMap = (id: string) => call<void>("DELETE", pathOf(id));
export const checkMap = (id: string) => call<contract.CheckAnswer>("GET", `${pathOf(id)}:check`);

/** Propose changes of a stored map that the scans of several visits show. */
export const updateMap = (id: string, visits: { visit: string; scans: Scan[] }[]) => post<Proposal>(`${pathOf(id)}:update`, { visits });
/** Return a map with those changes of a proposal that are accepted; the service stores nothing. */
export const applyChanges = (map: MapDocument, { changes, sharpened }: Proposal) => post<contract.ApplyAnswer>("/v1/maps:apply", { map, changes, sharpened });
export const limits = () => call<contract.Limits>("GET", "/v1/limits");

/** Convert files of another tool to a map; the service stores nothing. */
export const importMap = (files: File[], options: Record<string, string>) => importing<Imported>("/v1/maps:import", files, options);
/** Read the scans of a log, at most so many, evenly spread. */
export const importScans = (files: File[], most: number) => importing<ImportedScans>("/v1/scans:import", files, { max_scans: String(most) });

async function importing<T>(path: string, files: File[], fields: Record<string, string>): Promise<T> {
  const form = new FormData();
  for (const file of files) form.append("file", file, file.name);
  for (const [name, value] of Object.entries(fields)) form.append(name, value);
  try {
    return await call<T>("POST", path, form);
  } catch (error) {
    // The service does not repeat names that were sent.
    if (error instanceof Problem) error.message = error.message.replace(/^\/files\/(\d+)/, (whole, k: string) => files[Number(k)]?.name ?? whole).replace(/^\/files: /, "");
    throw error;
  }
}
