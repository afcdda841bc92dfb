// The walls of the map. Large maps move as a picture and are drawn sharp once they stand still.

import { made, sized } from "./dom";
import { state } from "./state";
import type { Segment } from "./types";
import { toPixels, view } from "./view";

const MANY = 2000; // walls up to which each frame draws all of them
const STILL = 120; // ms without a change of the view

interface Drawn {
  of: Segment[];
  colour: string;
  view: typeof view;
  picture: HTMLCanvasElement;
}

let path: { of: Segment[]; of_them: Path2D } | null = null;
let drawn: Drawn | null = null;
let timer = 0;

/** Draw the walls; `again` is called when they have to be drawn again. */
export function drawWalls(context: CanvasRenderingContext2D, colour: string, again: () => void): void {
  if (state.walls.length <= MANY) return stroke(context, colour);
  const same = drawn !== null && drawn.of === state.walls && drawn.colour === colour && drawn.view.ratio === view.ratio;
  const still = same && (["x", "y", "scale", "width", "height"] as const).every((name) => drawn!.view[name] === view[name]);
  if (!same) draw(colour);
  else if (!still) {
    clearTimeout(timer);
    timer = window.setTimeout(() => {
      draw(colour);
      again();
    }, STILL);
  }
  const from = drawn!.view;
  const factor = view.scale / from.scale;
  const [x, y] = toPixels(from.x, from.y);
  context.drawImage(drawn!.picture, x - (factor * from.width) / 2, y - (factor * from.height) / 2, factor * from.width, factor * from.height);
}

function draw(colour: string): void {
  const picture = drawn?.picture ?? made("canvas");
  stroke(sized(picture, view.width, view.height, view.ratio), colour);
  drawn = { of: state.walls, colour, view: { ...view }, picture };
}

function stroke(context: CanvasRenderingContext2D, colour: string): void {
  const [ox, oy] = state.walls[0] ?? [0, 0];
  if (path?.of !== state.walls) {
    // About one of its ends: a browser's paths are single precision.
    const of_them = new Path2D();
    for (const [x1, y1, x2, y2] of state.walls) {
      of_them.moveTo(x1 - ox, y1 - oy);
      of_them.lineTo(x2 - ox, y2 - oy);
    }
    path = { of: state.walls, of_them };
  }
  context.save();
  context.translate(...toPixels(ox, oy));
  context.scale(view.scale, -view.scale);
  context.lineCap = "butt";
  context.lineWidth = 1.6 / view.scale;
  context.strokeStyle = colour;
  context.stroke(path.of_them);
  context.restore();
}
