// Parts that are placed, turned and linked, and built as one design.

import { bitsOf, get, post, type Point, type Problem, type Refusal, type Shelf, type Small } from "./api";
import { arrow, Drawing, isEach, where } from "./drawing";
import { button, choice, clear, field, figure, h, iconButton, number, s, say, select } from "./dom";
import { emptyPlan, isPlan, MOST, portsOf, readPlan, spoken, withoutPart, withPart, writePlan, type Plan, type PlanEnd, type PlanPart, type Port, type WrittenPlan } from "./plan";
import { shelfView, thumbnail } from "./shelves";
import { History } from "./task";
import { sentence, undoing } from "./words";

interface Built { problem: Problem; mask: string; efficiency: number | null; status: string; message: string; provenance: Record<string, unknown>; parts: Record<string, number[]> }

const KEY = "bellcrank-machine";
const NEAR = 2.1;
/** Designs of a shelf before one asks for all. */
const SHOWN = 12;
/** In the order of their use; what is on other shelves fits no machine. */
const SHELVES = ["machines", "library", "struts", "kept", "runs"];

export class MachinePage {
  readonly element = h("div", { class: "page machine" });
  private readonly drawing = new Drawing("The machine");
  private readonly panel = h("aside", { class: "panel", "aria-label": "Parts" });
  private readonly shelf = h("div", { class: "shelves" }, h("p", { class: "note" }, "Fetching the designs …"));
  private readonly fault = h("p", { class: "complaint", role: "alert" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private readonly blank = h("div", { class: "blank" },
    h("h2", {}, "Nothing here yet"),
    h("p", {}, "Open one of the machines below to see how it is done, or add actuators one by one: the first is pushed, and each moves the next."));
  private readonly undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => this.step("undo"));
  private readonly redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("redo"));
  private readonly history: History<Plan>;
  private readonly keys = undoing((way) => this.step(way));
  private built: Built | null = null;
  private smalls = new Map<string, Small>();
  private asked = 0;

  constructor(given: WrittenPlan | null) {
    this.history = new History(given ? readPlan(given) : keptPlan());
    this.element.append(
      h("div", { class: "intro" }, h("h1", {}, "A machine of several parts"),
        h("p", {}, given?.about ? sentence(`${given.name}: ${given.about}`) : "Pick designs, say what pushes what, and build them as one piece.")),
      h("div", { class: "main" },
        h("section", { class: "stage", "aria-label": "Machine" },
          h("div", { class: "bar" }, button("New machine", () => this.set(emptyPlan()), "quiet"), h("span", { class: "spring" }), this.undoButton, this.redoButton),
          h("div", { class: "paper" }, this.readout, this.drawing.svg, this.blank), h("div", { class: "below" }, this.fault)),
        h("section", { class: "card", "aria-label": "Designs to add" }, this.shelf)),
      this.panel);
    document.addEventListener("keydown", this.keys);
    void this.changed();
    void this.load();
  }

  private get plan(): Plan { return this.history.value; }

  close(): void {
    this.asked = -1;
    document.removeEventListener("keydown", this.keys);
  }

  private async load(): Promise<void> {
    let shelves: Shelf[];
    try {
      shelves = await get<Shelf[]>("/gallery");
    } catch (error) {
      clear(this.shelf, h("p", { class: "fault", role: "alert" }, sentence((error as Refusal).message)));
      return;
    }
    for (const small of shelves.flatMap(({ entries }) => entries)) this.smalls.set(`${small.source}/${small.key}`, small);
    const wanted = SHELVES.map((source) => shelves.find((shelf) => shelf.source === source)).filter((shelf) => shelf?.entries.length) as Shelf[];
    clear(this.shelf, ...wanted.map((shelf) => shelf.source === "machines"
      ? shelfView({ ...shelf, title: "Start from a machine" }, (small) => this.tile(small, () => void this.start(small.key)))
      : shelfView({ ...shelf, title: `Add: ${shelf.title.toLowerCase()}` }, (small) => this.tile(small, () => this.add(small)), SHOWN)));
    this.show();
  }

