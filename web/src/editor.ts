// The page on which a task is stated, and a design is drawn by hand.

import { bitsOf, fetchRegistries, get, hexOf, isInSpace, post, ServerError, session, Solver, type ItemState, type Point, type Registries, type Response, type Run } from "./api";
import { store, storedHistory, storedSettings, storeSettings, TASK_KEY } from "./begin";
import { Canvas, type CanvasActions } from "./canvas";
import { where } from "./drawing";
import { announce, button, choice, clear, count, download, figure, h, iconButton } from "./dom";
import type { Fault, Settings, TaskEditor } from "./editing";
import { Panels } from "./panels";
import { SpaceCanvas } from "./spacecanvas";
import {
  assign, History, imagesOf, isSpatial, isTask, isTurn, nodesOf, sectionsOf, toLink, vectorInSpace, vectorOf, isSymmetric, withImages, withSection, withSections,
  type Built, type Direction, type Domain, type Hold, type Kind, type Shape, type Table, type Target, type Task, type Tool, type ZoneKind, type ZoneShape,
} from "./task";
import { withInputsAfterWeights } from "./weights";
import { faultText, fileName, lengthIn, sentence, suffixOf, undoKeys } from "./text";
import type { Arrow, TaskDrawing, View } from "./view";

const TOOLS: [Tool, string, string][] = [
  ["supports", "Supports", "Click nodes to hold them; drag a box to select several, double-click to select a row."],
  ["inputs", "Inputs", "Click the nodes that are pushed; drag the orange arrow to set direction and stroke."],
  ["outputs", "Outputs", "Click the nodes that must move; drag the blue arrow to set the direction."],
  ["loads", "Loads", "Click nodes on which a force acts, or which a spring holds. Forces grow with the input, or act before it as a weight that hangs on the part."],
  ["zones", "Zones", "Drag to draw a hole, a zone that stays free, or a zone that stays solid."],
  ["hand", "By hand", "Click struts to remove or add them; the part is computed at once."],
];
/** Hints for a task in space. */
const IN_SPACE: Partial<Record<Tool, string>> = {
  supports: "Click nodes to hold them; drag to turn the view. Choose a layer to see its nodes only, or to add all of them at once. Solid bars are kept; the search decides on the thin lines.",
  inputs: "Click the nodes that are pushed; set direction and stroke in the panel.",
  outputs: "Click the nodes that must move; set their direction in the panel.",
  zones: "Add holes and zones in the panel, under Part, domain, files.",
};
/** Further hints for a symmetric design. */
const MIRRORED: Partial<Record<Tool, string>> = {
  supports: " The design is symmetric: a click selects the mirror image, too.",
  inputs: " The design is symmetric: an input on the line of symmetry, or with an image, is changed with its mirror image.",
  outputs: " The design is symmetric: an output on the line of symmetry, or with an image, is changed with its mirror image.",
};
const WELCOME = "This example is held at the bottom and pushed down at the right; its output must move left. Change it, or press Design it.";
/** What a first node makes of a kind without any table. */
const FIRST: Record<Kind, Record<string, unknown>> = {
  supports: { at: [] },
  inputs: { at: [], direction: "down", displacement: 3 },
  outputs: { at: [], direction: "left", gain: [{ maximise: true }], off_axis: [{ at_most: "10%" }] },
  loads: { at: [], direction: "down", force: "10 g" },
};
const DELAY = 60;
/** Milliseconds without a change after which a design by hand is verified along the whole stroke. */
const REST = 250;

