// A lattice as SVG: few paths of many beams, which can be redrawn sixty times a second.

import type { Point, Problem } from "./api";
import { s } from "./dom";

export interface Group { name: string; beams: ArrayLike<number> }

export interface Box { x: number; y: number; w: number; h: number }

export const BINS = 12;

/** Flatten positions to x and y of each node in turn. */
function flatten(positions: Point[]): Float64Array {
  const flat = new Float64Array(2 * positions.length);
  positions.forEach(([x, y], k) => { flat[2 * k] = x; flat[2 * k + 1] = y; });
  return flat;
}

/** Size of the struts in lattice units. */
export interface Section { width: number; widths?: number[] | null; thickness?: number }

/** Struts of a problem; those of the spring model are drawn with a usual width. */
export function sectionOf({ section, widths }: Pick<Problem, "section" | "widths">): Section {
  return { width: section?.diameter ?? section?.width ?? 0.2, widths, thickness: section?.thickness ?? 0.5 };
}

/** A drawing of a lattice whose nodes move, flat or in space. */
export interface LatticeDrawing {
  readonly element: Element;
  /** Coordinates of all nodes in turn: at rest, and as drawn. */
  rest: Float64Array;
  at: Float64Array;
  setLattice(positions: Point[], beams: [number, number][]): void;
  /** Give the same lattice another geometry, in the same view. */
  setGeometry(positions: Point[], section: Section): void;
  draw(groups: Group[]): void;
  ghost(name: string, beams: ArrayLike<number>): void;
  mark(name: string, nodes: ArrayLike<number>): void;
  makeRoom(beams: ArrayLike<number>, displacement: ArrayLike<number>): void;
  /** Draw the paths of outputs, each from rest to the full stroke. */
  trace(paths: number[][][]): void;
  /** The beam next to the pointer; -1 for none. */
  beamAt(event: { clientX: number; clientY: number }): number;
  close(): void;
}

export class Drawing implements LatticeDrawing {
  readonly svg: SVGSVGElement;
  readonly overlay: SVGGElement;
  private readonly under: SVGGElement;
  private readonly layer: SVGGElement;
  protected readonly dots: SVGGElement;
  private readonly paths = new Map<string, SVGPathElement>();
  private readonly marks = new Map<string, SVGPathElement>();
  rest: Float64Array = new Float64Array(0);
  at: Float64Array = new Float64Array(0);
  beams: [number, number][] = [];
  /** Bounds of the lattice at rest, with a margin; `view` is the visible region. */
  box: Box = { x: 0, y: 0, w: 10, h: 10 };
  private view: Box = this.box;
  private readonly dims = s("g", { class: "dims", "aria-hidden": "true" });
  private readonly outline = s("path", { class: "printed", "fill-rule": "evenodd", "aria-hidden": "true" });
  private readonly screws = s("path", { class: "screw", "aria-hidden": "true" });
  private readonly path_ = s("path", { class: "output-path", "aria-hidden": "true" });

  constructor(label: string) {
    this.svg = s("svg", { class: "drawing", role: "img", "aria-label": label, preserveAspectRatio: "xMidYMid meet" });
    this.under = s("g", { class: "under" });
    this.layer = s("g", { class: "beams" });
    this.dots = s("g", { class: "dots" });
    this.overlay = s("g", { class: "overlay" });
    this.svg.append(this.under, this.layer, this.dots, this.overlay);
    this.overlay.append(this.path_);
  }

  get element(): SVGSVGElement { return this.svg; }
  close(): void { /* nothing is held */ }

