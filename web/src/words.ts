// Sentences, names of files, and the keys for undo.

export function fileName(title: string): string {
  return title.trim().toLowerCase().replaceAll(/[^a-z0-9]+/g, "-").replaceAll(/^-|-$/g, "") || "bellcrank";
}

export function suffixOf(name: string): string {
  const found = /\.[a-z0-9]+$/i.exec(name);
  return found ? found[0].toLowerCase() : ".txt";
}

export function sentence(text: string): string {
  const trimmed = text.trim();
  if (!trimmed) return "";
  return trimmed.charAt(0).toUpperCase() + trimmed.slice(1) + (/[.!?]$/.test(trimmed) ? "" : ".");
}

/** What to try where a search has found nothing good. */
export const REMEDIES = [
  "Search longer: Thorough, or more chains.",
  "Leave more beams to the search: fewer held nodes, fewer painted beams, no mirror.",
  "Ask for less: a shorter stroke, or an output nearer to the input.",
];

/** What a search says of itself, without the words of the command line. */
export function plainly(message: string): string {
  return sentence(message.replace(/^problem '[^']*': /, "").replaceAll(/ \(--[a-z-]+\)/g, ""));
}

/** Hear Ctrl+Z and Ctrl+Shift+Z, except where somebody writes. */
export function undoing(step: (way: "undo" | "redo") => void): (event: KeyboardEvent) => void {
  return (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    const { target } = event;
    if (target instanceof HTMLInputElement && target.type !== "radio" && target.type !== "checkbox") return;
    event.preventDefault();
    step(event.shiftKey ? "redo" : "undo");
  };
}
