// The page on which a task is drawn, and a design by hand.

import { post, Refusal, session, Solver, bitsOf, hexOf, type Part, type Point, type Problem, type Response } from "./api";
import { KEY } from "./begin";
import { Canvas, type Tool } from "./canvas";
import { where } from "./drawing";
import { choice, clear, download, figure, h, iconButton, say } from "./dom";
import { Panels } from "./panels";
import {
  assign, goalsOf, History, images, nodesOf, problemOf, taskOf, toLink, type Hold, type Region, type Task,
} from "./task";
import { fileName, sentence, suffixOf, undoing } from "./words";

const TOOLS: [Tool, string, string][] = [
  ["supports", "Hold", "Click nodes that are held; drag a box for many, double-click for a row."],
  ["input", "Push", "Click nodes that are pushed; drag the orange arrow to aim, longer for a longer stroke."],
  ["output", "Move", "Click nodes that should move; drag the blue arrow to say which way."],
  ["beams", "Beams", "Paint beams that must stay or must never be there."],
  ["hand", "By hand", "Click beams away and back; what the real solver says is drawn in at once."],
];

const MISSING: [Region, string][] = [
  ["supports", "Nothing is held yet: choose Hold and click nodes."],
  ["input", "Nothing is pushed yet: choose Push and click nodes."],
  ["output", "Nothing is to move yet: choose Move and click nodes."],
];
const WELCOME = "To begin with: held below, pushed down on the right, it should move left. Change what you like, or just press Design it.";

export interface Settings { method: string; steps: number; chains: number; seed: number; real: boolean; width: number; material: string }

export class Editor {
  readonly element = h("div", { class: "page draw" });
  tool: Tool = "supports";
  hold: Hold = "fixed";
  brush: "keep" | "never" | "auto" = "keep";
  settings: Settings = { method: "basin-hopping", steps: 20000, chains: 4, seed: 0, real: true, width: 2, material: "ninjaflex" };
  fault: { key: string; message: string } | null = null;
  response: Response | null = null;
  private history: History<Task>;
  private readonly canvas: Canvas;
  private readonly panels: Panels;
  private readonly solver: Solver;
  private stiffness: Problem["stiffness"] | null = null;
  private readonly hint = h("p", { class: "hint" });
  private readonly complaint = h("p", { class: "complaint", role: "alert" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private readonly tools = h("div", { class: "tools" });
  private readonly undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => this.step("undo"));
  private readonly redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("redo"));
  private checking: AbortController | null = null;
  private timer = 0;
  private checked = "";
  private readonly leaving = (): void => this.keep();
  private readonly keys = undoing((way) => this.step(way));

  constructor(task: Task, private readonly fresh = false) {
    this.history = new History(task);
    this.canvas = new Canvas({
      nodes: (region, nodes, add, merge) => this.set(assign(this.task, region, nodes, add, this.hold), merge),
      beams: (beams, merge) => this.paint(beams, merge),
      aim: (region, direction, amount, merge) => this.aim(region, direction, amount, merge),
    });
    this.solver = new Solver((answer, latency) => this.answered(answer, latency, answer.error));
    this.panels = new Panels(this);
    this.build();
    this.choose("supports");
    document.addEventListener("keydown", this.keys);
    addEventListener("pagehide", this.leaving);
    this.changed();
  }

  get task(): Task { return this.history.value; }
  get problem(): Problem { return problemOf(this.task); }

  /** The problem with the stiffness of the part that it is for, as the server says it is. */
  private get meant(): Problem { return this.settings.real && this.stiffness ? { ...this.problem, stiffness: this.stiffness } : this.problem; }

  private get part(): Part {
    return { width: this.settings.width, thickness: 5, scale: this.task.scale, material: this.settings.material };
  }

  /** Take up another stiffness. */
  restiffen(): void {
    void this.check().then(() => this.ask());
  }
  /** What has to be drawn before anything can be searched. */
  get missing(): { region: Region; message: string } | null {
    const { problem } = this.task;
    const empty = MISSING.find(([region]) => !nodesOf(problem, region).length);
    return empty ? { region: empty[0], message: empty[1] } : null;
  }

  close(): void {
    removeEventListener("pagehide", this.leaving);
    document.removeEventListener("keydown", this.keys);
    clearTimeout(this.timer);
    this.checking?.abort();
    this.solver.close();
  }

