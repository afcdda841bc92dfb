// Mouse, touch and keyboard on the plan.

import { ask, askSoon } from "./asking";
import { changeAt, toggle } from "./changes";
import { HANDLE, redraw } from "./drawing";
import { wrap } from "./geometry";
import { showLegend } from "./legend";
import { describe, placeAt, wallAt } from "./pointed";
import { lookAt } from "./proposal";
import { addWalls, boundsOf, changed, state, type Layer } from "./state";
import { step } from "./verdict";
import { fit, keepVisible, toMetres, toPixels, view, zoom } from "./view";

const canvas = document.querySelector<HTMLCanvasElement>("#plan")!;
const hover = document.querySelector<HTMLElement>("#hover")!;
const cursor = document.querySelector<HTMLElement>("#cursor")!;
const erase = document.querySelector<HTMLInputElement>("#erase")!;
const build = document.querySelector<HTMLInputElement>("#build")!;
const BOX = [1, 0.6]; // m; of a box that is added
const GRIP = 18; // px about the robot
const FINGER = 1.6; // times as much under a finger
type Grip = "plan" | "robot" | "turn";
let drag: { what: Grip; x: number; y: number; moved: boolean } | null = null;
const fingers = new Map<number, [number, number]>();

/** Put the text next to the mouse, inside the plan. */
function besides(px: number, py: number): void {
  hover.style.translate = "0 0"; // at the edge it would be squeezed
  const [x, y] = [Math.min(px + 14, view.width - hover.offsetWidth - 8), Math.min(py + 14, view.height - hover.offsetHeight - 8)];
  hover.style.translate = `${Math.max(0, x)}px ${Math.max(0, y)}px`;
}

function whatAt(px: number, py: number, factor = 1): Grip {
  if ((!state.scan && !state.virtual) || state.log.length) return "plan";
  const [rx, ry] = toPixels(state.robot.x, state.robot.y);
  const [hx, hy] = [rx + HANDLE * Math.cos(state.robot.theta), ry - HANDLE * Math.sin(state.robot.theta)];
  if (Math.hypot(px - hx, py - hy) < (factor * GRIP) / 1.5) return "turn";
  return Math.hypot(px - rx, py - ry) < factor * GRIP ? "robot" : "plan";
}

// One finger away from the robot scrolls the page. One on the robot drags it, and two move and zoom the plan.
canvas.addEventListener(
  "touchstart",
  (event) => {
    const box = canvas.getBoundingClientRect();
    const [first] = event.touches;
    if (event.touches.length > 1 || whatAt(first.clientX - box.x, first.clientY - box.y, FINGER) !== "plan") event.preventDefault();
  },
  { passive: false },
);

canvas.addEventListener("pointerdown", (event) => {
  const [px, py] = [event.offsetX, event.offsetY];
  const touch = event.pointerType === "touch";
  if (touch) fingers.set(event.pointerId, [px, py]);
  canvas.setPointerCapture(event.pointerId);
  drag = fingers.size > 1 ? null : { what: whatAt(px, py, touch ? FINGER : 1), x: px, y: py, moved: false };
});

canvas.addEventListener("pointermove", (event) => {
  const [px, py] = [event.offsetX, event.offsetY];
  if (fingers.size > 1 && fingers.has(event.pointerId)) return pinch(event.pointerId, px, py);
  const touch = event.pointerType === "touch";
  const [x, y] = toMetres(px, py);
  if (!touch) cursor.textContent = `x ${x.toFixed(2)} m, y ${y.toFixed(2)} m`;
  if (!drag) {
    if (!touch) point(px, py);
    return;
  }
  const [dx, dy] = [px - drag.x, py - drag.y];
  drag.moved ||= Math.hypot(dx, dy) > 3;
  if (!drag.moved) return;
  [drag.x, drag.y] = [px, py];
  if (drag.what === "plan") {
    if (touch) return; // it scrolls
    view.x -= dx / view.scale;
    view.y += dy / view.scale;
    redraw();
    return;
  }
  if (drag.what === "robot") move(dx / view.scale, -dy / view.scale);
  else state.robot = { ...state.robot, theta: Math.atan2(y - state.robot.y, x - state.robot.x) };
  askSoon();
});

/** Describe what the mouse points at. */
function point(px: number, py: number): void {
  const text = describe(px, py);
  const [x, y] = toMetres(px, py);
  const pointed = placeAt(x, y);
  if (pointed !== state.pointed) {
    state.pointed = pointed;
    looked();
  }
  lookAt(changeAt(x, y, 8 / view.scale));
  hover.hidden = !text;
  hover.textContent = text;
  if (text) besides(px, py);
  canvas.style.cursor = { plan: erase.checked || build.checked ? "crosshair" : "grab", robot: "move", turn: "alias" }[whatAt(px, py)];
}

/** Move and zoom the plan with two fingers, of which one has moved. */
function pinch(id: number, px: number, py: number): void {
  const [ox, oy] = fingers.get(id)!;
  const [qx, qy] = [...fingers].find(([other]) => other !== id)![1];
  fingers.set(id, [px, py]);
  view.x -= (px - ox) / 2 / view.scale;
  view.y += (py - oy) / 2 / view.scale;
  zoom(Math.hypot(px - qx, py - qy) / Math.max(1, Math.hypot(ox - qx, oy - qy)), (px + qx) / 2, (py + qy) / 2);
  looked();
}

