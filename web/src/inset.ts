// The scan in the sensor's own frame, before it is laid on the map.

import { arrow, sized } from "./dom";
import { colours, sentSegments } from "./drawing";
import { pointsOf } from "./geometry";
import { onChange, state } from "./state";

const box = document.querySelector<HTMLElement>("#inset")!;
const canvas = box.querySelector("canvas")!;
const SIDE = 150; // px

export function drawInset(): void {
  const { answer, sent } = state;
  box.hidden = !answer || !sent;
  if (!answer || !sent) return;
  const context = sized(canvas, SIDE, SIDE);
  context.translate(SIDE / 2, SIDE / 2);
  const points = pointsOf(sent.scan);
  const segments = sentSegments();
  const reach = Math.max(1, ...[...points, ...segments.flatMap(([a, b, c, d]) => [[a, b], [c, d]])].map(([x, y]) => Math.max(Math.abs(x), Math.abs(y))));
  const scale = (0.46 * SIDE) / reach;
  context.fillStyle = colours.scan;
  for (const [x, y] of points) context.fillRect(scale * x - 0.7, -scale * y - 0.7, 1.4, 1.4);
  const matched = new Set(answer.correspondences.map((pair) => pair.scan));
  context.lineWidth = 3;
  segments.forEach(([x1, y1, x2, y2], k) => {
    context.strokeStyle = matched.has(k) ? colours.matched : colours.unmatched;
    context.beginPath();
    context.moveTo(scale * x1, -scale * y1);
    context.lineTo(scale * x2, -scale * y2);
    context.stroke();
  });
  context.strokeStyle = colours.robot;
  context.lineWidth = 2;
  arrow(context, 0, 0, 0, 8);
  context.stroke();
}

onChange(drawInset);