  private build(): void {
    const stage = h("section", { class: "stage", "aria-label": "Drawing" },
      h("div", { class: "bar" }, this.tools,
        h("span", { class: "spring" }), this.undoButton, this.redoButton),
      h("div", { class: "paper" }, this.readout, this.canvas.svg),
      h("div", { class: "below" }, this.hint, this.complaint));
    this.element.append(
      h("div", { class: "intro" },
        h("h1", {}, "What should move, when you push where?"),
        h("p", {}, "Draw what is held, what is pushed and what should move; bellcrank finds which beams to leave out so that one piece of material does it."),
        this.fresh && h("p", { class: "welcome" }, WELCOME)),
      stage, this.panels.element);
  }

  choose(tool: Tool): void {
    this.tool = tool;
    this.canvas.tool = tool;
    this.element.dataset.tool = tool;
    if (tool === "hand" && !this.task.hand) this.set({ ...this.task, hand: this.problem.initial });
    clear(this.tools, choice("Tool", TOOLS.map(([key, text]) => [key, text]), tool, (picked) => this.choose(picked)));
    this.tools.querySelectorAll("label").forEach((label, k) => label.classList.add("tool", TOOLS[k]![0]));
    this.hint.textContent = TOOLS.find(([key]) => key === tool)![2];
    this.show();
    (this.tools.querySelector("input:checked") as HTMLElement | null)?.focus({ preventScroll: true });
  }

  /** Take in a task that was changed. */
  set(task: Task, merge = false): void {
    this.history.set(task, merge);
    this.changed();
  }

  /** Take in another task from elsewhere. */
  open(task: Task): void {
    this.set(task);
    this.choose("supports");
  }

  private aim(region: "input" | "output", direction: [number, number], amount: number | null, merge: boolean): void {
    const { problem } = this.task;
    const next = region === "input"
      ? { ...problem, input: { ...problem.input, direction, amount: amount ?? problem.input.amount } }
      : { ...problem, output: { ...problem.output, direction } };
    this.set({ ...this.task, problem: next }, merge);
  }

  private paint(beams: number[], merge: boolean): void {
    const all = beams.flatMap((beam) => images(this.problem, beam, this.task.mirror));
    if (this.tool === "hand") {
      const bits = bitsOf(this.task.hand ?? this.problem.initial, this.problem.beams.length);
      const to = bits[beams[0]!] ? 0 : 1;
      for (const beam of all) bits[beam] = to;
      this.set({ ...this.task, hand: hexOf(bits) }, merge);
      say(`${to ? "added" : "removed"} beam ${beams[0]}`);
      return;
    }
    const rules = [...this.task.rules];
    const to = !merge && rules[beams[0]!] === this.brush ? "auto" : this.brush;
    for (const beam of all) rules[beam] = to;
    this.set({ ...this.task, rules, hand: null }, merge);
  }

  pickRows(yes: boolean): void { this.canvas.rows = yes; }

  clearRegion(region: "supports" | "input" | "output"): void {
    this.set(assign(this.task, region, nodesOf(this.task.problem, region), false));
  }

  turn(region: "input" | "output", direction: Point): void { this.change(region, { direction }); }

  change(region: "input" | "output", changes: Record<string, unknown>): void {
    const { problem } = this.task;
    this.set({ ...this.task, problem: { ...problem, [region]: { ...problem[region], ...changes } } });
  }

  private step(way: "undo" | "redo"): void {
    this.history[way]();
    this.changed();
    say(way === "undo" ? "undone" : "done again");
  }

  private changed(): void {
    if (this.tool === "hand" && !this.task.hand) this.history.set({ ...this.task, hand: this.problem.initial }, true);
    clearTimeout(this.timer);
    if (this.tool === "hand") {
      // The question goes out before anything is drawn, and what can wait waits.
      this.ask();
      this.showDrawing();
      this.timer = window.setTimeout(() => { this.keep(); this.show(); void this.check(); }, 150);
      return;
    }
    this.keep();
    this.show();
    this.timer = window.setTimeout(() => void this.check(), 120);
  }

  private keep(): void {
    try { localStorage.setItem(KEY, JSON.stringify(this.task)); } catch { /* storage is full: nothing is kept */ }
  }

  private ask(): void {
    if (this.task.hand && !this.missing) this.solver.ask(this.meant, this.task.hand);
  }

  private show(): void {
    this.showDrawing();
    const byHand = this.tool === "hand" && this.task.hand;
    this.undoButton.disabled = !this.history.canUndo;
    this.redoButton.disabled = !this.history.canRedo;
    this.complaint.textContent = this.missing ? "" : (this.fault?.message ?? "");
    if (!byHand) clear(this.readout);
    this.panels.show();
  }

