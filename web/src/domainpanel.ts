// Size and material of the part, where material may be, and files of tasks.

import { get } from "./api";
import { bundledTask, emptySpaceTask, emptyTask, exampleTask } from "./begin";
import { button, choice, clear, count, field, h, number, select } from "./dom";
import type { TaskEditor } from "./editing";
import { amount } from "./fields";
import { ON_CORNER_TITLE } from "./limitspanel";
import { taskPictures } from "./taskpictures";
import { cleaned, isSpatial, resized, scaled, type Amount, type Domain, type Material, type OutputTable, type Shape, type Table, type Task, type ZoneKind, type ZoneShape } from "./task";
import { lengthIn } from "./text";

/** Problems of the paper on whose lattices a part can be designed. */
const LATTICES = ["crane", "anti-parallel", "pliers", "scaling-8", "scaling-12", "discs"];
const ZONES: [ZoneKind, string][] = [["holes", "Hole"], ["keep_out", "Free"], ["solid", "Solid"]];
const FRESH: Record<string, () => Task> = { example: exampleTask, empty: emptyTask, "empty-space": emptySpaceTask };
/** Octets that stand on a corner: layers of triangles, which a third of a turn does not change. */
const ON_CORNER = { kind: "octet", up: [1, 1, 1], envelope: "cylinder" };
const OWN: Material = { name: "own", young: 12, poisson: 0.45, density: 1.2, strain_limit: 0.3 };

export class DomainPanel {
  private tasks: { name: string; kind: string; about: string }[] = [];
  private linked = "";
  /** What a task may start from, above the drawing. */
  readonly start = h("div", { class: "start" });
  /** Description of the task that was opened, until it is changed. */
  private readonly about = h("span", { class: "more", role: "status" });
  private opened = "";

  constructor(
    private readonly editor: TaskEditor,
    private readonly attempt: (work: () => Promise<void>) => void,
    private readonly refresh: () => void,
  ) {
    void get<{ name: string; kind: string; about: string }[]>("/tasks").then((found) => { this.tasks = found; this.showStart(); this.refresh(); }, () => undefined);
  }

  summary(): string {
    const { built, task } = this.editor;
    if (JSON.stringify(task.table) !== this.opened) this.about.textContent = "";
    return built ? `${count(built.lattice.positions.length, "node")}, ${count(built.lattice.beams.length, "strut")}` : "";
  }

  make(): HTMLElement {
    const { editor } = this;
    const { table } = editor.task;
    const file = this.file("File to open", ".toml,.json", (picked) => this.attempt(() => editor.load(picked)));
    const name = h("input", { type: "text", value: table.name, maxlength: 100, "data-key": "name" });
    name.addEventListener("change", () => { if (name.value.trim()) editor.change({ ...editor.task.table, name: name.value.trim() }); });
    return h("div", { class: "content" },
      field("Name", name),
      this.part(), this.domain(), this.zones(),
      h("div", { class: "buttons" },
        button("Open a file", () => file.click(), "", { "data-key": "open" }), file,
        button("Download the task", () => this.attempt(() => editor.save()), "", { "data-key": "toml" }),
        button(this.linked || "Copy link", () => this.attempt(async () => { this.linked = await editor.link(); }), "", { "data-key": "link" })));
  }

  /** Offer an empty domain in the plane or in space, an example, and the bundled tasks. */
  private showStart(): void {
    const { editor } = this;
    const open = (name: string): void => this.attempt(async () => {
      editor.open(FRESH[name]?.() ?? await bundledTask(name));
      this.about.textContent = this.tasks.find((each) => each.name === name)?.about ?? "";
      this.opened = JSON.stringify(editor.task.table);
    });
    const pick = h("select", { "data-key": "start", id: "start", onchange: () => { if (pick.value) open(pick.value); } }, h("option", { value: "" }, "choose …"),
      h("option", { value: "example" }, "the example"), h("option", { value: "empty" }, "an empty rectangle"), h("option", { value: "empty-space" }, "an empty box in space"),
      ...[...new Set(this.tasks.map(({ kind }) => kind))].map((kind) => h("optgroup", { label: `Tasks ${kind}`.replace("Tasks parts", "Parts") },
        ...this.tasks.filter((each) => each.kind === kind).map(({ name, about: text }) => h("option", { value: name }, kind.startsWith("parts") || !text ? name : `${name}: ${short(text)}`)))));
    clear(this.start, button("Empty rectangle", () => open("empty")), button("Empty box in space", () => open("empty-space")),
      h("label", { for: "start" }, "or start from"), pick, this.about, this.tasks.length > 0 && taskPictures(open));
  }