  private tile(small: Small, press: () => void): HTMLElement {
    return h("button", { type: "button", class: "tile", "data-entry": `${small.source}/${small.key}`, onclick: press },
      thumbnail(small), h("span", { class: "title" }, small.title), h("span", { class: "note" }, small.note));
  }

  private async start(key: string): Promise<void> {
    try {
      this.set(readPlan(await get<WrittenPlan>(`/machines/${key}`)));
      this.element.scrollIntoView({ block: "start" });
    } catch (error) {
      this.fault.textContent = sentence((error as Refusal).message);
    }
  }

  private add(small: Small): void {
    if (this.plan.parts.length >= MOST) { this.fault.textContent = `A machine has at most ${MOST} parts here.`; return; }
    this.set(withPart(this.plan, `${small.source}/${small.key}`));
    say(`${small.title} added`);
  }

  private set(plan: Plan): void {
    this.history.set(plan);
    void this.changed();
  }

  private step(way: "undo" | "redo"): void {
    this.history[way]();
    say(way === "undo" ? "undone" : "done again");
    void this.changed();
  }

  /** Change one part; the others stay as they are. */
  private change(name: string, changes: Partial<PlanPart>): void {
    this.set({ ...this.plan, parts: this.plan.parts.map((part) => (part.name === name ? { ...part, ...changes } : part)) });
  }

  private async changed(): Promise<void> {
    const asked = ++this.asked;
    try { localStorage.setItem(KEY, JSON.stringify(this.plan)); } catch { /* storage is full: nothing is kept */ }
    this.fault.textContent = "";
    if (!this.plan.parts.length) this.built = null;
    this.drawing.svg.classList.toggle("stale", this.built !== null);
    this.show();
    this.draw();
    if (!this.plan.parts.length) return;
    try {
      const built = await post<Built>("/machines", { plan: writePlan(this.plan) });
      if (asked !== this.asked) return;
      this.built = built;
      this.fault.textContent = built.efficiency === null ? sentence(built.message) : "";
      this.drawing.svg.classList.remove("stale");
    } catch (error) {
      if (asked !== this.asked) return;
      this.built = null;
      this.fault.textContent = sentence((error as Refusal).message);
    }
    this.draw();
    this.show();
  }

  private draw(): void {
    const { built, drawing } = this;
    this.blank.hidden = this.plan.parts.length > 0;
    if (!built) {
      clear(this.readout);
      drawing.svg.classList.toggle("stale", this.plan.parts.length > 0);
      if (!this.plan.parts.length) {
        drawing.draw([]);
        for (const name of ["support", "input", "output"]) drawing.mark(name, []);
        drawing.overlay.replaceChildren();
      }
      return;
    }
    const { problem } = built;
    drawing.setLattice(problem.positions, problem.beams, 2.6);
    const bits = bitsOf(built.mask, problem.beams.length);
    const owned = new Set<number>();
    const groups = Object.values(built.parts).map((beams, k) => {
      const present = beams.filter((beam) => bits[beam] && !owned.has(beam));
      present.forEach((beam) => owned.add(beam));
      return { name: `part-${k % 4}`, beams: present };
    });
    const painted = [0, 1, 2, 3].map((k) => ({ name: `part-${k}`, beams: groups.filter(({ name }) => name === `part-${k}`).flatMap(({ beams }) => beams) }));
    drawing.draw([...painted, { name: "bridge", beams: where(bits).filter((beam) => !owned.has(beam)) }]);
    drawing.markRegions(problem);
    drawing.overlay.replaceChildren(...(["input", "output"] as const).flatMap((region) => arrows(problem, region)));
    const against = built.efficiency !== null && built.efficiency < 0;
    clear(this.readout, h("strong", {}, figure(built.efficiency, 3)),
      h("span", { class: against ? "alarm" : "" }, against ? "It moves against its arrow: what drives it should be made to push a load." : "output motion over input motion"),
      h("span", {}, `${problem.positions.length} nodes, ${where(bits).length} beams`));
  }

