// The interface of the task editor that its panels use; types only.

import type { Registries, Response, Point, Problem } from "./api";
import type { Tool } from "./canvas";
import type { Hold, Region, Task } from "./task";

export type Brush = "keep" | "never" | "auto";

/** Settings of a search; `forPart` searches frames with struts of a width in mm, else the spring model. */
export interface Settings { method: string; steps: number; chains: number; seed: number; forPart: boolean; width: number; material: string }

export interface Fault { key: string; message: string }

export interface TaskEditor {
  readonly task: Task;
  readonly problem: Problem;
  readonly tool: Tool;
  readonly fault: Fault | null;
  readonly response: Response | null;
  readonly registries: Registries | null;
  /** The first region that has no nodes, and a message that names it. */
  readonly missing: { region: Region; message: string } | null;
  hold: Hold;
  brush: Brush;
  settings: Settings;
  choose(tool: Tool): void;
  /** Replace the task by a changed one. */
  set(task: Task, merge?: boolean): void;
  /** Replace the task by another one. */
  open(task: Task): void;
  selectRows(rows: boolean): void;
  clearRegion(region: Region): void;
  setDirection(region: "input" | "output", direction: Point): void;
  change(region: "input" | "output", changes: Record<string, unknown>): void;
  /** Evaluate again after a change of the part. */
  updateModel(): void;
  startSearch(): Promise<void>;
  saveHandDesign(title: string): Promise<void>;
  save(suffix: ".toml" | ".json"): Promise<void>;
  /** Create a link to the task and return the text that the button shows then. */
  link(): Promise<string>;
  load(file: File): Promise<void>;
}
