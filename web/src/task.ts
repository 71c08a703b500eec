// The task as a table, as in a task file, with undo, and its conversion to a link.

import type { Part, Point, Problem } from "./api";
import { lengthIn } from "./text";

/** A number in the usual unit, or a text with a unit. */
export type Amount = number | string;
export type Direction = string | Point;

export interface Shape { circle?: Point; sphere?: Point; cylinder?: Point; radius?: Amount; box?: number[]; polygon?: Point[] }
export interface Region extends Shape { point?: Point; count?: number; edge?: string; face?: string; between?: Point; nodes?: number[]; without?: Shape }
export type Hold = "all" | "x" | "y" | "z";
export interface Support { at: Region[]; hold?: Hold }
export interface InputTable { at?: Region[]; direction?: Direction; displacement?: Amount; force?: Amount; during?: [Amount, Amount] }
export interface LoadTable { at: Region[]; direction: Direction; force?: Amount; spring?: Amount; during?: [Amount, Amount] }
export interface Bounds {
  value?: Amount; at_least?: Amount; at_most?: Amount; target?: Amount; tolerance?: Amount;
  from?: Amount; to?: Amount; of?: string; maximise?: boolean; minimise?: boolean; scale?: Amount;
}
export interface PathTable { points?: Point[]; arc?: [Amount, Amount]; error?: Amount }

export const QUANTITIES = ["gain", "travel", "off_axis", "rotation", "payload", "dead_load", "stiffness", "blocked_force", "sag"] as const;
export type QuantityName = (typeof QUANTITIES)[number];

export type OutputTable = { name?: string; at?: Region[]; direction?: Direction; spring?: Amount; path?: PathTable } & Partial<Record<QuantityName, Bounds[]>>;

export interface CaseTable {
  name?: string; supports?: Support[]; inputs?: InputTable[]; loads?: LoadTable[]; gravity?: Direction; gravity_during?: [Amount, Amount]; outputs?: OutputTable[];
  input_force?: Bounds[]; strain?: Bounds[];
}
export interface Material { name: string; young: number; poisson: number; density?: number; strain_limit?: number; [key: string]: unknown }
export interface Domain {
  size?: number[]; outline?: Shape | Point[]; cells?: string | { kind: string; [key: string]: unknown }; lattice?: Record<string, unknown>; problem?: string;
  holes?: Shape[]; keep_out?: Shape[]; solid?: Shape[];
}
export interface Limits { strain?: Amount | boolean; clearance?: Amount | boolean; stable_stroke?: Amount; strut_loss?: Amount; mass?: Amount; symmetry?: string; upright?: Direction }
export interface Tolerance { width?: Amount; each_width?: Amount; node?: Amount; angle?: Amount; least_yield?: Amount; keep?: Amount }
export interface Table {
  name: string; description?: string;
  part?: { width?: Amount; thickness?: Amount; spacing?: Amount; fillet?: Amount; joint?: Amount; material?: string | Material };
  domain: Domain; supports?: Support[]; cases: CaseTable[]; limits?: Limits; tolerance?: Tolerance;
}

export interface Task {
  table: Table;
  /** A design drawn by hand, as a mask. */
  hand: string | null;
}

/** Nodes of the regions of a load case, in the order of its tables. */
export interface CaseRegions { inputs: number[][]; outputs: number[][]; loads: number[][]; supports: number[][] }

/** A task as the server builds it. */
export interface Built {
  lattice: Pick<Problem, "positions" | "beams">;
  part: Part;
  regions: { supports: number[][]; given: { input: number[]; output: number[]; supports: number[] }; cases: CaseRegions[] };
  /** Key of the first table without a region. */
  missing: string | null;
  /** Why there is no problem. */
  fault: { key: string; message: string } | null;
  problem: Problem | null;
  items: { name: string; label: string; wanted: string }[];
  /** Inputs and loads of each load case in words. */
  conditions: { case: string; texts: string[] }[];
}

/** Kinds of zones of a domain. */
export type ZoneKind = "holes" | "keep_out" | "solid";
export type ZoneShape = "box" | "circle";

