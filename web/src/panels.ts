// The panels beside the drawing: the properties of the task in text and numbers.

import { get, post, type Point, type Problem, type ServerError } from "./api";
import { builtInTask, emptyTask, exampleTask } from "./begin";
import { angleOf, isEach, unit, directionName } from "./drawing";
import { button, choice, clear, count, field, figure, h, number, select } from "./dom";
import type { Brush, TaskEditor } from "./editing";
import { craneRows, transferNodes } from "./lattices";
import { SearchBox } from "./searchbox";
import { directionOf, nodesOf, type Hold, type Rule } from "./task";
import { sentence } from "./text";

interface BundledProblem { name: string; group: string; about: string }

export class Panels {
  readonly element = h("aside", { class: "panel", "aria-label": "Task" });
  private problems: BundledProblem[] = [];
  private local: Record<string, string> = {};
  private readonly searchBox: SearchBox;
  private pressed = false;
  private stale = false;

  constructor(private readonly editor: TaskEditor) {
    this.searchBox = new SearchBox(editor, () => this.show());
    this.element.addEventListener("pointerdown", () => this.press());
    void get<BundledProblem[]>("/problems").then((found) => { this.problems = found; this.show(); });
  }

  /** Postpone updates until the pointer is released: a replaced element would receive no click. */
  private press(): void {
    this.pressed = true;
    const release = (): void => {
      removeEventListener("pointerup", release);
      removeEventListener("pointercancel", release);
      setTimeout(() => { // after the click
        this.pressed = false;
        if (this.stale) this.show();
      });
    };
    addEventListener("pointerup", release);
    addEventListener("pointercancel", release);
  }

  show(): void {
    this.stale = this.pressed;
    if (this.pressed) return;
    const focused = document.activeElement;
    const label = focused instanceof HTMLElement && this.element.contains(focused) ? focused.dataset.key ?? "" : "";
    clear(this.element,
      this.section("lattice", "Lattice", this.latticeSummary(), this.lattice()),
      this.section("supports", "Supports", this.regionSummary("supports"), this.supports()),
      this.section("input", "Input", this.regionSummary("input"), this.input()),
      this.section("output", "Output", this.regionSummary("output"), this.output()),
      this.section("beams", "Beams", this.beamSummary(), this.beams()),
      this.searchBox.make());
    if (label) this.element.querySelector<HTMLElement>(`[data-key="${label}"]`)?.focus({ preventScroll: true });
  }

  private section(key: string, title: string, summary: string, content: HTMLElement): HTMLElement {
    const { editor } = this;
    const open = key === "lattice" ? this.local.lattice === "open" : editor.tool === key || (key === "beams" && editor.tool === "hand");
    const fault = this.faultOf(key);
    const press = (): void => {
      if (key === "lattice") { this.local.lattice = open ? "" : "open"; this.show(); }
      else if (!open) editor.choose(key as never);
    };
    return h("section", { class: `step ${key}${open ? " open" : ""}${fault ? " faulty" : ""}` },
      h("h2", {}, h("button", { type: "button", "aria-expanded": String(open), onclick: press, "data-key": `head-${key}` },
        h("span", { class: "name" }, title), h("span", { class: "summary" }, summary))),
      open && content,
      fault && h("p", { class: "fault", role: "alert" }, fault));
  }

  private faultOf(key: string): string {
    const { fault, missing } = this.editor;
    if (this.local[`fault-${key}`]) return this.local[`fault-${key}`]!;
    if (missing) return missing.region === key ? missing.message : "";
    if (!fault) return "";
    const keys: Record<string, string[]> = {
      lattice: ["lattice", "positions", "beams"], supports: ["supports"], input: ["input"], output: ["output"], beams: ["designable", "initial", "problem"],
    };
    const owner = Object.entries(keys).find(([, names]) => names.some((name) => fault.key.startsWith(name)));
    return (owner ? owner[0] === key : key === "beams") ? fault.message : "";
  }

