// Files that a user brings: what they are is told by what is in them.

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
    throw new Error(`${name} is not JSON.`);
  }
  if (Array.isArray(content)) return takeMap({ segments: content } as MapDocument);
  if (typeof content !== "object" || content === null) throw new Error(`${name} is neither a map nor a scan.`);
  const told = content as Record<string, unknown>;
  if ("map" in told && "scan" in told) {
    // A request as it is sent.
    const { map, scan } = told as { map: MapDocument; scan: Scan };
    if (!("segments" in map)) throw new Error(`${name} names a stored map: open that one first, and a file with the scan.`);
    takeMap(map);
    takeScan(scan);
  } else if ("ranges" in told) takeScan({ laser: told } as unknown as Scan);
  else if ("laser" in told || "points" in told) takeScan(told as Scan);
  else if ("segments" in told) {
    // Both are lists of segments: a scan says so in its name, or by what only scans have.
    if (/scan/i.test(name) || "viewpoint" in told || "stamp" in told || "points" in told) takeScan(told as Scan);
    else takeMap(told as unknown as MapDocument);
  } else throw new Error(`${name} is neither a map nor a scan: it has none of segments, points, laser and ranges.`);
}

function takeMap(map: MapDocument): void {
  if (!Array.isArray(map.segments) || !map.segments.length) throw new Error("The map has no segments.");
  if (!map.segments.every((s) => Array.isArray(s) && s.length === 4 && s.every(Number.isFinite)))
    throw new Error("A segment of the map is not four numbers.");
  setMap(map); // a scan stays: it may be waiting for this map
  showAll("A map from a file.");
}

function takeScan(scan: Scan): void {
  Object.assign(state, { scan, virtual: false });
  forget();
  if (!state.map) about.textContent = "A scan from a file. Now bring the map to find it in.";
  document.querySelector<HTMLInputElement>("#virtual")!.checked = false;
  changed();
}

const input = document.querySelector<HTMLInputElement>("#files")!;
input.addEventListener("change", () => {
  void open([...(input.files ?? [])]);
  input.value = "";
});
// Whoever is told that a drawing does not say its unit need not bring it again.
units.addEventListener("change", () => {
  if (drawing.length) void open(drawing);
});
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  void open([...(event.dataTransfer?.files ?? [])]);
});
