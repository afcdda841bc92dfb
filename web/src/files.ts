// Files that a user opens; their names and their content determine their kind.

import { importMap, importScans } from "./api";
import { askSoon } from "./asking";
import { dropped } from "./dropped";
import { openSeveral } from "./floors";
import { showImport, showScanImport } from "./imported";
import { openLog, openScans } from "./log";
import { isProposal, openProposal } from "./proposal";
import { isLatest, openStored, showAll, supersede } from "./scene";
import { changed, forget, forgetMap, setMap, state } from "./state";
import type { Asked, MapDocument, Proposal, Scan } from "./types";
import { messageOf, write } from "./words";

const about = document.querySelector<HTMLElement>("#about")!;
const status = document.querySelector<HTMLElement>("#reading")!;
const units = document.querySelector<HTMLSelectElement>("#units")!;
const surface = document.querySelector<HTMLInputElement>("#surface")!;
const LOGS = /\.(bag|mcap|db3|log|clf|carmen)$|^metadata\.yaml$/i;
const GRIDS = /\.(ya?ml|pgm|png|bmp|bag|mcap|db3)$/i;
const MOST_SCANS = 200; // of a log that are searched here
let drawing: File[] = []; // the last one, for other options
let last: Promise<unknown> = Promise.resolve(); // of the files that were opened
let waiting = 0;
let opening = 0;
let problems: string[] = [];

/** Open files, after those that are being read. */
export function open(files: File[]): void {
  if (!waiting || !isLatest(opening)) {
    opening = supersede();
    problems = [];
  }
  const mine = opening;
  waiting++;
  last = last.then(() => read(files, mine)).finally(() => waiting--);
}

async function read(files: File[], mine: number): Promise<void> {
  if (!isLatest(mine)) return; // something else was chosen meanwhile
  const json = files.filter(({ name }) => /\.(json|jsonl|ndjson)$/i.test(name));
  const logs = files.filter(({ name }) => LOGS.test(name));
  const maps = files.filter((file) => !json.includes(file) && !logs.includes(file));
  const proposals: [string, Proposal][] = [];
  const before = problems.length;
  try {
    for (const file of json) proposals.push(...(await take(file.name, await file.text(), mine)));
    if (maps.length) await readMap(maps, mine);
    if (logs.length) await readLog(logs, mine);
    for (const [name, proposal] of proposals) await openProposal(name, proposal, mine); // its map may be among the files
  } catch (error) {
    problems.push(messageOf(error));
  }
  if (!isLatest(mine)) return;
  write(status, problems.join(" "));
  if (problems.length === before) askSoon();
}

/** Show which file is read, after what was wrong with those before it. */
function reading(name: string): void {
  write(status, [...problems, `Reading ${name} ...`].join(" "));
}

async function readMap(files: File[], mine: number): Promise<void> {
  drawing = files;
  reading(files[0].name);
  await requirePicture(files);
  const isGrid = files.some(({ name }) => GRIDS.test(name));
  const options = isGrid ? { surface: surface.value } : { units: units.value };
  const found = await importMap(files, Object.fromEntries(Object.entries(options).filter(([, value]) => value)));
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

/** Raise an error where of a grid's YAML file and its picture only one was chosen. */
async function requirePicture(files: File[]): Promise<void> {
  if (files.every(({ name }) => /\.(pgm|png|bmp)$/i.test(name))) throw new Error(`${files[0].name} needs its YAML file: choose both.`);
  const grid = files.find(({ name }) => /\.ya?ml$/i.test(name));
  const picture = grid && /^image: *["']?(?:[^"'\n]*[/\\])?([^"'\n#]*\w)/m.exec(await grid.text())?.[1];
  if (picture && !files.some(({ name }) => name === picture)) throw new Error(`${grid.name} needs ${picture}: choose both.`);
}

/** Read the scans of a log; also its map, where it has no scans or no other map was opened. */
async function readLog(files: File[], mine: number): Promise<void> {
  let problem: unknown = null;
  const { name } = files.find((file) => !/yaml$/i.test(file.name)) ?? files[0];
  reading(name);
  try {
    const found = await importScans(files, MOST_SCANS);
    if (!isLatest(mine)) return;
    openScans(name, found, MOST_SCANS);
    showScanImport(found.report);
  } catch (error) {
    problem = error;
  }
  if (!isLatest(mine) || !(problem || !state.map)) return;
  try {
    await readMap(files, mine);
  } catch {
    if (problem) throw problem; // a log need not have a map
  }
}

/** Take a file for what it is; proposals of changes are returned. */
async function take(name: string, text: string, mine: number): Promise<[string, Proposal][]> {
  if (openLog(name, text)) return [];
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
  if ("scan" in fields && ("map" in fields || "maps" in fields)) {
    await takeRequest(name, fields as unknown as Asked, mine);
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

/** Take a request as it is sent: its maps, its scan, its options, and a prior of the page. */
async function takeRequest(name: string, { map, maps, scan, options, prior }: Asked, mine: number): Promise<void> {
  const ids = Array.isArray(maps) && maps.every((one) => !("segments" in one)) ? maps.map((one) => one.map_id) : [];
  if (map && "segments" in map) takeMap(map);
  else if (map) await openStored(map.map_id, mine);
  else if (ids.length) await openSeveral(ids, mine);
  else throw new Error(`${name} refers to maps that are not stored as they were sent. Search on several maps first, under "Stored maps", then open a file with the scan.`);
  if (!isLatest(mine)) return;
  takeScan(scan);
  const set = (id: string, value: unknown) => typeof value === "number" && (document.querySelector<HTMLInputElement>(id)!.value = String(value));
  set("#on-map", options?.on_map);
  set("#usable-from", options?.usable_from);
  if (prior) Object.assign(state.robot, { x: prior.x, y: prior.y, theta: prior.theta });
  document.querySelector<HTMLInputElement>("#near")!.checked = Boolean(prior);
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
  open([...(input.files ?? [])]);
  input.value = "";
});
// After a message about a missing unit the drawing need not be opened again.
for (const option of [units, surface]) option.addEventListener("change", () => {
  if (drawing.length) open(drawing);
});
document.addEventListener("dragover", (event) => event.preventDefault());
document.addEventListener("drop", (event) => {
  event.preventDefault();
  if (event.dataTransfer) dropped(event.dataTransfer).then(open, (error: unknown) => write(status, messageOf(error)));
});
