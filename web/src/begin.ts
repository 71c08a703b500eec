// The task that is shown first, and where the current one is stored: each tab has its own.

import { get } from "./api";
import type { Settings } from "./editing";
import { fromLink, isTask, type Table, type Task } from "./task";

/** Key of the current task in the storages of the browser. */
export const TASK_KEY = "bellcrank-task";
const HISTORY_KEY = "bellcrank-history";
const SETTINGS_KEY = "bellcrank-settings";
const SETTINGS: Settings = { method: "", steps: 8000, chains: 2, seed: 0, fromHand: false };

/** A task of one load case without supports, inputs and outputs. */
export function emptyTask(): Task {
  return { table: { name: "my part", domain: { size: [82, 72] }, supports: [], cases: [{ inputs: [], outputs: [] }] }, hand: null };
}

/** A box in space of one load case without supports, inputs and outputs. */
export function emptySpaceTask(): Task {
  return { table: { name: "my part", domain: { size: [45, 17, 45] }, supports: [], cases: [{ inputs: [], outputs: [] }] }, hand: null };
}

/** A rectangle that is held at the bottom and pushed down at the upper right; its output is at the upper left. */
export function exampleTask(): Task {
  return {
    table: {
      name: "my part", domain: { size: [82, 72] }, supports: [{ at: [{ edge: "bottom" }] }],
      cases: [{
        inputs: [{ at: [{ point: [76, 70] }, { point: [66, 70] }], direction: "down", displacement: 3 }],
        outputs: [{ at: [{ point: [6, 70] }, { point: [16, 70] }], direction: "left", gain: [{ maximise: true }], off_axis: [{ at_most: "10%" }], rotation: [{ value: "5 deg" }], dead_load: [{ at_least: "10 g" }], sag: [{ at_most: "10%" }] }],
      }],
    },
    hand: null,
  };
}

/** Return the task of a link, else that of this tab, else the latest one, else an example. */
export async function firstTask(link: string): Promise<Task> {
  if (link) {
    try {
      const given = await fromLink(link);
      if (isTask(given)) return given;
    } catch { /* not a link to a task: ignored */ }
  }
  for (const storage of [sessionStorage, localStorage]) {
    try {
      const stored = JSON.parse(storage.getItem(TASK_KEY) ?? "null") as unknown;
      if (isTask(stored)) return stored;
    } catch { /* the stored text is no task: ignored */ }
  }
  return exampleTask();
}

export async function bundledTask(name: string): Promise<Task> {
  return { table: await get<Table>(`/tasks/${name}`), hand: null };
}

/** Store the task and the steps before it; the steps are left out if the storage is full. */
export function store(task: Task, history: { past: string[]; future: string[] }): void {
  const text = JSON.stringify(task);
  for (const work of [
    () => sessionStorage.setItem(TASK_KEY, text),
    () => localStorage.setItem(TASK_KEY, text),
    () => sessionStorage.setItem(HISTORY_KEY, JSON.stringify(history)),
  ]) {
    try { work(); } catch { sessionStorage.removeItem(HISTORY_KEY); }
  }
}

export function storedHistory(): { past: string[]; future: string[] } | null {
  try {
    return JSON.parse(sessionStorage.getItem(HISTORY_KEY) ?? "null") as { past: string[]; future: string[] } | null;
  } catch {
    return null;
  }
}

/** Make a task the current one of this tab; undo returns to the one before. */
export function openTask(task: Task): void {
  const before = sessionStorage.getItem(TASK_KEY) ?? localStorage.getItem(TASK_KEY);
  const history = storedHistory() ?? { past: [], future: [] };
  store(task, { past: before ? [...history.past, before] : history.past, future: [] });
}

/** Settings of the latest search of this tab, else of any. */
export function storedSettings(): Settings {
  try {
    return { ...SETTINGS, ...JSON.parse(sessionStorage.getItem(SETTINGS_KEY) ?? localStorage.getItem(SETTINGS_KEY) ?? "{}") as Partial<Settings>, fromHand: false };
  } catch {
    return SETTINGS;
  }
}

export function storeSettings(settings: Settings): void {
  try {
    // Each tab keeps its own settings; a new one begins with those that were stored last.
    for (const storage of [sessionStorage, localStorage]) storage.setItem(SETTINGS_KEY, JSON.stringify(settings));
  } catch { /* the storage is full: the settings hold for this page only */ }
}
