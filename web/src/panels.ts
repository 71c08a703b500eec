// The panels beside the drawing: the task in text and numbers, and its specification.

import { casePanel } from "./casepanel";
import { button, choice, clear, count, h, percent } from "./dom";
import { DomainPanel } from "./domainpanel";
import type { TaskEditor } from "./editing";
import { ratio } from "./fields";
import { limitsPanel } from "./limitspanel";
import { SearchBox } from "./searchbox";
import { itemTable, verdictOf } from "./specification";
import { isSpatial, nodesOf, type Hold, type Kind } from "./task";
import { sentence } from "./text";

const OWNERS: [RegExp, string][] = [
  [/^(domain|lattice|positions|beams|name)/, "domain"],
  [/^part/, "domain"],
  [/^supports|\.supports/, "supports"],
  [/^cases\[\d+\]\.inputs|^input/, "inputs"],
  [/^cases\[\d+\]\.(outputs|input_force|strain)|^output/, "outputs"],
  [/^cases\[\d+\]\.(loads|gravity)/, "loads"],
  [/^(limits|tolerance)/, "limits"],
];
const NEEDED: Record<string, string> = {
  supports: "No supports: choose Supports and click nodes.",
  inputs: "No input: choose Inputs and click nodes.",
  outputs: "No output: choose Outputs and click nodes.",
  loads: "A load has no nodes: choose Loads and click nodes.",
};

const HOLDS: [Hold, string][] = [["all", "Fixed"], ["y", "Slides ↔"], ["x", "Slides ↕"]];
const HOLDS_IN_SPACE: [Hold, string][] = [["all", "Fixed"], ["x", "Held in x"], ["y", "Held in y"], ["z", "Held in z"]];

interface Kept { key: string; text: string | null; selection: [number, number] | null }

export class Panels {
  readonly element = h("aside", { class: "panel", "aria-label": "Task" });
  private readonly open = new Set<string>();
  private readonly local: Record<string, string> = {};
  private readonly searchBox: SearchBox;
  private readonly domain: DomainPanel;
  private readonly items = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": "Specification" });
  private pressed = false;
  private stale = false;
  private shownTool = "";
  private revealed = "";
  private timer = 0;

  constructor(private readonly editor: TaskEditor) {
    this.searchBox = new SearchBox(editor, () => this.show());
    this.domain = new DomainPanel(editor, (work) => void this.attempt("domain", work), () => this.show());
    this.element.addEventListener("pointerdown", () => this.press());
  }

  /** What a task may start from. */
  get start(): HTMLElement { return this.domain.start; }

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

  /** Scroll to the section of a tool when it is shown, if it is not visible. */
  reveal(tool: string): void { this.revealed = tool === "zones" ? "domain" : tool; this.show(); }

  /** Update after the present event: a field that is left must not be replaced before the next one has the focus. */
  show(): void {
    if (!this.timer) this.timer = window.setTimeout(() => { this.timer = 0; this.update(); });
  }

