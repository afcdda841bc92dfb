// The analysis of a map: a heat map on the plan shows where localization fails.

import { analyze } from "./api";
import { asStored, changed, kept, onChange, state, type Shown } from "./state";
import type { Analysis } from "./types";
import { messageOf } from "./words";

const value = (id: string) => document.querySelector<HTMLInputElement>(id)!.value;
const button = document.querySelector<HTMLButtonElement>("#analyze")!;
const clear = document.querySelector<HTMLButtonElement>("#clear")!;
const text = document.querySelector<HTMLElement>("#analyzed")!;
const show = document.querySelector<HTMLSelectElement>("#show")!;
const TIME = 20_000; // ms
const LONG_TIME = 30_000; // ms; a drive takes many searches

button.addEventListener("click", async () => {
  if (!state.map) {
    text.textContent = "There is no map yet. Open one, or choose an example.";
    return;
  }
  const { own, landmark } = kept();
  const laser = {
    fov: Math.min(2 * Math.PI, (Math.PI / 180) * Number(value("#fov"))),
    beams: Math.round(Number(value("#beams"))),
    range_max: Number(value("#range")),
    sigma: state.laser.sigma,
  };
  const spacing = value("#spacing") === "" ? null : Number(value("#spacing"));
  const drive = Number(value("#drive"));
  // The analysis reports each place without the added boxes and with them.
  const stored = asStored() || (state.mapId !== null && own.length === state.own);
  const map = stored ? { map_id: state.mapId! } : { ...state.map, segments: own };
  button.disabled = true;
  text.textContent = drive || landmark.length ? "Analyzing, which may take half a minute ..." : "Analyzing ...";
  const of = state.walls;
  try {
    const found = await analyze({ map, laser, spacing, drive, landmark, deadline_ms: drive ? LONG_TIME : TIME });
    if (of !== state.walls) return; // another map is shown by now
    Object.assign(state, { analysis: found, pointed: null });
    state.show = landmark.length ? "landmark" : drive ? "driven" : "now";
    text.textContent = summaryOf(found, drive);
  } catch (error) {
    text.textContent = messageOf(error);
  } finally {
    button.disabled = false;
    changed();
  }
});

function summaryOf({ places: found, summary, complete }: Analysis, drive: number): string {
  const { places, usable, similar_pose, left_out, resolved_within, usable_with_landmark } = summary;
  const rest = complete ? "" : ` The time limit left out ${left_out} more.`;
  if (!places) return `The map has no free place for a robot.${rest}`;
  const driven = resolved_within === null ? "" : ` After a drive of up to ${drive} m: at ${resolved_within}.`;
  const landmark = usable_with_landmark === null ? "" : ` With the added boxes: at ${usable_with_landmark}.`;
  const each = found.some((one) => one.pose.theta !== found[0].pose.theta) ? "places, four headings at each" : "places";
  return `Localization succeeds at ${usable} of ${places} ${each}; ${similar_pose} have a similar place.${driven}${landmark}${rest}`;
}

show.addEventListener("change", () => {
  state.show = show.value as Shown;
  changed();
});

clear.addEventListener("click", () => {
  state.analysis = state.pointed = null;
  changed();
});

onChange(() => {
  if (clear.disabled !== !state.analysis && !state.analysis && !button.disabled) text.textContent = "";
  clear.disabled = !state.analysis;
  const { resolved_within, usable_with_landmark } = state.analysis?.summary ?? { resolved_within: null, usable_with_landmark: null };
  const there: Record<Shown, boolean> = { now: true, driven: resolved_within !== null, landmark: usable_with_landmark !== null };
  if (!there[state.show]) state.show = "now";
  for (const option of show.options) option.disabled = !there[option.value as Shown];
  show.disabled = !there.driven && !there.landmark;
  show.value = state.show;
});
