// Examples, and what to do when another map is shown.

import { example } from "./api";
import { askSoon } from "./asking";
import { boundsOf, changed, onChange, setMap, state } from "./state";
import type { Example } from "./types";
import { tellProblem } from "./verdict";
import { fit } from "./view";

const NAMES: Record<string, string> = {
  flat: "A flat",
  office: "An office",
  rooms: "Look-alike rooms",
  corridor: "A corridor",
  warehouse: "A warehouse",
};
const chooser = document.querySelector<HTMLSelectElement>("#example")!;
const virtual = document.querySelector<HTMLInputElement>("#virtual")!;

export function showAll(about: string, example = ""): void {
  chooser.value = example;
  document.querySelector("#about")!.textContent = about;
  for (const [id, value] of Object.entries({ "#fov": (180 / Math.PI) * state.laser.fov, "#beams": state.laser.beams, "#range": state.laser.range_max }))
    document.querySelector<HTMLInputElement>(id)!.value = String(Math.round(100 * value) / 100);
  fit(boundsOf(state.walls));
  changed();
}

export async function choose(name: string): Promise<void> {
  let found: Example;
  try {
    found = await example<Example>(name);
  } catch (error) {
    tellProblem(error instanceof Error ? error.message : String(error));
    return;
  }
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
  state.virtual = virtual.checked; // it may be waiting for a map that is being read
  askSoon();
});

onChange(() => {
  virtual.checked = state.virtual;
  document.querySelector<HTMLElement>("#hint")!.hidden = state.map !== null || state.scan !== null || state.log.length > 0;
});