  setLattice(positions: Point[], beams: [number, number][], margin = 1.1): void {
    this.rest = flatten(positions);
    this.at = this.rest;
    this.beams = beams;
    let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const [x, y] of positions) {
      x0 = Math.min(x0, x); x1 = Math.max(x1, x);
      y0 = Math.min(y0, y); y1 = Math.max(y1, y);
    }
    this.box = { x: x0 - margin, y: -y1 - margin, w: x1 - x0 + 2 * margin, h: y1 - y0 + 2 * margin };
    this.setView(this.box);
  }

  setGeometry(positions: Point[]): void {
    this.rest = flatten(positions);
    this.at = this.rest;
  }

  /** Enlarge the view, if necessary, so that displaced beams are inside. */
  makeRoom(beams: ArrayLike<number>, displacement: ArrayLike<number>, margin = 0.6): void {
    this.enlarge(Array.from(beams).flatMap((beam) => this.beams[beam]!.map((node): Point =>
      [this.rest[2 * node]! + displacement[2 * node]!, this.rest[2 * node + 1]! + displacement[2 * node + 1]!])), margin);
  }

  /** Enlarge the view, if necessary, so that points are inside. */
  private enlarge(points: Point[], margin = 0.6): void {
    const { x, y, w, h } = this.view;
    let [x0, y0, x1, y1] = [x, y, x + w, y + h];
    for (const [px, py] of points) {
      x0 = Math.min(x0, px - margin); x1 = Math.max(x1, px + margin);
      y0 = Math.min(y0, -py - margin); y1 = Math.max(y1, -py + margin);
    }
    this.setView({ x: x0, y: y0, w: x1 - x0, h: y1 - y0 });
  }

  private setView(view: Box): void {
    this.view = view;
    this.svg.setAttribute("viewBox", `${view.x} ${view.y} ${view.w} ${view.h}`);
    thicken(this.svg, view.w);
  }

  /**
   * Write width and height of the lattice at rest beside it, below and on the right, or on the other
   * side where there are marks; `scale` is the length of a unit in mm.
   */
  dimensions(scale: number, marks: Point[] = []): void {
    if (!this.dims.parentNode) this.under.append(this.dims);
    const [x0, x1] = [least(this.rest, 0), most(this.rest, 0)];
    const [y0, y1] = [-least(this.rest, 1), -most(this.rest, 1)];
    const text = (length: number): string => `${(length * scale).toFixed(length * scale < 100 ? 1 : 0).replace(/\.0$/, "")} mm`;
    const isFree = (isOutside: (x: number, y: number) => boolean): boolean => !marks.some(([x, y]) => isOutside(x, -y));
    const row = isFree((_, y) => y > y0 + 0.3) || !isFree((_, y) => y < y1 - 0.3) ? y0 + 0.85 : y1 - 0.85;
    const column = isFree((x) => x > x1 + 0.3) || !isFree((x) => x < x0 - 0.3) ? x1 + 0.85 : x0 - 0.85;
    const size = 0.028 * Math.max(this.view.h, this.view.w / 1.5);
    this.dims.style.fontSize = `${size.toFixed(3)}px`;
    this.dims.replaceChildren(
      s("path", { d: `M${x0} ${row}H${x1}M${x0} ${row - 0.15}v0.3M${x1} ${row - 0.15}v0.3M${column} ${y0}V${y1}M${column - 0.15} ${y0}h0.3M${column - 0.15} ${y1}h0.3` }),
      s("text", { x: (x0 + x1) / 2, y: row + size / 3, "text-anchor": "middle" }, text(x1 - x0)),
      s("text", { x: column, y: (y0 + y1) / 2, "text-anchor": "middle", transform: `rotate(-90 ${column} ${(y0 + y1) / 2}) translate(0 ${(size / 3).toFixed(3)})` }, text(y0 - y1)));
  }

  trace(paths: number[][][]): void {
    this.path_.setAttribute("d", paths.flatMap((path) => path.map(([x, y], k) => `${k ? "L" : "M"}${x!.toFixed(3)} ${(-y!).toFixed(3)}`)).join(""));
  }

  beamAt(event: { clientX: number; clientY: number }): number { return this.nearestBeam(this.locate(event), 0.4); }

  lines(beams: ArrayLike<number>, at: Float64Array = this.at): string {
    let d = "";
    for (let k = 0; k < beams.length; k++) {
      const beam = this.beams[beams[k]!]!;
      const a = 2 * beam[0];
      const b = 2 * beam[1];
      d += `M${at[a]!.toFixed(3)} ${(-at[a + 1]!).toFixed(3)}L${at[b]!.toFixed(3)} ${(-at[b + 1]!).toFixed(3)}`;
    }
    return d;
  }

  /** Draw groups of beams at the current positions; other groups are cleared. */
  draw(groups: Group[]): void {
    const named = new Set<string>();
    for (const { name, beams } of groups) {
      named.add(name);
      this.path(name).setAttribute("d", this.lines(beams));
    }
    for (const [name, path] of this.paths) {
      if (!named.has(name) && path.parentNode === this.layer) path.setAttribute("d", "");
    }
  }

  /** Draw beams at rest below all other elements. */
  ghost(name: string, beams: ArrayLike<number>): void {
    const key = `under-${name}`;
    let path = this.paths.get(key);
    if (!path) {
      path = s("path", { class: `beam ${name}` });
      this.paths.set(key, path);
      this.under.append(path);
    }
    path.setAttribute("d", this.lines(beams, this.rest));
  }

  /** Fill an outline at rest below the beams, draw its holes for screws above them, and make room for all. */
  printed(loops: Point[][], screws: Point[][]): void {
    if (!this.outline.parentNode) {
      this.under.prepend(this.outline);
      this.overlay.append(this.screws);
    }
    const closed = (loop: Point[]): string => `M${loop.map(([x, y]) => `${x.toFixed(3)} ${(-y).toFixed(3)}`).join("L")}Z`;
    this.outline.setAttribute("d", loops.map(closed).join(""));
    this.screws.setAttribute("d", screws.map(closed).join(""));
    this.enlarge(loops.flat());
  }

  path(name: string): SVGPathElement {
    let path = this.paths.get(name);
    if (!path) {
      path = s("path", { class: `beam ${name}` });
      this.paths.set(name, path);
      this.layer.append(path);
    }
    return path;
  }

  /** Mark nodes with dots of one class. */
  mark(name: string, nodes: ArrayLike<number>, at: Float64Array = this.at): void {
    let path = this.marks.get(name);
    if (!path) {
      path = s("path", { class: `dot ${name}` });
      this.marks.set(name, path);
      this.dots.append(path);
    }
    let d = "";
    for (let k = 0; k < nodes.length; k++) {
      const n = 2 * nodes[k]!;
      d += `M${at[n]!.toFixed(3)} ${(-at[n + 1]!).toFixed(3)}h0`;
    }
    path.setAttribute("d", d);
  }

  /** Position of the pointer in lattice units. */
  locate(event: { clientX: number; clientY: number }): Point {
    const matrix = this.svg.getScreenCTM();
    if (!matrix) return [0, 0];
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
    return [point.x, -point.y];
  }

  nearestNode([x, y]: Point, reach = 0.6): number {
    let found = -1;
    let best = reach * reach;
    for (let k = 0; k < this.at.length; k += 2) {
      const distance = (this.at[k]! - x) ** 2 + (this.at[k + 1]! - y) ** 2;
      if (distance < best) { best = distance; found = k / 2; }
    }
    return found;
  }

  nearestBeam([x, y]: Point, reach = 0.3, at: Float64Array = this.at): number {
    let found = -1;
    let best = reach;
    this.beams.forEach(([a, b], k) => {
      const [ax, ay, bx, by] = [at[2 * a]!, at[2 * a + 1]!, at[2 * b]!, at[2 * b + 1]!];
      const [dx, dy] = [bx - ax, by - ay];
      const t = Math.min(0.85, Math.max(0.15, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
      const distance = Math.hypot(ax + t * dx - x, ay + t * dy - y);
      if (distance < best) { best = distance; found = k; }
    });
    return found;
  }
}

function least(flat: ArrayLike<number>, axis: number): number {
  let found = Infinity;
  for (let k = axis; k < flat.length; k += 2) found = Math.min(found, flat[k]!);
  return found;
}

function most(flat: ArrayLike<number>, axis: number): number {
  let found = -Infinity;
  for (let k = axis; k < flat.length; k += 2) found = Math.max(found, flat[k]!);
  return found;
}

/** Mark supports, inputs and outputs of a problem, those of all load cases. */
export function markRegions(drawing: Pick<LatticeDrawing, "mark">, { supports, input, output, specification }: Problem): void {
  const cases = specification?.cases ?? [];
  const outputs = [specification?.outputs ?? {}, ...cases.map((each) => each.outputs)].flatMap((each) => Object.values(each));
  drawing.mark("support", [...supports.fixed, ...supports.fixed_x, ...supports.fixed_y, ...(supports.fixed_z ?? [])]);
  drawing.mark("input", [...new Set([input, ...cases.map((each) => each.input)].flatMap(({ nodes }) => nodes))]);
  drawing.mark("output", [...new Set([output, ...outputs].flatMap(({ nodes }) => nodes))]);
}

/** Make lines thicker in a picture of a large lattice; `width` is the visible width in beam lengths. */
export function thicken(svg: SVGElement, width: number, usual = 32): void {
  svg.style.setProperty("--thick", Math.min(2, Math.max(1, width / usual)).toFixed(2));
}

export function range(length: number): number[] {
  return Array.from({ length }, (_, k) => k);
}

export function where(bits: ArrayLike<number>, value = 1): number[] {
  const found: number[] = [];
  for (let k = 0; k < bits.length; k++) if (bits[k] === value) found.push(k);
  return found;
}

/** Group beams by colour according to a fraction from 0 to 1 of each. */
export function binned(beams: number[], share: ArrayLike<number>, prefix = "heat"): Group[] {
  const groups: number[][] = Array.from({ length: BINS }, () => []);
  for (const beam of beams) {
    const bin = Math.min(BINS - 1, Math.max(0, Math.floor(Math.sqrt(share[beam]!) * BINS)));
    groups[bin]!.push(beam);
  }
  return groups.map((found, bin) => ({ name: `${prefix}-${bin}`, beams: found }));
}

export function unit(angle: number): Point {
  const round = (v: number): number => Math.round(v * 1e15) / 1e15;
  return [round(Math.cos((angle * Math.PI) / 180)), round(Math.sin((angle * Math.PI) / 180))];
}

export function angleOf([x, y]: Point): number {
  return (Math.round((Math.atan2(y, x) * 180) / Math.PI) + 360) % 360;
}

export function isEach(direction: Point | Point[]): direction is Point[] {
  return Array.isArray(direction[0]);
}

/** An arrow from one point along a vector, as a path with its head. */
export function arrow([x, y]: Point, [dx, dy]: Point, head = 0.34): string {
  const length = Math.hypot(dx, dy) || 1;
  const [ux, uy] = [dx / length, dy / length];
  const [tx, ty] = [x + dx, y + dy];
  const size = Math.min(head, 0.6 * length);
  const side = (sign: number): string => {
    const px = tx - size * (ux - sign * 0.55 * uy);
    const py = ty - size * (uy + sign * 0.55 * ux);
    return `${px.toFixed(3)} ${(-py).toFixed(3)}`;
  };
  return `M${x.toFixed(3)} ${(-y).toFixed(3)}L${tx.toFixed(3)} ${(-ty).toFixed(3)}M${side(1)}L${tx.toFixed(3)} ${(-ty).toFixed(3)}L${side(-1)}`;
}

/** Three quarters of a turn about a point, counter-clockwise, as a path with its head. */
export function turnArrow([x, y]: Point, radius = 0.9): string {
  return `M${x} ${-y - radius}A${radius} ${radius} 0 1 0 ${x + radius} ${-y}M${x + radius - 0.25} ${-y + 0.3}L${x + radius} ${-y}L${x + radius + 0.25} ${-y + 0.3}`;
}
