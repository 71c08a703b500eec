// Requests to the server, and the types of its responses.

/** A point of the plane or of space. */
export type Point = [number, number, number?];

export interface Problem {
  schema: string;
  name: string;
  positions: Point[];
  beams: [number, number][];
  initial: string;
  designable: number[];
  stiffness: { bond: number; angle: number };
  supports: { fixed: number[]; fixed_x: number[]; fixed_y: number[]; fixed_z?: number[] };
  input: { nodes: number[]; direction: Point | Point[]; drive: "displacement" | "force"; amount: number };
  output: { nodes: number[]; direction: Point | Point[]; spring: number | null; spring_kind: string | null };
  aggregate: string;
  objective?: string;
  /** Cross-section and material of the beams of a frame, in lattice units; without them a problem is one of the spring model. */
  section?: { shape: string; width?: number; thickness?: number; diameter?: number } | null;
  /** Width of each beam, if they differ. */
  widths?: number[] | null;
  material?: { young: number; poisson: number } | null;
  /** Names of the first load case and its output, other outputs and load cases, and what is wanted of them. */
  specification?: Specification | null;
}

export interface Specification {
  case: string;
  output: string;
  outputs?: Record<string, Problem["output"]>;
  cases?: { name: string; input: Problem["input"]; outputs: Record<string, Problem["output"]> }[];
  items: Wanted[];
  maximise: Wanted[];
  /** Deviations of random prints that are to meet all items. */
  tolerances?: { least_yield: number; angle: number } | null;
}

/** A quantity of an output that is bounded or maximised. */
export interface Wanted { quantity: string; case: string; at_least?: number | null; at_most?: number | null }

export function isInSpace({ positions }: Pick<Problem, "positions">): boolean { return positions[0]?.length === 3; }

/** Whether an output of a load case is to turn, and none is to move. */
export function isTurning({ specification }: Problem, loadCase: string): boolean {
  const { items = [], maximise = [] } = specification ?? {};
  const own = [...items, ...maximise].filter((each) => each.case === loadCase);
  const turns = own.some((each) => each.quantity === "rotation" && (maximise.includes(each) || (each.at_least ?? -1) > 0 || (each.at_most ?? 1) < 0));
  return turns && !own.some(({ quantity }) => quantity === "gain" || quantity === "travel");
}

/** Whether a rotation is maximised: the motion of the output along a direction then says little. */
export function maximisesRotation({ specification }: Problem): boolean { return specification?.maximise[0]?.quantity === "rotation"; }

/** The mechanical model of a problem in words. */
export function modelOf(problem: Problem): string { return problem.section ? "frames" : "spring model"; }

/** An item of a specification: what is wanted, and what a design reaches in one model. */
export interface ItemState { name: string; label: string; wanted: string; reached: string; margin: number | null; /** Null while it is not known. */ met: boolean | null }

/** A quantity that is maximised or minimised, and what a design reaches. */
export interface Objective { quantity: string; label: string; reached: string }

/** Figures of an output in one load case; none if the path is not stable. */
export interface PartFigures {
  case: string;
  output: string;
  status: string;
  efficiency?: number | null;
  travel_mm?: number | null;
  off_axis?: number | null;
  rotation_deg?: number | null;
  /** Axis of the largest rotation, about which it is right-handed. */
  rotation_axis?: [number, number, number] | null;
  output_deformation_mm?: number | null;
  payload_N?: number | null;
  dead_load_N?: number | null;
  sag_mm?: number | null;
  largest_input_force_N?: number | null;
  strain?: number | null;
  path_mm?: Point[];
  /** Values from rest to the full stroke. */
  curve?: Record<"input_mm" | "output_mm" | "rotation_deg" | "input_force_N", (number | null)[]>;
}

export interface PartReport {
  specified: boolean;
  items: { search: ItemState[] | null; frames: ItemState[] | null };
  objectives: Objective[];
  /** Inputs and loads in words. */
  conditions: string[];
  figures: PartFigures[];
  /** What is wanted of random prints; null without tolerances. */
  tolerance: { name: string; label: string; wanted: string } | null;
}

/** A part over tolerances: rows of texts, and what the loss of each strut costs. */
export interface ToleranceFound { sentence: string; prints: number; met: number; /** Deviations in words. */ deviations: string; /** What these prints do: meet all items, or keep a part of the efficiency. */ met_words: string; rows: string[][]; losses: { measure?: string; beams: number[]; cost: (number | null)[] } }

export interface Response {
  status: string;
  message: string;
  efficiency: number | null;
  displacement: number[] | null;
  items: ItemState[] | null;
}