  private async attempt(key: string, work: () => Promise<void>): Promise<void> {
    this.local[`fault-${key}`] = "";
    try {
      await work();
    } catch (error) {
      this.local[`fault-${key}`] = sentence((error as ServerError).message);
    }
    this.show();
  }

  private latticeSummary(): string {
    const { problem, scale } = this.editor.task;
    return `${count(problem.positions.length, "node")}, ${count(problem.beams.length, "beam")} of ${scale} mm`;
  }

  private lattice(): HTMLElement {
    const { editor } = this;
    const table = editor.task.lattice;
    const kinds: [string, string][] = [
      ["triangular-rectangle", "Rectangle"], ["triangular-rows", "Crane"], ["displaced-delaunay", "Disordered"], ["jammed-discs", "Discs"],
    ];
    const kind = String(table?.kind ?? "");
    const start = select(
      [["", "choose …"], ["example", "an example"], ...this.problems.map((each): [string, string] => [each.name, each.name])],
      "", (name) => void this.attempt("lattice", async () => editor.open(name === "example" ? await exampleTask() : await builtInTask(name))));
    start.dataset.key = "start";
    const whole = (key: string, label: string, least: number, most: number): HTMLElement => {
      const input = number(Number(table?.[key] ?? least), { min: least, max: most, step: 1 }, (value) =>
        void this.remake({ ...table, [key]: Math.round(value) }));
      input.dataset.key = `lattice-${key}`;
      return field(label, input);
    };
    const scale = number(editor.task.scale, { min: 0.5, max: 500, step: "any" }, (value) => {
      if (value > 0) editor.set({ ...editor.task, scale: value });
    });
    scale.dataset.key = "scale";
    const file = h("input", { type: "file", accept: ".toml,.json", class: "visually-hidden", tabindex: -1, "aria-label": "File to open" });
    file.addEventListener("change", () => {
      const picked = file.files?.[0];
      if (picked) void this.attempt("lattice", () => this.editor.load(picked));
    });
    return h("div", { class: "content" },
      field("Start from", start),
      choice("Kind of lattice", kinds, kind as never, (picked) => void this.remake(
        picked === "jammed-discs" ? { kind: picked, discs: 120, seed: 1 }
          : picked === "triangular-rows" ? craneRows(11, 6)
          : { kind: picked, columns: Number(table?.columns ?? 8), rows: Number(table?.rows ?? 9), ...(picked === "displaced-delaunay" ? { displacement: 0.2, seed: 1 } : {}) })),
      (kind === "triangular-rectangle" || kind === "displaced-delaunay") && h("div", { class: "row" },
        whole("columns", "Columns", 2, 60), whole("rows", "Rows", 2, 60)),
      kind === "triangular-rows" && Array.isArray(table?.counts) && table.counts.length > 6 && h("div", { class: "row" },
        this.size("Columns", Number(table.counts[0]), 5, 40, (value) => craneRows(value, (table.counts as number[]).length - 6)),
        this.size("Rows of the body", table.counts.length - 6, 1, 40, (value) => craneRows(Number((table.counts as number[])[0]), value))),
      kind === "jammed-discs" && h("div", { class: "row" }, whole("discs", "Discs", 20, 1000), whole("seed", "Seed", 0, 100000)),
      kind === "displaced-delaunay" && h("div", { class: "row" }, whole("seed", "Seed", 0, 100000)),
      h("div", { class: "row" }, field("Beam length", scale, "mm"),
        field("Name", this.name())),
      h("div", { class: "buttons" },
        button("Open a file", () => file.click(), "", { "data-key": "open" }), file,
        button("Save TOML", () => void this.attempt("lattice", () => editor.save(".toml")), "", { "data-key": "toml" }),
        button("Save JSON", () => void this.attempt("lattice", () => editor.save(".json")), "", { "data-key": "json" }),
        button(this.local.link || "Copy link", () => void this.attempt("lattice", async () => {
          this.local.link = await editor.link();
        }), "", { "data-key": "link" })));
  }

