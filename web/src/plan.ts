// The plan of a machine as plain data, and its conversion to and from the form of the server.

export type Port = "input" | "output";

export interface PlanPart {
  name: string;
  entry: string;
  /** A port such as `first.output`; empty if the part is placed at `at`. */
  join: string;
  by: Port;
  mirror: boolean;
  rotate: number;
  at: [number, number];
  supports: boolean;
}

export interface PlanLink { from: string; to: string; kind: "weld" | "bridge" }
export interface PlanEnd { ports: string[]; direction?: [number, number][] }

export interface Plan {
  name: string;
  parts: PlanPart[];
  links: PlanLink[];
  input: PlanEnd;
  output: PlanEnd;
}

/** Form of the files of `bellcrank machine`. */
export interface WrittenPlan {
  name: string;
  about?: string;
  parts: Record<string, { entry: string; join?: string; by?: Port; mirror?: boolean; rotate?: number; at?: [number, number]; supports?: boolean }>;
  links?: PlanLink[];
  input: PlanEnd;
  output: PlanEnd;
}

const NAMES = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth", "eleventh", "twelfth"];
export const MOST = NAMES.length;

export function emptyPlan(): Plan {
  return { name: "my machine", parts: [], links: [], input: { ports: [] }, output: { ports: [] } };
}

export function readPlan(written: WrittenPlan): Plan {
  return {
    name: written.name, links: written.links ?? [], input: written.input, output: written.output,
    parts: Object.entries(written.parts).map(([name, part]) => ({
      name, entry: part.entry, join: part.join ?? "", by: part.by ?? "input", mirror: part.mirror ?? false,
      rotate: part.rotate ?? 0, at: part.at ?? [0, 0], supports: part.supports ?? true,
    })),
  };
}

export function writePlan(plan: Plan): WrittenPlan {
  const parts = Object.fromEntries(plan.parts.map((part, k) => [part.name, {
    entry: part.entry,
    ...(part.join ? { join: part.join, by: part.by } : k ? { at: part.at } : {}),
    ...(part.mirror ? { mirror: true } : {}), ...(part.rotate ? { rotate: part.rotate } : {}),
    ...(part.supports ? {} : { supports: false }),
  }]));
  return { name: plan.name, parts, links: plan.links, input: plan.input, output: plan.output };
}

export function portsOf(plan: Plan): string[] {
  return plan.parts.flatMap(({ name }) => [`${name}.input`, `${name}.output`]);
}

/** Display text of a port, such as "output of first". */
export function portLabel(port: string): string {
  const [part, end] = port.split(".");
  return `${end} of ${part}`;
}

/** Add a design: the first receives the input, each further one is attached to the output of the previous one. */
export function withPart(plan: Plan, entry: string): Plan {
  const name = NAMES.find((each) => !plan.parts.some((part) => part.name === each)) ?? `part ${plan.parts.length + 1}`;
  const last = plan.parts.at(-1);
  const part: PlanPart = { name, entry, join: last ? `${last.name}.output` : "", by: "input", mirror: false, rotate: 0, at: [0, 0], supports: true };
  return {
    ...plan, parts: [...plan.parts, part], output: { ports: [`${name}.output`] },
    input: last ? plan.input : { ports: [`${name}.input`] },
  };
}

export function withoutPart(plan: Plan, name: string): Plan {
  const remains = (port: string): boolean => !port.startsWith(`${name}.`);
  const parts = plan.parts.filter((part) => part.name !== name).map((part) => (remains(part.join) ? part : { ...part, join: "" }));
  const end = (before: PlanEnd, fallback: string): PlanEnd => {
    const ports = before.ports.filter(remains);
    if (ports.length === before.ports.length) return before;
    return { ports: ports.length || !fallback ? ports : [fallback] };
  };
  const [first, last] = [parts[0], parts.at(-1)];
  return {
    ...plan, parts, links: plan.links.filter((link) => remains(link.from) && remains(link.to)),
    input: end(plan.input, first ? `${first.name}.input` : ""), output: end(plan.output, last ? `${last.name}.output` : ""),
  };
}

/** Whether a stored value is a plan. */
export function isPlan(value: unknown): value is Plan {
  const plan = value as Plan | null;
  return !!plan && typeof plan === "object" && typeof plan.name === "string" && Array.isArray(plan.parts)
    && plan.parts.every((part) => typeof part.name === "string" && typeof part.entry === "string" && typeof part.join === "string")
    && Array.isArray(plan.links) && Array.isArray(plan.input?.ports) && Array.isArray(plan.output?.ports);
}