  private showDrawing(): void {
    const byHand = this.tool === "hand" && this.task.hand;
    const problem = this.problem;
    const fault = this.fault ? [...this.fault.message.matchAll(/\bnode (\d+)/g)].map((m) => Number(m[1])) : [];
    this.canvas.show(this.task, problem, byHand ? bitsOf(this.task.hand!, problem.beams.length) : null, fault);
    if (!byHand) this.canvas.showMoved(null, []);
    this.element.classList.toggle("by-hand", !!byHand);
  }

  /** Ask the server what it thinks of the task. */
  private async check(): Promise<void> {
    this.checking?.abort();
    if (this.missing) {
      this.fault = null;
      this.show();
      return;
    }
    const body = { problem: this.problem, goals: goalsOf(this.task), part: this.settings.real ? this.part : null };
    const text = JSON.stringify(body);
    if (text === this.checked) return;
    const asked = new AbortController();
    this.checking = asked;
    try {
      const found = await post<{ response: Response | null; stiffness: Problem["stiffness"] | null }>("/tasks/check", body, asked.signal);
      this.checked = found.response ? text : "";
      this.fault = null;
      this.response = found.response;
      if (found.stiffness && JSON.stringify(found.stiffness) !== JSON.stringify(this.stiffness)) {
        this.stiffness = found.stiffness;
        this.ask();
      }
    } catch (error) {
      if (error instanceof DOMException) return;
      const refused = error as Refusal;
      this.checked = "";
      this.fault = { key: refused.key, message: inPlainWords(refused.message) };
    }
    if (!asked.signal.aborted) this.show();
  }

  private answered(answer: Response, latency: number, error?: { message: string }): void {
    if (this.tool !== "hand" || !this.task.hand) return;
    const bits = bitsOf(this.task.hand, this.problem.beams.length);
    this.canvas.showMoved(error ? null : answer.displacement, where(bits));
    const whole = this.response?.efficiency;
    const good = !error && answer.status === "converged";
    clear(this.readout,
      h("strong", {}, error ? "–" : figure(answer.efficiency, 3)),
      h("span", {}, error ? sentence(error.message) : good ? "output motion over input motion" : sentence(answer.message)),
      good && whole !== null && whole !== undefined && h("span", {}, `all beams: ${figure(whole, 3)}`),
      h("span", { class: "latency" }, `${latency.toFixed(0)} ms, ${where(bits).length} beams`));
    this.readout.dataset.latency = latency.toFixed(1);
    document.dispatchEvent(new CustomEvent("bellcrank-response", { detail: latency }));
  }

  /** Begin the search, and go to where it can be watched. */
  async begin(): Promise<void> {
    const { settings, task } = this;
    const body = {
      title: task.problem.name, session: session(), problem: this.problem, goals: goalsOf(task),
      method: settings.method, steps: settings.steps, chains: settings.chains, seed: settings.seed,
      part: settings.real ? this.part : null,
      reference: task.hand && task.hand !== this.problem.initial ? task.hand : null,
    };
    const { id } = await post<{ id: string }>("/runs", body);
    location.hash = `#/run/${id}`;
  }

  async keepHand(title: string): Promise<void> {
    const kept = await post<{ source: string; key: string }>("/gallery", {
      problem: this.meant, mask: this.task.hand, title, provenance: { kind: "drawn", ...(this.settings.real ? { part: this.part } : {}) },
    });
    location.hash = `#/design/${kept.source}/${kept.key}`;
  }

  async save(suffix: ".toml" | ".json"): Promise<void> {
    const { text } = await post<{ text: string }>("/tasks/write", { problem: this.problem, lattice: this.task.lattice, suffix });
    download(new Blob([text], { type: "text/plain" }), `${fileName(this.task.problem.name)}${suffix}`);
  }

  /** Put the task into a link, and say where that is: a browser copies only on a page it trusts. */
  async link(): Promise<string> {
    const address = `${location.origin}/#/draw/${await toLink(this.task)}`;
    try {
      await navigator.clipboard.writeText(address);
      return "Copied";
    } catch {
      history.replaceState(null, "", address);
      return "See the address";
    }
  }

  async load(file: File): Promise<void> {
    const suffix = suffixOf(file.name);
    const read = await post<{ problem: Problem; lattice: Record<string, unknown> | null; mask: string | null }>("/tasks/read", { text: await file.text(), suffix });
    this.open({ ...taskOf(read.problem, read.lattice, this.task.scale), hand: read.mask });
  }
}

/** Say what is wrong with a mirror as the page calls it; other sentences stay as they are. */
function inPlainWords(message: string): string {
  const lonely = /^goal 'mirror .*: (\d+ of \d+) designable beams/.exec(message);
  return lonely ? `The task is not symmetric: ${lonely[1]} beams have no mirror image. Choose mirrored nodes, or drop the mirror.` : sentence(message);
}
