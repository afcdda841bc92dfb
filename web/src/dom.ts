// Elements of the page: finding and making them, canvases in the screen's pixels, and files for the user.

export const element = <T extends HTMLElement = HTMLElement>(id: string) => document.querySelector<T>(id)!;

/** Make an element with properties and children. */
export function made<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Partial<HTMLElementTagNameMap[K]> = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const one = Object.assign(document.createElement(tag), properties);
  one.append(...children);
  return one;
}

/** Give a canvas a size, and return its context; both in pixels of the style sheet. */
export function sized(canvas: HTMLCanvasElement, width: number, height: number, ratio = window.devicePixelRatio || 1): CanvasRenderingContext2D {
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const context = canvas.getContext("2d")!;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  return context;
}

/** Add the outline of a robot to a context; its length from the middle to the front in pixels. */
export function arrow(context: CanvasRenderingContext2D, px: number, py: number, theta: number, front: number): void {
  const [c, s] = [front * Math.cos(theta), -front * Math.sin(theta)];
  context.beginPath();
  context.moveTo(px + c, py + s);
  context.lineTo(px - 0.62 * (c + s), py - 0.62 * (s - c));
  context.lineTo(px - 0.62 * (c - s), py - 0.62 * (s + c));
  context.closePath();
}

/** Save JSON as a file. */
export function save(json: string, name: string): void {
  const link = made("a", { href: URL.createObjectURL(new Blob([json], { type: "application/json" })), download: name });
  link.click();
  URL.revokeObjectURL(link.href);
}