  /** How much of the domain the lattice fills, if that is not all of it. */
  private filled(): HTMLElement | null {
    const { built, task: { table: { domain: { size } } } } = this.editor;
    if (!built || !size || size.some((length) => typeof length !== "number")) return null;
    const lengths = size.map((_, axis) => {
      const values = built.lattice.positions.map((point) => point[axis]!);
      return built.part.scale * (Math.max(...values) - Math.min(...values));
    });
    // The struts extend by half of their width beyond the nodes.
    const outer = lengths.map((length) => length + built.part.width);
    if (outer.every((length, axis) => length > 0.93 * (size[axis] as number))) return null;
    const spacings = size.map((length, axis) => Math.floor((10 * built.part.scale * ((length as number) - built.part.width)) / lengths[axis]!) / 10);
    const fitting = Math.min(...spacings);
    const larger = fitting > built.part.scale ? ` With nodes ${fitting} mm apart the same cells are as large as fit.` : "";
    // Columns and rows of the triangular lattice.
    const cells = [1, Math.sqrt(3) / 2];
    const next = size.map((length, axis) => Math.ceil(10 * (outer[axis]! > 0.93 * (length as number) ? (length as number) : outer[axis]! + cells[axis]! * built.part.scale)) / 10);
    const room = size.length === 2 ? ` ${next.join(" × ")} mm would hold more cells.` : "";
    return h("p", { class: "note" }, `The part is ${outer.map((length) => length.toFixed(1)).join(" × ")} mm: whole cells with nodes ${built.part.scale} mm apart, and half a strut around them.${larger}${room}`);
  }

  private file(label: string, accept: string, use: (file: File) => void): HTMLInputElement {
    const input = h("input", { type: "file", accept, class: "visually-hidden", tabindex: -1, "aria-label": label });
    input.addEventListener("change", () => {
      const picked = input.files?.[0];
      if (picked) use(picked);
    });
    return input;
  }

  private part(): HTMLElement {
    const { editor } = this;
    const { table } = editor.task;
    const part = table.part ?? {};
    const put = (changes: NonNullable<Table["part"]>): void => {
      const now = editor.task.table;
      const next = cleaned({ ...now.part, ...changes });
      editor.change(cleaned({ ...now, part: Object.keys(next).length ? next : undefined }));
    };
    const size = (key: "width" | "thickness" | "spacing", label: string, usual: number): HTMLElement =>
      amount(`part-${key}`, label, part[key] ?? usual, "mm", (value) => put({ [key]: value }));
    const own = typeof part.material === "object" ? part.material : null;
    const material = select([
      ...(editor.registries?.materials ?? []).map(({ name, title }): [string, string] => [name, title]), ["own", "own …"],
    ], own ? "own" : String(part.material ?? "ninjaflex"), (picked) => put({ material: picked === "own" ? OWN : picked }));
    material.dataset.key = "part-material";
    const figure = (key: "young" | "poisson" | "density" | "strain_limit", label: string, unit: string): HTMLElement =>
      amount(`material-${key}`, label, own?.[key], unit, (value) => put({ material: cleaned({ ...own!, [key]: value }) as Material }));
    return h("div", {},
      h("div", { class: "row" }, size("spacing", "Spacing of nodes", 10), size("width", isSpatial(table) ? "Strut diameter" : "Strut width", 2)),
      h("div", { class: "row" }, isSpatial(table) ? null : size("thickness", "Thickness", 5), field("Material", material)),
      own && h("div", { class: "row" }, figure("young", "Young's modulus", "MPa"), figure("poisson", "Poisson's ratio", "")),
      own && h("div", { class: "row" }, figure("density", "Density", "g/cm³"), figure("strain_limit", "Largest strain", "")));
  }

