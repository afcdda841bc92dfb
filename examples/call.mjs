// Asks a running service where a scan was taken; Node 18 or newer, or any browser's fetch. No package needed:
//   node examples/call.mjs http://127.0.0.1:8000
// A key, where the service wants one, in LINEFIX_KEY.
const url = process.argv[2] ?? "http://127.0.0.1:8000";

// An L-shaped room, walked round counter-clockwise: free space on the left of every wall. Metres.
const walls = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]];
// The same walls as a robot sees them that stands at (1, 1) and looks along the map's y axis.
const seen = walls.map(([x1, y1, x2, y2]) => [y1 - 1, 1 - x1, y2 - 1, 1 - x2]);

const headers = { "Content-Type": "application/json" };
if (process.env.LINEFIX_KEY) headers.Authorization = `Bearer ${process.env.LINEFIX_KEY}`;
const response = await fetch(`${url}/v1/associate`, {
  method: "POST",
  headers,
  body: JSON.stringify({ map: { segments: walls }, scan: { segments: seen, sigma: 0.02 } }),
  signal: AbortSignal.timeout(60_000),
});
const answer = await response.json();
if (!response.ok) {
  console.error(`${response.status} ${answer.code}: ${answer.detail}`);
  process.exit(2);
}
console.log(`status ${answer.status}`);
if (!answer.usable) {
  // The one thing to check before moving.
  console.log("no pose to act on");
  process.exit(1);
}
const { x, y, theta } = answer.pose;
console.log(`x ${x.toFixed(3)} m, y ${y.toFixed(3)} m, theta ${theta.toFixed(4)} rad`);
