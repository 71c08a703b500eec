// The drawing of a task in space, on which nodes are selected, layer by layer.

import type { CanvasActions } from "./canvas";
import { range, sectionOf, where } from "./drawing";
import { announce, h, select } from "./dom";
import { loadSpace } from "./loadspace";
import { describeTarget, nextInDirection } from "./marks";
import type { SpaceDrawing } from "./space";
import type { Tool, ZoneShape } from "./task";
import type { TaskDrawing, View } from "./view";
import { sentence } from "./text";

/** Largest number of separate layers; more are joined. */
const LAYERS = 40;
const JOINED = 0.8;
const ARROW = 1.6;
const STRETCH = 4;
/** Distance of the arrow of an input from its nodes. */
const GAP = 0.5;

export class SpaceCanvas implements TaskDrawing {
  readonly element = h("div", { class: "space-canvas" });
  tool: Tool = "supports";
  rows = false;
  zoneShape: ZoneShape = "box";
  private readonly bar = h("div", { class: "layers" });
  private readonly tip = h("span", { class: "tip", hidden: true });
  private drawing: SpaceDrawing | null = null;
  private view_: View | null = null;
  private shown = "";
  private layer = "";
  private layers: { name: string; nodes: number[] }[] = [];
  private cursor = -1;
  private response: { displacement: number[]; beams: number[] } | null = null;
  private isClosed = false;
  private pressed: [number, number] | null = null;

  constructor(private readonly actions: CanvasActions) {
    this.element.append(this.bar, this.tip);
  }

  close(): void {
    this.isClosed = true;
    this.drawing?.close();
  }

  private async open(view: View): Promise<void> {
    const { problem, part } = view.built;
    const section = problem ? sectionOf(problem) : { width: part.width / part.scale };
    let drawing: SpaceDrawing;
    try {
      drawing = await loadSpace("The task: a lattice in space with supports, inputs and outputs", section);
    } catch (error) {
      this.element.append(h("p", { class: "fault", role: "alert" }, sentence((error as Error).message)));
      return;
    }
    if (this.isClosed) { drawing.close(); return; }
    this.drawing = drawing;
    const { canvas } = drawing;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-roledescription", "drawing");
    canvas.addEventListener("pointerdown", (event) => { this.pressed = event.button === 0 ? [event.clientX, event.clientY] : null; });
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointermove", (event) => this.hover(event));
    canvas.addEventListener("pointerleave", () => this.point(-1, -1));
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("blur", () => this.point(-1, -1));
    this.element.append(drawing.element);
    this.shown = "";
    if (this.view_) this.show(this.view_);
  }

  show(view: View): void {
    if (!this.view_ && !this.drawing) void this.open(view);
    this.view_ = view;
    const { drawing } = this;
    if (!drawing) return;
    const { positions, beams } = view.built.lattice;
    const text = JSON.stringify([positions, beams.length]);
    if (text !== this.shown) {
      this.shown = text;
      this.cursor = -1;
      this.layer = "";
      drawing.setLattice(positions, beams);
      this.layers = layersOf(positions.map(([, , z]) => z!), view.built.part.scale);
      this.showLayers();
    }
    this.paint();
  }

  /** Show the design in its deformed state. */
  showMoved(displacement: number[] | null, beams: number[]): void {
    this.response = displacement ? { displacement, beams } : null;
    this.paint();
  }

  private showLayers(): void {
    const pick = select([["", "All layers"], ...this.layers.map(({ name }, k): [string, string] => [String(k), name])], this.layer, (layer) => { this.layer = layer; this.showLayers(); this.paint(); });
    pick.id = "layer";
    pick.setAttribute("aria-label", "Layer of nodes");
    pick.dataset.key = "layer";
    const all = h("button", { type: "button", class: "small", "data-key": "whole-layer", disabled: this.layer === "", onclick: () => this.pickLayer() }, "Add all free nodes of the layer");
    this.bar.replaceChildren(h("label", { for: "layer" }, "Nodes of"), pick, all);
  }

