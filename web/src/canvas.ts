// The drawing of the task, on which nodes are selected, arrows are dragged and zones are drawn.

import type { Point } from "./api";
import { angleOf, arrow, Drawing, range, turnArrow, where } from "./drawing";
import { announce, s } from "./dom";
import { describeTarget, mirrorAxes, nextInDirection, rollerLines, shapePath } from "./marks";
import { directionAt, middleOf, rowOf, type Direction, type Shape, type Target, type Tool, type ZoneShape } from "./task";
import type { Arrow, TaskDrawing, View } from "./view";

/** Length of the arrow of an input, in strokes. */
export const STRETCH = 4;
const SHORTEST = 0.7;

export interface CanvasActions {
  nodes(nodes: number[], add: boolean): void;
  beams(beams: number[], merge: boolean): void;
  aim(target: Target, direction: Direction, stroke: number | null, merge: boolean): void;
  zone(shape: Shape): void;
  note(text: string): void;
}

type Drag = { kind: "box" | "paint" | "aim" | "zone"; from: Point; arrow?: Arrow; add: boolean; done: Set<number>; moved: boolean };

export class Canvas extends Drawing implements TaskDrawing {
  tool: Tool = "supports";
  rows = false;
  zoneShape: ZoneShape = "box";
  private view_: View | null = null;
  private cursor = -1;
  private movedTo: Float64Array | null = null;
  private drag: Drag | null = null;
  private readonly hover = s("circle", { class: "hover", r: 0.24, visibility: "hidden" });
  private readonly hoverBeam = s("path", { class: "hover-beam" });
  private readonly band = s("path", { class: "band", visibility: "hidden" });
  private readonly faults = s("g", { class: "faults" });
  private readonly arrowGroup = s("g", { class: "arrows" });
  private readonly zoneGroup = s("g", { class: "zones" });
  private readonly response = s("path", { class: "beam response" });
  private readonly axes = s("path", { class: "axis" });
  private readonly rollers = s("path", { class: "rollers" });

  constructor(private readonly actions: CanvasActions) {
    super("The task: a lattice with supports, inputs and outputs");
    this.svg.setAttribute("role", "application");
    this.svg.setAttribute("tabindex", "0");
    this.svg.setAttribute("aria-roledescription", "drawing");
    this.svg.classList.add("canvas");
    this.svg.insertBefore(this.response, this.dots);
    this.svg.prepend(this.zoneGroup);
    this.overlay.append(this.rollers, this.axes, this.hoverBeam, this.hover, this.band, this.faults);
    this.svg.insertBefore(this.arrowGroup, this.dots);
    this.svg.addEventListener("pointerdown", (event) => this.down(event));
    this.svg.addEventListener("pointermove", (event) => this.moved(event));
    this.svg.addEventListener("pointerup", (event) => this.up(event));
    this.svg.addEventListener("pointercancel", () => this.drop());
    this.svg.addEventListener("pointerleave", () => this.point(-1, -1));
    this.svg.addEventListener("dblclick", (event) => this.double(event));
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.svg.addEventListener("blur", () => this.point(-1, -1));
  }

  show(view: View): void {
    const { lattice } = view.built;
    const before = this.view_?.built.lattice;
    const changed = before !== lattice && (JSON.stringify(before?.positions) !== JSON.stringify(lattice.positions) || before?.beams.length !== lattice.beams.length);
    this.view_ = view;
    if (changed) {
      this.setLattice(lattice.positions, lattice.beams, 2.1);
      this.cursor = -1;
    }
    this.dimensions(view.built.part.scale, view.arrows.filter(({ nodes }) => nodes.length).map((each) => this.tip(each)));
    this.at = this.rest;
    const { bits, designable } = view;
    this.ghost("possible", bits ? where(bits, 0) : []);
    const shown = bits ? where(bits) : range(lattice.beams.length);
    this.draw([
      { name: "rule-auto", beams: shown.filter((k) => designable[k]) },
      { name: "rule-touch", beams: shown.filter((k) => !designable[k]) },
    ]);
    this.mark("node", range(lattice.positions.length));
    const held = (test: (hold: string) => boolean): number[] => view.held.filter(({ hold }) => test(hold)).flatMap(({ nodes }) => nodes);
    this.mark("support", held((hold) => hold === "all"));
    this.mark("roller", held((hold) => hold !== "all"));
    this.rollers.setAttribute("d", rollerLines(this.rest, held((hold) => hold === "x"), held((hold) => hold === "y")));
    this.markArrows(bits && this.movedTo?.length === this.rest.length ? this.movedTo : this.rest);
    this.arrowGroup.replaceChildren(...view.arrows.flatMap((each) => this.arrowMarks(each)));
    this.zoneGroup.replaceChildren(...view.zones.map(({ kind, shape }) => s("path", { class: `zone ${kind}`, d: shapePath(shape, view.built.part.scale) })));
    this.axes.setAttribute("d", mirrorAxes(middleOf(view.built), this.box, { x: view.symmetry.includes("x"), y: view.symmetry.includes("y") }));
    this.faults.replaceChildren(...view.faults.filter((node) => 2 * node < this.rest.length).map((node) =>
      s("circle", { cx: this.rest[2 * node]!, cy: -this.rest[2 * node + 1]!, r: 0.4 })));
  }

