// What the drawing shows of a task; types only.

import type { Point } from "./api";
import type { Built, Shape, Target, Tool, ZoneKind, ZoneShape } from "./task";

/** An input, output or load of the shown load case. */
export interface Arrow { target: Target; nodes: number[]; direction: Point; /** Whether it turns, whatever its direction. */ turns: boolean; /** Displacement, lattice units. */ stroke: number | null }

/** What the drawing shows of a task. */
export interface View {
  built: Built;
  held: { nodes: number[]; hold: string; active: boolean }[];
  arrows: Arrow[];
  target: Target;
  zones: { kind: ZoneKind; shape: Shape }[];
  /** Whether each beam may be removed. */
  designable: Uint8Array;
  symmetry: string;
  /** Present beams of the design drawn by hand, if there is one. */
  bits: Uint8Array | null;
  faults: number[];
}

/** The drawing of a task, in the plane or in space. */
export interface TaskDrawing {
  readonly element: Element;
  tool: Tool;
  /** Whether a click selects the whole row or layer of a node. */
  rows: boolean;
  zoneShape: ZoneShape;
  show(view: View): void;
  /** Show the design in its deformed state. */
  showMoved(displacement: number[] | null, beams: number[]): void;
  close(): void;
}
