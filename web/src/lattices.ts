// Tables of lattices, and the transfer of regions from one lattice to another.

import type { Point, Problem } from "./api";

/** Return a lattice like the crane of the paper: a wide base, a body, and projecting arms. */
export function craneRows(across: number, up: number): Record<string, unknown> {
  const counts = [across, across + 1, across];
  const first_x = [0.5, 0, 0.5];
  for (let row = 0; row < up; row++) {
    counts.push(row % 2 ? across - 1 : across);
    first_x.push(row % 2 ? 0.5 : 0);
  }
  const shift = up % 2 ? 0.5 : 0;
  for (const start of [-1 + shift, -0.5 + shift, -1 + shift]) {
    counts.push(across + (up % 2 ? 0 : 1));
    first_x.push(start);
  }
  return { kind: "triangular-rows", counts, first_x };
}

const SIDES: [0 | 1, 1 | -1][] = [[1, -1], [1, 1], [0, -1], [0, 1]];
/** Less than the height of a row, more than the displacement of nodes in a disordered lattice. */
const EDGE = 0.7;

/** Nodes along one side: lowest or highest in x or y. */
function along(positions: Point[], [axis, sign]: [0 | 1, 1 | -1]): number[] {
  const extreme = Math.max(...positions.map((point) => sign * point[axis]));
  return positions.flatMap((point, k) => (extreme - sign * point[axis] < EDGE ? [k] : []));
}

/** Find the nodes of a new lattice at the relative positions of nodes of the old one. */
export function transferNodes(before: Problem, made: Pick<Problem, "positions">, nodes: number[]): number[] {
  const box = (positions: Point[]): [number, number, number, number] => {
    const xs = positions.map((p) => p[0]);
    const ys = positions.map((p) => p[1]);
    return [Math.min(...xs), Math.min(...ys), Math.max(...xs) - Math.min(...xs) || 1, Math.max(...ys) - Math.min(...ys) || 1];
  };
  const [ox, oy, ow, oh] = box(before.positions);
  const [nx, ny, nw, nh] = box(made.positions);
  const found = new Set<number>();
  const height = (positions: Point[]): Map<number, number[]> => {
    const rows = new Map<number, number[]>();
    positions.forEach(([, y], k) => { const key = Math.round(10 * y); rows.set(key, [...(rows.get(key) ?? []), k]); });
    return rows;
  };
  // Complete rows are mapped to complete rows.
  const [old, fresh] = [height(before.positions), height(made.positions)];
  const rows = [...fresh.keys()];
  const left = new Set(nodes);
  // Complete edges are mapped to complete edges, also without rows.
  for (const side of SIDES) {
    const edge = along(before.positions, side);
    if (edge.length < 3 || !edge.every((node) => left.has(node))) continue;
    along(made.positions, side).forEach((node) => found.add(node));
    edge.forEach((node) => left.delete(node));
  }
  for (const [key, row] of old) {
    if (row.length < 3 || !row.every((node) => left.has(node))) continue;
    const target = key / 10 - oy < 0.5 * oh ? 10 * ny + key - 10 * oy : 10 * (ny + nh) - (10 * (oy + oh) - key);
    const nearest = rows.reduce((a, b) => (Math.abs(b - target) < Math.abs(a - target) ? b : a));
    fresh.get(nearest)!.forEach((node) => found.add(node));
    row.forEach((node) => left.delete(node));
  }
  for (const node of left) {
    const [x, y] = before.positions[node]!;
    // Near an edge, the distance from that edge is kept, so that corners are mapped to corners.
    const fit = (v: number, o: number, w: number, n: number, m: number): number =>
      v - o < 0.3 * w ? n + (v - o) : o + w - v < 0.3 * w ? n + m - (o + w - v) : n + ((v - o) / w) * m;
    const [tx, ty] = [fit(x, ox, ow, nx, nw), fit(y, oy, oh, ny, nh)];
    let best = 0.8;
    let nearest = -1;
    made.positions.forEach(([px, py], k) => {
      const distance = Math.hypot(px - tx, py - ty);
      if (distance < best) { best = distance; nearest = k; }
    });
    if (nearest >= 0) found.add(nearest);
  }
  return [...found].sort((a, b) => a - b);
}
