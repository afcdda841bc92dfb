// Files that a user opens; their names and their content determine their kind.

import { importMap, importScans } from "./api";
import { askSoon } from "./asking";
import { showImport, showScanImport } from "./imported";
import { openLog, openScans } from "./log";
import { isProposal, openProposal } from "./proposal";
import { isLatest, showAll, supersede } from "./scene";
import { changed, forget, forgetMap, setMap, state } from "./state";
import type { MapDocument, Proposal, Scan } from "./types";

const about = document.querySelector<HTMLElement>("#about")!;
const status = document.querySelector<HTMLElement>("#reading")!;
const units = document.querySelector<HTMLSelectElement>("#units")!;
const LOGS = /\.(bag|mcap|db3|log|clf|carmen)$/i;
const MOST_SCANS = 200; // of a log that are searched here
let drawing: File[] = []; // the last one, for another unit

export async function open(files: File[]): Promise<void> {
  const mine = supersede();
  const foreign: File[] = [];
  const proposals: [string, Proposal][] = [];
  let message = "";
  try {
    for (const file of files) {
      if (/\.(json|jsonl|ndjson)$/i.test(file.name)) proposals.push(...take(file.name, await file.text()));
      else foreign.push(file);
    }
    if (foreign.length) {
      status.textContent = `Reading ${foreign[0].name} ...`;
      await (foreign.some((file) => LOGS.test(file.name)) ? readLog(foreign, mine) : readMap(foreign, mine));
    }
    for (const [name, proposal] of proposals) await openProposal(name, proposal, mine); // its map may be among the files
  } catch (error) {
    message = error instanceof Error ? error.message : String(error);
  }
  if (!isLatest(mine)) return; // other files were opened meanwhile
  status.textContent = message;
  if (!message) askSoon();
}

async function readMap(files: File[], mine: number): Promise<void> {
  drawing = files;
  const found = await importMap(files, units.value);
  if (!isLatest(mine)) return;
  takeMap(found.map);
  if (found.picture) {
    const image = new Image();
    image.addEventListener("load", changed);
    image.src = `data:image/png;base64,${found.picture.png}`;
    state.picture = { image, pose: found.picture.pose, resolution: found.picture.resolution };
  }
  showImport(found);
  changed();
}

/** Read the scans of a log; also its map, where it has no scans or no other map was opened. */
async function readLog(files: File[], mine: number): Promise<void> {
  let problem: unknown = null;
  try {
    const found = await importScans(files, MOST_SCANS);
    if (!isLatest(mine)) return;
    openScans(found);
    showScanImport(found.report);
  } catch (error) {
    problem = error;
  }
  if (!isLatest(mine) || !(problem || !state.map)) return;
  try {
    await readMap(files, mine);
  } catch {
    if (problem) throw problem;
    if (!state.map) about.textContent = "The log has no map. Open the map, too.";
  }
}

/** Take a file for what it is; proposals of changes are returned. */
function take(name: string, text: string): [string, Proposal][] {
  if (openLog(text)) return [];
  let content: unknown;
  try {
    content = JSON.parse(text);
  } catch {
    throw new Error(`${name} is not JSON. Open a map, a scan or a log in JSON.`);
  }
  if (Array.isArray(content)) content = { segments: content };
  if (typeof content !== "object" || content === null) throw new Error(`${name} is neither a map nor a scan. Expected a JSON object, or an array of segments.`);
  const fields = content as Record<string, unknown>;
  if (isProposal(fields)) return [[name, fields as unknown as Proposal]];
  if ("maps" in fields && "scan" in fields) {
    if (!state.floors.length) throw new Error(`${name} refers to several maps. Search on them first, under "Stored maps".`);
    takeScan(fields.scan as Scan);
  } else if ("map" in fields && "scan" in fields) {
    // A request as it is sent.
    const { map, scan } = fields as { map: MapDocument; scan: Scan };
    if (!("segments" in map)) throw new Error(`${name} refers to a stored map. Open that map first, then a file with the scan.`);
    takeMap(map);
    takeScan(scan);
  } else if ("ranges" in fields) takeScan({ laser: fields } as unknown as Scan);
  else if ("laser" in fields || ("points" in fields && !("segments" in fields))) takeScan(fields as Scan);
  else if ("segments" in fields) {
    // Both are lists of segments; a map may have points, too. A scan is recognized by its name, or by its own fields.
    const scan = /scan/i.test(name) || "viewpoint" in fields || "stamp" in fields;
    if (scan && !("points" in fields)) takeScan(fields as Scan);
    else takeMap(fields as unknown as MapDocument);
  } else throw new Error(`${name} is neither a map nor a scan. Expected segments, points, laser or ranges.`);
  return [];
}

function takeMap(map: MapDocument): void {
  if (!Array.isArray(map.segments) || !map.segments.length) throw new Error("The map has no segments. Expected at least one.");
  if (!map.segments.every((s) => Array.isArray(s) && s.length === 4 && s.every(Number.isFinite)))
    throw new Error("A segment of the map is not valid. Expected four numbers, x1, y1, x2, y2.");
  if (!(map.points ?? []).every((p) => Array.isArray(p) && p.length === 2 && p.every(Number.isFinite)))
    throw new Error("A point of the map is not valid. Expected two numbers, x, y.");
  setMap(map); // a scan stays: it may be waiting for this map
  showAll("A map from a file.");
}

function takeScan(scan: Scan): void {
  if (state.example) forgetMap();
  Object.assign(state, { scan, virtual: false, log: [], scans: [], logAt: 0 });
  forget();
  if (!state.map) about.textContent = "A scan from a file. Now open its map.";
  changed();
}

const input = document.querySelector<HTMLInputElement>("#files")!;
input.addEventListener("change", () => {
  void open([...(input.files ?? [])]);
  input.value = "";
});
// After a message about a missing unit the drawing need not be opened again.
units.addEventListener("change", () => {
  if (drawing.length) void open(drawing);
});
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  void open([...(event.dataTransfer?.files ?? [])]);
});