  private domain(): HTMLElement {
    const { editor } = this;
    const { table } = editor.task;
    const { domain } = table;
    const kind = domain.size?.length === 3 ? "space" : domain.size ? "size" : domain.outline ? "outline" : domain.problem ? "problem" : "lattice";
    const put = (next: Domain): void => editor.change({ ...editor.task.table, domain: cleaned(next) });
    const zones = isSpatial(table) ? {} : { holes: domain.holes, keep_out: domain.keep_out, solid: domain.solid };
    const drawing = this.file("Outline to read", ".dxf,.svg", (picked) => this.attempt(() => editor.loadOutline(picked)));
    const options: [string, string][] = [["size", "Rectangle"], ["outline", "Outline"], ["space", "Box in space"], ["problem", "Lattice of the paper"], ...(kind === "lattice" ? [["lattice", "Own lattice"] as [string, string]] : [])];
    const pick = (picked: string): void => {
      // Nodes of the plane are none of space: regions are selected anew.
      if (picked === "space" || isSpatial(table)) editor.open({ table: { ...(picked === "space" ? emptySpaceTask() : emptyTask()).table, name: table.name }, hand: null });
      else if (picked === "size") put({ size: [82, 72], ...zones });
      else if (picked === "outline") put({ outline: [[0, 0], [80, 0], [80, 40], [40, 40], [40, 70], [0, 70]], ...zones });
      else if (picked === "problem") editor.change({ ...table, domain: { problem: "crane" }, supports: [], cases: table.cases.map((each) => ({ ...each, inputs: [], outputs: (each.outputs?.length ? each.outputs : [{ gain: [{ maximise: true }] }]).map((output: OutputTable) => cleaned({ ...output, at: undefined, direction: undefined })) })) });
    };
    // A field may be left after the panel is drawn again: the present task counts, not that of the drawing.
    const side = (index: 0 | 1 | 2) => (value: Amount | undefined): void => {
      const now = editor.task.table;
      const size = [...now.domain.size!] as number[];
      const length = value === undefined ? size[index]! : lengthIn(value);
      (size as Amount[])[index] = Number.isNaN(length) ? value! : length;
      // The server says what is wrong with a text that is no length.
      if (Number.isNaN(length)) editor.change({ ...now, domain: { ...now.domain, size } });
      else editor.change(resized(now, size));
    };
    const lattice = select(LATTICES.map((name): [string, string] => [name, name]), domain.problem ?? "crane", (picked) => put({ problem: picked }));
    lattice.dataset.key = "domain-problem";
    const corners = Array.isArray(domain.outline) ? domain.outline : null;
    return h("div", {},
      choice("Kind of domain", options, kind, pick),
      kind === "size" && h("div", { class: "row" },
        amount("domain-width", "Width", domain.size![0], "mm", side(0)), amount("domain-height", "Height", domain.size![1], "mm", side(1))),
      kind === "space" && h("div", {}, h("div", { class: "row three" },
        amount("domain-width", "Width (x)", domain.size![0], "mm", side(0)), amount("domain-depth", "Depth (y)", domain.size![1], "mm", side(1)), amount("domain-height", "Height (z)", domain.size![2], "mm", side(2))),
        this.cells(domain, put)),
      this.filled(),
      this.scaling(),
      kind === "outline" && h("div", {},
        corners ? amount("domain-corners", "Corners, mm", corners.length > 40 ? undefined : corners.map((point) => point.join(", ")).join("; "), "", (value) => {
          const points = String(value ?? "").split(";").map((text) => text.split(",").map(Number) as [number, number]).filter((point) => point.length === 2 && point.every(Number.isFinite));
          if (points.length > 2) put({ ...domain, outline: points });
        }, corners.length > 40 ? `${corners.length} corners of a drawing` : "x, y; x, y; …") : this.round(domain, put),
        choice("Outline", [["corners", "Corners"], ["circle", "Circle"]] as ["corners" | "circle", string][], corners ? "corners" : "circle", (picked) =>
          put({ ...domain, outline: picked === "circle" ? { circle: [40, 40], radius: 40 } : [[0, 0], [80, 0], [80, 40], [40, 40], [40, 70], [0, 70]] })),
        button("Read DXF or SVG", () => drawing.click(), "", { "data-key": "outline" }), drawing),
      kind === "problem" && field("Lattice", lattice, "", "With the supports, input and output of the paper unless you select others."));
  }