export interface Motion {
  /** Names of all load cases. */
  cases: string[];
  /** Nodes of the load case of this motion. */
  input: number[];
  outputs: Record<string, number[]>;
  supports: number[];
  /** Motion of the input at each state, in lattice units; none for a force. */
  moved: number[] | null;
  part: number[];
  displacement: number[][];
  energy: number[][];
  efficiency: (number | null)[];
  force: (number | null)[];
  snapped: boolean[];
  /** Rotation of the first output that has several nodes, in degrees; in space its size. */
  rotation: (number | null)[];
  /** Axis of this rotation in space, about which it is right-handed; null for a small one. */
  axis: ([number, number, number] | null)[];
  /** The model in words. */
  model: string;
}

export interface Run {
  id: string;
  title: string;
  created: number;
  status: "queued" | "running" | "paused" | "stopped" | "finished" | "failed";
  message: string;
  efficiency: number | null;
  /** What the result was to maximise or minimise and its value, if that is not the efficiency. */
  objective: string;
  /** Whether the result meets all items by frames; null without a result or a specification. */
  met: boolean | null;
  method: string;
  settings: { steps: number; chains: number; seed: number; goals: string[]; hot?: number; cold?: number; replicas?: number };
  part: Part | null;
  reference: string | null;
  /** Whether a design is refined, without a search. */
  refine: boolean;
  done: number;
  total: number;
  has_design: boolean;
  place: number;
}

export interface Comparison { title: string; mask: string; efficiency: number | null }

export interface RunDetails extends Run {
  problem: Problem;
  mask: string | null;
  provenance: Record<string, unknown>;
  comparison: Comparison | null;
  /** Table of the task, as in a task file, if the search was started from one. */
  task: Record<string, unknown> | null;
}

export type TracePoint = [number, number | null, number | null, number];

export interface RunUpdate {
  run: Run;
  reset: boolean;
  points: Record<string, TracePoint[]>;
  chains: Record<string, { step: number; efficiency: number | null; best: number | null; temperature: number; accepted: number; mask: string }>;
  speed: number | null;
  left: number | null;
  tried: [number, number] | null;
  refined: { designs: number; geometries: number; sheets: number; /** Largest number of geometries. */ most: number; /** Mean time of a geometry. */ seconds: number | null; objective: number | null; /** Part of the random prints that meets all items, at most the wanted one; null without them. */ share: number | null } | null;
  /** The displayed design, with the nodes of its problem if it is refined; null for the one sent before. */
  moved: { mask: string; problem: Problem | null; efficiency: number | null; displacement: number[] | null; items: ItemState[] | null; objectives: Objective[] } | null;
  error?: { message: string };
}

export interface Part { width: number; thickness: number; scale: number; material: string | { name: string }; fillet?: number | null }

export interface GalleryEntry {
  source: string;
  key: string;
  title: string;
  note: string;
  problem: string;
  efficiency: number | null;
  beams: number;
  facets: Record<string, string>;
  picture: { lines: number[]; supports: number[]; input: number[]; output: number[]; box: number[] };
}

export interface Collection { source: string; title: string; entries: GalleryEntry[] }

export interface Named { name: string; title: string }

/** Registered entries of the server, from which the page builds its choices. */
export interface Registries {
  searches: (Named & { summary: string; running_best: boolean })[];
  materials: (Named & { /** Largest strain; null if it is not known. */ strain_limit: number | null })[];
  files: (Named & { purpose: string; in_space: boolean })[];
  /** Usual deviations over which a task is designed. */
  tolerance: Named[];
  /** Lattices that fill a domain in space. */
  cells: Named[];
  levels: (Named & { duration: string; missing: string; in_space: boolean })[];
}

/** An error reported by the server: a sentence, and the key of the request that it concerns. */
export class ServerError extends Error {
  constructor(message: string, readonly key: string, readonly status: number) {
    super(message);
  }
}

async function serverError(response: globalThis.Response): Promise<ServerError> {
  try {
    const { message, key } = (await response.json()) as { message?: string; key?: string };
    return new ServerError(message ?? response.statusText, key ?? "", response.status);
  } catch {
    return new ServerError(`the server returned status ${response.status}`, "", response.status);
  }
}

