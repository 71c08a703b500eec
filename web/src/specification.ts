// The items of a specification and the figures of a part.

import type { ItemState, Objective, PartFigures } from "./api";
import { count, figure, h } from "./dom";

/** The items that a design reaches in one model. */
export interface Column { title: string; items: ItemState[] }

/** What is maximised, unless it is the motion of the output over that of the input, which a headline shows anyway. */
export function otherObjective(objectives: Objective[]): Objective | null {
  const first = objectives[0];
  // A payload beyond the wanted one is not always determined.
  return first && first.quantity !== "gain" && /^[-\d]/.test(first.reached) ? first : null;
}

/** One sentence on a list of items: whether all are met, and which one is farthest from it. */
export function verdictOf(items: ItemState[]): string {
  const missed = items.filter(({ met }) => met === false);
  if (!missed.length) return `All ${count(items.length, "item")} met`;
  const worst = missed.reduce((a, b) => ((b.margin ?? -Infinity) < (a.margin ?? -Infinity) ? b : a));
  return `${missed.length} of ${count(items.length, "item")} missed, farthest: ${worst.label}`;
}

/** A table of items: whether each is met in the last model, what is wanted, and what is reached. */
export function itemTable(columns: Column[], wanted: ItemState[] = []): HTMLElement {
  const last = columns.at(-1)?.items ?? wanted;
  const rows = last.map((item, k) => h("tr", { class: columns.length && item.met !== null ? (item.met ? "met" : "missed") : "open", "data-item": item.name },
    h("td", {}, columns.length && item.met !== null ? mark(item.met) : ""),
    h("th", { scope: "row" }, item.label, h("small", {}, item.wanted)),
    ...columns.map(({ items }) => h("td", {}, items[k]?.reached ?? "–")),
    columns.length > 0 && h("td", { class: "more" }, marginText(columns.map(({ items }) => items[k]?.margin ?? null)))));
  return h("table", { class: "items" },
    h("caption", {}, "Specification"),
    columns.length > 0 && h("thead", {}, h("tr", {}, h("td"), h("td"), ...columns.map(({ title }) => h("th", { scope: "col" }, title)), h("th", { scope: "col" }, "margin"))),
    h("tbody", {}, ...rows));
}

/** The smallest margin of an item in all models. */
function marginText(margins: (number | null)[]): string {
  const known = margins.filter((each) => each !== null);
  if (!known.length) return "";
  const least = Math.min(...known);
  return `${least > 0 ? "+" : ""}${figure(100 * least, 0)} %`;
}

function mark(met: boolean): HTMLElement {
  return h("span", { class: "mark", role: "img", "aria-label": met ? "met" : "missed" }, met ? "✓" : "✗");
}

/** The model of the figures of a part. */
export const FRAMES = "beams with rigid joints (frames), 8 elements in each strut";

/** A column of figures: an output, in a model. */
export interface FigureColumn { title: string; row: PartFigures }

/** One column for each output in each model. */
export function figureColumns(models: [title: string, figures: PartFigures[]][]): FigureColumn[] {
  return models.flatMap(([title, figures]) => {
    const sameCase = figures.every((row) => row.case === figures[0]!.case);
    return figures.map((row) => ({ row, title: figures.length === 1 ? title : [...(sameCase ? [] : [row.case]), row.output, title].join(", ") }));
  });
}

/** Positive side of each axis. */
const SIDES = ["the right", "the back", "above"];
/** Cosine of the angle to an axis of coordinates from which on the hand of a rotation is that seen from its positive side. */
const ALONG = 0.9;

/** Axis and hand of a rotation in space, which is right-handed about the axis. */
export function turnText(axis: [number, number, number]): string {
  const about = `about (${axis.map((value) => String(Number(value.toFixed(2)) + 0).replace("-", "−")).join(", ")})`;
  const k = axis.findIndex((value) => Math.abs(value) >= ALONG);
  return k < 0 ? `${about}, right-handed` : `${about}, ${axis[k]! > 0 ? "counter-clockwise" : "clockwise"} seen from ${SIDES[k]}`;
}

/** A table of figures for all outputs and models, or one for each output if there would be too many columns beside a drawing. */
export function figureTables(models: [title: string, figures: PartFigures[]][]): HTMLElement[] {
  const columns = figureColumns(models);
  if (columns.length < 3) return [figureTable(columns)];
  const outputs = [...new Set(columns.map(({ row }) => JSON.stringify([row.case, row.output])))];
  return outputs.map((key) => figureTable(columns.filter(({ row }) => JSON.stringify([row.case, row.output]) === key)));
}

/** Motion, off-axis motion, rotation and load of each output, always beside each other. */
export function figureTable(columns: FigureColumn[]): HTMLElement {
  const rows: [string, (row: PartFigures) => string, string?][] = [
    ["output / input motion", (row) => figure(row.efficiency, 2)],
    ["motion of the output", (row) => unit(row.travel_mm, 2, "mm")],
    ["off-axis motion", (row) => (row.off_axis == null ? "–" : `${figure(100 * row.off_axis, 1)}\u00a0%${row.travel_mm == null ? "" : ` (${figure(row.off_axis * Math.abs(row.travel_mm), 2)}\u00a0mm)`}`)],
    ["rotation of the output", (row) => `${unit(row.rotation_deg, 1, "°")}${row.rotation_axis && row.rotation_deg != null ? ` ${turnText(row.rotation_axis)}` : ""}`],
    ["deformation of the output", (row) => unit(row.output_deformation_mm, 2, "mm"), "of its nodes from a rigid motion"],
    ["payload that halves the motion", (row) => weight(row.payload_N), "a load that grows with the input"],
    ["dead load that halves the motion", (row) => weight(row.dead_load_N), "a weight that acts before the input"],
    ["sag under own weight", (row) => unit(row.sag_mm, 2, "mm")],
    ["largest input force", (row) => unit(row.largest_input_force_N, 2, "N")],
    ["largest strain", (row) => (row.strain == null ? "–" : `${figure(100 * row.strain, 1)}\u00a0%`)],
  ];
  return h("table", { class: "figures part" },
    h("caption", {}, "Figures of the part at full stroke; off-axis motion and rotation are the largest along it"),
    h("thead", {}, h("tr", {}, h("td"), ...columns.map(({ title }) => h("th", { scope: "col" }, title)))),
    h("tbody", {}, ...rows.map(([name, text, about]) => h("tr", {}, h("th", { scope: "row" }, name, about && h("small", {}, about)), ...columns.map(({ row }) => h("td", {}, text(row)))))));
}

function weight(force: number | null | undefined): string {
  return force === undefined ? "–" : force === null ? "none" : `${figure((1000 * force) / 9.80665, 0)}\u00a0g (${figure(force, 3)}\u00a0N)`;
}

function unit(value: number | null | undefined, digits: number, name: string): string {
  return value === null || value === undefined ? "–" : `${figure(value, digits)}${name === "°" ? "" : "\u00a0"}${name}`;
}
