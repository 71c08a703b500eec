// Parts that are placed, turned and linked, and built as one design.

import { get, post, type Problem, type Refusal, type Shelf, type Small } from "./api";
import { bitsOf } from "./api";
import { arrow, Drawing, isEach, where } from "./drawing";
import { button, choice, clear, field, figure, h, number, s, select } from "./dom";
import { sentence } from "./editor";
import { thumbnail } from "./gallery";

interface Part { name: string; entry: string; small: Small; join: string; by: "input" | "output"; mirror: boolean; rotate: number; at: [number, number]; supports: boolean }
interface Built { problem: Problem; mask: string; efficiency: number | null; status: string; message: string; provenance: Record<string, unknown>; parts: Record<string, number[]> }

const NAMES = ["first", "second", "third", "fourth", "fifth", "sixth"];

export class MachinePage {
  readonly element = h("div", { class: "page machine" });
  private readonly drawing = new Drawing("The machine");
  private readonly panel = h("aside", { class: "panel", "aria-label": "Parts" });
  private readonly shelf = h("div", { class: "tiles small" });
  private readonly fault = h("p", { class: "complaint", role: "alert" });
  private readonly readout = h("div", { class: "readout", "aria-live": "polite" });
  private parts: Part[] = [];
  private links: { from: string; to: string; kind: "weld" | "bridge" }[] = [];
  private drives: string[] = [];
  private moves: string[] = [];
  private name = "my machine";
  private built: Built | null = null;
  private number = 0;

  constructor() {
    this.element.append(
      h("div", { class: "intro" }, h("h1", {}, "A machine of several parts"),
        h("p", {}, "Pick designs, say what pushes what, and build them as one piece.")),
      h("div", { class: "main" },
        h("section", { class: "stage", "aria-label": "Machine" }, h("div", { class: "paper" }, this.readout, this.drawing.svg), h("div", { class: "below" }, this.fault)),
        h("section", { class: "card", "aria-label": "Designs to add" }, h("h2", {}, "Add a part"), this.shelf)),
      this.panel);
    this.show();
    void this.load();
  }

  close(): void { this.number = -1; }

  private async load(): Promise<void> {
    const shelves = await get<Shelf[]>("/gallery");
    const all = shelves.flatMap((shelf) => shelf.entries);
    clear(this.shelf, ...all.map((small) => h("button", { type: "button", class: "tile", "data-entry": `${small.source}/${small.key}`, onclick: () => this.add(small) },
      thumbnail(small), h("span", { class: "title" }, small.title), h("span", { class: "note" }, small.note))));
    if (!all.length) clear(this.shelf, h("p", {}, "There is no design yet."));
  }

  private add(small: Small): void {
    if (this.parts.length >= NAMES.length) { this.fault.textContent = `A machine has at most ${NAMES.length} parts here.`; return; }
    const name = NAMES.find((each) => !this.parts.some((part) => part.name === each))!;
    const last = this.parts.at(-1);
    this.parts.push({ name, entry: `${small.source}/${small.key}`, small, join: last ? `${last.name}.output` : "", by: "input", mirror: false, rotate: 0, at: [0, 0], supports: true });
    if (this.parts.length === 1) this.drives = [`${name}.input`];
    this.moves = [`${name}.output`];
    void this.changed();
  }

  private removePart(name: string): void {
    this.parts = this.parts.filter((part) => part.name !== name);
    for (const part of this.parts) if (part.join.startsWith(`${name}.`)) part.join = "";
    const stays = (port: string): boolean => !port.startsWith(`${name}.`);
    this.links = this.links.filter((link) => stays(link.from) && stays(link.to));
    this.drives = this.drives.filter(stays);
    this.moves = this.moves.filter(stays);
    if (this.parts.length) {
      if (!this.drives.length) this.drives = [`${this.parts[0]!.name}.input`];
      if (!this.moves.length) this.moves = [`${this.parts.at(-1)!.name}.output`];
    }
    void this.changed();
  }

  private plan(): Record<string, unknown> {
    const parts = Object.fromEntries(this.parts.map((part, k) => [part.name, {
      entry: part.entry,
      ...(part.join ? { join: part.join, by: part.by } : k ? { at: part.at } : {}),
      ...(part.mirror ? { mirror: true } : {}), ...(part.rotate ? { rotate: part.rotate } : {}),
      ...(part.supports ? {} : { supports: false }),
    }]));
    return { name: this.name, parts, links: this.links, input: { ports: this.drives }, output: { ports: this.moves } };
  }

  private async changed(): Promise<void> {
    this.show();
    const asked = ++this.number;
    if (!this.parts.length) {
      this.built = null;
      this.fault.textContent = "";
      this.draw();
      return;
    }
    try {
      const built = await post<Built>("/machines", { plan: this.plan() });
      if (asked !== this.number) return;
      this.built = built;
      this.fault.textContent = built.efficiency === null ? sentence(built.message) : "";
    } catch (error) {
      if (asked !== this.number) return;
      this.built = null;
      this.fault.textContent = sentence((error as Refusal).message);
    }
    this.draw();
    this.show();
  }

