// Marks of rollers and mirror axes, and navigation from node to node with the arrow keys.

import type { Point } from "./api";
import type { Box } from "./drawing";
import { nodesOf, type Task } from "./task";

/** Directions in which nodes may slide, as a path. */
export function rollerLines(rest: Float64Array, along_y: number[], along_x: number[]): string {
  let d = "";
  for (const [nodes, dx, dy] of [[along_y, 0, 0.34], [along_x, 0.34, 0]] as [number[], number, number][]) {
    for (const node of nodes) {
      const [x, y] = [rest[2 * node]!, -rest[2 * node + 1]!];
      d += `M${x - dx} ${y - dy}L${x + dx} ${y + dy}`;
    }
  }
  return d;
}

/** Mirror axes, through the middle of the designable beams. */
export function mirrorAxes(
  rest: Float64Array, beams: [number, number][], box: Box, mirror: { x: boolean; y: boolean },
): string {
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const node of beams.flat()) {
    x0 = Math.min(x0, rest[2 * node]!); x1 = Math.max(x1, rest[2 * node]!);
    y0 = Math.min(y0, -rest[2 * node + 1]!); y1 = Math.max(y1, -rest[2 * node + 1]!);
  }
  return (mirror.x ? `M${(x0 + x1) / 2} ${box.y}V${box.y + box.h}` : "") + (mirror.y ? `M${box.x} ${(y0 + y1) / 2}H${box.x + box.w}` : "");
}

/** Find the nearest node or beam in a direction, starting from a corner if `at` is negative. */
export function nextInDirection(total: number, place: (k: number) => Point, at: number, corner: Point, [wx, wy]: Point): number {
  const from = at >= 0 ? place(at) : corner;
  let best = Infinity;
  let found = at;
  for (let k = 0; k < total; k++) {
    const [x, y] = place(k);
    const along = (x - from[0]) * wx + (y - from[1]) * wy;
    const across = Math.abs((x - from[0]) * wy) + Math.abs((y - from[1]) * wx);
    if (k === at || (at >= 0 && along < 0.05)) continue;
    const cost = Math.abs(along) + 2.2 * across;
    if (cost < best) { best = cost; found = k; }
  }
  return found;
}

/** Describe a node or beam for screen readers. */
export function describeTarget({ problem, rules }: Task, tool: string, bits: Uint8Array, k: number): string {
  if (tool === "hand") return `beam ${k}, ${bits[k] ? "present" : "absent"}`;
  if (tool === "beams") return `beam ${k}, ${{ auto: "designable", keep: "always present", never: "always absent", free: "designable" }[rules[k]!]}`;
  const [x, y] = problem.positions[k]!;
  const part = (["supports", "input", "output"] as const).find((region) => nodesOf(problem, region).includes(k));
  const name = part ? { supports: "support", input: "input", output: "output" }[part] : "free";
  return `node ${k} at ${x.toFixed(1)}, ${y.toFixed(1)}: ${name}`;
}