  private size(label: string, value: number, least: number, most: number, make: (value: number) => Record<string, unknown>): HTMLElement {
    const input = number(value, { min: least, max: most, step: 1 }, (given) =>
      void this.remake(make(Math.min(most, Math.max(least, Math.round(given))))));
    input.dataset.key = `crane-${label}`;
    return field(label, input);
  }

  private name(): HTMLInputElement {
    const input = h("input", { type: "text", value: this.editor.task.problem.name, maxlength: 100, "data-key": "name" });
    input.addEventListener("change", () => {
      const name = input.value.trim();
      if (name) this.editor.set({ ...this.editor.task, problem: { ...this.editor.task.problem, name } });
    });
    return input;
  }

  private async remake(table: Record<string, unknown>): Promise<void> {
    await this.attempt("lattice", async () => {
      const made = await post<Pick<Problem, "positions" | "beams">>("/lattices", { lattice: table });
      const before = this.editor.task;
      let next = emptyTask(made, table, before);
      // Regions are transferred to the nearest nodes of the new lattice.
      for (const region of ["input", "output"] as const) next = { ...next, problem: { ...next.problem, [region]: { ...next.problem[region], nodes: transferNodes(before.problem, made, before.problem[region].nodes) } } };
      const taken = new Set([...next.problem.input.nodes, ...next.problem.output.nodes]);
      const held = transferNodes(before.problem, made, before.problem.supports.fixed).filter((node) => !taken.has(node));
      next.problem.supports = { fixed: held, fixed_x: [], fixed_y: [] };
      const output = next.problem.output.nodes.filter((node) => !next.problem.input.nodes.includes(node));
      next.problem.output = { ...next.problem.output, nodes: output };
      this.editor.set(next);
    });
  }

  private regionSummary(region: "supports" | "input" | "output"): string {
    const { problem, scale } = this.editor.task;
    const nodes = nodesOf(problem, region).length;
    if (!nodes) return "none";
    if (region === "supports") return count(nodes, "node");
    const at = problem[region];
    const direction = isEach(at.direction) ? "several directions" : directionName(at.direction);
    if (region === "output") return `${count(nodes, "node")}, ${direction}`;
    const { drive, amount } = problem.input;
    return `${count(nodes, "node")}, ${drive === "displacement" ? `${figure(amount * scale, 1)} mm` : `force ${figure(amount, 2)}`} ${direction}`;
  }

  private picking(region: "supports" | "input" | "output"): HTMLElement {
    const { editor } = this;
    const all = nodesOf(editor.task.problem, region);
    const rows = h("input", { type: "checkbox", "data-key": "rows", checked: this.local.rows === "yes" });
    rows.addEventListener("change", () => { this.local.rows = rows.checked ? "yes" : ""; editor.selectRows(rows.checked); });
    return h("div", { class: "row between" },
      h("label", { class: "tick" }, rows, "Whole rows"),
      button("Clear", () => editor.clearRegion(region), "quiet", { disabled: !all.length, "data-key": "clear" }));
  }

  private supports(): HTMLElement {
    const options: [Hold, string][] = [["fixed", "Fixed"], ["fixed_y", "Roller ↔"], ["fixed_x", "Roller ↕"]];
    return h("div", { class: "content" },
      choice("Kind of support", options, this.editor.hold, (picked) => { this.editor.hold = picked; }),
      this.picking("supports"));
  }

  private direction(region: "input" | "output"): HTMLElement {
    const { editor } = this;
    const at = editor.task.problem[region];
    if (isEach(at.direction)) {
      return h("p", {}, "The nodes have different directions. ",
        button("Use one direction", () => editor.setDirection(region, directionOf(at)), "quiet", { "data-key": "same" }));
    }
    const angle = number(angleOf(at.direction), { min: 0, max: 360, step: 5 }, (value) => editor.setDirection(region, unit(value)));
    angle.dataset.key = `${region}-angle`;
    const directions: [string, string, Point][] = [["↑", "up", [0, 1]], ["→", "right", [1, 0]], ["↓", "down", [0, -1]], ["←", "left", [-1, 0]]];
    return h("div", { class: "row" }, field("Direction", angle, "°"),
      h("div", { class: "directions", role: "group", "aria-label": "Common directions" }, ...directions.map(([sign, name, direction]) =>
        button(sign, () => editor.setDirection(region, direction), "quiet", { "aria-label": name, title: name, "data-key": `${region}-${name}` }))));
  }