  /** Show the design in its deformed state. */
  showMoved(displacement: number[] | null, beams: number[]): void {
    const at = this.rest.slice();
    if (displacement) for (let k = 0; k < at.length; k++) at[k]! += displacement[k]!;
    this.movedTo = displacement ? at : null;
    this.response.setAttribute("d", displacement ? this.lines(beams, at) : "");
    if (displacement) this.makeRoom(beams, displacement);
    this.markArrows(at);
  }

  private markArrows(at: Float64Array): void {
    for (const [name, kind] of [["input", "inputs"], ["output", "outputs"], ["load", "loads"]] as const) {
      this.mark(name, this.view_!.arrows.filter(({ target }) => target.kind === kind).flatMap(({ nodes }) => nodes), at);
    }
  }

  private centre({ nodes }: Arrow): Point {
    let [x, y] = [0, 0];
    for (const node of nodes) { x += this.rest[2 * node]!; y += this.rest[2 * node + 1]!; }
    return [x / nodes.length, y / nodes.length];
  }

  private tip(each: Arrow): Point {
    const [x, y] = this.centre(each);
    const length = each.stroke === null ? 1.6 : Math.max(SHORTEST, STRETCH * each.stroke);
    return [x + each.direction[0] * length, y + each.direction[1] * length];
  }

  private arrowMarks(each: Arrow): SVGElement[] {
    if (!each.nodes.length) return [];
    const [from, tip] = [this.centre(each), this.tip(each)];
    const { target } = this.view_!;
    const isActive = target.kind === each.target.kind && target.index === each.target.index;
    const group = s("g", { class: `arrow ${each.target.kind}${isActive ? " active" : ""}` });
    if (each.turns) {
      group.append(s("path", { class: "shaft", d: turnArrow(from) }));
      return [group];
    }
    group.append(s("path", { class: "shaft", d: arrow(from, [tip[0] - from[0], tip[1] - from[1]]) }),
      s("circle", { class: "handle", cx: tip[0], cy: -tip[1], r: 0.42 }));
    return [group];
  }

  private get picksBeams(): boolean { return this.tool === "hand"; }
  private get picksNodes(): boolean { return this.tool !== "hand" && this.tool !== "zones"; }

  private handleAt(point: Point): Arrow | null {
    const reached = (this.view_?.arrows ?? []).filter((each) => {
      if (!each.nodes.length || each.turns) return false;
      const tip = this.tip(each);
      return Math.hypot(tip[0] - point[0], tip[1] - point[1]) < 0.45;
    });
    return reached.find(({ target }) => target.kind === this.tool) ?? reached[0] ?? null;
  }

  private down(event: PointerEvent): void {
    if (!this.view_ || event.button !== 0) return;
    const from = this.locate(event);
    this.svg.setPointerCapture(event.pointerId);
    const handle = this.picksNodes ? this.handleAt(from) : null;
    const base = { from, add: true, done: new Set<number>(), moved: false };
    if (handle) this.drag = { ...base, kind: "aim", arrow: handle };
    else if (this.tool === "zones") this.drag = { ...base, kind: "zone" };
    else if (this.picksBeams) {
      this.drag = { ...base, kind: "paint" };
      this.paint(from);
    } else this.drag = { ...base, kind: "box", add: !event.altKey };
  }

