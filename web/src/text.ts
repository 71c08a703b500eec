// Sentences, file names, and the keys for undo.

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

/** Suggestions for a search that has found no good design. */
export const REMEDIES = [
  "Search longer: Thorough, or more chains.",
  "Make more beams designable: fewer supports, fewer fixed beams, no mirror symmetry.",
  "Reduce the requirement: a shorter stroke, or an output closer to the input.",
];

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