  /** A field and a button that multiply all lengths of the task. */
  private scaling(): HTMLElement {
    const { editor } = this;
    const percent = number(100, { min: 1, max: 10000, step: "any" }, () => undefined);
    percent.dataset.key = "domain-scale";
    const scale = (): void => {
      const value = percent.valueAsNumber;
      if (value >= 1 && value <= 10000 && value !== 100) editor.change(scaled(editor.task.table, value / 100));
    };
    return h("div", {},
      h("div", { class: "row between" }, field("Scale the task to", percent, "%"), button("Scale", scale, "", { "data-key": "scale" })),
      h("p", { class: "note" }, "Multiplies all lengths: domain, spacing, struts, places of nodes, strokes and travels. Loads and forces stay."));
  }

  /** Centre and radius of a round outline. */
  private round(domain: Domain, put: (next: Domain) => void): HTMLElement {
    const shape = domain.outline as Shape;
    const centre = amount("domain-centre", "Centre x, y, mm", shape.circle?.join(", "), "", (value) => {
      const read = String(value ?? "").split(",").map(Number);
      if (read.length === 2 && read.every(Number.isFinite)) put({ ...domain, outline: { ...shape, circle: read as [number, number] } });
    });
    return h("div", { class: "row" }, centre, amount("domain-radius", "Radius", shape.radius, "mm", (value) => put({ ...domain, outline: { ...shape, radius: value ?? shape.radius! } })));
  }

  /** The lattice that fills a box. */
  private cells(domain: Domain, put: (next: Domain) => void): HTMLElement {
    const { cells } = domain;
    const isOnCorner = typeof cells === "object" && Object.keys(cells).length === 3 && Object.entries(ON_CORNER).every(([key, value]) => JSON.stringify(cells[key]) === JSON.stringify(value));
    const own = typeof cells === "object" && !isOnCorner ? cells : null;
    const options = [...(this.editor.registries?.cells ?? []).map(({ name, title }): [string, string] => [name, title]), ["on-corner", ON_CORNER_TITLE] as [string, string]];
    const kinds = select([...options, ...(own ? [["own", `${own.kind} of the task`] as [string, string]] : [])], own ? "own" : isOnCorner ? "on-corner" : String(cells ?? "octet"),
      // The size may have been changed after the panel was drawn.
      (picked) => { if (picked !== "own") put({ ...this.editor.task.table.domain, cells: picked === "octet" ? undefined : picked === "on-corner" ? ON_CORNER : picked }); });
    kinds.dataset.key = "domain-cells";
    return field("Lattice", kinds, "", isOnCorner ? "A third of a turn about the upright axis does not change this lattice if width and depth are equal: designs may be 3-fold symmetric." : "");
  }

