// The drawing of the task, on which nodes and beams are selected and arrows are dragged.

import type { Point, Problem } from "./api";
import { angleOf, arrow, Drawing, isEach, range, unit, where } from "./drawing";
import { announce, s } from "./dom";
import { describeTarget, mirrorAxes, nextInDirection, rollerLines } from "./marks";
import { directionOf, nodesOf, rowOf, touching, type Region, type Rule, type Task } from "./task";

export type Tool = "supports" | "input" | "output" | "beams" | "hand";

/** Length of the arrow of the input, in strokes. */
export const STRETCH = 4;
const SHORTEST = 0.7;

export interface CanvasActions {
  nodes(region: Region, nodes: number[], add: boolean, merge: boolean): void;
  beams(beams: number[], merge: boolean): void;
  aim(region: "input" | "output", direction: Point, amount: number | null, merge: boolean): void;
}

export class Canvas extends Drawing {
  tool: Tool = "supports";
  rows = false;
  private task: Task | null = null;
  private bits: Uint8Array = new Uint8Array(0);
  private cursor = -1;
  private movedTo: Float64Array | null = null;
  private drag: { kind: "box" | "paint" | "aim"; from: Point; region?: "input" | "output"; add: boolean; done: Set<number>; moved: boolean } | null = null;
  private readonly hover = s("circle", { class: "hover", r: 0.24, visibility: "hidden" });
  private readonly hoverBeam = s("path", { class: "hover-beam" });
  private readonly band = s("rect", { class: "band", visibility: "hidden" });
  private readonly faults = s("g", { class: "faults" });
  private readonly arrows = { input: s("g", { class: "arrow input" }), output: s("g", { class: "arrow output" }) };
  private readonly response = s("path", { class: "beam response" });
  private readonly axes = s("path", { class: "axis" });
  private readonly rollers = s("path", { class: "rollers" });

  constructor(private readonly actions: CanvasActions) {
    super("The task: a lattice with supports, input and output");
    this.svg.setAttribute("role", "application");
    this.svg.setAttribute("tabindex", "0");
    this.svg.setAttribute("aria-roledescription", "drawing");
    this.svg.classList.add("canvas");
    this.svg.insertBefore(this.response, this.dots);
    this.overlay.append(this.rollers, this.axes, this.hoverBeam, this.hover, this.band, this.faults);
    this.svg.insertBefore(this.arrows.output, this.dots);
    this.svg.insertBefore(this.arrows.input, this.dots);
    this.svg.addEventListener("pointerdown", (event) => this.down(event));
    this.svg.addEventListener("pointermove", (event) => this.moved(event));
    this.svg.addEventListener("pointerup", (event) => this.up(event));
    this.svg.addEventListener("pointercancel", () => this.drop());
    this.svg.addEventListener("pointerleave", () => this.point(-1, -1));
    this.svg.addEventListener("dblclick", (event) => this.double(event));
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.svg.addEventListener("blur", () => this.point(-1, -1));
  }

  /** Show a task; `bits` are the present beams of the design drawn by hand, if there is one. */
  show(task: Task, problem: Problem, bits: Uint8Array | null, fault: number[] = []): void {
    const changed = this.task?.problem.positions !== task.problem.positions || this.task?.problem.beams !== task.problem.beams;
    this.task = task;
    if (changed) {
      this.setLattice(problem.positions, problem.beams);
      this.cursor = -1;
    }
    this.at = this.rest;
    const groups: Record<Rule | "touch" | "absent", number[]> = { auto: [], keep: [], never: [], free: [], touch: [], absent: [] };
    const touches = touching(problem);
    if (bits) {
      this.bits = bits;
      this.ghost("possible", where(bits, 0));
      for (const k of where(bits)) groups[touches[k] ? "touch" : "auto"].push(k);
    } else {
      this.ghost("possible", []);
      task.rules.forEach((rule, k) => groups[rule === "auto" && touches[k] ? "touch" : rule].push(k));
    }
    this.draw(Object.entries(groups).map(([name, beams]) => ({ name: `rule-${name}`, beams })));
    this.mark("node", range(problem.positions.length));
    const { fixed, fixed_x, fixed_y } = problem.supports;
    this.mark("support", fixed);
    this.mark("roller", [...fixed_x, ...fixed_y]);
    const at = bits && this.movedTo?.length === this.rest.length ? this.movedTo : this.rest;
    this.mark("input", problem.input.nodes, at);
    this.mark("output", problem.output.nodes, at);
    this.showRollers(fixed_x, fixed_y);
    this.showArrow("input");
    this.showArrow("output");
    this.showAxes();
    this.showFaults(fault);
  }