  private show(): void {
    const focused = (document.activeElement as HTMLElement | null)?.dataset["key"];
    const { parts } = this.plan;
    this.undoButton.disabled = !this.history.canUndo;
    this.redoButton.disabled = !this.history.canRedo;
    clear(this.panel,
      parts.length > 0 && this.machineBox(),
      ...parts.map((part, k) => this.partBox(part, k)),
      !parts.length && h("section", { class: "step open" }, h("h2", { class: "plain" }, "Parts"),
        h("div", { class: "content" }, h("p", {}, "None yet. Any elementary actuator can push any other: their ends have the same shape."),
          h("p", { class: "note" }, "To make one of your own, draw from one of the tasks “elementary-…” and search it."))));
    if (focused) this.panel.querySelector<HTMLElement>(`[data-key="${focused}"]`)?.focus({ preventScroll: true });
  }

  private partBox(part: PlanPart, k: number): HTMLElement {
    const key = (what: string): Record<string, string> => ({ "data-key": `${part.name}-${what}` });
    const others = portsOf(this.plan).filter((port) => !port.startsWith(`${part.name}.`));
    const joins: [string, string][] = [...(k === 0 && !part.join ? [] : others.map((port): [string, string] => [port, `on ${spoken(port)}`])), ["", k === 0 ? "here" : "at a place"]];
    const turns: [string, string][] = [0, 60, 120, 180, 240, 300].map((angle) => [String(angle), `${angle}°`]);
    const tick = (what: "mirror" | "supports", text: string): HTMLElement => h("label", { class: "tick" },
      h("input", { type: "checkbox", checked: part[what], ...key(what), onchange: () => this.change(part.name, { [what]: !part[what] }) }), text);
    const place = (axis: 0 | 1, label: string): HTMLElement => field(label, keyed(number(part.at[axis], { step: "any" }, (value) =>
      this.change(part.name, { at: axis ? [part.at[0], value] : [value, part.at[1]] })), key(`at-${axis}`)));
    return h("section", { class: "step open" },
      h("h2", { class: "plain" }, h("span", { class: `swatch part-${k % 4}` }),
        h("span", {}, `${part.name}: ${this.smalls.get(part.entry)?.title ?? part.entry.split("/")[1]}`),
        button("Remove", () => this.set(withoutPart(this.plan, part.name)), "quiet small", { "aria-label": `Remove ${part.name}` })),
      h("div", { class: "content" },
        h("div", { class: "row" },
          field("Goes", keyed(select(joins, part.join, (join) => this.change(part.name, { join })), key("join"))),
          field("Turned", keyed(select(turns, String(part.rotate), (angle) => this.change(part.name, { rotate: Number(angle) })), key("rotate")))),
        part.join !== "" && choice<Port>("With its", [["input", "With its input"], ["output", "With its output"]], part.by, (by) => this.change(part.name, { by })),
        k > 0 && part.join === "" && h("div", { class: "row" }, place(0, "x of its input"), place(1, "y of its input")),
        h("div", { class: "row" }, tick("mirror", "Mirrored"), tick("supports", "Held"))));
  }