  private get pickable(): number[] {
    return this.layer === "" ? range(this.view_!.built.lattice.positions.length) : this.layers[Number(this.layer)]!.nodes;
  }

  private pickLayer(): void {
    const { picksNodes, tool, view_: view } = this;
    if (!picksNodes || !view) return;
    // Single nodes of a layer may have another role already, such as an input amid an output.
    const taken = new Set(tool === "loads" ? [] : [...view.held.flatMap(({ nodes }) => nodes), ...view.arrows.filter(({ target }) => target.kind !== "loads").flatMap(({ nodes }) => nodes)]);
    const free = this.pickable.filter((node) => !taken.has(node));
    if (free.length) this.actions.nodes(free, true);
    else this.actions.note("All nodes of this layer belong to a support, an input or an output.");
  }

  private paint(): void {
    const { drawing, view_: view } = this;
    if (!drawing || !view) return;
    const { bits, designable, built } = view;
    const { response } = this;
    drawing.at = response ? Float64Array.from(drawing.rest, (value, k) => value + response.displacement[k]!) : drawing.rest;
    const present = bits ? where(bits) : range(built.lattice.beams.length);
    // Struts that are only a choice of the search are lines: nodes stay visible between them.
    drawing.ghost("rest", bits ? where(bits, 0) : present.filter((k) => designable[k]));
    drawing.draw(bits ? [{ name: "plain", beams: present }] : [{ name: "possible", beams: present.filter((k) => !designable[k]) }]);
    const held = view.held.flatMap(({ nodes }) => nodes);
    const marked = new Set([...held, ...view.arrows.flatMap(({ nodes }) => nodes)]);
    drawing.mark("node", this.picksNodes ? this.pickable.filter((node) => !marked.has(node)) : []);
    // Marks of other layers than the chosen one are pale: seen from above, all lie over each other.
    const inside = new Set(this.pickable);
    const near = (nodes: number[]): number[] => nodes.filter((node) => inside.has(node));
    drawing.mark("far", [...marked].filter((node) => !inside.has(node)));
    drawing.mark("support", near(view.held.filter(({ hold }) => hold === "all").flatMap(({ nodes }) => nodes)));
    drawing.mark("roller", near(view.held.filter(({ hold }) => hold !== "all").flatMap(({ nodes }) => nodes)));
    for (const [name, kind] of [["input", "inputs"], ["output", "outputs"], ["load", "loads"]] as const) {
      drawing.mark(name, near(view.arrows.filter(({ target }) => target.kind === kind).flatMap(({ nodes }) => nodes)));
    }
    drawing.arrows(view.arrows.filter(({ nodes, turns }) => nodes.length && !turns).map(({ nodes, direction, stroke, target }) => {
      const length = stroke === null ? ARROW : Math.max(0.7, STRETCH * stroke);
      const middle = [0, 1, 2].map((axis) => nodes.reduce((sum, node) => sum + drawing.at[3 * node + axis]!, 0) / nodes.length);
      // The arrow of an input ends at its nodes, as a push.
      const from = target.kind === "outputs" ? middle : middle.map((value, axis) => value - (length + GAP) * (direction[axis] ?? 0));
      return { from, direction: direction as number[], length, kind: target.kind.slice(0, -1) };
    }));
    drawing.shapes(view.zones, built.part.scale);
  }

  private get picksBeams(): boolean { return this.tool === "hand"; }
  private get picksNodes(): boolean { return this.tool !== "hand" && this.tool !== "zones"; }

  private found(event: PointerEvent): { node: number; beam: number } {
    if (!this.drawing || !this.view_) return { node: -1, beam: -1 };
    return this.drawing.pick(event, this.picksNodes ? this.pickable : [], this.picksBeams ? where(this.view_.designable) : []);
  }

  private up(event: PointerEvent): void {
    const { pressed } = this;
    this.pressed = null;
    if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return; // the view was turned
    const { node, beam } = this.found(event);
    if (node >= 0) { this.toggle(node); this.point(-1, -1); }
    if (beam >= 0) this.actions.beams([beam], false);
  }

