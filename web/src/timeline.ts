// The verdicts of a log in their order, and the filter of its scans.

import { element, sized } from "./dom";
import { colours, KINDS } from "./drawing";
import { kindOf } from "./heat";
import { changed, onChange, state } from "./state";
import type { LogLine } from "./types";

const canvas = element<HTMLCanvasElement>("#timeline canvas");
const filter = element<HTMLSelectElement>("#filter");
const THUMB = 12; // px, as in the style sheet: its middle is on the scan
const LEAST = 0.25; // height of a verdict that is worst; the best has the whole height
export const FADED = 0.15; // opacity of a scan that the filter omits

export const codesOf = (line: LogLine) => line.reasons.map((one) => (typeof one === "string" ? one : one.code));

/** Whether the filter shows a scan; one that was not searched yet only where all are shown. */
export function passes(line: LogLine | null): boolean {
  if (!state.filter) return true;
  return line !== null && [line.usable ? "usable" : "not usable", ...codesOf(line)].includes(state.filter);
}

/** The first scan that the filter shows, from one onwards or backwards; null where there is none. */
export function matching(from: number, way: number): number | null {
  for (let k = from; k >= 0 && k < state.log.length; k += way) if (passes(state.log[k])) return k;
  return null;
}

/** Offer what the verdicts so far can be filtered by. */
export function showFilter(): void {
  if (filter.matches(":focus") && state.filter === filter.value) return; // it may be open
  const counts = new Map<string, number>([["usable", 0], ["not usable", 0]]);
  for (const line of state.log)
    if (line) for (const one of [line.usable ? "usable" : "not usable", ...codesOf(line)]) counts.set(one, (counts.get(one) ?? 0) + 1);
  filter.replaceChildren(
    new Option(`all scans (${state.log.length})`, ""),
    ...[...counts].map(([one, count]) => new Option(`${one.replaceAll("_", " ")} (${count})`, one)),
  );
  filter.value = state.filter;
}

filter.addEventListener("change", () => {
  state.filter = filter.value;
  changed();
});

function draw(): void {
  const { log } = state;
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const context = sized(canvas, width, height);
  const step = (width - THUMB) / Math.max(1, log.length - 1);
  log.forEach((line, k) => {
    const worse = line ? KINDS.indexOf(kindOf(line)) / (KINDS.length - 1) : 1;
    const high = height * (1 - (1 - LEAST) * worse);
    context.fillStyle = line ? colours[kindOf(line)] : colours.grid;
    context.globalAlpha = passes(line) ? 1 : FADED;
    const [left, right] = [k - 0.5, k + 0.5].map((at) => Math.round((THUMB / 2 + at * step) * ratio) / ratio); // no gaps
    context.fillRect(left, height - high, Math.max(1 / ratio, right - left), high);
  });
}

new ResizeObserver(draw).observe(canvas);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => requestAnimationFrame(draw));
onChange(draw);