  /** A hole or zone in space, by numbers. */
  private zoneInSpace(): HTMLElement {
    const { editor } = this;
    const { table } = editor.task;
    const [w, d, t] = table.domain.size as [number, number, number];
    const shapes: Record<string, Shape> = {
      box: { box: [0, 0, Math.round(0.8 * t), w, d, t] }, sphere: { sphere: [w / 2, d / 2, t], radius: Math.round(w / 4) }, cylinder: { cylinder: [w / 2, d / 2], radius: Math.round(w / 5) },
    };
    const add = select([["", "choose a shape …"], ["box", "box"], ["sphere", "sphere"], ["cylinder", "upright cylinder"]], "", (name) => {
      const { kind } = editor.zone;
      if (name) editor.change({ ...table, domain: { ...table.domain, [kind]: [...(table.domain[kind] ?? []), shapes[name]!] } });
    });
    add.dataset.key = "zone-add";
    return h("div", { class: "row" },
      field("Zone", Object.assign(select(ZONES.map(([kind, title]): [string, string] => [kind, title]), editor.zone.kind, (picked) => { editor.zone = { ...editor.zone, kind: picked as ZoneKind }; }))),
      field("Add", add));
  }

  /** The numbers of a zone, to correct what was drawn. */
  private zoneFields(kind: ZoneKind, index: number, shape: Shape): HTMLElement | null {
    const { table } = this.editor.task;
    const key = (["box", "sphere", "cylinder", "circle"] as const).find((name) => shape[name]);
    if (!key) return null;
    const put = (next: Shape): void => this.editor.change({ ...table, domain: { ...table.domain, [kind]: table.domain[kind]!.map((each, k) => (k === index ? next : each)) } });
    const given = shape[key] as number[];
    const labels = { box: given.length === 6 ? "x, y, z of two corners, mm" : "x, y of two corners, mm", sphere: "Centre x, y, z, mm", cylinder: "Axis x, y, mm", circle: "Centre x, y, mm" };
    const numbers = amount(`zone-${kind}-${index}-${key}`, labels[key], given.join(", "), "", (value) => {
      const read = String(value ?? "").split(",").map(Number);
      if (read.length === given.length && read.every(Number.isFinite)) put({ ...shape, [key]: read });
    });
    return h("div", { class: `numbers ${key === "box" ? "" : "row"}` }, numbers, key === "box" ? null : amount(`zone-${kind}-${index}-radius`, "Radius", shape.radius, "mm", (value) => put({ ...shape, radius: value ?? shape.radius! })));
  }

  private zones(): HTMLElement {
    const { editor } = this;
    const { table } = editor.task;
    const { domain } = table;
    const known = ZONES.flatMap(([kind, title]) => (table.domain[kind] ?? []).map((shape, index) => ({ kind, title, shape, index })));
    const drop = (kind: ZoneKind, index: number): void => {
      const left = (table.domain[kind] ?? []).filter((_, k) => k !== index);
      editor.change({ ...table, domain: cleaned({ ...table.domain, [kind]: left.length ? left : undefined }) });
    };
    return h("div", { class: "zones" },
      domain.size?.length === 3 ? this.zoneInSpace() : editor.tool === "zones" ? h("div", { class: "row between" },
        choice("Kind of zone", ZONES, editor.zone.kind, (picked) => { editor.zone = { ...editor.zone, kind: picked }; }),
        choice("Shape of zone", [["box", "Box"], ["circle", "Circle"]] as [ZoneShape, string][], editor.zone.shape, (picked) => { editor.zone = { ...editor.zone, shape: picked }; editor.choose("zones"); }))
        : button("Draw holes and zones", () => editor.choose("zones"), "quiet", { "data-key": "zones" }),
      ...known.map(({ kind, title, shape, index }) => h("div", { class: "zone-row" }, `${title}: ${shapeText(shape)} `,
        button("Remove", () => drop(kind, index), "quiet small", { "data-key": `zone-${kind}-${index}`, "aria-label": `Remove ${title.toLowerCase()} ${index + 1}` }),
        this.zoneFields(kind, index, shape))));
  }
}

function shapeText({ circle, sphere, cylinder, box, polygon }: Shape): string {
  if (sphere) return "sphere";
  if (cylinder) return "upright cylinder";
  if (circle) return "circle";
  return box ? "box" : `polygon of ${polygon?.length ?? 0} corners`;
}

/** The beginning of a description, for a list. */
function short(text: string, most = 58): string {
  return text.length <= most ? text : `${text.slice(0, text.lastIndexOf(" ", most))} …`;
}