export class Editor implements TaskEditor {
  readonly element = h("div", { class: "page draw" });
  tool: Tool = "supports";
  hold: Hold = "all";
  zone: { kind: ZoneKind; shape: ZoneShape } = { kind: "holes", shape: "box" };
  private chosen: Settings = storedSettings();
  fault: Fault | null = null;
  registries: Registries | null = null;
  built: Built | null = null;
  loadCase = 0;
  target: Target = { kind: "supports", index: 0 };
  reached: ItemState[] | null = null;
  private history: History<Task>;
  private canvas: TaskDrawing;
  private readonly paper: HTMLElement;
  private readonly panels: Panels;
  private readonly solver: Solver;
  private readonly hint = h("p", { class: "hint" });
  private readonly errorLine = h("p", { class: "error", role: "alert" });
  private readonly welcome = h("p", { class: "welcome" }, WELCOME);
  private readonly notice = h("p", { class: "notice", role: "status" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private readonly tools = h("div", { class: "tools" });
  private readonly undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => this.step("undo"));
  private readonly redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("redo"));
  private pairing = false;
  private building: AbortController | null = null;
  private verifying: AbortController | null = null;
  private timer = 0;
  private rest = 0;
  private sent = "";
  /** Whether another task was opened since the latest one was built. */
  private isOther = false;
  private readonly onLeave = (): void => this.store();
  private readonly onStorage = (event: StorageEvent): void => this.noteOtherTab(event);
  private readonly actions: CanvasActions = {
    nodes: (nodes, add) => this.pick(nodes, add),
    beams: (beams, merge) => this.paint(beams, merge),
    aim: (target, direction, stroke, merge) => this.aim(target, direction, stroke, merge),
    zone: (shape) => this.addZone(shape),
    note: (text) => this.note(text),
  };
  private readonly keys = undoKeys((action) => this.step(action));

  constructor(task: Task, isFirstVisit = false) {
    this.welcome.hidden = !isFirstVisit;
    this.history = new History(task, storedHistory());
    this.canvas = new Canvas(this.actions);
    this.paper = h("div", { class: "paper" }, this.readout, this.canvas.element, this.notice);
    this.solver = new Solver((result, latency) => this.showResponse(result, latency, result.error));
    this.panels = new Panels(this);
    this.layOut();
    this.choose("supports");
    document.addEventListener("keydown", this.keys);
    addEventListener("pagehide", this.onLeave);
    addEventListener("storage", this.onStorage);
    this.changed();
    void fetchRegistries().then((found) => {
      this.registries = found;
      this.settings = { ...this.settings, method: this.settings.method || found.searches[0]!.name };
      this.panels.show();
    }, (error: ServerError) => { this.errorLine.textContent = sentence(error.message); });
  }

  get settings(): Settings { return this.chosen; }
  set settings(settings: Settings) { this.chosen = settings; storeSettings(settings); }

  get task(): Task { return this.history.value; }
  get hasHandDesign(): boolean { return this.task.hand !== null && this.task.hand !== this.built?.problem?.initial; }
  get missing(): string | null { return this.built?.missing ?? null; }

  close(): void {
    removeEventListener("pagehide", this.onLeave);
    removeEventListener("storage", this.onStorage);
    document.removeEventListener("keydown", this.keys);
    clearTimeout(this.timer);
    clearTimeout(this.rest);
    this.building?.abort();
    this.verifying?.abort();
    this.solver.close();
    this.canvas.close();
  }

  /** The drawing for a lattice in the plane or in space. */
  private showCanvas(inSpace: boolean): void {
    if (inSpace === this.canvas instanceof SpaceCanvas) return;
    const { tool, rows } = this.canvas;
    this.canvas.close();
    this.canvas.element.remove();
    this.canvas = Object.assign(inSpace ? new SpaceCanvas(this.actions) : new Canvas(this.actions), { tool, rows });
    this.paper.append(this.canvas.element);
    this.element.classList.toggle("in-space", inSpace);
  }

  private layOut(): void {
    const stage = h("section", { class: "stage", "aria-label": "Drawing" },
      h("div", { class: "bar" }, this.tools,
        h("span", { class: "spring" }), this.undoButton, this.redoButton),
      this.paper,
      h("div", { class: "below" }, this.hint, this.errorLine));
    this.element.append(
      h("div", { class: "intro" },
        h("h1", {}, "Design a compliant mechanism"),
        h("p", {}, "State where the part is held, where it is pushed, and what its outputs must do. The search determines which struts to keep; the result is one piece that prints."),
        this.panels.start, !this.welcome.hidden && this.welcome),
      stage, this.panels.element);
  }