export type Kind = "supports" | "inputs" | "outputs" | "loads";
/** What is selected or drawn with the pointer. */
export type Tool = Kind | "zones" | "hand";
/** A table with a region: a support of the task, or an input, output or load of a load case. */
export interface Target { kind: Kind; index: number }

type Sections = Support[] | InputTable[] | OutputTable[] | LoadTable[];

export function sectionsOf(table: Table, load_case: number, kind: Kind): Sections {
  return kind === "supports" ? table.supports ?? [] : table.cases[load_case]?.[kind] ?? [];
}

export function withSections(table: Table, load_case: number, kind: Kind, sections: Sections): Table {
  if (kind === "supports") return { ...table, supports: sections as Support[] };
  return { ...table, cases: table.cases.map((each, k) => (k === load_case ? { ...each, [kind]: sections } : each)) };
}

export function withSection(table: Table, load_case: number, { kind, index }: Target, changes: Record<string, unknown>): Table {
  const sections = sectionsOf(table, load_case, kind).map((each, k) => (k === index ? cleaned({ ...each, ...changes }) : each));
  return withSections(table, load_case, kind, sections as Sections);
}

/** A table without the keys that are undefined. */
export function cleaned<T extends object>(table: T): T {
  return Object.fromEntries(Object.entries(table).filter(([, value]) => value !== undefined)) as T;
}

export function nodesOf(built: Built, load_case: number, kind: Kind): number[][] {
  return kind === "supports" ? built.regions.supports : built.regions.cases[load_case]?.[kind] ?? [];
}

/** Regions that name nodes: the whole lowest or highest row as an edge or a face, else each node by its point in mm. */
export function regionsOf(nodes: number[], positions: Point[], scale: number): Region[] {
  const set = new Set(nodes);
  const heights = positions.map((point) => point.at(-1)!);
  for (const [name, height] of [["bottom", Math.min(...heights)], ["top", Math.max(...heights)]] as [string, number][]) {
    const row = heights.flatMap((each, k) => (Math.abs(each - height) < 0.1 ? [k] : []));
    if (row.length > 2 && row.length === set.size && row.every((node) => set.has(node))) return [positions[0]!.length === 3 ? { face: name } : { edge: name }];
  }
  return nodes.map((node) => ({ point: positions[node]!.map((value) => Math.round(value! * scale * 100) / 100) as Point }));
}

/** Add nodes to a target or remove them; a node belongs to one support, input or output of a load case. */
export function assign(task: Task, built: Built, load_case: number, target: Target, nodes: number[], add: boolean): Task {
  const { positions } = built.lattice;
  const scale = built.part.scale;
  const given = new Set(nodes);
  let { table } = task;
  for (const kind of ["supports", "inputs", "outputs"] as const) {
    nodesOf(built, load_case, kind).forEach((known, index) => {
      const own = kind === target.kind && index === target.index;
      if (own || target.kind === "loads" || !add || !known.some((node) => given.has(node))) return;
      table = withSection(table, load_case, { kind, index }, { at: regionsOf(known.filter((node) => !given.has(node)), positions, scale) });
    });
  }
  const known = nodesOf(built, load_case, target.kind)[target.index] ?? [];
  const next = add ? [...new Set([...known, ...nodes])].sort((a, b) => a - b) : known.filter((node) => !given.has(node));
  return { table: withSection(table, load_case, target, { at: regionsOf(next, positions, scale) }), hand: null };
}

/** Whether nodes, at least one, are their own images by the mirror symmetry of a design. */
export function isSymmetric(built: Built, symmetry: string, nodes: number[]): boolean {
  return nodes.length > 0 && withImages(built, symmetry, nodes).length === nodes.length;
}

/** Whether an output is to turn, whatever its motion. */
export function isTurn({ direction, rotation, gain, travel }: OutputTable): boolean {
  return direction === undefined && rotation !== undefined && !gain && !travel;
}

/** The middle of the designable struts of a lattice in the plane, about which designs are symmetric. */
export function middleOf({ lattice: { positions, beams }, problem }: Built): [number, number] {
  const designable = problem?.designable.length ? problem.designable.map((beam) => beams[beam]!) : beams;
  const along = (axis: 0 | 1): number => {
    const values = designable.flat().map((node) => positions[node]![axis]);
    return 0.5 * (Math.min(...values) + Math.max(...values));
  };
  return [along(0), along(1)];
}