  private update(): void {
    this.stale = this.pressed;
    if (this.pressed) return;
    const { editor } = this;
    if (this.shownTool !== editor.tool) {
      // The section of a tool opens with it.
      this.shownTool = editor.tool;
      for (const key of ["supports", "inputs", "outputs", "loads"]) this.open.delete(key);
      this.open.add(editor.tool === "zones" ? "domain" : editor.tool);
    }
    const kept = this.kept();
    const place = kept && this.placeOf(kept.key);
    const unfolded = [...this.element.querySelectorAll("details[open] > summary[data-key]")].map((summary) => (summary as HTMLElement).dataset.key!);
    clear(this.element,
      this.section("domain", "Part, domain, files", this.domain.summary(), () => this.domain.make()),
      this.section("supports", "Supports", this.nodeSummary("supports"), () => this.supports()),
      editor.task.table.cases.length > 1 && this.cases(),
      ...(["inputs", "outputs", "loads"] as const).map((kind) =>
        this.section(kind, { inputs: "Inputs", outputs: "Outputs", loads: "Loads" }[kind], this.nodeSummary(kind), () => casePanel(editor, kind))),
      this.section("limits", "Limits and tolerance", this.limitsSummary(), () => limitsPanel(editor)),
      h("section", { class: "step open specification" }, this.items),
      editor.tool === "hand" && this.hand(),
      this.searchBox.make(), this.searchBox.makeButton());
    this.showItems();
    this.markFault();
    // What was unfolded stays so.
    for (const key of unfolded) this.element.querySelector(`summary[data-key="${CSS.escape(key)}"]`)?.parentElement!.setAttribute("open", "");
    this.restore(kept);
    if (this.revealed) {
      const head = this.element.querySelector(`[data-key="head-${this.revealed}"]`);
      const top = head?.getBoundingClientRect().top ?? 0;
      if (head && (top < 0 || top > innerHeight - 80)) head.scrollIntoView({ block: "nearest", behavior: "instant" });
      this.revealed = "";
      return;
    }
    // The focused element stays where it is on the screen, whatever is shown above it.
    const now = kept && this.placeOf(kept.key);
    if (place != null && now != null && Math.abs(now - place) > 1) scrollBy({ top: now - place, behavior: "instant" });
  }

  /** Distance of an element from the upper edge of the window. */
  private placeOf(key: string): number | null {
    return this.element.querySelector(`[data-key="${CSS.escape(key)}"]`)?.getBoundingClientRect().top ?? null;
  }

  /** The focused field, with a text that is not taken over yet, and its selection. */
  private kept(): Kept | null {
    const focused = document.activeElement;
    if (!(focused instanceof HTMLElement) || !this.element.contains(focused) || !focused.dataset.key) return null;
    if (!(focused instanceof HTMLInputElement) || focused.type !== "text") return { key: focused.dataset.key, text: null, selection: null };
    const { selectionStart, selectionEnd, value, defaultValue } = focused;
    return { key: focused.dataset.key, text: value === defaultValue ? null : value, selection: [selectionStart ?? value.length, selectionEnd ?? value.length] };
  }

  private restore(kept: Kept | null): void {
    if (!kept) return;
    const found = this.element.querySelector<HTMLElement>(`[data-key="${CSS.escape(kept.key)}"]`);
    found?.focus({ preventScroll: true });
    if (!(found instanceof HTMLInputElement) || !kept.selection) return;
    if (kept.text !== null) {
      found.value = kept.text;
      // A text that was typed before this element existed is taken over when it is left.
      let isTaken = false;
      found.addEventListener("change", () => { isTaken = true; });
      found.addEventListener("blur", () => { if (!isTaken && found.value !== found.defaultValue) found.dispatchEvent(new Event("change")); }, { once: true });
    }
    found.setSelectionRange(...kept.selection);
  }

  /** The items of the specification, with what the design drawn by hand reaches. */
  showItems(): void {
    const { editor } = this;
    const items = editor.built?.items ?? [];
    const conditions = editor.built?.conditions ?? [];
    const asked = conditions.length > 0 && h("ul", { class: "plain conditions", "aria-label": "Inputs and loads" },
      ...conditions.map(({ case: name, texts }) => h("li", {}, conditions.length > 1 && h("b", {}, `${name}: `), sentence(texts.join("; ")))));
    const reached = editor.tool === "hand" ? editor.reached : null;
    if (!items.length) {
      clear(this.items, h("h2", { class: "plain" }, "Specification"), asked, h("p", { class: "note" }, editor.fault ? "It is listed here when the task is without errors." : editor.missing ? "It is listed here when supports, an input and an output are known." : "Nothing but the motion is asked for."));
      return;
    }
    const wanted = items.map((item) => ({ ...item, reached: "", margin: null, met: false }));
    clear(this.items, h("h2", { class: "plain" }, "Specification"), asked,
      reached && h("p", { class: `verdict ${reached.every(({ met }) => met) ? "met" : "missed"}` }, `${verdictOf(reached)} by this design.`),
      itemTable(reached ? [{ title: "by hand", items: reached }] : [], wanted),
      !items.some(({ name }) => name.endsWith("strain")) && h("p", { class: "note" }, editor.task.table.limits?.strain === false ? "The strain is not limited." : "The strain is not limited, since no limit of the material is known: enter one under Limits and tolerance."),
      this.tiltWarning(),
      !items.some(({ name }) => name.endsWith("stable_stroke")) && h("p", { class: "note" }, "The part must be stable up to the full stroke."));
  }