  private moved(event: PointerEvent): void {
    if (!this.view_) return;
    const at = this.locate(event);
    const drag = this.drag;
    if (!drag) {
      const handle = this.picksNodes ? this.handleAt(at) : null;
      this.svg.classList.toggle("on-handle", handle !== null);
      if (this.picksBeams) this.point(-1, this.nearestBeam(at));
      else this.point(handle || !this.picksNodes ? -1 : this.nearestNode(at), -1);
      return;
    }
    if (Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) > 0.25) {
      if (drag.kind === "aim") this.aim(drag.arrow!, at, event.shiftKey, drag.moved);
      drag.moved = true;
    }
    if (drag.kind === "paint") this.paint(at);
    if (drag.kind === "box" && drag.moved) this.stretch(boxShape(drag.from, at), 1);
    if (drag.kind === "zone" && drag.moved) this.stretch(this.zoneAt(drag.from, at), 1);
  }

  private up(event: PointerEvent): void {
    const drag = this.drag;
    if (!drag || !this.view_) return;
    const at = this.locate(event);
    this.drop();
    if (drag.kind === "zone" && drag.moved) this.actions.zone(this.zoneAt(drag.from, at));
    if (drag.kind !== "box" && !(drag.kind === "aim" && !drag.moved)) return; // a click on an arrow selects the node under it
    if (drag.moved) {
      const [x0, y0, x1, y1] = boxShape(drag.from, at).box as [number, number, number, number];
      const inside = range(this.rest.length / 2).filter((k) => {
        const [x, y] = [this.rest[2 * k]!, this.rest[2 * k + 1]!];
        return x >= x0 && x <= x1 && y >= y0 && y <= y1;
      });
      if (inside.length) this.actions.nodes(inside, drag.add);
    } else {
      this.toggleNode(this.nearestNode(at), this.rows || event.shiftKey);
    }
  }

  private zoneAt(from: Point, to: Point): Shape {
    return this.zoneShape === "box" ? boxShape(from, to) : { circle: from, radius: Math.hypot(to[0] - from[0], to[1] - from[1]) };
  }

  private drop(): void {
    this.drag = null;
    this.band.setAttribute("visibility", "hidden");
  }

  private double(event: MouseEvent): void {
    if (!this.picksNodes || !this.view_) return;
    // The two preceding clicks have toggled the node twice; this toggles its row.
    this.toggleNode(this.nearestNode(this.locate(event)), true);
  }

  /** Nodes of the active support, input, output or load. */
  private get active(): number[] {
    const { target, arrows, held } = this.view_!;
    if (target.kind === "supports") return held[target.index]?.nodes ?? [];
    return arrows.find((each) => each.target.kind === target.kind && each.target.index === target.index)?.nodes ?? [];
  }

  private toggleNode(node: number, row: boolean): void {
    if (node < 0 || !this.view_ || !this.picksNodes) return;
    const inside = this.active.includes(node);
    this.actions.nodes(row ? rowOf(this.view_.built.lattice.positions, node) : [node], !inside);
  }

  private paint(at: Point): void {
    const beam = this.nearestBeam(at, 0.3, this.rest);
    if (beam < 0 || !this.drag || this.drag.done.has(beam)) return;
    const merge = this.drag.done.size > 0;
    this.drag.done.add(beam);
    this.actions.beams([beam], merge);
  }

  private aim(each: Arrow, at: Point, fine: boolean, merge: boolean): void {
    const from = this.centre(each);
    const [dx, dy] = [at[0] - from[0], at[1] - from[1]];
    const angle = angleOf([dx, dy]);
    const length = Math.max(SHORTEST, Math.hypot(dx, dy));
    const stroke = each.stroke === null ? null : Math.round((length / STRETCH) * 200) / 200;
    this.actions.aim(each.target, directionAt(fine ? angle : Math.round(angle / 15) * 15), stroke, merge);
  }

  private stretch(shape: Shape, scale: number): void {
    this.band.setAttribute("visibility", "visible");
    this.band.setAttribute("d", shapePath(shape, scale));
  }

  private point(node: number, beam: number): void {
    this.hover.setAttribute("visibility", node >= 0 ? "visible" : "hidden");
    if (node >= 0) {
      this.hover.setAttribute("cx", String(this.rest[2 * node]));
      this.hover.setAttribute("cy", String(-this.rest[2 * node + 1]!));
    }
    this.hoverBeam.setAttribute("d", beam >= 0 ? this.lines([beam], this.rest) : "");
  }

  private key(event: KeyboardEvent): void {
    const keys: Record<string, Point> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const direction = keys[event.key];
    if (!this.view_ || event.ctrlKey || event.metaKey || this.tool === "zones") return;
    if (direction) {
      event.preventDefault();
      this.step(direction);
    } else if (event.key === " " || event.key === "Enter") {
      event.preventDefault();
      if (this.cursor < 0) this.step([0, 1]);
      else if (this.picksBeams) this.actions.beams([this.cursor], false);
      else this.toggleNode(this.cursor, event.shiftKey || this.rows);
    }
  }

  /** Move the cursor to the next node or beam in a direction. */
  private step(direction: Point): void {
    const beams = this.picksBeams;
    const total = beams ? this.beams.length : this.rest.length / 2;
    const place = (k: number): Point => {
      if (!beams) return [this.rest[2 * k]!, this.rest[2 * k + 1]!];
      const [a, b] = this.beams[k]!;
      return [(this.rest[2 * a]! + this.rest[2 * b]!) / 2, (this.rest[2 * a + 1]! + this.rest[2 * b + 1]!) / 2];
    };
    if (this.cursor >= total) this.cursor = -1;
    const found = nextInDirection(total, place, this.cursor, [this.box.x, -this.box.y - this.box.h], direction);
    this.cursor = found;
    this.point(beams ? -1 : found, beams ? found : -1);
    if (found >= 0) announce(describeTarget(this.view_!, this.tool, found));
  }
}

/** The box between two points. */
function boxShape([ax, ay]: Point, [bx, by]: Point): Shape {
  return { box: [Math.min(ax, bx), Math.min(ay, by), Math.max(ax, bx), Math.max(ay, by)] };
}
