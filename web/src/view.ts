// The visible part of the plane: metres to pixels and back, y up.

import type { Segment } from "./types";

export const view = { x: 0, y: 0, scale: 40, width: 100, height: 100, ratio: 1 };

const BORDER = 12; // px, within the margin of a map that is fitted

export function toPixels(x: number, y: number): [number, number] {
  return [view.width / 2 + (x - view.x) * view.scale, view.height / 2 - (y - view.y) * view.scale];
}

export function toMetres(px: number, py: number): [number, number] {
  return [view.x + (px - view.width / 2) / view.scale, view.y - (py - view.height / 2) / view.scale];
}

export function fit([low_x, low_y, high_x, high_y]: Segment): void {
  view.x = (low_x + high_x) / 2;
  view.y = (low_y + high_y) / 2;
  const [wide, high] = [Math.max(high_x - low_x, 1), Math.max(high_y - low_y, 1)];
  view.scale = 0.88 * Math.min(view.width / wide, view.height / high);
}

/** Move to a place that is at the border of the screen or beyond. */
export function keepVisible(x: number, y: number): void {
  const [px, py] = toPixels(x, y);
  if (px < BORDER || py < BORDER || px > view.width - BORDER || py > view.height - BORDER) Object.assign(view, { x, y });
}

/** Zoom about a place on the screen, which stays where it is. */
export function zoom(factor: number, px = view.width / 2, py = view.height / 2): void {
  const [x, y] = toMetres(px, py);
  view.scale = Math.min(5000, Math.max(0.02, view.scale * factor));
  view.x = x - (px - view.width / 2) / view.scale;
  view.y = y + (py - view.height / 2) / view.scale;
}