  /** A warning where the direction of the input may deviate by more than bounds on the off-axis motion allow. */
  private tiltWarning(): HTMLElement | null {
    const { tolerances, items = [] } = this.editor.built?.problem?.specification ?? {};
    const sideways = Math.sin((Math.PI / 180) * (tolerances?.angle ?? 0));
    const bounds = items.filter(({ quantity }) => quantity === "off_axis").map(({ at_most: most }) => most ?? Infinity);
    const least = Math.min(Infinity, ...bounds);
    return !tolerances || least >= sideways ? null : h("p", { class: "note bad" }, `An input that is ${tolerances.angle}° off its direction moves what it pushes sideways by ${percent(sideways)} % of the stroke. Where the output moves with it, many prints miss an off-axis motion of at most ${percent(least)} %, whatever the design: enter a smaller deviation of the direction under Limits and tolerance, or a wider bound under Outputs.`);
  }

  private section(key: string, title: string, summary: string, make: () => HTMLElement): HTMLElement {
    const { editor } = this;
    const isOpen = this.open.has(key);
    const fault = this.faultOf(key);
    const isTool = key === "supports" || key === "inputs" || key === "outputs" || key === "loads";
    const press = (): void => {
      if (isTool && !isOpen) { editor.choose(key); return; }
      if (isOpen) this.open.delete(key); else this.open.add(key);
      this.show();
    };
    return h("section", { class: `step ${key}${isOpen ? " open" : ""}${fault ? " faulty" : ""}` },
      h("h2", {}, h("button", { type: "button", "aria-expanded": String(isOpen), onclick: press, "data-key": `head-${key}` },
        h("span", { class: "name" }, title), h("span", { class: "summary" }, summary))),
      isOpen && make(),
      fault && h("p", { class: "fault", role: "alert" }, fault));
  }

  private faultOf(key: string): string {
    const { fault, missing } = this.editor;
    if (this.local[key]) return this.local[key]!;
    const owner = (text: string): string => OWNERS.find(([pattern]) => pattern.test(text))?.[1] ?? "domain";
    if (fault) return owner(fault.key || fault.message) === key ? fault.text : "";
    return missing && owner(missing) === key ? NEEDED[key] ?? "" : "";
  }

  /** Mark the fields that an error is about. */
  private markFault(): void {
    for (const key of this.faultyFields()) this.element.querySelector(`[data-key="${CSS.escape(key)}"]`)?.setAttribute("aria-invalid", "true");
  }

  /** Keys of the fields that an error is about; none if it is not about a value, or that of another load case. */
  private faultyFields(): string[] {
    const key = this.editor.fault?.key ?? "";
    if (key.startsWith("domain.size")) return ["domain-width", "domain-depth", "domain-height"];
    const [, owner, own] = /^(part|limits|tolerance)\.(\w+)/.exec(key) ?? [];
    if (owner) return [`${owner === "limits" ? "limit" : owner}-${own}`];
    const [, loadCase, kind, index, name, number] = /^cases\[(\d+)\]\.(inputs|outputs|loads)\[(\d+)\]\.(\w+)(?:\[(\d+)\])?/.exec(key) ?? [];
    if (Number(loadCase) !== this.editor.loadCase) return [];
    const field = name === "direction" ? "angle" : kind === "outputs" ? (name === "spring" ? name : `${name}-${number ?? 0}`) : "amount";
    return name === "at" || name === "during" ? [] : [`${kind}-${index}-${field}`];
  }