  private machineBox(): HTMLElement {
    const { plan } = this;
    const ports = portsOf(plan);
    const options = ports.map((port): [string, string] => [port, spoken(port)]);
    const name = h("input", { type: "text", value: plan.name, maxlength: 100, "data-key": "name" });
    name.addEventListener("change", () => this.set({ ...plan, name: name.value.trim() || "my machine" }));
    const relink = (k: number, changes: Partial<Plan["links"][number]>): void =>
      this.set({ ...plan, links: plan.links.map((link, n) => (n === k ? { ...link, ...changes } : link)) });
    const linkRows = plan.links.map((link, k) => h("div", { class: "row three" },
      field("Link", select(options, link.from, (from) => relink(k, { from }))),
      field("with", select(options, link.to, (to) => relink(k, { to }))),
      field("by", select([["weld", "weld"], ["bridge", "bridge"]], link.kind, (kind) => relink(k, { kind }))),
      button("Remove the link", () => this.set({ ...plan, links: plan.links.filter((_, n) => n !== k) }), "quiet small")));
    return h("section", { class: "step open" }, h("h2", { class: "plain" }, "Together"),
      h("div", { class: "content" },
        field("Name", name),
        h("div", { class: "row" }, this.endBox("Pushed at", "input"), this.endBox("Moves at", "output")),
        ...linkRows,
        ports.length > 2 && button("Add a link", () => this.set({ ...plan, links: [...plan.links, { from: ports[1]!, to: ports[2]!, kind: "bridge" }] })),
        h("button", { type: "button", class: "primary", disabled: !this.built, "data-key": "build", onclick: () => void this.build() }, "Build it"),
        !this.built && this.fault.textContent && h("p", { class: "fault" }, this.fault.textContent)));
  }

  /** Where the machine is pushed, or moves: one port as a rule, several of a machine that has them. */
  private endBox(label: string, end: "input" | "output"): HTMLElement {
    const { plan } = this;
    const { ports } = plan[end];
    const several = ports.length > 1;
    const options: [string, string][] = portsOf(plan).map((port) => [port, spoken(port)]);
    if (several) options.unshift(["", `${ports.length} ports`]);
    const pick = (port: string): void => { if (port) this.set({ ...plan, [end]: { ports: [port] } satisfies PlanEnd }); };
    return field(label, keyed(select(options, several ? "" : (ports[0] ?? ""), pick), { "data-key": end }),
      "", several ? ports.map(spoken).join(", ") : "");
  }

  private async build(): Promise<void> {
    if (!this.built) return;
    try {
      const { problem, mask, provenance } = this.built;
      const kept = await post<{ source: string; key: string }>("/gallery", { problem, mask, provenance, title: this.plan.name });
      location.hash = `#/design/${kept.source}/${kept.key}`;
    } catch (error) {
      this.fault.textContent = sentence((error as Refusal).message);
    }
  }
}

function keyed<E extends HTMLElement>(element: E, key: Record<string, string>): E {
  for (const [name, value] of Object.entries(key)) element.setAttribute(name, value);
  return element;
}

function keptPlan(): Plan {
  try {
    const kept = JSON.parse(localStorage.getItem(KEY) ?? "null") as unknown;
    if (isPlan(kept)) return kept;
  } catch { /* what was kept is no plan */ }
  return emptyPlan();
}

/** Which way the machine is pushed, or moves: an arrow for each port. */
function arrows(problem: Problem, region: "input" | "output"): SVGElement[] {
  const { nodes, direction } = problem[region];
  const place = (node: number): Point => problem.positions[node]!;
  const ports: { nodes: number[]; way: Point }[] = [];
  nodes.forEach((node, k) => {
    const [x, y] = place(node);
    // Nodes of a port are neighbours; ports are further apart.
    const port = ports.find((each) => each.nodes.some((other) => Math.hypot(place(other)[0] - x, place(other)[1] - y) < NEAR));
    if (port) port.nodes.push(node);
    else ports.push({ nodes: [node], way: isEach(direction) ? direction[k]! : direction });
  });
  return ports.map(({ nodes: group, way: [dx, dy] }) => {
    const x = group.reduce((sum, node) => sum + place(node)[0] / group.length, 0);
    const y = group.reduce((sum, node) => sum + place(node)[1] / group.length, 0);
    return s("g", { class: `arrow ${region}` }, s("path", { class: "shaft", d: arrow([x, y], [2.4 * dx, 2.4 * dy], 0.5) }));
  });
}
