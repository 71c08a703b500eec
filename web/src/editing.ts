// The interface of the task editor that its panels use; types only.

import type { ItemState, Registries } from "./api";
import type { Built, Hold, Table, Target, Task, Tool, ZoneKind, ZoneShape } from "./task";

/** Settings of a search. */
export interface Settings { method: string; steps: number; chains: number; seed: number; /** Whether it begins with the design drawn by hand. */ fromHand: boolean }

/** Why there is no problem: the message of the server, and as the page writes it. */
export interface Fault { key: string; message: string; text: string }

export interface TaskEditor {
  readonly task: Task;
  readonly built: Built | null;
  readonly tool: Tool;
  readonly fault: Fault | null;
  readonly registries: Registries | null;
  /** Key of the first table that has no nodes. */
  readonly missing: string | null;
  /** Number of the load case that is shown. */
  readonly loadCase: number;
  /** Table whose nodes are selected in the drawing. */
  readonly target: Target;
  hold: Hold;
  zone: { kind: ZoneKind; shape: ZoneShape };
  settings: Settings;
  choose(tool: Tool): void;
  aimAt(target: Target): void;
  showCase(loadCase: number): void;
  /** Replace the table of the task by a changed one. */
  change(table: Table, merge?: boolean): void;
  /** Replace the task by another one. */
  open(task: Task): void;
  /** Items that the design drawn by hand reaches. */
  readonly reached: ItemState[] | null;
  /** Whether a design is drawn by hand that is not the full lattice. */
  readonly hasHandDesign: boolean;
  /** Number of the support with the chosen hold; of a new one if there is none. */
  supportIndex(): number;
  setRows(rows: boolean): void;
  restoreBeams(): void;
  startSearch(): Promise<void>;
  saveHandDesign(title: string): Promise<void>;
  refineHandDesign(): Promise<void>;
  save(): Promise<void>;
  /** Create a link to the task and return the text that the button shows then. */
  link(): Promise<string>;
  /** Open a file with a task or a design. */
  load(file: File): Promise<void>;
  /** Read the outline of the domain from a DXF or SVG file. */
  loadOutline(file: File): Promise<void>;
}
