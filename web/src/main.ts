// Puts the page together; each module looks after its own controls.

import "./analysis";
import "./files";
import "./imported";
import "./inset";
import "./log";
import "./pointer";
import "./share";
import "./stored";
import "./trying";
import { setKey } from "./api";
import { readColours, redraw, resize } from "./drawing";
import { choose } from "./scene";
import { onChange } from "./state";

const key = document.querySelector<HTMLInputElement>("#key")!;
key.addEventListener("input", () => setKey(key.value));
document.querySelector("#key-form")!.addEventListener("submit", (event) => event.preventDefault());

onChange(redraw);
readColours();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readColours();
  redraw();
});
new ResizeObserver(resize).observe(document.querySelector("#plan")!);
resize();

const named = new URLSearchParams(location.search).get("example");
if (named && /^[a-z]+$/.test(named)) {
  document.querySelector<HTMLSelectElement>("#example")!.value = named;
  void choose(named);
}