canvas.addEventListener("pointerup", (event) => {
  fingers.delete(event.pointerId);
  if (drag && !drag.moved && erase.checked) toggleWall(event.offsetX, event.offsetY);
  else if (drag && !drag.moved && !build.checked) toggleChange(event.offsetX, event.offsetY);
  if (drag && !drag.moved && build.checked) putBox(...toMetres(event.offsetX, event.offsetY));
  drag = null;
});
canvas.addEventListener("pointercancel", (event) => {
  fingers.delete(event.pointerId);
  drag = null;
});
canvas.addEventListener("pointerleave", () => {
  hover.hidden = true;
  cursor.textContent = "";
  lookAt(-1);
});

canvas.addEventListener(
  "wheel",
  (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
    looked();
  },
  { passive: false },
);

/** Accept or refuse the change that is there. */
function toggleChange(px: number, py: number): void {
  const change = changeAt(...toMetres(px, py), 8 / view.scale);
  if (change < 0) return;
  toggle(change);
  changed();
  point(px, py);
}

function toggleWall(px: number, py: number): void {
  const wall = wallAt(...toMetres(px, py), 10 / view.scale);
  if (wall < 0) return;
  if (state.off.has(wall)) state.off.delete(wall);
  else if (state.off.size < state.walls.length - 1) state.off.add(wall); // a map has one wall at least
  askSoon();
}

/** Add a box about a place; its free side is outside. */
function putBox(x: number, y: number): void {
  if (!state.map) return;
  const [w, h] = [BOX[0] / 2, BOX[1] / 2];
  const corners: [number, number][] = [[x - w, y - h], [x - w, y + h], [x + w, y + h], [x + w, y - h]];
  addWalls(corners.map((one, k) => [...one, ...corners[(k + 1) % 4]]));
  askSoon();
}

function move(dx: number, dy: number, turn = 0): void {
  const { x, y, theta } = state.robot;
  state.robot = { x: x + dx, y: y + dy, theta: wrap(theta + turn) };
}

function fitPlan(): void {
  fit(boundsOf(state.walls));
}

/** Draw another part of the plan, and what the legend says of it. */
function looked(): void {
  redraw();
  showLegend();
}

const SHIFTED = 10;
canvas.addEventListener("keydown", (event) => {
  const metres = 0.1 * (event.shiftKey ? SHIFTED : 1);
  const radians = (Math.PI / 180) * 5;
  const pixels = 60 / view.scale;
  const robot: Record<string, () => void> = {
    ArrowLeft: () => move(-metres, 0),
    ArrowRight: () => move(metres, 0),
    ArrowUp: () => move(0, metres),
    ArrowDown: () => move(0, -metres),
    q: () => move(0, 0, radians),
    e: () => move(0, 0, -radians),
  };
  const plan: Record<string, () => void> = {
    "+": () => zoom(1.25),
    "-": () => zoom(0.8),
    "0": fitPlan,
    w: () => (view.y += pixels),
    s: () => (view.y -= pixels),
    a: () => (view.x -= pixels),
    d: () => (view.x += pixels),
    n: () => step(1),
    b: () => putBox(state.robot.x + 1.5 * Math.cos(state.robot.theta), state.robot.y + 1.5 * Math.sin(state.robot.theta)),
    Enter: () => void ask(),
  };
  const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (event.ctrlKey || event.metaKey || event.altKey || !(robot[name] || plan[name])) return;
  event.preventDefault();
  if (robot[name]) {
    robot[name]();
    keepVisible(state.robot.x, state.robot.y);
    askSoon();
  } else {
    plan[name]();
    if (name === "n") changed();
    else if (name === "b") return;
    else looked();
  }
});

for (const [id, action] of Object.entries({
  "#zoom-in": () => zoom(1.25),
  "#zoom-out": () => zoom(0.8),
  "#fit": fitPlan,
}))
  document.querySelector(id)!.addEventListener("click", () => {
    action();
    looked();
  });

const openers = [...document.querySelectorAll<HTMLButtonElement>("#tools [aria-controls]")];

/** Show the panel of a button, or hide it. */
function expand(button: HTMLButtonElement, is_open: boolean): void {
  document.getElementById(button.getAttribute("aria-controls")!)!.hidden = !is_open;
  button.setAttribute("aria-expanded", String(is_open));
}

for (const button of openers) button.addEventListener("click", () => expand(button, button.getAttribute("aria-expanded") !== "true"));
document.addEventListener("keydown", ({ key }) => {
  if (key !== "Escape") return;
  for (const button of openers) expand(button, false);
  document.querySelector<HTMLElement>("#hover")!.hidden = true; // what a pointer that stays would leave in the way
});
for (const tick of document.querySelectorAll<HTMLInputElement>("#layers input"))
  tick.addEventListener("change", () => {
    state.layers[tick.value as Layer] = tick.checked;
    changed();
  });