async function send(method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<globalThis.Response> {
  let response: globalThis.Response;
  try {
    response = await fetch(`/api${path}`, {
      method,
      signal: signal ?? null,
      ...(body === undefined ? {} : { body: JSON.stringify(body), headers: { "content-type": "application/json" } }),
    });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new ServerError("the server cannot be reached; check that bellcrank serve is running", "", 0);
  }
  if (!response.ok) throw await serverError(response);
  return response;
}

export async function get<T>(path: string): Promise<T> {
  return (await send("GET", path)).json() as Promise<T>;
}

let registries: Promise<Registries> | null = null;

/** Fetch the registries; later calls reuse the result. */
export async function fetchRegistries(): Promise<Registries> {
  registries ??= get<Registries>("/registries");
  try {
    return await registries;
  } catch (error) {
    registries = null;
    throw error;
  }
}

export async function post<T>(path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  return (await send("POST", path, body ?? undefined, signal)).json() as Promise<T>;
}

export async function remove(path: string): Promise<void> {
  await send("DELETE", path);
}

export async function fetchFile(suffix: string, body: unknown): Promise<Blob> {
  return (await send("POST", `/files/${suffix}`, body)).blob();
}

export async function fetchBlob(path: string): Promise<Blob> {
  return (await send("GET", path)).blob();
}

function address(path: string): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api${path}`;
}

/** Receive updates over a websocket, which is reopened after it closes. */
export function follow(path: string, receive: (update: RunUpdate) => void, setLost: (lost: boolean) => void): () => void {
  let socket: WebSocket | null = null;
  let ended = false;
  let wait = 300;
  const open = (): void => {
    socket = new WebSocket(address(path));
    socket.onmessage = (event: MessageEvent<string>) => {
      wait = 300;
      setLost(false);
      receive(JSON.parse(event.data) as RunUpdate);
    };
    socket.onclose = () => {
      if (ended) return;
      setLost(true);
      setTimeout(() => { if (!ended) open(); }, wait);
      wait = Math.min(wait * 1.6, 4000);
    };
  };
  open();
  return () => {
    ended = true;
    socket?.close();
  };
}

type Evaluation = Response & { id: number; error?: { message: string; key: string } };

/** Evaluates designs one after the other; while one is being evaluated, only the latest is queued. */
export class Solver {
  private socket: WebSocket | null = null;
  private sent: Problem | null = null;
  private queued: { problem: Problem; mask: string; part: Part } | null = null;
  private busy = false;
  private number = 0;
  private since = 0;
  /** Milliseconds between the last request and its result. */
  latency = 0;

  constructor(private readonly onResult: (result: Evaluation, latency: number) => void) {}

  /** Evaluate a design at once, by few steps along its path. */
  evaluate(problem: Problem, mask: string, part: Part): void {
    this.queued = { problem, mask, part };
    this.next();
  }

  close(): void {
    this.queued = null;
    this.socket?.close();
    this.socket = null;
  }

  private next(): void {
    if (this.busy || !this.queued) return;
    if (!this.socket || this.socket.readyState > WebSocket.OPEN) {
      this.sent = null;
      this.socket = new WebSocket(address("/edit"));
      this.socket.onopen = () => this.next();
      this.socket.onmessage = (event: MessageEvent<string>) => this.receive(JSON.parse(event.data) as Evaluation);
      this.socket.onclose = () => { this.busy = false; };
      return;
    }
    if (this.socket.readyState !== WebSocket.OPEN) return;
    const { problem, mask, part } = this.queued;
    this.queued = null;
    this.busy = true;
    this.since = performance.now();
    const changed = problem !== this.sent;
    this.sent = problem;
    this.socket.send(JSON.stringify({ id: ++this.number, mask, ...(changed ? { problem, part } : {}) }));
  }

  private receive(result: Evaluation): void {
    this.busy = false;
    this.latency = performance.now() - this.since;
    this.onResult(result, this.latency);
    this.next();
  }
}

export function bitsOf(hex: string, beams: number): Uint8Array {
  const bits = new Uint8Array(beams);
  for (let k = 0; k < beams; k++) bits[k] = (parseInt(hex[k >> 2] ?? "0", 16) >> (3 - (k & 3))) & 1;
  return bits;
}

export function hexOf(bits: ArrayLike<number>): string {
  let text = "";
  const digits = 2 * Math.ceil(bits.length / 8);
  for (let d = 0; d < digits; d++) {
    let value = 0;
    for (let b = 0; b < 4; b++) value = (value << 1) | (bits[4 * d + b] ? 1 : 0);
    text += value.toString(16);
  }
  return text;
}

/** Identifier of this browser; the server alternates between the searches of several browsers. */
export function session(): string {
  let known = localStorage.getItem("bellcrank-session");
  if (!known || !/^[a-z0-9-]{1,64}$/.test(known)) {
    known = Array.from(crypto.getRandomValues(new Uint8Array(8)), (b) => b.toString(16).padStart(2, "0")).join("");
    localStorage.setItem("bellcrank-session", known);
  }
  return known;
}
