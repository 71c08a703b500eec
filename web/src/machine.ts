// The page on which parts are placed, rotated and linked, and assembled to one design.

import { bitsOf, get, modelOf, post, type PartReport, type Point, type Problem, type ServerError, type Collection, type GalleryEntry } from "./api";
import { arrow, Drawing, isEach, markRegions, where } from "./drawing";
import { announce, button, choice, clear, field, figure, h, iconButton, number, s, select } from "./dom";
import { emptyPlan, isPlan, MOST, portLabel, portsOf, readPlan, withoutPart, withPart, writePlan, type Plan, type PlanEnd, type PlanPart, type Port, type WrittenPlan } from "./plan";
import { collectionView, thumbnail } from "./collections";
import { partOf } from "./result";
import { figureColumns, figureTable } from "./specification";
import { History } from "./task";
import { sentence, undoKeys } from "./text";

interface Built { problem: Problem; mask: string; efficiency: number | null; status: string; message: string; provenance: Record<string, unknown>; parts: Record<string, number[]> }

const KEY = "bellcrank-machine";
const NEAR = 2.1;
/** Number of designs of a collection shown at first. */
const SHOWN = 12;
/** Collections whose designs have ports, in the order of display. */
const COLLECTIONS = ["machines", "library", "struts", "kept", "runs"];

export class MachinePage {
  readonly element = h("div", { class: "page machine" });
  private readonly drawing = new Drawing("The machine");
  private readonly panel = h("aside", { class: "panel", "aria-label": "Parts" });
  private readonly collection = h("div", { class: "collections" }, h("p", { class: "note" }, "Loading designs …"));
  private readonly fault = h("p", { class: "error", role: "alert" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private readonly blank = h("div", { class: "blank" },
    h("h2", {}, "No parts"),
    h("p", {}, "Open one of the bundled machines below as an example, or add actuators one by one. The first one receives the input, and each drives the next."));
  private readonly undoButton = iconButton("undo", "Undo (Ctrl+Z)", () => this.step("undo"));
  private readonly redoButton = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("redo"));
  private readonly history: History<Plan>;
  private readonly keys = undoKeys((action) => this.step(action));
  private built: Built | null = null;
  /** Figures of the machine as a part; a text says why there are none. */
  private report: PartReport | string | null = null;
  private known = new Map<string, GalleryEntry>();
  private requested = 0;

  constructor(given: WrittenPlan | null) {
    this.history = new History(given ? readPlan(given) : storedPlan());
    this.element.append(
      h("div", { class: "intro" }, h("h1", {}, "Assemble a machine"),
        h("p", {}, given?.about ? sentence(`${given.name}: ${given.about}`) : "Add designs, connect their ports, and assemble them to one piece.")),
      h("div", { class: "main" },
        h("section", { class: "stage", "aria-label": "Machine" },
          h("div", { class: "bar" }, button("New machine", () => this.set(emptyPlan()), "quiet"), h("span", { class: "spring" }), this.undoButton, this.redoButton),
          h("div", { class: "paper" }, this.readout, this.drawing.svg, this.blank), h("div", { class: "below" }, this.fault)),
        h("section", { class: "card", "aria-label": "Designs to add" }, this.collection)),
      this.panel);
    document.addEventListener("keydown", this.keys);
    void this.changed();
    void this.load();
  }

  private get plan(): Plan { return this.history.value; }

  close(): void {
    this.requested = -1;
    document.removeEventListener("keydown", this.keys);
  }

  private async load(): Promise<void> {
    let collections: Collection[];
    try {
      collections = await get<Collection[]>("/gallery");
    } catch (error) {
      clear(this.collection, h("p", { class: "fault", role: "alert" }, sentence((error as ServerError).message)));
      return;
    }
    for (const entry of collections.flatMap(({ entries }) => entries)) this.known.set(`${entry.source}/${entry.key}`, entry);
    const wanted = COLLECTIONS.map((source) => collections.find((collection) => collection.source === source)).filter((collection) => collection?.entries.length) as Collection[];
    clear(this.collection, ...wanted.map((collection) => collection.source === "machines"
      ? collectionView({ ...collection, title: "Bundled machines" }, (entry) => this.tile(entry, () => void this.start(entry.key)))
      : collectionView({ ...collection, title: `Add: ${collection.title.toLowerCase()}` }, (entry) => this.tile(entry, () => this.add(entry)), SHOWN)));
    this.show();
  }

  private tile(entry: GalleryEntry, press: () => void): HTMLElement {
    return h("button", { type: "button", class: "tile", "data-entry": `${entry.source}/${entry.key}`, onclick: press },
      thumbnail(entry), h("span", { class: "title" }, entry.title), h("span", { class: "note" }, entry.note));
  }

  private async start(key: string): Promise<void> {
    try {
      this.set(readPlan(await get<WrittenPlan>(`/machines/${key}`)));
      this.element.scrollIntoView({ block: "start" });
    } catch (error) {
      this.fault.textContent = sentence((error as ServerError).message);
    }
  }

  private add(entry: GalleryEntry): void {
    if (this.plan.parts.length >= MOST) { this.fault.textContent = `A machine has at most ${MOST} parts on this page.`; return; }
    this.set(withPart(this.plan, `${entry.source}/${entry.key}`));
    announce(`${entry.title} added`);
  }

  private set(plan: Plan): void {
    this.history.set(plan);
    void this.changed();
  }

  private step(action: "undo" | "redo"): void {
    this.history[action]();
    announce(action === "undo" ? "undone" : "redone");
    void this.changed();
  }

  /** Change one part. */
  private change(name: string, changes: Partial<PlanPart>): void {
    this.set({ ...this.plan, parts: this.plan.parts.map((part) => (part.name === name ? { ...part, ...changes } : part)) });
  }

  private async changed(): Promise<void> {
    const requested = ++this.requested;
    try { localStorage.setItem(KEY, JSON.stringify(this.plan)); } catch { /* the storage is full: not stored */ }
    this.fault.textContent = "";
    if (!this.plan.parts.length) this.built = null;
    this.drawing.svg.classList.toggle("stale", this.built !== null);
    this.show();
    this.draw();
    if (!this.plan.parts.length) return;
    try {
      const built = await post<Built>("/machines", { plan: writePlan(this.plan) });
      if (requested !== this.requested) return;
      this.built = built;
      this.report = null;
      void this.compute(built, requested);
      this.fault.textContent = built.efficiency === null ? sentence(built.message) : "";
      this.drawing.svg.classList.remove("stale");
    } catch (error) {
      if (requested !== this.requested) return;
      this.built = null;
      this.fault.textContent = sentence((error as ServerError).message);
    }
    this.draw();
    this.show();
  }

  /** Compute the figures of the machine as a part. */
  private async compute({ problem, mask, provenance }: Built, requested: number): Promise<void> {
    let found: PartReport | string;
    try {
      found = await post<PartReport>("/report", { problem, mask, part: partOf({ part: null, provenance }) });
    } catch (error) {
      found = sentence((error as ServerError).message);
    }
    if (requested !== this.requested) return;
    this.report = found;
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
    markRegions(drawing, problem);
    drawing.overlay.replaceChildren(...(["input", "output"] as const).flatMap((region) => arrows(problem, region)));
    const part = typeof this.report === "string" ? null : this.report;
    const value = part?.figures[0]?.efficiency ?? null;
    const reversed = (value ?? built.efficiency ?? 0) < 0;
    const model = part ? "frames, 8 elements in each strut: output / input motion" : typeof this.report === "string" ? this.report : "computing the part …";
    clear(this.readout, h("strong", {}, figure(value, 2)),
      h("span", { class: reversed ? "alarm" : "" }, reversed ? "The output moves against its direction: drive it by an actuator with a larger payload." : model),
      h("span", {}, `${modelOf(problem)}: ${figure(built.efficiency, 2)}`),
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
        h("div", { class: "content" }, h("p", {}, "No parts. Elementary actuators have ports of the same shape, so that each can drive any other."),
          h("p", { class: "note" }, "To design an actuator of your own, start from one of the tasks “element-…”."))));
    if (focused) this.panel.querySelector<HTMLElement>(`[data-key="${focused}"]`)?.focus({ preventScroll: true });
  }