  choose(tool: Tool): void {
    this.tool = tool;
    this.canvas.tool = tool;
    this.element.dataset.tool = tool;
    if (tool !== "zones" && tool !== "hand") this.target = { kind: tool, index: tool === "supports" ? this.supportIndex() : 0 };
    if (tool === "hand") this.drawByHand();
    clear(this.tools, choice("Tool", TOOLS.map(([key, text]) => [key, text]), tool, (picked) => this.choose(picked)));
    this.tools.querySelectorAll("label").forEach((label, k) => label.classList.add("tool", TOOLS[k]![0]));
    this.show();
    (this.tools.querySelector("input:checked") as HTMLElement | null)?.focus({ preventScroll: true });
    this.panels.reveal(tool);
  }

  aimAt(target: Target): void {
    if (this.tool !== target.kind) this.choose(target.kind);
    this.target = target;
    this.show();
  }

  showCase(loadCase: number): void {
    this.loadCase = loadCase;
    this.target = { ...this.target, index: this.target.kind === "supports" ? this.target.index : 0 };
    this.show();
  }

  setRows(rows: boolean): void { this.canvas.rows = rows; }

  /** Number of the support with the chosen hold; of a new one if there is none. */
  supportIndex(): number {
    const supports = this.task.table.supports ?? [];
    const found = supports.findIndex(({ hold }) => (hold ?? "all") === this.hold);
    return found < 0 ? supports.length : found;
  }

  private set(task: Task, merge = false): void {
    this.welcome.hidden = true;
    this.history.set(task, merge);
    this.changed();
  }

  change(table: Table, merge = false): void { this.set({ table, hand: this.task.hand }, merge); }

  open(task: Task): void {
    this.loadCase = 0;
    this.isOther = true;
    this.set(task);
    this.choose(this.tool === "hand" ? "supports" : this.tool);
  }

  /** Add nodes to the active table or remove them. */
  private pick(nodes: number[], add: boolean): void {
    const { built, loadCase } = this;
    if (!built) return;
    if (this.target.kind === "supports") this.target = { kind: "supports", index: this.supportIndex() };
    const { kind, index } = this.target;
    let { table } = this.task;
    const symmetry = isSpatial(table) ? "" : table.limits?.symmetry ?? "";
    const before = nodesOf(built, loadCase, kind)[index] ?? [];
    // Supports of a symmetric design are symmetric, and inputs and outputs that are so stay it.
    if (symmetry && (kind === "supports" || isSymmetric(built, symmetry, before))) nodes = withImages(built, symmetry, nodes);
    const sections = sectionsOf(table, loadCase, kind);
    let now = built;
    if (index >= sections.length) {
      const fresh = kind === "supports" ? { at: [], ...(this.hold === "all" ? {} : { hold: this.hold }) } : FIRST[kind];
      table = withInputsAfterWeights(withSections(table, loadCase, kind, [...sections, fresh] as never), loadCase);
      now = withRegion(built, loadCase, { kind, index: sections.length }, []);
      this.target = { kind, index: sections.length };
    }
    const next = assign({ ...this.task, table }, now, loadCase, this.target, nodes, add);
    // The regions follow at once, since the next click may come before the server has answered.
    const gone = new Set(nodes);
    const taken: string[] = [];
    for (const other of ["supports", "inputs", "outputs"] as const) {
      nodesOf(now, loadCase, other).forEach((known, k) => {
        const left = known.filter((node) => !gone.has(node));
        if (!add || kind === "loads" || left.length === known.length) return;
        if (other !== kind || k !== index) taken.push(`${count(known.length - left.length, "node")} of ${other.slice(0, -1)} ${k + 1}`);
        now = withRegion(now, loadCase, { kind: other, index: k }, left);
      });
    }
    const known = nodesOf(built, loadCase, kind)[this.target.index] ?? [];
    this.built = withRegion(now, loadCase, this.target, add ? [...new Set([...known, ...nodes])] : known.filter((node) => !gone.has(node)));
    this.set({ ...next, hand: null }, this.pairing);
    const text = taken.length ? `${sentence(`Taken over: ${taken.join(", ")}`)} A node belongs to one support, input or output.` : "";
    this.note(text);
    if (!this.pairing && (kind === "inputs" || kind === "outputs")) this.pickImages(symmetry, kind, index, before, nodes, add);
  }

