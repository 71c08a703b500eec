// Marks of rollers and mirror axes, and navigation from node to node with the arrow keys.

import type { Point, Problem } from "./api";
import type { Box } from "./drawing";
import type { Shape } from "./task";
import type { View } from "./view";

/** Where outputs move to, beside which no dimension is drawn: one unit from their middles. */
export function outputTips({ positions, output, specification }: Problem): Point[] {
  const cases = specification?.cases ?? [];
  const outputs = [output, ...Object.values(specification?.outputs ?? {}), ...cases.flatMap((each) => Object.values(each.outputs))];
  return outputs.filter(({ nodes }) => nodes.length).map(({ nodes, direction }) => {
    const along = (Array.isArray(direction[0]) ? direction[0] : direction) as Point;
    return [0, 1].map((axis) => nodes.reduce((sum, node) => sum + positions[node]![axis]!, 0) / nodes.length + along[axis]!) as Point;
  });
}

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

/** Mirror axes through the middle of a design. */
export function mirrorAxes([x, y]: [number, number], box: Box, mirror: { x: boolean; y: boolean }): string {
  return (mirror.x ? `M${x} ${box.y}V${box.y + box.h}` : "") + (mirror.y ? `M${box.x} ${-y}H${box.x + box.w}` : "");
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

/** Describe a node or beam for screen readers, with its position in mm. */
export function describeTarget({ built, held, arrows, bits }: View, tool: string, k: number): string {
  if (tool === "hand") return `beam ${k}, ${bits?.[k] ? "present" : "absent"}`;
  const place = built.lattice.positions[k]!.map((value) => (value! * built.part.scale).toFixed(1)).join(", ");
  const arrow = arrows.find(({ nodes }) => nodes.includes(k));
  const names = { supports: "support", inputs: "input", outputs: "output", loads: "load" };
  const name = arrow ? names[arrow.target.kind] : held.some(({ nodes }) => nodes.includes(k)) ? "support" : "free";
  return `node at ${place} mm: ${name}`;
}

/** A shape as a path; `scale` is the length of a unit of the drawing in units of the shape. */
export function shapePath({ circle, radius, box, polygon }: Shape, scale: number): string {
  if (circle && radius !== undefined) {
    const [x, y, r] = [circle[0] / scale, -circle[1] / scale, parseFloat(String(radius)) / scale];
    return `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
  }
  const [x0, y0, x1, y1] = box ?? [];
  const corners = polygon ?? (box ? [[x0!, y0!], [x1!, y0!], [x1!, y1!], [x0!, y1!]] : []);
  return corners.length ? `M${corners.map(([x, y]) => `${x! / scale} ${-y! / scale}`).join("L")}Z` : "";
}
