// Where the map will fail, as a heat map over the plan.

import { analyze } from "./api";
import { changed, onChange, state } from "./state";
import type { MapDocument } from "./types";

const value = (id: string) => document.querySelector<HTMLInputElement>(id)!.value;
const button = document.querySelector<HTMLButtonElement>("#analyze")!;
const clear = document.querySelector<HTMLButtonElement>("#clear")!;
const told = document.querySelector<HTMLElement>("#analyzed")!;
const TIME = 20_000; // ms

button.addEventListener("click", async () => {
  if (!state.map) {
    told.textContent = "There is no map yet.";
    return;
  }
  const map: MapDocument = { ...state.map, segments: state.walls.filter((_, k) => !state.off.has(k)) };
  const laser = {
    fov: Math.min(2 * Math.PI, (Math.PI / 180) * Number(value("#fov"))),
    beams: Math.round(Number(value("#beams"))),
    range_max: Number(value("#range")),
    sigma: state.laser.sigma,
  };
  const spacing = value("#spacing") === "" ? null : Number(value("#spacing"));
  const target = state.mapId !== null && !state.off.size ? { map_id: state.mapId } : map;
  button.disabled = true;
  told.textContent = "Looking about ...";
  const of = state.walls;
  try {
    const found = await analyze({ map: target, laser, spacing, deadline_ms: TIME });
    if (of !== state.walls) return; // another map is shown by now
    state.analysis = found;
    const { places, usable, look_alike, left_out } = found.summary;
    const rest = found.complete ? "" : ` There was no time for ${left_out} more.`;
    told.textContent = places
      ? `A robot would know where it is at ${usable} of ${places} places; ${look_alike} look like another.${rest}`
      : `There is no place where a robot could stand.${rest}`;
  } catch (error) {
    told.textContent = error instanceof Error ? error.message : String(error);
  } finally {
    button.disabled = false;
    changed();
  }
});

clear.addEventListener("click", () => {
  state.analysis = null;
  changed();
});

onChange(() => {
  if (clear.disabled !== !state.analysis && !state.analysis && !button.disabled) told.textContent = "";
  clear.disabled = !state.analysis;
});