  private input(): HTMLElement {
    const { editor } = this;
    const { drive, amount } = editor.task.problem.input;
    const moves = drive === "displacement";
    const by = moves ? editor.task.scale : 1;
    const size = number(Number((amount * by).toFixed(4)), { min: 0.001, step: "any" }, (value) => {
      if (value > 0) editor.change("input", { amount: value / by });
    });
    size.dataset.key = "amount";
    return h("div", { class: "content" },
      this.direction("input"),
      h("div", { class: "row" }, field(moves ? "Stroke" : "Force on each node", size, moves ? "mm" : ""),
        field("Prescribed", select([["displacement", "displacement"], ["force", "force"]], drive, (picked) =>
          editor.change("input", { drive: picked as Problem["input"]["drive"], amount: picked === "force" ? 0.02 : 0.3 })))),
      this.picking("input"));
  }

  private output(): HTMLElement {
    const { editor } = this;
    const { spring } = editor.task.problem.output;
    const stiff = number(spring ?? 0, { min: 0, step: "any" }, (value) =>
      editor.change("output", value > 0 ? { spring: value, spring_kind: "directional" } : { spring: null, spring_kind: null }));
    stiff.dataset.key = "spring";
    return h("div", { class: "content" }, this.direction("output"),
      field("Output spring stiffness", stiff, "", "0 for none; for comparison, a beam has a stiffness of 10"),
      this.picking("output"));
  }

  private beamSummary(): string {
    const { editor } = this;
    const rules = editor.task.rules.filter((rule) => rule === "keep" || rule === "never").length;
    const mirrored = editor.task.mirror.x || editor.task.mirror.y ? ", symmetric" : "";
    return `${editor.problem.designable.length.toLocaleString("en")} designable${rules ? `, ${rules} fixed` : ""}${mirrored}`;
  }

  private beams(): HTMLElement {
    const { editor } = this;
    const { mirror } = editor.task;
    const tick = (axis: "x" | "y", text: string): HTMLElement => {
      const input = h("input", { type: "checkbox", checked: mirror[axis], "data-key": `mirror-${axis}` });
      input.addEventListener("change", () => editor.set({ ...editor.task, mirror: { ...editor.task.mirror, [axis]: input.checked } }));
      return h("label", { class: "tick" }, input, text);
    };
    if (editor.tool === "hand") {
      return h("div", { class: "content" },
        h("p", {}, "The search result is compared with this design."),
        h("div", { class: "buttons" },
          button("Save this design", () => void this.attempt("beams", () => editor.saveHandDesign(editor.task.problem.name)), "", { "data-key": "save" }),
          button("Restore all beams", () => editor.set({ ...editor.task, hand: editor.problem.initial }), "", { "data-key": "all" })),
        h("div", { class: "row ticks" }, tick("x", "Mirror symmetry left/right"), tick("y", "Mirror symmetry up/down")));
    }
    const brushes: [Rule, string][] = [["keep", "Present"], ["never", "Absent"], ["auto", "Designable"]];
    return h("div", { class: "content" },
      choice("Mark as", brushes, editor.brush as Rule, (picked) => { editor.brush = picked as Brush; }),
      h("div", { class: "row ticks" }, tick("x", "Mirror symmetry left/right"), tick("y", "Mirror symmetry up/down")),
      h("div", { class: "buttons" },
        button("Make all designable", () => editor.set({ ...editor.task, rules: editor.task.rules.map(() => "auto") }), "", { "data-key": "free" })));
  }
}