  private toggle(node: number): void {
    const { target, held, arrows } = this.view_!;
    const active = target.kind === "supports" ? held[target.index]?.nodes ?? []
      : arrows.find((each) => each.target.kind === target.kind && each.target.index === target.index)?.nodes ?? [];
    const layer = this.rows ? this.layers.find(({ nodes }) => nodes.includes(node))?.nodes : null;
    this.actions.nodes(layer ?? [node], !active.includes(node));
  }

  private hover(event: PointerEvent): void {
    if (event.buttons) return;
    const { node, beam } = this.found(event);
    this.point(node, beam);
  }

  /** Name the node or strut under the pointer or the cursor. */
  private point(node: number, beam: number): void {
    const found = node >= 0 ? node : beam;
    this.tip.hidden = found < 0;
    this.drawing?.mark("hover", node >= 0 ? [node] : []);
    if (this.drawing) this.drawing.canvas.style.cursor = found >= 0 ? "pointer" : "grab";
    if (found < 0 || !this.drawing || !this.view_) return;
    this.tip.textContent = describeTarget(this.view_, this.tool, found);
    const [x, y] = this.drawing.screen(node >= 0 ? node : this.view_.built.lattice.beams[beam]![0]);
    this.tip.style.left = `${x}px`;
    this.tip.style.top = `${y + this.bar.offsetHeight}px`;
  }

  private key(event: KeyboardEvent): void {
    const keys: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const direction = keys[event.key];
    if (!this.view_ || event.ctrlKey || event.metaKey || event.shiftKey || this.tool === "zones") return;
    if (direction) {
      event.preventDefault();
      this.step(direction);
    } else if ((event.key === " " || event.key === "Enter") && this.cursor >= 0) {
      event.preventDefault();
      if (this.picksBeams) this.actions.beams([this.cursor], false); else this.toggle(this.cursor);
    } else if (event.key === "PageUp" || event.key === "PageDown") {
      event.preventDefault();
      const last = this.layers.length - 1;
      const now = this.layer === "" ? (event.key === "PageUp" ? -1 : last + 1) : Number(this.layer);
      this.layer = String(Math.max(0, Math.min(last, now + (event.key === "PageUp" ? 1 : -1))));
      this.showLayers();
      this.paint();
      announce(`layer ${this.layers[Number(this.layer)]!.name}`);
    }
  }

  /** Move the cursor to the next node or strut on the screen. */
  private step(direction: [number, number]): void {
    const drawing = this.drawing!;
    const choices = this.picksBeams ? where(this.view_!.designable) : this.pickable;
    const place = (k: number): [number, number] => {
      const [a, b] = this.picksBeams ? drawing.beams[choices[k]!]! : [choices[k]!, choices[k]!];
      const [[ax, ay], [bx, by]] = [drawing.screen(a), drawing.screen(b)];
      return [(ax + bx) / 2, (ay + by) / 2];
    };
    const found = nextInDirection(choices.length, place, choices.indexOf(this.cursor), [0, drawing.canvas.clientHeight], direction);
    this.cursor = found < 0 ? -1 : choices[found]!;
    this.point(this.picksBeams ? -1 : this.cursor, this.picksBeams ? this.cursor : -1);
    if (this.cursor >= 0) announce(describeTarget(this.view_!, this.tool, this.cursor));
  }
}

/** Nodes at the same height, from the lowest layer; in lattices without layers those of slices. */
function layersOf(heights: number[], scale: number): { name: string; nodes: number[] }[] {
  const order = range(heights.length).sort((a, b) => heights[a]! - heights[b]!);
  const joined = (gap: number): { low: number; nodes: number[] }[] => {
    const found: { low: number; nodes: number[] }[] = [];
    for (const node of order) {
      const last = found.at(-1);
      if (last && heights[node]! - last.low < gap) last.nodes.push(node);
      else found.push({ low: heights[node]!, nodes: [node] });
    }
    return found;
  };
  let layers = joined(0.05);
  if (layers.length > LAYERS) layers = joined(JOINED);
  return layers.map(({ low, nodes }) => ({ name: `Layer at ${(low * scale).toFixed(1)} mm`, nodes }));
}
