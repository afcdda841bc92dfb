// The scan as the sensor saw it, before it was laid on the map.

import { pairColour, sentSegments } from "./drawing";
import { pointsOf } from "./geometry";
import { onChange, state } from "./state";
import type { Segment } from "./types";

const box = document.querySelector<HTMLElement>("#inset")!;
const canvas = box.querySelector("canvas")!;
const context = canvas.getContext("2d")!;
const SIDE = 150; // px

function draw(): void {
  const { answer, sent } = state;
  box.hidden = !answer || !sent;
  if (!answer || !sent) return;
  const ratio = window.devicePixelRatio || 1;
  canvas.width = canvas.height = SIDE * ratio;
  const colour = (name: string) => getComputedStyle(document.documentElement).getPropertyValue(name);
  const points = pointsOf(sent.scan);
  const segments = sentSegments();
  const reach = Math.max(1, ...[...points, ...segments.flatMap(([a, b, c, d]) => [[a, b], [c, d]])].map(([x, y]) => Math.max(Math.abs(x), Math.abs(y))));
  const scale = (0.46 * SIDE) / reach;
  context.setTransform(ratio, 0, 0, ratio, (SIDE * ratio) / 2, (SIDE * ratio) / 2);
  context.fillStyle = colour("--point");
  for (const [x, y] of points) context.fillRect(scale * x - 0.7, -scale * y - 0.7, 1.4, 1.4);
  const pair = new Map(answer.correspondences.map((one, index) => [one.scan, index]));
  segments.forEach((segment, k) => stroke(segment, scale, pair.has(k) ? pairColour(pair.get(k)!) : colour("--unmatched")));
  context.fillStyle = colour("--robot");
  context.beginPath();
  context.moveTo(8, 0);
  context.lineTo(-5, -5);
  context.lineTo(-5, 5);
  context.fill();
}

function stroke([x1, y1, x2, y2]: Segment, scale: number, colour: string): void {
  context.strokeStyle = colour;
  context.lineWidth = 3;
  context.beginPath();
  context.moveTo(scale * x1, -scale * y1);
  context.lineTo(scale * x2, -scale * y2);
  context.stroke();
}

onChange(draw);
