// Puts the page together; each module looks after its own controls.

import "./analysis";
import "./files";
import "./imported";
import "./legend";
import "./log";
import "./pointer";
import "./proposal";
import "./stored";
import "./trying";
import { setKey } from "./api";
import { readColours, redraw, resize } from "./drawing";
import { update } from "./floors";
import { drawInset } from "./inset";
import { choose, FIRST } from "./scene";
import { openLink } from "./share";
import { onChange } from "./state";

const key = document.querySelector<HTMLInputElement>("#key")!;
key.addEventListener("input", () => setKey(key.value));
document.querySelector("#key-form")!.addEventListener("submit", (event) => event.preventDefault());

onChange(redraw);
readColours();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  readColours();
  redraw();
  drawInset();
  update();
});
new ResizeObserver(resize).observe(document.querySelector("#plan")!);
resize();

const named = openLink() ? null : new URLSearchParams(location.search).get("example") ?? "";
if (named !== null) void choose(/^[a-z]+$/.test(named) ? named : FIRST);
