// Examples, and what happens when another map is shown.

import { example, getMap } from "./api";
import { askSoon } from "./asking";
import { degrees } from "./geometry";
import { boundsOf, changed, onChange, setMap, state } from "./state";
import type { Example } from "./types";
import { showProblem } from "./verdict";
import { fit } from "./view";
import { messageOf } from "./words";

const NAMES: Record<string, string> = {
  flat: "A flat",
  office: "An office",
  rooms: "Three equal rooms",
  corridor: "A corridor",
  warehouse: "A warehouse",
};
export const FIRST = "rooms"; // which is shown when the page opens
const chooser = document.querySelector<HTMLSelectElement>("#example")!;
const virtual = document.querySelector<HTMLInputElement>("#virtual")!;

let latest = 0;

/** Begin to open something; what was being opened before is dropped. Returns its number. */
export function supersede(): number {
  document.querySelector("#reading")!.textContent = "";
  return ++latest;
}

/** Return whether nothing else was opened since. */
export const isLatest = (number: number) => number === latest;

export function showAll(about: string, example = ""): void {
  state.example = example;
  document.querySelector("#about")!.textContent = about;
  for (const [id, value] of Object.entries({ "#fov": degrees(state.laser.fov), "#beams": state.laser.beams, "#range": state.laser.range_max }))
    document.querySelector<HTMLInputElement>(id)!.value = String(Math.round(100 * value) / 100);
  fit(boundsOf(state.walls));
  changed();
}

/** Show a stored map, and search the scan on it. */
export async function openStored(id: string, mine = supersede()): Promise<void> {
  const map = await getMap(id);
  if (!isLatest(mine)) return;
  setMap(map, id);
  showAll(`The stored map ${id}.`);
  askSoon();
}

export async function choose(name: string): Promise<void> {
  const mine = supersede();
  let found: Example;
  try {
    found = await example<Example>(name);
  } catch (error) {
    showProblem(messageOf(error));
    return;
  }
  if (mine !== latest) return;
  state.scans = [];
  setMap(found.map);
  Object.assign(state, { boxes: found.boxes, robot: found.pose, laser: found.laser, virtual: true, scan: null });
  showAll(found.about, name);
  askSoon();
}

chooser.append(new Option("choose one", ""), ...Object.entries(NAMES).map(([name, title]) => new Option(title, name)));
chooser.addEventListener("change", () => {
  if (chooser.value) void choose(chooser.value);
});
virtual.addEventListener("change", () => {
  state.virtual = virtual.checked; // also while a map is being read
  askSoon();
});

onChange(() => {
  virtual.checked = state.virtual;
  chooser.value = state.example;
  document.querySelector<HTMLElement>("#hint")!.hidden = state.map !== null || state.scan !== null || state.log.length > 0;
});