  /** Change the mirror image of an input or output, which is another one, in the same way. */
  private pickImages(symmetry: string, kind: Kind, index: number, before: number[], nodes: number[], add: boolean): void {
    const { built, target } = this;
    if (!built || (symmetry !== "x" && symmetry !== "y") || !before.length) return;
    const [old, next] = [imagesOf(built, symmetry, before), imagesOf(built, symmetry, nodes)];
    const other = nodesOf(built, this.loadCase, kind).findIndex((each, k) => k !== index && each.length === old.length && old.every((node) => each.includes(node)));
    if (other < 0 || next.includes(-1)) return;
    this.pairing = true;
    this.target = { kind, index: other };
    this.pick(next, add);
    this.target = target;
    this.pairing = false;
    this.show();
  }

  private aim(target: Target, direction: Direction, stroke: number | null, merge: boolean): void {
    this.target = target;
    const scale = this.built?.part.scale ?? 10;
    const changes = { direction, ...(stroke === null ? {} : { displacement: Math.round(stroke * scale * 100) / 100 }) };
    this.change(withSection(this.task.table, this.loadCase, target, changes), merge);
  }

  private addZone(shape: Shape): void {
    const scale = this.built?.part.scale ?? 10;
    const mm = (value: number): number => Math.round(value * scale * 10) / 10;
    const own: Shape = shape.box ? { box: shape.box.map(mm) } : { circle: (shape.circle as number[]).map(mm) as Point, radius: mm(Number(shape.radius)) };
    const { table } = this.task;
    this.change({ ...table, domain: { ...table.domain, [this.zone.kind]: [...(table.domain[this.zone.kind] ?? []), own] } });
  }

  private paint(beams: number[], merge: boolean): void {
    const problem = this.built?.problem;
    if (!problem || !this.task.hand) return;
    const bits = bitsOf(this.task.hand, problem.beams.length);
    const to = bits[beams[0]!] ? 0 : 1;
    for (const beam of beams) bits[beam] = to;
    this.set({ ...this.task, hand: hexOf(bits) }, merge);
    announce(`${to ? "added" : "removed"} strut ${beams[0]}`);
  }

  restoreBeams(): void { if (this.built?.problem) this.set({ ...this.task, hand: this.built.problem.initial }); }

  /** Begin with all struts if there is no design by hand yet. */
  private drawByHand(): void {
    const problem = this.built?.problem;
    if (!problem) return;
    if (!this.task.hand) this.history.set({ ...this.task, hand: problem.initial }, true);
    this.evaluate();
  }

  private step(action: "undo" | "redo"): void {
    this.history[action]();
    this.changed();
    announce(action === "undo" ? "undone" : "redone");
  }

  private changed(): void {
    clearTimeout(this.timer);
    this.loadCase = Math.min(this.loadCase, this.task.table.cases.length - 1);
    if (this.tool === "hand" && JSON.stringify(this.task.table) === this.sent) {
      // The request is sent before the drawing is updated; the rest is delayed.
      this.drawByHand();
      this.showDrawing();
      this.timer = window.setTimeout(() => { this.store(); this.show(); }, 150);
      return;
    }
    this.store();
    this.show();
    this.timer = window.setTimeout(() => void this.build(), this.built ? DELAY : 0);
  }

  private store(): void { store(this.task, this.history.stored); }

  /** Offer the task of another tab, which does not replace the one of this tab. */
  private noteOtherTab(event: StorageEvent): void {
    if (event.key !== TASK_KEY || !event.newValue) return;
    const other = JSON.parse(event.newValue) as unknown;
    if (!isTask(other) || JSON.stringify(other) === JSON.stringify(this.task)) return;
    clear(this.notice, "The task was changed in another tab; this tab keeps its own. ",
      button("Open that one here", () => { clear(this.notice); this.open(other); }, "quiet small"));
  }

