// Sentences, file names, and the keys for undo.

import { percent } from "./dom";

export function fileName(title: string): string {
  return title.trim().toLowerCase().replaceAll(/[^a-z0-9]+/g, "-").replaceAll(/^-|-$/g, "") || "bellcrank";
}

export function suffixOf(name: string): string {
  const found = /\.[a-z0-9]+$/i.exec(name);
  return found ? found[0].toLowerCase() : ".txt";
}

const LENGTHS: Record<string, number> = { mm: 1, cm: 10, m: 1000, um: 0.001, in: 25.4 };

/** A length in mm; NaN if it is none. */
export function lengthIn(value: number | string): number {
  if (typeof value === "number") return value;
  const found = /^\s*([-+.\deE]+)\s*([a-z]*)\s*$/.exec(value);
  return found ? Number(found[1]) * (LENGTHS[found[2] || "mm"] ?? NaN) : NaN;
}

export function sentence(text: string): string {
  const trimmed = text.trim();
  if (!trimmed) return "";
  return trimmed.charAt(0).toUpperCase() + trimmed.slice(1) + (/[.!?]$/.test(trimmed) ? "" : ".");
}

const SECTIONS: Record<string, string> = { supports: "Support", inputs: "Input", outputs: "Output", loads: "Load", input: "Input", output: "Output" };
const PARTS: Record<string, string> = { domain: "Domain", limits: "Limits", part: "Part", tolerance: "Tolerance" };

/** A message of the server on a task, with the titles of the page instead of keys; `place` describes a node by its number. */
export function faultText(message: string, place: (node: number) => string): string {
  const named = message.replace(/^key '([^']+)' is missing/, (_, key: string) => `${key}: the ${key.split(".").at(-1)} is missing`);
  const found = /^([\w[\].]+): /.exec(named);
  const key = found?.[1] ?? "";
  const rest = (found ? named.slice(found[0].length) : named)
    .replace(/, the first is \d+$/, "").replace(/problem '[^']*'/, "the lattice").replaceAll(/\bdesignable beams\b/g, "struts").replaceAll(/\bdesignable image\b/g, "image that the search may change")
    .replaceAll(/\bnode (\d+)\b/g, (_, node: string) => place(Number(node)));
  const section = /(supports|inputs|outputs|loads)\[(\d+)\]|^(input|output|supports)\b/.exec(key);
  const inside = key.replace(/^cases\[\d+\]\./, "").split(".").slice(1).map((word) => word.replace(/\[\d+\]$/, "").replaceAll("_", " "));
  const field = inside.filter((word) => word !== "at" && word !== "nodes").join(", ");
  const loadCase = /^cases\[(\d+)\]/.exec(key);
  const of = loadCase && Number(loadCase[1]) > 0 ? ` of load case ${Number(loadCase[1]) + 1}` : "";
  if (section) {
    const title = section[1] ? `${SECTIONS[section[1]]} ${Number(section[2]) + 1}` : SECTIONS[section[3]!]!;
    return sentence(`${title}${of}${field && `, ${field}`}: ${rest}`);
  }
  const part = PARTS[key.split(".")[0]!];
  if (part) return sentence(`${part}${field && `, ${field}`}: ${rest}`);
  return sentence(key ? `${key.replaceAll("_", " ")}: ${rest}` : rest);
}

/** The status of a search in words. */
export function statusName(status: string): string { return status === "stopped" ? "ended early, by Stop" : status; }

/** Suggestions for a search that has found no good design. */
export const REMEDIES = [
  "Refine the design (Next steps): nodes and widths change until the items are met in the printed outline, too.",
  "Search longer: Thorough, or more chains.",
  "Let the search decide on more struts: fewer supports, fewer struts that are kept, no symmetry.",
  "Give the part more room: a larger domain, or a smaller spacing of nodes with thinner struts.",
  "Reduce the requirement: less motion of the output, wider bounds, or an output closer to the input.",
];

/** Why an input that turns by some degrees may miss a bound on the off-axis motion. */
export function tilted(degrees: number): string {
  return `If the push is ${degrees}° off its direction, what it pushes moves sideways by ${percent(Math.sin((Math.PI / 180) * degrees))} % of the stroke, and an output beside it by about as much: such a print misses a smaller bound on the off-axis motion.`;
}

/** Message of a search without the options of the command line. */
export function runMessage(message: string): string {
  return sentence(message.replace(/^problem '[^']*': /, "").replaceAll(/ \(--[a-z-]+\)/g, ""));
}

/** Return a handler of Ctrl+Z and Ctrl+Shift+Z, except in text fields. */
export function undoKeys(step: (action: "undo" | "redo") => void): (event: KeyboardEvent) => void {
  return (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    const { target } = event;
    if (target instanceof HTMLInputElement && target.type !== "radio" && target.type !== "checkbox") return;
    event.preventDefault();
    step(event.shiftKey ? "redo" : "undo");
  };
}
