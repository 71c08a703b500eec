// The page on which a task is defined, and a design is drawn by hand.

import { bitsOf, fetchRegistries, hexOf, modelOf, post, ServerError, session, Solver, type Part, type Point, type Problem, type Registries, type Response } from "./api";
import { TASK_KEY } from "./begin";
import { Canvas, type Tool } from "./canvas";
import { where } from "./drawing";
import { announce, choice, clear, download, figure, h, iconButton } from "./dom";
import type { Brush, Fault, Settings, TaskEditor } from "./editing";
import { Panels } from "./panels";
import {
  assign, goalsOf, History, images, nodesOf, problemOf, taskOf, toLink, type Hold, type Region, type Task,
} from "./task";
import { fileName, sentence, suffixOf, undoKeys } from "./text";

const TOOLS: [Tool, string, string][] = [
  ["supports", "Supports", "Click nodes to support them; drag a box to select several, double-click to select a row."],
  ["input", "Input", "Click the input nodes; drag the orange arrow to set direction and stroke."],
  ["output", "Output", "Click the output nodes; drag the blue arrow to set the direction in which they should move."],
  ["beams", "Beams", "Mark beams that must be present or absent."],
  ["hand", "By hand", "Click beams to remove or add them; the computed response is shown at once."],
];

const MISSING: [Region, string][] = [
  ["supports", "No supports: choose Supports and click nodes."],
  ["input", "No input: choose Input and click nodes."],
  ["output", "No output: choose Output and click nodes."],
];
const WELCOME = "This example is supported at the bottom and pushed down at the right; its output should move left. Change it, or press Design it.";

export class Editor implements TaskEditor {
  readonly element = h("div", { class: "page draw" });
  tool: Tool = "supports";
  hold: Hold = "fixed";
  brush: Brush = "keep";
  settings: Settings = { method: "", steps: 25000, chains: 2, seed: 0, forPart: true, width: 2, material: "" };
  fault: Fault | null = null;
  registries: Registries | null = null;
  response: Response | null = null;
  private history: History<Task>;
  private readonly canvas: Canvas;
  private readonly panels: Panels;
  private readonly solver: Solver;
  private frame: Pick<Problem, "section" | "material"> = {};
  private readonly hint = h("p", { class: "hint" });
  private readonly errorLine = h("p", { class: "error", role: "alert" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private readonly tools = h("div", { class: "tools" });
  private readonly undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => this.step("undo"));
  private readonly redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("redo"));
  private checking: AbortController | null = null;
  private timer = 0;
  private checked = "";
  private readonly onLeave = (): void => this.store();
  private readonly keys = undoKeys((action) => this.step(action));

  constructor(task: Task, private readonly isFirstVisit = false) {
    this.history = new History(task);
    this.canvas = new Canvas({
      nodes: (region, nodes, add, merge) => this.set(assign(this.task, region, nodes, add, this.hold), merge),
      beams: (beams, merge) => this.paint(beams, merge),
      aim: (region, direction, amount, merge) => this.aim(region, direction, amount, merge),
    });
    this.solver = new Solver((result, latency) => this.showResponse(result, latency, result.error));
    this.panels = new Panels(this);
    this.build();
    this.choose("supports");
    document.addEventListener("keydown", this.keys);
    addEventListener("pagehide", this.onLeave);
    this.changed();
    void fetchRegistries().then((found) => {
      this.registries = found;
      this.settings = { ...this.settings, method: this.settings.method || found.searches[0]!.name, material: this.settings.material || found.materials[0]!.name };
      this.panels.show();
      void this.check();
    }, (error: ServerError) => { this.errorLine.textContent = sentence(error.message); });
  }

  get task(): Task { return this.history.value; }
  get problem(): Problem { return problemOf(this.task); }

  /** The problem as a frame of the struts of the part, with the section computed by the server. */
  private get partProblem(): Problem { return this.settings.forPart ? { ...this.problem, ...this.frame } : this.problem; }

  /** The part to be designed; null without one, or before its material is known. */
  private get part(): Part | null {
    const { forPart, width, material } = this.settings;
    return forPart && material ? { width, thickness: 5, scale: this.task.scale, material } : null;
  }

  updateModel(): void {
    void this.check().then(() => this.evaluate());
  }

  get missing(): { region: Region; message: string } | null {
    const { problem } = this.task;
    const empty = MISSING.find(([region]) => !nodesOf(problem, region).length);
    return empty ? { region: empty[0], message: empty[1] } : null;
  }