  /** Build the task on the server. */
  private async build(): Promise<void> {
    this.building?.abort();
    const requested = new AbortController();
    this.building = requested;
    const text = JSON.stringify(this.task.table);
    try {
      const former = this.built;
      const before = former?.lattice;
      this.built = await post<Built>("/tasks/build", { task: this.task.table }, requested.signal);
      this.fault = this.built.fault && this.faultOf(this.built.fault);
      const { lattice } = this.built;
      const same = !before || (before.beams.length === lattice.beams.length && JSON.stringify(before.positions) === JSON.stringify(lattice.positions));
      if (former && !same && !this.isOther) this.nameMoved(former, this.built);
      this.isOther = false;
      if (this.task.hand && !(same && this.task.hand.length === hexOf(new Uint8Array(lattice.beams.length)).length)) {
        this.history.set({ ...this.task, hand: null }, true);
      }
    } catch (error) {
      if (error instanceof DOMException) return;
      const refused = error as ServerError;
      this.fault = this.faultOf(refused);
    }
    if (requested.signal.aborted) return;
    this.sent = text;
    this.reached = null;
    if (this.tool === "hand") this.drawByHand();
    this.show();
  }

  /** Name the regions whose nodes lie differently beside each other in another lattice, as after a change of size. */
  private nameMoved(former: Built, now: Built): void {
    const offsets = ({ lattice: { positions } }: Built, nodes: number[]): number[][] => {
      const sorted = nodes.map((node) => positions[node]! as number[]).sort((a, b) => a[0]! - b[0]! || a[1]! - b[1]!);
      return sorted.map((place) => place.map((value, axis) => value - sorted[0]![axis]!));
    };
    const names: string[] = [];
    for (const kind of ["supports", "inputs", "outputs"] as Kind[]) {
      const cases = kind === "supports" ? [0] : now.regions.cases.map((_, k) => k);
      for (const k of cases) nodesOf(now, k, kind).forEach((nodes, index) => {
        const old = nodesOf(former, k, kind)[index];
        if (!old || old.length < 2) return;
        // A whole edge or face has other nodes in each lattice.
        const isWhole = sectionsOf(this.task.table, k, kind)[index]?.at?.every(({ edge, face, between }) => (edge || face) && !between);
        if (old.length !== nodes.length) { if (!isWhole) names.push(`${kind.slice(0, -1)} ${index + 1} (${nodes.length} instead of ${count(old.length, "node")})`); return; }
        const [one, two] = [offsets(former, old), offsets(now, nodes)];
        if (one.some((place, j) => place.some((value, axis) => Math.abs(value - two[j]![axis]!) > 0.1))) names.push(`${kind.slice(0, -1)} ${index + 1}`);
      });
    }
    const text = names.length ? `In the new lattice other nodes are selected: ${names.join(", ")}. Check them in the drawing.` : "";
    this.note(text);
  }

  /** Show a notice in the drawing; an empty one removes it. */
  private note(text: string): void {
    clear(this.notice, text && `${text} `, text && button("Close", () => clear(this.notice), "quiet small"));
    if (text) announce(text);
  }

  private faultOf({ key, message }: { key: string; message: string }): Fault {
    const { lattice, part } = this.built ?? {};
    const place = (node: number): string => {
      const at = lattice?.positions[node];
      return at && part ? `the node at ${at.map((value) => (value! * part.scale).toFixed(1)).join(", ")} mm` : `node ${node}`;
    };
    return { key, message, text: faultText(message, place) };
  }

  /** Compute the design drawn by hand at once, and along the whole stroke after a pause. */
  private evaluate(): void {
    const { built, task } = this;
    clearTimeout(this.rest);
    this.verifying?.abort();
    if (!built?.problem || !task.hand) return;
    this.solver.evaluate(built.problem, task.hand, built.part);
    this.rest = window.setTimeout(() => void this.verify(), REST);
  }

  private async verify(): Promise<void> {
    const { built, task } = this;
    const requested = new AbortController();
    this.verifying = requested;
    try {
      const found = await post<Response>("/response", { problem: built!.problem, mask: task.hand, part: built!.part }, requested.signal);
      if (!requested.signal.aborted) this.showResponse(found, null);
    } catch (error) {
      if (!(error instanceof DOMException)) this.errorLine.textContent = sentence((error as ServerError).message);
    }
  }