  private draw(): void {
    const { built, drawing } = this;
    if (!built) {
      clear(this.readout);
      drawing.svg.classList.toggle("stale", this.parts.length > 0);
      if (!this.parts.length) { drawing.draw([]); for (const name of ["support", "input", "output"]) drawing.mark(name, []); drawing.overlay.replaceChildren(); }
      return;
    }
    drawing.svg.classList.remove("stale");
    const { problem } = built;
    drawing.setLattice(problem.positions, problem.beams, 2.6);
    const bits = bitsOf(built.mask, problem.beams.length);
    const owned = new Set<number>();
    const groups = Object.values(built.parts).map((beams, k) => {
      const present = beams.filter((beam) => bits[beam] && !owned.has(beam));
      present.forEach((beam) => owned.add(beam));
      return { name: `part-${k % 4}`, beams: present };
    });
    drawing.draw([...groups, { name: "bridge", beams: where(bits).filter((beam) => !owned.has(beam)) }]);
    drawing.markRegions(problem);
    drawing.overlay.replaceChildren(...(["input", "output"] as const).map((region) => {
      const { nodes, direction } = problem[region];
      const [x, y] = nodes.reduce(([sx, sy], node) => [sx + problem.positions[node]![0] / nodes.length, sy + problem.positions[node]![1] / nodes.length], [0, 0]);
      const way = isEach(direction) ? direction[0]! : direction;
      return s("g", { class: `arrow ${region}` }, s("path", { class: "shaft", d: arrow([x, y], [2.4 * way[0], 2.4 * way[1]], 0.5) }));
    }));
    clear(this.readout, h("strong", {}, figure(built.efficiency, 3)), h("span", {}, "output motion over input motion"),
      h("span", {}, `${problem.positions.length} nodes, ${where(bits).length} beams`));
  }

  private ports(): string[] { return this.parts.flatMap((part) => [`${part.name}.input`, `${part.name}.output`]); }

  private show(): void {
    clear(this.panel,
      ...this.parts.map((part, k) => this.partBox(part, k)),
      !this.parts.length && h("section", { class: "step open" }, h("h2", { class: "plain" }, "Parts"), h("div", { class: "content" }, h("p", {}, "Pick a design on the left to begin with. Parts of machines fit each other: search one from “elementary-…” tasks first, or use a library design."))),
      this.parts.length > 0 && this.machineBox());
  }

  private partBox(part: Part, k: number): HTMLElement {
    const others = this.ports().filter((port) => !port.startsWith(`${part.name}.`));
    const joins: [string, string][] = [...(k === 0 || others.length === 0 ? [] : others.map((port): [string, string] => [port, `on ${port.replace(".", "’s ")}`])), ["", k === 0 ? "here" : "at a place"]];
    const turns: [string, string][] = [0, 60, 120, 180, 240, 300].map((angle) => [String(angle), `${angle}°`]);
    const mirror = h("input", { type: "checkbox", checked: part.mirror });
    mirror.addEventListener("change", () => { part.mirror = mirror.checked; void this.changed(); });
    const supports = h("input", { type: "checkbox", checked: part.supports });
    supports.addEventListener("change", () => { part.supports = supports.checked; void this.changed(); });
    const place = (axis: 0 | 1, label: string): HTMLElement => field(label, number(part.at[axis], { step: "any" }, (value) => { part.at[axis] = value; void this.changed(); }));
    return h("section", { class: "step open" },
      h("h2", { class: "plain" }, h("span", { class: `swatch part-${k % 4}` }), `${part.name}: ${part.small.title}`,
        button("Remove", () => this.removePart(part.name), "quiet small", { "aria-label": `Remove ${part.name}` })),
      h("div", { class: "content" },
        h("div", { class: "row" },
          field("Goes", select(joins, part.join, (picked) => { part.join = picked; void this.changed(); })),
          field("Turned", select(turns, String(part.rotate), (picked) => { part.rotate = Number(picked); void this.changed(); }))),
        part.join !== "" && choice("With its", [["input", "With its input"], ["output", "With its output"]], part.by, (picked) => { part.by = picked; void this.changed(); }),
        k > 0 && part.join === "" && h("div", { class: "row" }, place(0, "x of its input"), place(1, "y of its input")),
        h("div", { class: "row" }, h("label", { class: "tick" }, mirror, "Mirrored"), h("label", { class: "tick" }, supports, "Held"))));
  }

  private machineBox(): HTMLElement {
    const ports = this.ports();
    const options = ports.map((port): [string, string] => [port, port.replace(".", "’s ")]);
    const name = h("input", { type: "text", value: this.name, maxlength: 100 });
    name.addEventListener("change", () => { this.name = name.value.trim() || "my machine"; });
    const linkRows = this.links.map((link, k) => h("div", { class: "row three" },
      field("Link", select(options, link.from, (picked) => { link.from = picked; void this.changed(); })),
      field("with", select(options, link.to, (picked) => { link.to = picked; void this.changed(); })),
      field("by", select([["weld", "weld"], ["bridge", "bridge"]], link.kind, (picked) => { link.kind = picked as "weld"; void this.changed(); })),
      button("Remove", () => { this.links.splice(k, 1); void this.changed(); }, "quiet small")));
    return h("section", { class: "step open" }, h("h2", { class: "plain" }, "Together"),
      h("div", { class: "content" },
        field("Name", name),
        h("div", { class: "row" },
          field("Pushed at", select(options, this.drives[0] ?? "", (picked) => { this.drives = [picked]; void this.changed(); })),
          field("Moves at", select(options, this.moves[0] ?? "", (picked) => { this.moves = [picked]; void this.changed(); }))),
        ...linkRows,
        ports.length > 2 && button("Add a link", () => { this.links.push({ from: ports[1]!, to: ports[2]!, kind: "bridge" }); void this.changed(); }),
        h("button", { type: "button", class: "primary", disabled: !this.built, onclick: () => void this.open() }, "Build it")));
  }

  private async open(): Promise<void> {
    if (!this.built) return;
    try {
      const { problem, mask, provenance } = this.built;
      const kept = await post<{ source: string; key: string }>("/gallery", { problem, mask, provenance, title: this.name });
      location.hash = `#/design/${kept.source}/${kept.key}`;
    } catch (error) {
      this.fault.textContent = sentence((error as Refusal).message);
    }
  }
}