  private partBox(part: PlanPart, k: number): HTMLElement {
    const key = (what: string): Record<string, string> => ({ "data-key": `${part.name}-${what}` });
    const others = portsOf(this.plan).filter((port) => !port.startsWith(`${part.name}.`));
    const joins: [string, string][] = [...(k === 0 && !part.join ? [] : others.map((port): [string, string] => [port, portLabel(port)])), ["", k === 0 ? "origin" : "coordinates"]];
    const turns: [string, string][] = [0, 60, 120, 180, 240, 300].map((angle) => [String(angle), `${angle}°`]);
    const tick = (what: "mirror" | "supports", text: string): HTMLElement => h("label", { class: "tick" },
      h("input", { type: "checkbox", checked: part[what], ...key(what), onchange: () => this.change(part.name, { [what]: !part[what] }) }), text);
    const place = (axis: 0 | 1, label: string): HTMLElement => field(label, keyed(number(part.at[axis], { step: "any" }, (value) =>
      this.change(part.name, { at: axis ? [part.at[0], value] : [value, part.at[1]] })), key(`at-${axis}`)));
    return h("section", { class: "step open" },
      h("h2", { class: "plain" }, h("span", { class: `swatch part-${k % 4}` }),
        h("span", {}, `${part.name}: ${this.known.get(part.entry)?.title ?? part.entry.split("/")[1]}`),
        button("Remove", () => this.set(withoutPart(this.plan, part.name)), "quiet small", { "aria-label": `Remove ${part.name}` })),
      h("div", { class: "content" },
        h("div", { class: "row" },
          field("Attached to", keyed(select(joins, part.join, (join) => this.change(part.name, { join })), key("join"))),
          field("Rotation", keyed(select(turns, String(part.rotate), (angle) => this.change(part.name, { rotate: Number(angle) })), key("rotate")))),
        part.join !== "" && choice<Port>("Attached by", [["input", "By its input"], ["output", "By its output"]], part.by, (by) => this.change(part.name, { by })),
        k > 0 && part.join === "" && h("div", { class: "row" }, place(0, "x of input"), place(1, "y of input")),
        h("div", { class: "row" }, tick("mirror", "Mirrored"), tick("supports", "Supported"))));
  }

