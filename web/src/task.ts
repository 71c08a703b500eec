// The task as plain data, with undo, and its conversion to and from the form of the server.

import { bitsOf, hexOf, type Point, type Problem } from "./api";
import { isEach } from "./drawing";

export type Rule = "auto" | "keep" | "never" | "free";
export type Region = "supports" | "input" | "output";
export type Hold = "fixed" | "fixed_x" | "fixed_y";

export interface Task {
  problem: Problem;
  /** Table of the lattice, if it was made from one. */
  lattice: Record<string, unknown> | null;
  /** Rule of each beam; `auto` makes it designable unless it touches a region. */
  rules: Rule[];
  mirror: { x: boolean; y: boolean };
  /** Length of a lattice unit, mm. */
  scale: number;
  /** A design drawn by hand, as a mask. */
  hand: string | null;
}

export function touching(problem: Problem): Uint8Array {
  const taken = new Set([
    ...problem.supports.fixed, ...problem.supports.fixed_x, ...problem.supports.fixed_y,
    ...problem.input.nodes, ...problem.output.nodes,
  ]);
  return Uint8Array.from(problem.beams, ([a, b]) => (taken.has(a) || taken.has(b) ? 1 : 0));
}

/** Convert a problem to a task. */
export function taskOf(problem: Problem, lattice: Record<string, unknown> | null = null, scale = 10): Task {
  const touches = touching(problem);
  const designable = new Uint8Array(problem.beams.length);
  for (const beam of problem.designable) designable[beam] = 1;
  const initial = bitsOf(problem.initial, problem.beams.length);
  const rules = problem.beams.map((_, k): Rule => {
    if (touches[k]) return designable[k] ? "free" : initial[k] ? "auto" : "never";
    return designable[k] ? "auto" : initial[k] ? "keep" : "never";
  });
  return { problem, lattice, rules, mirror: { x: false, y: false }, scale, hand: null };
}

/** Convert a task to a problem with its designable beams and initial design. */
export function problemOf(task: Task): Problem {
  const { problem, rules } = task;
  const touches = touching(problem);
  const initial = bitsOf(problem.initial, problem.beams.length);
  const designable: number[] = [];
  rules.forEach((rule, k) => {
    if (rule === "free" || (rule === "auto" && !touches[k])) designable.push(k);
    if (rule === "never") initial[k] = 0;
    else if (rule === "keep" || touches[k]) initial[k] = 1;
  });
  return { ...problem, designable, initial: hexOf(initial) };
}

export function goalsOf(task: Task): string[] {
  return (["x", "y"] as const).filter((axis) => task.mirror[axis]).map((axis) => `mirror ${axis}`);
}

export function nodesOf(problem: Problem, region: Region): number[] {
  if (region !== "supports") return problem[region].nodes;
  const { fixed, fixed_x, fixed_y } = problem.supports;
  return [...fixed, ...fixed_x, ...fixed_y];
}

/** Add nodes to a region or remove them; a node belongs to one region only. */
export function assign(task: Task, region: Region, nodes: number[], add: boolean, hold: Hold = "fixed"): Task {
  const gone = new Set(nodes);
  const without = (list: number[]): number[] => list.filter((node) => !gone.has(node));
  const { supports, input, output } = task.problem;
  const next = {
    supports: { fixed: without(supports.fixed), fixed_x: without(supports.fixed_x), fixed_y: without(supports.fixed_y) },
    input: withNodes(input, without(input.nodes)),
    output: withNodes(output, without(output.nodes)),
  };
  if (add) {
    const sorted = (list: number[]): number[] => [...new Set([...list, ...nodes])].sort((a, b) => a - b);
    if (region === "supports") next.supports[hold] = sorted(next.supports[hold]);
    else if (region === "input") next.input = withNodes(input, sorted(next.input.nodes));
    else next.output = withNodes(output, sorted(next.output.nodes));
  }
  return { ...task, problem: { ...task.problem, ...next }, hand: null };
}

