// Poses, and a simulated scanner like the service's own: each beam returns its range to the nearest wall.

import type { Example, Laser, Pose, Scan, Segment, View } from "./types";

export const degrees = (radians: number) => (180 / Math.PI) * radians;

export function wrap(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

export function place(pose: Pose, x: number, y: number): [number, number] {
  const c = Math.cos(pose.theta);
  const s = Math.sin(pose.theta);
  return [pose.x + c * x - s * y, pose.y + s * x + c * y];
}

export function placed(pose: Pose, [x1, y1, x2, y2]: Segment): Segment {
  return [...place(pose, x1, y1), ...place(pose, x2, y2)];
}

/** How far a point is from a segment, metres. */
export function distance(x: number, y: number, [x1, y1, x2, y2]: Segment): number {
  const [dx, dy] = [x2 - x1, y2 - y1];
  const t = Math.max(0, Math.min(1, ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - x1 - t * dx, y - y1 - t * dy);
}

/** Gaussian noise that is the same each time, so that a verdict does not flicker. */
export function noise(seed: number): () => number {
  let a = seed | 0;
  const uniform = () => {
    a = (a + 0x6d2b79f5) | 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
  return () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform());
}

/** Simulate a scan from a pose; a range above `range_max` says that nothing came back. */
export function takeScan(walls: Segment[], pose: Pose, laser: Example["laser"], sigma: number): Scan {
  const full = laser.fov > 2 * Math.PI - 0.01;
  const step = laser.fov / (full ? laser.beams : laser.beams - 1);
  const start = -laser.fov / 2;
  const gauss = noise(1);
  const ranges: number[] = [];
  for (let k = 0; k < laser.beams; k++) {
    const angle = pose.theta + start + k * step;
    const range = cast(walls, pose, Math.cos(angle), Math.sin(angle)) + sigma * gauss();
    ranges.push(range <= laser.range_max ? round(Math.max(0.01, range)) : round(2 * laser.range_max));
  }
  const scanned: Laser = { angle_min: start, angle_increment: step, ranges, range_max: laser.range_max };
  return { laser: scanned };
}

function cast(walls: Segment[], from: Pose, dx: number, dy: number): number {
  let nearest = Infinity;
  for (const [x1, y1, x2, y2] of walls) {
    const [ex, ey] = [x2 - x1, y2 - y1];
    const cross = dx * ey - dy * ex;
    if (cross === 0) continue;
    const [bx, by] = [x1 - from.x, y1 - from.y];
    const range = (bx * ey - by * ex) / cross;
    const fraction = (bx * dy - by * dx) / cross;
    if (range > 0 && range < nearest && fraction >= -1e-9 && fraction <= 1 + 1e-9) nearest = range;
  }
  return nearest;
}

/** Return a scan with noise added. */
export function noisy<T extends Scan>(scan: T, sigma: number): T {
  if (sigma === 0) return scan;
  if (scan.views) return { ...scan, views: scan.views.map((one) => noisy(one, sigma)) };
  const gauss = noise(2);
  if (scan.laser) {
    const most = scan.laser.range_max ?? Infinity;
    const ranges = scan.laser.ranges.map((r) => (r === null || r > most ? r : round(Math.max(0.01, r + sigma * gauss()))));
    return { ...scan, laser: { ...scan.laser, ranges }, ...(scan.sigma ? { sigma: Math.hypot(scan.sigma, sigma) } : {}) };
  }
  const moved = (values: number[]) => values.map((v) => round(v + sigma * gauss()));
  if (scan.points) return { ...scan, points: scan.points.map(moved) as [number, number][] };
  // A segment is a fit of many points: its ends move by less than these do.
  return { ...scan, segments: (scan.segments ?? []).map((s) => moved(s) as Segment), sigma: Math.hypot(Number(scan.sigma ?? 0.02), sigma) };
}

/** Return a scan's points or segments from the frame of a view's sensor in that of the robot. */
export function fromView({ pose, flipped }: View, x: number, y: number): [number, number] {
  return place(pose, x, flipped ? -y : y);
}

/** The points of a scan in its own frame. */
export function pointsOf(scan: Scan): [number, number][] {
  if (scan.views) return scan.views.flatMap((one) => pointsOf({ ...one, views: undefined }).map(([x, y]) => fromView(one, x, y)));
  if (scan.points && Array.isArray(scan.points[0])) return scan.points;
  if (!scan.laser) return [];
  const { angle_min, angle_increment, ranges } = scan.laser;
  const [range_min, range_max] = [scan.laser.range_min ?? 0, scan.laser.range_max ?? Infinity];
  const points: [number, number][] = [];
  ranges.forEach((r, k) => {
    if (r === null || r < range_min || r > range_max || r <= 0) return;
    const angle = angle_min + k * angle_increment;
    points.push([r * Math.cos(angle), r * Math.sin(angle)]);
  });
  return points;
}

/** The beams of a scan that returned, from sensor to point, in the scan's frame. */
export function beamsOf(scan: Scan): Segment[] {
  const views: Partial<View>[] = scan.views ?? [scan];
  return views.flatMap(({ pose = { x: 0, y: 0, theta: 0 }, ...one }) => pointsOf({ views: [{ ...one, pose }] }).map((to): Segment => [pose.x, pose.y, ...to]));
}

function round(value: number): number {
  return Math.round(1e4 * value) / 1e4;
}
