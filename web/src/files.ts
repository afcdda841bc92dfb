// Files that a user opens; their content determines their kind.

import { importMap } from "./api";
import { tellImport } from "./imported";
import { askSoon } from "./asking";
import { openLog } from "./log";
import { changed, forget, setMap, state } from "./state";
import type { MapDocument, Scan } from "./types";
import { showAll } from "./scene";
import { tellProblem } from "./verdict";

const about = document.querySelector<HTMLElement>("#about")!;
const units = document.querySelector<HTMLSelectElement>("#units")!;
let drawing: File[] = []; // as it was brought last

export async function open(files: File[]): Promise<void> {
  const foreign: File[] = [];
  try {
    for (const file of files) {
      if (/\.(json|jsonl|ndjson)$/i.test(file.name)) take(file.name, await file.text());
      else foreign.push(file);
    }
    if (foreign.length) await read(foreign);
  } catch (error) {
    tellProblem(error instanceof Error ? error.message : String(error));
    return;
  }
  askSoon();
}

async function read(files: File[]): Promise<void> {
  drawing = files;
  const before = about.textContent;
  about.textContent = "Reading the map ...";
  try {
    const found = await importMap(files, units.value);
    takeMap(found.map);
    tellImport(found);
  } catch (error) {
    about.textContent = before;
    throw error;
  }
}

function take(name: string, text: string): void {
  if (openLog(text)) return;
  let content: unknown;
  try {
    content = JSON.parse(text);
  } catch {
    throw new Error(`${name} is not JSON. Open a map, a scan or a log in JSON.`);
  }
  if (Array.isArray(content)) return takeMap({ segments: content } as MapDocument);
  if (typeof content !== "object" || content === null) throw new Error(`${name} is neither a map nor a scan. Expected a JSON object, or an array of segments.`);
  const told = content as Record<string, unknown>;
  if ("map" in told && "scan" in told) {
    // A request as it is sent.
    const { map, scan } = told as { map: MapDocument; scan: Scan };
    if (!("segments" in map)) throw new Error(`${name} refers to a stored map. Open that map first, then a file with the scan.`);
    takeMap(map);
    takeScan(scan);
  } else if ("ranges" in told) takeScan({ laser: told } as unknown as Scan);
  else if ("laser" in told || "points" in told) takeScan(told as Scan);
  else if ("segments" in told) {
    // Both are lists of segments: a scan says so in its name, or by what only scans have.
    if (/scan/i.test(name) || "viewpoint" in told || "stamp" in told || "points" in told) takeScan(told as Scan);
    else takeMap(told as unknown as MapDocument);
  } else throw new Error(`${name} is neither a map nor a scan. Expected segments, points, laser or ranges.`);
}

function takeMap(map: MapDocument): void {
  if (!Array.isArray(map.segments) || !map.segments.length) throw new Error("The map has no segments. Expected at least one.");
  if (!map.segments.every((s) => Array.isArray(s) && s.length === 4 && s.every(Number.isFinite)))
    throw new Error("A segment of the map is not valid. Expected four numbers, x1, y1, x2, y2.");
  setMap(map); // a scan stays: it may be waiting for this map
  showAll("A map from a file.");
}

function takeScan(scan: Scan): void {
  Object.assign(state, { scan, virtual: false });
  forget();
  if (!state.map) about.textContent = "A scan from a file. Now open its map.";
  document.querySelector<HTMLInputElement>("#virtual")!.checked = false;
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
