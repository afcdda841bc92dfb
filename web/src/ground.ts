// The ground under the walls: the picture of an imported grid, and a grid of metres with its scale bar.

import { state } from "./state";
import { toMetres, toPixels, view } from "./view";

const bar = document.querySelector<HTMLElement>("#bar")!;
const length = document.querySelector<HTMLElement>("#length")!;
const APART = 24; // px; least distance of two lines of the grid
const LEAST_BAR = 45; // px

/** Draw the picture of the grid that the map was imported from. */
export function drawPicture(context: CanvasRenderingContext2D): void {
  const { picture } = state;
  if (!picture?.image.complete) return;
  const { pose, resolution, image } = picture;
  context.save();
  context.translate(...toPixels(pose.x, pose.y));
  context.rotate(-pose.theta);
  context.scale(resolution * view.scale, resolution * view.scale);
  context.imageSmoothingEnabled = view.scale * resolution < 1;
  context.globalAlpha = matchMedia("(prefers-color-scheme: dark)").matches ? 0.2 : 0.45;
  context.drawImage(image, 0, -image.naturalHeight); // its first row is the highest
  context.restore();
}

/** Draw lines at whole metres, and set the scale bar. */
export function drawGrid(context: CanvasRenderingContext2D, colour: string): void {
  const step = Math.max(1, roundedUp(APART));
  const [west, north] = toMetres(0, 0);
  const [east, south] = toMetres(view.width, view.height);
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  for (let x = Math.ceil(west / step) * step; x <= east; x += step) {
    const px = Math.round(toPixels(x, 0)[0]) + 0.5;
    context.moveTo(px, 0);
    context.lineTo(px, view.height);
  }
  for (let y = Math.ceil(south / step) * step; y <= north; y += step) {
    const py = Math.round(toPixels(0, y)[1]) + 0.5;
    context.moveTo(0, py);
    context.lineTo(view.width, py);
  }
  context.stroke();
  const shown = roundedUp(LEAST_BAR);
  bar.style.width = `${shown * view.scale}px`;
  length.textContent = `${shown >= 1 ? `${shown} m` : `${Math.round(100 * shown)} cm`}, grid ${step} m`;
}

/** Return the least length of 1, 2 or 5 times a power of ten that takes so many pixels, metres. */
function roundedUp(pixels: number): number {
  const least = pixels / view.scale;
  const power = 10 ** Math.floor(Math.log10(least));
  return power * ([1, 2, 5].find((one) => one * power >= least * (1 - 1e-9)) ?? 10);
}