/** Change the nodes of a region and keep the directions of single nodes. */
function withNodes<R extends Problem["input"] | Problem["output"]>(region: R, nodes: number[]): R {
  if (!isEach(region.direction)) return { ...region, nodes };
  const each = new Map(region.nodes.map((node, k) => [node, (region.direction as Point[])[k]!]));
  const common = region.direction[0] ?? [0, -1];
  return { ...region, nodes, direction: nodes.map((node) => each.get(node) ?? common) };
}

export function directionOf(region: Problem["input"] | Problem["output"]): Point {
  return isEach(region.direction) ? (region.direction[0] ?? [0, -1]) : region.direction;
}

/** Nodes of the row of a node, from left to right. */
export function rowOf(problem: Problem, node: number): number[] {
  const y = problem.positions[node]![1];
  return problem.positions
    .map(([px, py], k): [number, number, number] => [k, px, py])
    .filter(([, , py]) => Math.abs(py - y) < 0.05)
    .sort((a, b) => a[1] - b[1])
    .map(([k]) => k);
}

/** Return a beam and its mirror images. */
export function images(problem: Problem, beam: number, mirror: { x: boolean; y: boolean }): number[] {
  if (!mirror.x && !mirror.y) return [beam];
  const { positions, beams, designable } = problem;
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const k of designable.length ? designable : beams.keys()) {
    for (const node of beams[k]!) {
      const [x, y] = positions[node]!;
      x0 = Math.min(x0, x); x1 = Math.max(x1, x);
      y0 = Math.min(y0, y); y1 = Math.max(y1, y);
    }
  }
  const find = ([x, y]: Point): number =>
    positions.findIndex(([px, py]) => Math.abs(px - x) < 1e-3 && Math.abs(py - y) < 1e-3);
  const found = new Set([beam]);
  for (const [fx, fy] of [[mirror.x, false], [false, mirror.y], [mirror.x, mirror.y]] as [boolean, boolean][]) {
    if (!fx && !fy) continue;
    const [a, b] = beams[beam]!.map((node) => {
      const [x, y] = positions[node]!;
      return find([fx ? x0 + x1 - x : x, fy ? y0 + y1 - y : y]);
    }) as [number, number];
    const other = beams.findIndex(([p, q]) => (p === a && q === b) || (p === b && q === a));
    if (other >= 0) found.add(other);
  }
  return [...found];
}

/** A value with undo and redo. */
export class History<T> {
  private past: string[] = [];
  private future: string[] = [];

  constructor(private now: T, private readonly most = 100) {}

  get value(): T { return this.now; }
  get canUndo(): boolean { return this.past.length > 0; }
  get canRedo(): boolean { return this.future.length > 0; }

  /** Set the value; `merge` makes the change part of the last step, as during a drag. */
  set(value: T, merge = false): void {
    if (!merge) {
      this.past.push(JSON.stringify(this.now));
      if (this.past.length > this.most) this.past.shift();
    }
    this.future = [];
    this.now = value;
  }

  undo(): void { this.step(this.past, this.future); }
  redo(): void { this.step(this.future, this.past); }

  private step(from: string[], to: string[]): void {
    const text = from.pop();
    if (text === undefined) return;
    to.push(JSON.stringify(this.now));
    this.now = JSON.parse(text) as T;
  }
}

async function squeeze(stream: ReadableStream<Uint8Array>): Promise<Uint8Array> {
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Encode a task for the fragment of an address, which is not sent to a server. */
export async function toLink(task: Task): Promise<string> {
  const stream = new Blob([JSON.stringify(task)]).stream().pipeThrough(new CompressionStream("deflate-raw"));
  const bytes = await squeeze(stream as ReadableStream<Uint8Array>);
  return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

export async function fromLink(text: string): Promise<Task> {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return JSON.parse(new TextDecoder().decode(await squeeze(stream as ReadableStream<Uint8Array>))) as Task;
}

export function isTask(value: unknown): value is Task {
  const task = value as Task | null;
  return !!task && typeof task === "object" && !!task.problem && Array.isArray(task.problem.positions)
    && Array.isArray(task.problem.beams) && Array.isArray(task.rules) && task.rules.length === task.problem.beams.length
    && typeof task.scale === "number" && !!task.mirror;
}
