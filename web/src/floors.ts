// Several stored maps that are searched together: a row of thumbnails, and one of the maps large on the plan.

import { getMap } from "./api";
import { askSoon } from "./asking";
import { arrow, made, sized } from "./dom";
import { colours } from "./drawing";
import { isLatest, showAll, supersede } from "./scene";
import { boundsOf, onChange, setMap, showFloor, state } from "./state";
import type { Answer, MapDocument, MapVerdict, Pose } from "./types";
import { percent } from "./verdict";

const row = document.querySelector<HTMLElement>("#floors")!;
const [WIDTH, HEIGHT] = [132, 84]; // px of a thumbnail
const MOST = 24; // thumbnails; of more maps the best
const documents = new Map<string, MapDocument | null>(); // null: it cannot be read
const buttons = new Map<string, HTMLButtonElement>();
let reading = false;
let followed: { answer: Answer | null; other: number } = { answer: null, other: -1 }; // whose map was shown
let drawn = ""; // the thumbnails that are in the row

/** Search the scan on several stored maps, and show the first. */
export async function openSeveral(ids: string[], mine = supersede()): Promise<void> {
  const first = await getMap(ids[0]);
  if (!isLatest(mine)) return;
  documents.clear();
  buttons.clear();
  drawn = "";
  documents.set(ids[0], first);
  setMap(first, ids[0]);
  state.floors = ids;
  showAll(aboutOf(ids[0]));
  askSoon();
}

/** Show one of the maps large. A simulated scan stays as it was taken on the map before. */
async function show(id: string): Promise<void> {
  const of = state.floors;
  if (!documents.has(id)) await read(id);
  const map = documents.get(id);
  if (!map || of !== state.floors || state.mapId === id) return;
  if (state.virtual && state.sent) Object.assign(state, { virtual: false, scan: state.sent.scan });
  showFloor(map, id);
  showAll(aboutOf(id));
  if (state.virtual) askSoon(); // the robot is on this map now
  buttons.get(id)?.scrollIntoView({ block: "nearest", inline: "nearest" });
}

const aboutOf = (id: string) => `The stored map ${id}, one of ${state.floors.length} that are searched together.`;

async function read(id: string): Promise<void> {
  const found = await getMap(id).catch(() => null);
  documents.set(id, found);
}

/** Read the maps of the thumbnails, one after the other. */
async function readAll(): Promise<void> {
  if (reading) return;
  reading = true;
  for (let id = missing(); id !== undefined; id = missing()) {
    await read(id);
    update();
  }
  reading = false;
}

const missing = () => listed().find((id) => !documents.has(id));

/** The maps that have a thumbnail, in the order in which they were chosen. */
function listed(): string[] {
  const best = new Set((state.answer?.maps?.map((one) => one.map_id) ?? state.floors).slice(0, MOST));
  return state.floors.filter((id) => best.has(id) || id === state.mapId);
}

/** Follow the answer, or the alternative that is shown, to its map. */
function follow(): void {
  const { answer, others, other, floors } = state;
  if (!floors.length || !answer || (answer === followed.answer && other === followed.other)) return;
  // A simulated robot stays on its map, until the user looks at an alternative.
  const stay = state.virtual && other < 0 && answer !== followed.answer;
  followed = { answer, other };
  const wanted = other >= 0 ? others[other].map_id : answer.map?.map_id;
  if (wanted && !stay) void show(wanted);
}

/** Bring the thumbnails up to date. */
export function update(): void {
  row.hidden = !state.floors.length;
  if (row.hidden) {
    row.replaceChildren();
    return;
  }
  const verdicts = new Map(state.answer?.maps?.map((one) => [one.map_id, one]));
  const ids = listed();
  const items: HTMLElement[] = ids.map((id) => button(id, verdicts.get(id)));
  if (ids.length < state.floors.length) {
    items.push(made("span", { textContent: `and ${state.floors.length - ids.length} more` }));
  }
  // The order seldom changes, and a button that is put in again loses the focus.
  const now = ids.join(" ");
  if (now !== drawn || row.childElementCount !== items.length) row.replaceChildren(...items);
  drawn = now;
}

function button(id: string, verdict: MapVerdict | undefined): HTMLButtonElement {
  const one = buttons.get(id) ?? create(id);
  const on = state.answer?.map?.map_id === id;
  const { status, probability } = verdict ?? { status: null, probability: null };
  one.setAttribute("aria-pressed", String(state.mapId === id));
  one.dataset.state = status === null ? "none" : on && state.answer!.usable ? "usable" : status;
  const words = status === null ? "" : status.replace("_", " ") + (probability === null ? "" : `, ${percent(probability)}`);
  one.querySelector("small")!.textContent = documents.get(id) === null ? "cannot be read" : words;
  const map = documents.get(id);
  if (map) draw(one.querySelector("canvas")!, map, verdict?.pose ?? null, colours[on ? "estimate" : "other"]);
  return one;
}

function create(id: string): HTMLButtonElement {
  const one = made("button", {}, made("canvas"), made("span", { textContent: id }), made("small"));
  one.addEventListener("click", () => {
    state.other = followed.other = -1;
    void show(id);
  });
  buttons.set(id, one);
  return one;
}

/** Draw the walls and the best pose on a map, unless the canvas has them. */
function draw(canvas: HTMLCanvasElement, map: MapDocument, pose: Pose | null, colour: string): void {
  const content = JSON.stringify([pose, colour, colours.wall, window.devicePixelRatio]);
  if (canvas.dataset.content === content) return;
  canvas.dataset.content = content;
  const context = sized(canvas, WIDTH, HEIGHT);
  const [low_x, low_y, high_x, high_y] = boundsOf(map.segments);
  const scale = 0.9 * Math.min(WIDTH / Math.max(1, high_x - low_x), HEIGHT / Math.max(1, high_y - low_y));
  const at = (x: number, y: number): [number, number] => [WIDTH / 2 + scale * (x - (low_x + high_x) / 2), HEIGHT / 2 - scale * (y - (low_y + high_y) / 2)];
  context.strokeStyle = colours.wall;
  context.beginPath();
  for (const [x1, y1, x2, y2] of map.segments) {
    context.moveTo(...at(x1, y1));
    context.lineTo(...at(x2, y2));
  }
  context.stroke();
  if (!pose) return;
  context.fillStyle = colour;
  arrow(context, ...at(pose.x, pose.y), pose.theta, 9);
  context.fill();
}

onChange(() => {
  follow();
  update();
  if (state.floors.length) void readAll();
});