  close(): void {
    removeEventListener("pagehide", this.onLeave);
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
      h("div", { class: "below" }, this.hint, this.errorLine));
    this.element.append(
      h("div", { class: "intro" },
        h("h1", {}, "Design a compliant mechanism"),
        h("p", {}, "Define supports, input and output. The search determines which beams to remove, so that one piece of material produces the motion."),
        this.isFirstVisit && h("p", { class: "welcome" }, WELCOME)),
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

  set(task: Task, merge = false): void {
    this.history.set(task, merge);
    this.changed();
  }

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
      announce(`${to ? "added" : "removed"} beam ${beams[0]}`);
      return;
    }
    const rules = [...this.task.rules];
    const to = !merge && rules[beams[0]!] === this.brush ? "auto" : this.brush;
    for (const beam of all) rules[beam] = to;
    this.set({ ...this.task, rules, hand: null }, merge);
  }

  selectRows(rows: boolean): void { this.canvas.rows = rows; }

  clearRegion(region: "supports" | "input" | "output"): void {
    this.set(assign(this.task, region, nodesOf(this.task.problem, region), false));
  }

  setDirection(region: "input" | "output", direction: Point): void { this.change(region, { direction }); }

  change(region: "input" | "output", changes: Record<string, unknown>): void {
    const { problem } = this.task;
    this.set({ ...this.task, problem: { ...problem, [region]: { ...problem[region], ...changes } } });
  }

  private step(action: "undo" | "redo"): void {
    this.history[action]();
    this.changed();
    announce(action === "undo" ? "undone" : "redone");
  }

  private changed(): void {
    if (this.tool === "hand" && !this.task.hand) this.history.set({ ...this.task, hand: this.problem.initial }, true);
    clearTimeout(this.timer);
    if (this.tool === "hand") {
      // The request is sent before the drawing is updated; the rest is delayed.
      this.evaluate();
      this.showDrawing();
      this.timer = window.setTimeout(() => { this.store(); this.show(); void this.check(); }, 150);
      return;
    }
    this.store();
    this.show();
    this.timer = window.setTimeout(() => void this.check(), 120);
  }

  private store(): void {
    try { localStorage.setItem(TASK_KEY, JSON.stringify(this.task)); } catch { /* the storage is full: not stored */ }
  }

  private evaluate(): void {
    if (this.task.hand && !this.missing) this.solver.evaluate(this.partProblem, this.task.hand);
  }

  private show(): void {
    this.showDrawing();
    const byHand = this.tool === "hand" && this.task.hand;
    this.undoButton.disabled = !this.history.canUndo;
    this.redoButton.disabled = !this.history.canRedo;
    this.errorLine.textContent = this.missing ? "" : (this.fault?.message ?? "");
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

  /** Validate the task on the server, and evaluate the full lattice. */
  private async check(): Promise<void> {
    this.checking?.abort();
    if (this.missing) {
      this.fault = null;
      this.show();
      return;
    }
    const body = { problem: this.problem, goals: goalsOf(this.task), part: this.part };
    const text = JSON.stringify(body);
    if (text === this.checked) return;
    const requested = new AbortController();
    this.checking = requested;
    try {
      const found = await post<{ response: Response | null } & Pick<Problem, "section" | "material">>("/tasks/check", body, requested.signal);
      this.checked = found.response ? text : "";
      this.fault = null;
      this.response = found.response;
      const frame = found.section && found.material ? { section: found.section, material: found.material } : {};
      if (JSON.stringify(frame) !== JSON.stringify(this.frame)) {
        this.frame = frame;
        this.evaluate();
      }
    } catch (error) {
      if (error instanceof DOMException) return;
      const refused = error as ServerError;
      this.checked = "";
      this.fault = { key: refused.key, message: errorText(refused.message) };
    }
    if (!requested.signal.aborted) this.show();
  }

  private showResponse(response: Response, latency: number, error?: { message: string }): void {
    if (this.tool !== "hand" || !this.task.hand) return;
    const bits = bitsOf(this.task.hand, this.problem.beams.length);
    this.canvas.showMoved(error ? null : response.displacement, where(bits));
    const full = this.response?.efficiency;
    const converged = !error && response.status === "converged";
    clear(this.readout,
      h("strong", {}, error ? "–" : figure(response.efficiency, 3)),
      h("span", {}, error ? sentence(error.message) : converged ? `${modelOf(this.partProblem)}: output / input displacement` : sentence(response.message)),
      converged && full !== null && full !== undefined && h("span", {}, `full lattice: ${figure(full, 3)}`),
      h("span", { class: "latency" }, `${latency.toFixed(0)} ms, ${where(bits).length} beams`));
    this.readout.dataset.latency = latency.toFixed(1);
    document.dispatchEvent(new CustomEvent("bellcrank-response", { detail: latency }));
  }

  /** Start the search and open its page. */
  async startSearch(): Promise<void> {
    const { settings, task } = this;
    const body = {
      title: task.problem.name, session: session(), problem: this.problem, goals: goalsOf(task),
      method: settings.method, steps: settings.steps, chains: settings.chains, seed: settings.seed,
      part: this.part,
      reference: task.hand && task.hand !== this.problem.initial ? task.hand : null,
    };
    const { id } = await post<{ id: string }>("/runs", body);
    location.hash = `#/run/${id}`;
  }

  async saveHandDesign(title: string): Promise<void> {
    const saved = await post<{ source: string; key: string }>("/gallery", {
      problem: this.partProblem, mask: this.task.hand, title, provenance: { kind: "drawn", ...(this.part ? { part: this.part } : {}) },
    });
    location.hash = `#/design/${saved.source}/${saved.key}`;
  }

  async save(suffix: ".toml" | ".json"): Promise<void> {
    const { text } = await post<{ text: string }>("/tasks/write", { problem: this.problem, lattice: this.task.lattice, suffix });
    download(new Blob([text], { type: "text/plain" }), `${fileName(this.task.problem.name)}${suffix}`);
  }

  async link(): Promise<string> {
    const address = `${location.origin}/#/draw/${await toLink(this.task)}`;
    try {
      await navigator.clipboard.writeText(address);
      return "Copied";
    } catch { // browsers allow copying on secure pages only
      history.replaceState(null, "", address);
      return "See address bar";
    }
  }

  async load(file: File): Promise<void> {
    const suffix = suffixOf(file.name);
    const read = await post<{ problem: Problem; lattice: Record<string, unknown> | null; mask: string | null }>("/tasks/read", { text: await file.text(), suffix });
    this.open({ ...taskOf(read.problem, read.lattice, this.task.scale), hand: read.mask });
  }
}

/** Replace the message of a mirror constraint by the terms of the page; other messages are unchanged. */
function errorText(message: string): string {
  const unmatched = /^goal 'mirror .*: (\d+ of \d+) designable beams/.exec(message);
  return unmatched ? `The task is not symmetric: ${unmatched[1]} beams have no mirror image. Select symmetric nodes, or switch the mirror symmetry off.` : sentence(message);
}