  /** Show the design in its deformed state. */
  showMoved(displacement: number[] | null, beams: number[]): void {
    const at = this.rest.slice();
    if (displacement) for (let k = 0; k < at.length; k++) at[k]! += displacement[k]!;
    this.movedTo = displacement ? at : null;
    this.response.setAttribute("d", displacement ? this.lines(beams, at) : "");
    const { problem } = this.task!;
    this.mark("input", problem.input.nodes, at);
    this.mark("output", problem.output.nodes, at);
  }

  private showRollers(along_y: number[], along_x: number[]): void {
    this.rollers.setAttribute("d", rollerLines(this.rest, along_y, along_x));
  }

  private centre(region: "input" | "output"): Point | null {
    const nodes = this.task ? this.task.problem[region].nodes : [];
    if (!nodes.length) return null;
    let [x, y] = [0, 0];
    for (const node of nodes) { x += this.rest[2 * node]!; y += this.rest[2 * node + 1]!; }
    return [x / nodes.length, y / nodes.length];
  }

  private tip(region: "input" | "output"): Point | null {
    const from = this.centre(region);
    if (!from || !this.task) return null;
    const at = this.task.problem[region];
    const [dx, dy] = directionOf(at);
    const length = region === "input" && this.task.problem.input.drive === "displacement"
      ? Math.max(SHORTEST, STRETCH * this.task.problem.input.amount) : 1.6;
    return [from[0] + dx * length, from[1] + dy * length];
  }

  private showArrow(region: "input" | "output"): void {
    const group = this.arrows[region];
    group.replaceChildren();
    const [from, tip] = [this.centre(region), this.tip(region)];
    if (!from || !tip || !this.task) return;
    const { direction, nodes } = this.task.problem[region];
    if (isEach(direction)) {
      direction.forEach(([dx, dy], k) => {
        const node = nodes[k]!;
        const start: Point = [this.rest[2 * node]!, this.rest[2 * node + 1]!];
        group.append(s("path", { class: "shaft small", d: arrow(start, [0.8 * dx, 0.8 * dy], 0.24) }));
      });
      return;
    }
    const d = arrow(from, [tip[0] - from[0], tip[1] - from[1]]);
    group.append(s("path", { class: "shaft", d }));
    group.append(s("circle", { class: "handle", cx: tip[0], cy: -tip[1], r: 0.42 }));
  }

  private showAxes(): void {
    const { problem, mirror } = this.task!;
    const beams = problem.designable.length ? problem.designable : range(this.beams.length);
    this.axes.setAttribute("d", mirrorAxes(this.rest, beams.map((k) => this.beams[k]!), this.box, mirror));
  }

  private showFaults(nodes: number[]): void {
    this.faults.replaceChildren(...nodes.filter((node) => 2 * node < this.rest.length).map((node) =>
      s("circle", { cx: this.rest[2 * node]!, cy: -this.rest[2 * node + 1]!, r: 0.4 })));
  }

  private get picksBeams(): boolean { return this.tool === "beams" || this.tool === "hand"; }

  private handleAt(point: Point): "input" | "output" | null {
    for (const region of [this.tool === "output" ? "output" : "input", this.tool === "output" ? "input" : "output"] as const) {
      const tip = this.tip(region);
      if (!tip || isEach(this.task!.problem[region].direction)) continue;
      if (Math.hypot(tip[0] - point[0], tip[1] - point[1]) < 0.45) return region;
    }
    return null;
  }

