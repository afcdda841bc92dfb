// What a user may change about the scan and the map.

import { ask, askSoon } from "./asking";
import { onChange, state } from "./state";

const noise = document.querySelector<HTMLInputElement>("#noise")!;
const told = document.querySelector<HTMLOutputElement>("#noise-value")!;
const restore = document.querySelector<HTMLButtonElement>("#restore")!;

noise.addEventListener("input", () => {
  state.noise = Number(noise.value);
  askSoon();
});
restore.addEventListener("click", () => {
  state.off = new Set();
  askSoon();
});
document.querySelector("#near")!.addEventListener("change", askSoon);
document.querySelector("#run")!.addEventListener("click", () => void ask());

onChange(() => {
  told.textContent = `${(100 * state.noise).toFixed(1)} cm`;
  restore.disabled = state.off.size === 0;
});
