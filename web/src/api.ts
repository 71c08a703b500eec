// What the server is asked, and what it answers.

export type Point = [number, number];

export interface Problem {
  schema: string;
  name: string;
  positions: Point[];
  beams: [number, number][];
  initial: string;
  designable: number[];
  stiffness: { bond: number; angle: number };
  supports: { fixed: number[]; fixed_x: number[]; fixed_y: number[] };
  input: { nodes: number[]; direction: Point | Point[]; drive: "displacement" | "force"; amount: number };
  output: { nodes: number[]; direction: Point | Point[]; spring: number | null; spring_kind: string | null };
  aggregate: string;
  objective?: string;
}

export interface Response {
  status: string;
  message: string;
  efficiency: number | null;
  displacement: number[] | null;
}

export interface Motion {
  part: number[];
  displacement: number[][];
  energy: number[][];
  efficiency: (number | null)[];
  force: (number | null)[];
  snapped: boolean[];
}

export interface Run {
  id: string;
  title: string;
  created: number;
  status: "queued" | "running" | "paused" | "stopped" | "finished" | "failed";
  message: string;
  efficiency: number | null;
  method: string;
  settings: { steps: number; chains: number; seed: number; goals: string[]; hot?: number; cold?: number };
  part: Part | null;
  reference: string | null;
  done: number;
  total: number;
  has_design: boolean;
  place: number;
}

export interface Comparison { title: string; mask: string; efficiency: number | null }

export interface WholeRun extends Run {
  problem: Problem;
  mask: string | null;
  provenance: Record<string, unknown>;
  comparison: Comparison | null;
}

export type TracePoint = [number, number | null, number | null, number];

export interface News {
  run: Run;
  reset: boolean;
  points: Record<string, TracePoint[]>;
  chains: Record<string, { step: number; efficiency: number | null; best: number | null; temperature: number; accepted: number; mask: string }>;
  speed: number | null;
  left: number | null;
  tried: [number, number] | null;
  moved: { mask: string; efficiency: number | null; displacement: number[] | null } | null;
  error?: { message: string };
}

export interface Part { width: number; thickness: number; scale: number; material: string; fillet?: number | null }

export interface Small {
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

export interface Shelf { source: string; title: string; entries: Small[] }

export interface WholeDesign {
  title: string;
  note: string;
  problem: Problem;
  mask: string;
  efficiency: number | null;
  provenance: Record<string, unknown>;
}

/** What the server refused, in a sentence, and what the sentence is about. */
export class Refusal extends Error {
  constructor(message: string, readonly key: string, readonly status: number) {
    super(message);
  }
}

async function refusal(answer: globalThis.Response): Promise<Refusal> {
  try {
    const said = (await answer.json()) as { message?: string; key?: string };
    return new Refusal(said.message ?? answer.statusText, said.key ?? "", answer.status);
  } catch {
    return new Refusal(`the server answered ${answer.status}`, "", answer.status);
  }
}

async function ask(method: string, path: string, body?: unknown, signal?: AbortSignal): Promise<globalThis.Response> {
  let answer: globalThis.Response;
  try {
    answer = await fetch(`/api${path}`, {
      method,
      signal: signal ?? null,
      ...(body === undefined ? {} : { body: JSON.stringify(body), headers: { "content-type": "application/json" } }),
    });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Refusal("the server does not answer; is bellcrank serve still running?", "", 0);
  }
  if (!answer.ok) throw await refusal(answer);
  return answer;
}

export async function get<T>(path: string): Promise<T> {
  return (await ask("GET", path)).json() as Promise<T>;
}

export async function post<T>(path: string, body?: unknown, signal?: AbortSignal): Promise<T> {
  return (await ask("POST", path, body ?? undefined, signal)).json() as Promise<T>;
}

export async function remove(path: string): Promise<void> {
  await ask("DELETE", path);
}

export async function fetchFile(suffix: string, body: unknown): Promise<Blob> {
  return (await ask("POST", `/files/${suffix}`, body)).blob();
}

export async function fetchBlob(path: string): Promise<Blob> {
  return (await ask("GET", path)).blob();
}

function address(path: string): string {
  return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api${path}`;
}

/** Follow something over a websocket that is opened again when it breaks. */
export function follow(path: string, hear: (news: News) => void, lost: (yes: boolean) => void): () => void {
  let socket: WebSocket | null = null;
  let ended = false;
  let wait = 300;
  const open = (): void => {
    socket = new WebSocket(address(path));
    socket.onmessage = (event: MessageEvent<string>) => {
      wait = 300;
      lost(false);
      hear(JSON.parse(event.data) as News);
    };
    socket.onclose = () => {
      if (ended) return;
      lost(true);
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

type Answer = Response & { id: number; error?: { message: string; key: string } };

/** Asks for the response of one design after the other; while one is under way only the latest waits. */
export class Solver {
  private socket: WebSocket | null = null;
  private sent = "";
  private waiting: { problem: Problem; mask: string } | null = null;
  private busy = false;
  private number = 0;
  private since = 0;
  /** Milliseconds of the last answer, from question to answer. */
  latency = 0;

  constructor(private readonly hear: (answer: Answer, latency: number) => void) {}

  ask(problem: Problem, mask: string): void {
    this.waiting = { problem, mask };
    this.next();
  }

  close(): void {
    this.waiting = null;
    this.socket?.close();
    this.socket = null;
  }

  private next(): void {
    if (this.busy || !this.waiting) return;
    if (!this.socket || this.socket.readyState > WebSocket.OPEN) {
      this.sent = "";
      this.socket = new WebSocket(address("/edit"));
      this.socket.onopen = () => this.next();
      this.socket.onmessage = (event: MessageEvent<string>) => this.answered(JSON.parse(event.data) as Answer);
      this.socket.onclose = () => { this.busy = false; };
      return;
    }
    if (this.socket.readyState !== WebSocket.OPEN) return;
    const { problem, mask } = this.waiting;
    this.waiting = null;
    this.busy = true;
    this.since = performance.now();
    const text = JSON.stringify(problem);
    const fresh = text !== this.sent;
    this.sent = text;
    this.socket.send(JSON.stringify({ id: ++this.number, mask, ...(fresh ? { problem } : {}) }));
  }

  private answered(answer: Answer): void {
    this.busy = false;
    this.latency = performance.now() - this.since;
    this.hear(answer, this.latency);
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

/** Who this browser is, so that searches of several people take turns. */
export function session(): string {
  let known = localStorage.getItem("bellcrank-session");
  if (!known || !/^[a-z0-9-]{1,64}$/.test(known)) {
    known = Array.from(crypto.getRandomValues(new Uint8Array(8)), (b) => b.toString(16).padStart(2, "0")).join("");
    localStorage.setItem("bellcrank-session", known);
  }
  return known;
}