  private show(): void {
    this.showDrawing();
    const inSpace = this.canvas instanceof SpaceCanvas;
    const mirrored = (!inSpace && this.task.table.limits?.symmetry && MIRRORED[this.tool]) || "";
    this.hint.textContent = ((inSpace && IN_SPACE[this.tool]) || TOOLS.find(([key]) => key === this.tool)![2]) + mirrored;
    this.undoButton.disabled = !this.history.canUndo;
    this.redoButton.disabled = !this.history.canRedo;
    this.errorLine.textContent = this.fault?.text ?? "";
    if (this.tool !== "hand") clear(this.readout);
    this.panels.show();
  }

  private get byHand(): boolean { return this.tool === "hand" && this.task.hand !== null && this.built?.problem != null; }

  private showDrawing(): void {
    const { built } = this;
    if (!built) return;
    const { table } = this.task;
    const total = built.lattice.beams.length;
    const designable = new Uint8Array(total);
    if (built.problem) for (const beam of built.problem.designable) designable[beam] = 1;
    else designable.fill(1);
    const { domain } = table;
    const view: View = {
      built, target: this.target, designable, symmetry: table.limits?.symmetry ?? "",
      held: (table.supports ?? []).map((each, k) => ({ nodes: built.regions.supports[k] ?? [], hold: each.hold ?? "all", active: this.target.kind === "supports" && this.target.index === k })),
      arrows: this.arrows(built),
      zones: [...outlineZone(domain), ...(["holes", "keep_out", "solid"] as const).flatMap((kind) => (domain[kind] ?? []).map((shape) => ({ kind, shape })))],
      bits: this.byHand ? bitsOf(this.task.hand!, total) : null,
      faults: this.fault ? [...this.fault.message.matchAll(/\bnode (\d+)/g)].map((m) => Number(m[1])) : [],
    };
    if (!view.held.length && built.regions.given.supports.length) view.held.push({ nodes: built.regions.given.supports, hold: "all", active: false });
    this.showCanvas(isInSpace(built.lattice));
    this.canvas.zoneShape = this.zone.shape;
    this.canvas.show(view);
    if (!this.byHand) this.canvas.showMoved(null, []);
    this.element.classList.toggle("by-hand", this.byHand);
  }

  private arrows(built: Built): Arrow[] {
    const load_case = this.task.table.cases[this.loadCase]!;
    const { scale } = built.part;
    const problem = built.problem;
    const drive = problem?.input.drive === "displacement" ? problem.input.amount : null;
    const arrow = (kind: Kind, index: number, direction: Direction | undefined, usual: Point, stroke: number | null, turns = false): Arrow => ({
      turns, target: { kind, index }, nodes: nodesOf(built, this.loadCase, kind)[index] ?? [], direction: isInSpace(built.lattice) ? vectorInSpace(direction, usual.length === 3 ? usual : undefined) : vectorOf(direction, usual), stroke,
    });
    const first = (direction: Point | Point[] | undefined, usual: Point): Point => (direction === undefined ? usual : Array.isArray(direction[0]) ? direction[0] : direction as Point);
    const found = [
      ...(load_case.inputs ?? []).map((each, k) => arrow("inputs", k, each.direction, first(problem?.input.direction, [0, -1]),
        each.displacement === undefined ? (each.force === undefined ? drive : null) : lengthIn(each.displacement) / scale)),
      ...(load_case.outputs ?? []).map((each, k) => arrow("outputs", k, each.direction, first(problem?.output.direction, [0, 1]), null, isTurn(each))),
      ...(load_case.loads ?? []).map((each, k) => arrow("loads", k, each.direction, [0, -1], null)),
    ];
    if (!load_case.inputs?.length && built.regions.given.input.length) {
      found.push({ turns: false, target: { kind: "inputs", index: 0 }, nodes: built.regions.given.input, direction: first(problem?.input.direction, [0, -1]), stroke: drive });
    }
    return found;
  }

