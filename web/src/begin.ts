// The task that is shown first: from a link, from the last visit, or an example.

import { get, hexOf, post, type Problem } from "./api";
import { isEach } from "./drawing";
import { fromLink, isTask, taskOf, type Task } from "./task";

/** Key of the current task in the storage of the browser. */
export const TASK_KEY = "bellcrank-task";

/** A task on a lattice without supports, input and output. */
export function emptyTask(lattice: Pick<Problem, "positions" | "beams">, table: Record<string, unknown> | null, like: Task): Task {
  const { input, output } = like.problem;
  const problem: Problem = {
    ...like.problem, ...lattice,
    supports: { fixed: [], fixed_x: [], fixed_y: [] },
    input: { ...input, nodes: [], direction: isEach(input.direction) ? [0, -1] : input.direction },
    output: { ...output, nodes: [], direction: isEach(output.direction) ? [-1, 0] : output.direction },
    designable: [], initial: hexOf(new Uint8Array(lattice.beams.length).fill(1)),
  };
  return { ...like, problem, lattice: table, rules: lattice.beams.map(() => "auto"), hand: null };
}

/** Return the task of a link, else the stored one, else an example that can be searched. */
export async function firstTask(link: string): Promise<Task> {
  if (link) {
    try {
      const given = await fromLink(link);
      if (isTask(given)) return given;
    } catch { /* not a link to a task: ignored */ }
  }
  try {
    const stored = JSON.parse(localStorage.getItem(TASK_KEY) ?? "null") as unknown;
    if (isTask(stored)) return stored;
  } catch { /* the stored text is no task: ignored */ }
  return exampleTask();
}

/** A rectangle supported at its lowest row: input down at the upper right, output to the left at the upper left. */
export async function exampleTask(): Promise<Task> {
  const lattice = { kind: "triangular-rectangle", columns: 8, rows: 9 };
  const made = await post<Pick<Problem, "positions" | "beams">>("/lattices", { lattice });
  const problem: Problem = {
    schema: "bellcrank/problem/1", name: "my actuator", ...made, initial: "", designable: [],
    stiffness: { bond: 5, angle: 0.1 }, supports: { fixed: [], fixed_x: [], fixed_y: [] },
    input: { nodes: [], direction: [0, -1], drive: "displacement", amount: 0.3 },
    output: { nodes: [], direction: [-1, 0], spring: null, spring_kind: null }, aggregate: "mean",
  };
  const rows = made.positions.map(([x, y], k) => ({ x, y, k }));
  const top = Math.max(...rows.map((node) => node.y));
  const row = (y: number): number[] => rows.filter((n) => Math.abs(n.y - y) < 0.1).sort((a, b) => a.x - b.x).map((n) => n.k);
  problem.supports.fixed = row(0);
  problem.input.nodes = row(top).slice(-2);
  problem.output.nodes = row(top).slice(0, 2);
  problem.initial = hexOf(new Uint8Array(made.beams.length).fill(1));
  const task = taskOf(problem, lattice);
  return { ...task, rules: made.beams.map(() => "auto") };
}

export async function builtInTask(name: string): Promise<Task> {
  return taskOf(await get<Problem>(`/problems/${name}`));
}