/** Mirror images of nodes in a plane lattice, about the middle of its designable struts; -1 for none. */
export function imagesOf(built: Built, axis: "x" | "y", nodes: number[]): number[] {
  const { positions } = built.lattice;
  const index = axis === "x" ? 0 : 1;
  const middle = middleOf(built)[index];
  return nodes.map((node) => {
    const wanted = positions[node]!.map((value, k) => (k === index ? 2 * middle - value! : value!));
    return positions.findIndex(([x, y]) => Math.hypot(x - wanted[0]!, y - wanted[1]!) < 0.05);
  });
}

/** Nodes with their images by the mirror symmetry of a design in the plane. */
export function withImages(built: Built, symmetry: string, nodes: number[]): number[] {
  const all = new Set(nodes);
  for (const axis of ["x", "y"] as const) {
    if (symmetry === axis || symmetry === "xy") for (const image of imagesOf(built, axis, [...all])) if (image >= 0) all.add(image);
  }
  return [...all];
}

/** Distance from the middle, over the size of a domain, up to which something belongs to the middle. */
const MIDDLE = 0.15;

/** A table whose regions and zones lie elsewhere: coordinates along each axis, and radii, are mapped. */
function relocated(table: Table, along: (value: number, axis: number) => number, radius: (value: Amount | undefined) => Amount | undefined): Table {
  const point = (given: Point | undefined): Point | undefined => given?.map((value, axis) => along(value!, axis)) as Point | undefined;
  const shape = <T extends Shape>(given: T): T => cleaned({
    ...given, circle: point(given.circle), sphere: point(given.sphere), cylinder: point(given.cylinder), radius: radius(given.radius),
    box: given.box?.map((value, k) => along(value, k % (given.box!.length / 2))), polygon: given.polygon?.map((each) => point(each)!),
  });
  const region = (given: Region): Region => cleaned({
    ...shape(given), point: point(given.point), without: given.without && shape(given.without),
    between: given.between?.map((value) => along(value!, given.edge === "left" || given.edge === "right" ? 1 : 0)) as Point | undefined,
  });
  const moved = <T extends { at?: Region[] }>(sections: T[] | undefined): T[] | undefined => sections?.map((each) => (each.at ? { ...each, at: each.at.map(region) } : each));
  const cases = table.cases.map((each) => cleaned({ ...each, supports: moved(each.supports), inputs: moved(each.inputs), outputs: moved(each.outputs), loads: moved(each.loads) }));
  const { outline, holes, keep_out, solid } = table.domain;
  const domain = cleaned({
    ...table.domain, outline: Array.isArray(outline) ? outline.map((each) => point(each)!) : outline && shape(outline),
    holes: holes?.map(shape), keep_out: keep_out?.map(shape), solid: solid?.map(shape),
  });
  return cleaned({ ...table, domain, supports: moved(table.supports), cases });
}

/** A table for a domain of another size: selected nodes and zones keep their distances from the nearer side or from the middle. */
export function resized(table: Table, size: number[]): Table {
  const old = table.domain.size!;
  const along = (value: number, axis: number): number => {
    if (typeof value !== "number") return value;
    const part = value / old[axis]! - 0.5;
    const share = Math.abs(part) < MIDDLE ? 0.5 : part > 0 ? 1 : 0;
    return Math.round(100 * (value + share * (size[axis]! - old[axis]!))) / 100;
  };
  const moved = relocated(table, along, (value) => value);
  return { ...moved, domain: { ...moved.domain, size } };
}