  private async attempt(key: string, work: () => Promise<void>): Promise<void> {
    this.local[key] = "";
    try {
      await work();
    } catch (error) {
      this.local[key] = sentence((error as Error).message);
    }
    this.show();
  }

  private nodeSummary(kind: Kind): string {
    const { built, loadCase } = this.editor;
    if (!built) return "";
    const { given } = built.regions;
    let nodes = new Set(nodesOf(built, loadCase, kind).flat()).size;
    if (!nodes && kind !== "loads") nodes = { supports: given.supports, inputs: given.input, outputs: given.output }[kind].length;
    const weight = kind === "loads" && this.editor.task.table.cases[loadCase]?.gravity !== undefined && "own weight";
    return [nodes && count(nodes, "node"), weight].filter(Boolean).join(", ") || "none";
  }

  private cases(): HTMLElement {
    const { editor } = this;
    const names = editor.task.table.cases.map((each, k): [string, string] => [String(k), each.name ?? `case ${k + 1}`]);
    return h("section", { class: "step open cases" }, h("h2", { class: "plain" }, "Load case"),
      choice("Load case", names, String(editor.loadCase), (picked) => editor.showCase(Number(picked))));
  }

  private supports(): HTMLElement {
    const { editor } = this;
    const rows = h("input", { type: "checkbox", "data-key": "rows", checked: this.local["rows"] === "yes" });
    rows.addEventListener("change", () => { this.local["rows"] = rows.checked ? "yes" : ""; editor.setRows(rows.checked); });
    const clearAll = (): void => editor.change({ ...editor.task.table, supports: [] });
    return h("div", { class: "content" },
      choice("Kind of support", isSpatial(editor.task.table) ? HOLDS_IN_SPACE : HOLDS, editor.hold, (picked) => {
        editor.hold = picked;
        editor.aimAt({ kind: "supports", index: editor.supportIndex() });
      }),
      h("div", { class: "row between" }, h("label", { class: "tick" }, rows, isSpatial(editor.task.table) ? "Whole layers" : "Whole rows"),
        button("Clear", clearAll, "quiet", { disabled: !editor.task.table.supports?.length, "data-key": "clear-supports" })),
      !isSpatial(editor.task.table) && h("p", { class: "note" }, "A plate with screw holes can be added to the supports under Download of the result. At an edge it lies outside the domain and makes the part larger."));
  }

  private limitsSummary(): string {
    const { limits, tolerance } = this.editor.task.table;
    const { strain, clearance } = limits ?? {};
    const parts = [strain !== undefined && typeof strain !== "boolean" && `strain ${ratio(strain)}`, clearance !== undefined && typeof clearance !== "boolean" && "clearance", limits?.symmetry && (/fold/.test(limits.symmetry) ? `${limits.symmetry} symmetry` : `symmetric in ${limits.symmetry}`), limits?.mass !== undefined && "mass", limits?.strut_loss !== undefined && "strut loss", tolerance && "tolerance"];
    return parts.filter(Boolean).join(", ") || "strain and clearance";
  }

  private hand(): HTMLElement {
    const { editor } = this;
    return h("section", { class: "step open hand" }, h("h2", { class: "plain" }, "Design by hand"),
      h("div", { class: "content" },
        h("p", { class: "note" }, "The result of a search is compared with this design."),
        h("div", { class: "buttons" },
          button("Save this design", () => void this.attempt("hand", () => editor.saveHandDesign(editor.task.table.name)), "", { "data-key": "save" }),
          button("Refine this design", () => void this.attempt("hand", () => editor.refineHandDesign()), "", { "data-key": "refine", disabled: !editor.built?.items.length }),
          button("Restore all struts", () => editor.restoreBeams(), "", { "data-key": "all" })),
        this.local["hand"] && h("p", { class: "fault", role: "alert" }, this.local["hand"])));
  }
}
