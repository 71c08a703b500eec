// Fields of a task: numbers with a usual unit, or texts with a unit.

import { field, h } from "./dom";
import type { Amount } from "./task";

/** A field for a number in the usual unit, or with a unit of its own; empty for none. */
export function amount(
  key: string, label: string, value: Amount | undefined, unit: string, change: (value: Amount | undefined) => void, help = "",
): HTMLElement {
  const input = h("input", { type: "text", inputmode: "decimal", value: value === undefined ? "" : shown(value), "data-key": key, maxlength: 2000, size: 6 });
  input.defaultValue = input.value;
  input.addEventListener("change", () => change(read(input.value)));
  return field(label, input, unit, help);
}

/** The number or text of a field; nothing if it is empty. */
export function read(text: string): Amount | undefined {
  const trimmed = text.trim();
  if (!trimmed) return undefined;
  const value = Number(trimmed.replace(",", "."));
  return Number.isFinite(value) ? value : trimmed;
}

/** A number without digits of rounding, or a text. */
export function shown(value: Amount): string {
  return typeof value === "number" ? String(Number(value.toPrecision(6))) : value;
}

/** A ratio as a percentage, as the specification lists it. */
export function ratio(value: Amount | undefined): Amount | undefined {
  return typeof value === "number" ? `${Number((100 * value).toPrecision(6))}%` : value;
}