  private down(event: PointerEvent): void {
    if (!this.task || event.button !== 0) return;
    const from = this.locate(event);
    this.svg.setPointerCapture(event.pointerId);
    const handle = this.picksBeams ? null : this.handleAt(from);
    if (handle) {
      this.drag = { kind: "aim", from, region: handle, add: true, done: new Set(), moved: false };
    } else if (this.picksBeams) {
      this.drag = { kind: "paint", from, add: true, done: new Set(), moved: false };
      this.paint(from);
    } else {
      this.drag = { kind: "box", from, add: !event.altKey, done: new Set(), moved: false };
    }
  }

  private moved(event: PointerEvent): void {
    if (!this.task) return;
    const at = this.locate(event);
    const drag = this.drag;
    if (!drag) {
      const handle = this.picksBeams ? null : this.handleAt(at);
      this.svg.classList.toggle("on-handle", handle !== null);
      if (this.picksBeams) this.point(-1, this.nearestBeam(at));
      else this.point(handle ? -1 : this.nearestNode(at), -1);
      return;
    }
    if (Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) > 0.25) {
      if (drag.kind === "aim") this.aim(drag.region!, at, event.shiftKey, drag.moved);
      drag.moved = true;
    }
    if (drag.kind === "paint") this.paint(at);
    if (drag.kind === "box" && drag.moved) this.stretch(drag.from, at);
  }

  private up(event: PointerEvent): void {
    const drag = this.drag;
    if (!drag || !this.task) return;
    const at = this.locate(event);
    this.drop();
    if (drag.kind !== "box") return;
    const region = this.tool as Region;
    if (drag.moved) {
      const [x0, x1] = [Math.min(at[0], drag.from[0]), Math.max(at[0], drag.from[0])];
      const [y0, y1] = [Math.min(at[1], drag.from[1]), Math.max(at[1], drag.from[1])];
      const inside = range(this.rest.length / 2).filter((k) => {
        const [x, y] = [this.rest[2 * k]!, this.rest[2 * k + 1]!];
        return x >= x0 && x <= x1 && y >= y0 && y <= y1;
      });
      if (inside.length) this.actions.nodes(region, inside, drag.add, false);
    } else {
      this.toggleNode(this.nearestNode(at), this.rows || event.shiftKey);
    }
  }

  private drop(): void {
    this.drag = null;
    this.band.setAttribute("visibility", "hidden");
  }

  private double(event: MouseEvent): void {
    if (this.picksBeams || !this.task) return;
    // The two preceding clicks have toggled the node twice; this toggles its row.
    this.toggleNode(this.nearestNode(this.locate(event)), true);
  }

  private toggleNode(node: number, row: boolean): void {
    if (node < 0 || !this.task || this.picksBeams) return;
    const region = this.tool as Region;
    const inside = nodesOf(this.task.problem, region).includes(node);
    this.actions.nodes(region, row ? rowOf(this.task.problem, node) : [node], !inside, false);
  }

  private paint(at: Point): void {
    const beam = this.nearestBeam(at);
    if (beam < 0 || !this.drag || this.drag.done.has(beam)) return;
    const merge = this.drag.done.size > 0;
    this.drag.done.add(beam);
    this.actions.beams([beam], merge);
  }

  private aim(region: "input" | "output", at: Point, fine: boolean, merge: boolean): void {
    const from = this.centre(region)!;
    const [dx, dy] = [at[0] - from[0], at[1] - from[1]];
    const angle = angleOf([dx, dy]);
    const length = Math.max(SHORTEST, Math.hypot(dx, dy));
    const amount = region === "input" && this.task!.problem.input.drive === "displacement"
      ? Math.round((length / STRETCH) * 200) / 200 : null;
    this.actions.aim(region, unit(fine ? angle : Math.round(angle / 15) * 15), amount, merge);
  }

  private stretch(from: Point, to: Point): void {
    this.band.setAttribute("visibility", "visible");
    this.band.setAttribute("x", String(Math.min(from[0], to[0])));
    this.band.setAttribute("y", String(-Math.max(from[1], to[1])));
    this.band.setAttribute("width", String(Math.abs(to[0] - from[0])));
    this.band.setAttribute("height", String(Math.abs(to[1] - from[1])));
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
    if (!this.task || event.ctrlKey || event.metaKey) return;
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
    if (found >= 0) announce(describeTarget(this.task!, this.tool, this.bits, found));
  }
}