  /** Show a response, at once with its latency, or one that is verified. */
  private showResponse(response: Response, latency: number | null, error?: { message: string }): void {
    const { built } = this;
    if (!this.byHand || !built?.problem) return;
    const bits = bitsOf(this.task.hand!, built.problem.beams.length);
    this.canvas.showMoved(error ? null : response.displacement, where(bits));
    const isKnown = !error && response.displacement !== null;
    clear(this.readout,
      h("strong", {}, error ? "–" : figure(response.efficiency, 3)),
      h("span", {}, error ? sentence(error.message) : isKnown ? "output / input motion, frames" : sentence(response.message)),
      h("span", { class: "latency" }, `${latency === null ? "along the whole stroke" : `${latency.toFixed(0)} ms`}, ${where(bits).length} struts`));
    // The items follow when the design is verified.
    if (latency === null || error) {
      this.reached = response.items;
      this.panels.showItems();
    }
    if (latency !== null) document.dispatchEvent(new CustomEvent("bellcrank-response", { detail: latency }));
  }

  /** Start the search and open its page. */
  async startSearch(): Promise<void> {
    const { settings, task } = this;
    const body = {
      title: await this.freeTitle(task.table.name), session: session(), task: task.table,
      method: settings.method, steps: settings.steps, chains: settings.chains, seed: settings.seed,
      reference: this.hasHandDesign ? task.hand : null, start: this.hasHandDesign && settings.fromHand ? task.hand : null,
    };
    const { id } = await post<{ id: string }>("/runs", body);
    location.hash = `#/run/${id}`;
  }

  /** A title that no search has yet. */
  private async freeTitle(name: string): Promise<string> {
    const known = new Set((await get<Run[]>("/runs")).map(({ title }) => title));
    let title = name;
    for (let number = 2; known.has(title); number++) title = `${name.slice(0, 100)} (${number})`;
    return title;
  }

  /** Refine the design drawn by hand, and open the page of its refinement. */
  async refineHandDesign(): Promise<void> {
    const { task } = this;
    const { id } = await post<{ id: string }>("/runs", { title: `${task.table.name}, by hand, refined`.slice(0, 120), session: session(), task: task.table, start: task.hand, refine: true });
    location.hash = `#/run/${id}`;
  }

  async saveHandDesign(title: string): Promise<void> {
    const { built, task } = this;
    if (!built?.problem || !task.hand) return;
    const saved = await post<{ source: string; key: string }>("/gallery", {
      problem: built.problem, mask: task.hand, title, provenance: { kind: "drawn", part: built.part, task: task.table },
    });
    location.hash = `#/design/${saved.source}/${saved.key}`;
  }

  async save(): Promise<void> {
    const { text } = await post<{ text: string }>("/tasks/write", { task: this.task.table });
    download(new Blob([text], { type: "text/plain" }), `${fileName(this.task.table.name)}.toml`);
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
    const read = await post<{ task: Table | null; design: { source: string; key: string } | null }>("/tasks/read", { text: await file.text(), suffix: suffixOf(file.name) });
    if (read.task) this.open({ table: read.task, hand: null });
    if (read.design) location.hash = `#/design/${read.design.source}/${read.design.key}`;
  }

  async loadOutline(file: File): Promise<void> {
    const region = await post<Pick<Domain, "outline" | "holes">>("/tasks/region", { text: await file.text(), suffix: suffixOf(file.name) });
    this.change({ ...this.task.table, domain: region });
  }
}

/** The outline of a domain as a zone to be drawn. */
function outlineZone({ outline, size }: Domain): { kind: ZoneKind; shape: Shape }[] {
  const shape = Array.isArray(outline) ? { polygon: outline } : outline ?? (size ? { box: [0, 0, size[0]!, size[1]!] } : null);
  return shape ? [{ kind: "outline" as ZoneKind, shape }] : [];
}

/** A built task with other nodes in one region. */
function withRegion(built: Built, loadCase: number, { kind, index }: Target, nodes: number[]): Built {
  const replaced = (lists: number[][]): number[][] => {
    const next = [...lists];
    next[index] = nodes;
    return next;
  };
  const { regions } = built;
  if (kind === "supports") return { ...built, regions: { ...regions, supports: replaced(regions.supports) } };
  const cases = regions.cases.map((each, k) => (k === loadCase ? { ...each, [kind]: replaced(each[kind]) } : each));
  return { ...built, regions: { ...regions, cases } };
}