  private machineBox(): HTMLElement {
    const { plan } = this;
    const ports = portsOf(plan);
    const options = ports.map((port): [string, string] => [port, portLabel(port)]);
    const name = h("input", { type: "text", value: plan.name, maxlength: 100, "data-key": "name" });
    name.addEventListener("change", () => this.set({ ...plan, name: name.value.trim() || "my machine" }));
    const relink = (k: number, changes: Partial<Plan["links"][number]>): void =>
      this.set({ ...plan, links: plan.links.map((link, n) => (n === k ? { ...link, ...changes } : link)) });
    const linkRows = plan.links.map((link, k) => h("div", { class: "row three" },
      field("Link", select(options, link.from, (from) => relink(k, { from }))),
      field("to", select(options, link.to, (to) => relink(k, { to }))),
      field("type", select([["weld", "weld"], ["bridge", "bridge"]], link.kind, (kind) => relink(k, { kind }))),
      button("Remove link", () => this.set({ ...plan, links: plan.links.filter((_, n) => n !== k) }), "quiet small")));
    return h("section", { class: "step open" }, h("h2", { class: "plain" }, "Machine"),
      h("div", { class: "content" },
        field("Name", name),
        h("div", { class: "row" }, this.endBox("Input", "input"), this.endBox("Output", "output")),
        ...linkRows,
        ports.length > 2 && button("Add link", () => this.set({ ...plan, links: [...plan.links, { from: ports[1]!, to: ports[2]!, kind: "bridge" }] })),
        h("button", { type: "button", class: "primary", disabled: !this.built, "data-key": "build", onclick: () => void this.build() }, "Assemble"),
        this.report !== null && typeof this.report !== "string" && figureTable(figureColumns([["frames", this.report.figures]])),
        !this.built && this.fault.textContent && h("p", { class: "fault" }, this.fault.textContent)));
  }

  /** Select the input or output port of the machine; a bundled machine may have several. */
  private endBox(label: string, end: "input" | "output"): HTMLElement {
    const { plan } = this;
    const { ports } = plan[end];
    const several = ports.length > 1;
    const options: [string, string][] = portsOf(plan).map((port) => [port, portLabel(port)]);
    if (several) options.unshift(["", `${ports.length} ports`]);
    const pick = (port: string): void => { if (port) this.set({ ...plan, [end]: { ports: [port] } satisfies PlanEnd }); };
    return field(label, keyed(select(options, several ? "" : (ports[0] ?? ""), pick), { "data-key": end }),
      "", several ? ports.map(portLabel).join(", ") : "");
  }

  private async build(): Promise<void> {
    if (!this.built) return;
    try {
      const { problem, mask, provenance } = this.built;
      const saved = await post<{ source: string; key: string }>("/gallery", { problem, mask, provenance, title: this.plan.name });
      location.hash = `#/design/${saved.source}/${saved.key}`;
    } catch (error) {
      this.fault.textContent = sentence((error as ServerError).message);
    }
  }
}

function keyed<E extends HTMLElement>(element: E, key: Record<string, string>): E {
  for (const [name, value] of Object.entries(key)) element.setAttribute(name, value);
  return element;
}

function storedPlan(): Plan {
  try {
    const stored = JSON.parse(localStorage.getItem(KEY) ?? "null") as unknown;
    if (isPlan(stored)) return stored;
  } catch { /* the stored text is no plan: ignored */ }
  return emptyPlan();
}

/** Arrows of the input or output directions, one for each port. */
function arrows(problem: Problem, region: "input" | "output"): SVGElement[] {
  const { nodes, direction } = problem[region];
  const place = (node: number): Point => problem.positions[node]!;
  const ports: { nodes: number[]; along: Point }[] = [];
  nodes.forEach((node, k) => {
    const [x, y] = place(node);
    // Nodes of a port are neighbours; ports are further apart.
    const port = ports.find((each) => each.nodes.some((other) => Math.hypot(place(other)[0] - x, place(other)[1] - y) < NEAR));
    if (port) port.nodes.push(node);
    else ports.push({ nodes: [node], along: isEach(direction) ? direction[k]! : direction });
  });
  return ports.map(({ nodes: group, along: [dx, dy] }) => {
    const x = group.reduce((sum, node) => sum + place(node)[0] / group.length, 0);
    const y = group.reduce((sum, node) => sum + place(node)[1] / group.length, 0);
    return s("g", { class: `arrow ${region}` }, s("path", { class: "shaft", d: arrow([x, y], [2.4 * dx, 2.4 * dy], 0.5) }));
  });
}