/** A table with all lengths multiplied by a factor: the same nodes are selected. Forces, stiffnesses and ratios stay. */
export function scaled(table: Table, factor: number): Table {
  const long = <T extends Amount | boolean | undefined>(value: T): T => {
    const length = typeof value === "number" || typeof value === "string" ? lengthIn(value) : NaN;
    return (Number.isNaN(length) ? value : Math.round(1000 * factor * length) / 1000) as T;
  };
  const travel = (given: Bounds): Bounds => cleaned({
    ...given, value: long(given.value), at_least: long(given.at_least), at_most: long(given.at_most), target: long(given.target), tolerance: long(given.tolerance), scale: long(given.scale),
  });
  const path = (given: PathTable): PathTable => cleaned({ ...given, points: given.points?.map((each) => each.map(long) as Point), arc: given.arc && ([long(given.arc[0]), given.arc[1]] as [Amount, Amount]) });
  const moved = relocated(table, long, long);
  const { part = {}, domain, limits, cases } = moved;
  return cleaned({
    ...moved,
    part: cleaned({ ...part, spacing: long(part.spacing ?? 10), width: long(part.width ?? 2), thickness: isSpatial(table) ? part.thickness : long(part.thickness ?? 5), fillet: long(part.fillet), joint: long(part.joint) }),
    domain: cleaned({ ...domain, size: domain.size?.map(long) }),
    cases: cases.map((each) => cleaned({
      ...each,
      inputs: each.inputs?.map((given) => cleaned({ ...given, displacement: long(given.displacement) })),
      outputs: each.outputs?.map((given): OutputTable => cleaned({ ...given, travel: given.travel?.map(travel), path: given.path && path(given.path) })),
    })),
    limits: limits && cleaned({ ...limits, clearance: long(limits.clearance) }),
  });
}

const DIRECTIONS: Record<string, Point> = { right: [1, 0], up: [0, 1], left: [-1, 0], down: [0, -1] };
const IN_SPACE: Record<string, Point> = { right: [1, 0, 0], back: [0, 1, 0], up: [0, 0, 1], left: [-1, 0, 0], front: [0, -1, 0], down: [0, 0, -1] };

/** Whether a task is for a part in space. */
export function isSpatial({ domain }: Table): boolean {
  const positions = domain.lattice?.["positions"] as Point[] | undefined;
  return domain.size?.length === 3 || positions?.[0]?.length === 3;
}

/** Unit vector of a direction in space. */
export function vectorInSpace(direction: Direction | undefined, usual: Point = IN_SPACE.up!): Point {
  if (typeof direction === "string") return IN_SPACE[direction] ?? usual;
  if (direction === undefined || direction.length !== 3) return usual;
  const size = Math.hypot(...(direction as number[])) || 1;
  return direction.map((value) => value! / size) as Point;
}

/** Unit vector of a direction: a name, an angle or a vector. */
export function vectorOf(direction: Direction | undefined, usual: Point = [0, 1]): Point {
  if (direction === undefined) return usual;
  if (typeof direction !== "string") {
    const size = Math.hypot(direction[0], direction[1]) || 1;
    return [direction[0] / size, direction[1] / size];
  }
  const named = DIRECTIONS[direction];
  if (named) return named;
  const angle = (parseFloat(direction) * Math.PI) / 180;
  return Number.isFinite(angle) ? [Math.cos(angle), Math.sin(angle)] : usual;
}

/** A direction as a table has it: a name for a multiple of 90 degrees, else an angle. */
export function directionAt(angle: number): Direction {
  const whole = ((Math.round(angle) % 360) + 360) % 360;
  return Object.keys(DIRECTIONS)[whole / 90] ?? `${whole} deg`;
}

/** Nodes of the row of a node, from left to right. */
export function rowOf(positions: Point[], node: number): number[] {
  const y = positions[node]![1];
  return positions
    .map(([px, py], k): [number, number, number] => [k, px, py])
    .filter(([, , py]) => Math.abs(py - y) < 0.05)
    .sort((a, b) => a[1] - b[1])
    .map(([k]) => k);
}

/** A value with undo and redo, which outlasts a reload. */
export class History<T> {
  private past: string[] = [];
  private future: string[] = [];

  constructor(private now: T, stored: { past?: string[]; future?: string[] } | null = null, private readonly most = 60) {
    this.past = stored?.past ?? [];
    this.future = stored?.future ?? [];
  }

  get value(): T { return this.now; }
  get canUndo(): boolean { return this.past.length > 0; }
  get canRedo(): boolean { return this.future.length > 0; }
  get stored(): { past: string[]; future: string[] } { return { past: this.past, future: this.future }; }

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
  return !!task && typeof task === "object" && !!task.table && typeof task.table === "object"
    && typeof task.table.domain === "object" && Array.isArray(task.table.cases) && task.table.cases.length > 0;
}
