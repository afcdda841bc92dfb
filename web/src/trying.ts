// Changes to the scan and the map.

import { ask, askSoon } from "./asking";
import { onChange, restore as restoreMap, state } from "./state";

const noise = document.querySelector<HTMLInputElement>("#noise")!;
const shown = document.querySelector<HTMLOutputElement>("#noise-value")!;
const restore = document.querySelector<HTMLButtonElement>("#restore")!;

noise.addEventListener("input", () => {
  state.noise = Number(noise.value);
  askSoon();
});
restore.addEventListener("click", () => {
  restoreMap();
  askSoon();
});
// A click does one thing or the other.
const [erase, build] = ["#erase", "#build"].map((id) => document.querySelector<HTMLInputElement>(id)!);
erase.addEventListener("change", () => (build.checked &&= !erase.checked));
build.addEventListener("change", () => (erase.checked &&= !build.checked));
for (const id of ["#near", "#on-map", "#usable-from"]) document.querySelector(id)!.addEventListener("change", askSoon);
document.querySelector("#run")!.addEventListener("click", () => void ask());

onChange(() => {
  shown.textContent = `${(100 * state.noise).toFixed(1)} cm`;
  restore.disabled = state.off.size === 0 && state.walls.length === state.own;
});
