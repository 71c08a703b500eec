// Limits that hold in every load case, and tolerances.

import { h, select } from "./dom";
import type { TaskEditor } from "./editing";
import { amount, ratio } from "./fields";
import { cleaned, isSpatial, type Amount, type Limits, type Tolerance } from "./task";

const SYMMETRIES: [string, string][] = [["", "none"], ["x", "left and right"], ["y", "up and down"], ["xy", "both"]];
const SYMMETRIES_IN_SPACE: [string, string][] = [
  ["", "none"], ["x", "left and right"], ["y", "front and back"], ["xy", "both"], ["3-fold", "3-fold"], ["4-fold", "4-fold"]];

/** The lattice in space that a third of a turn does not change. */
export const ON_CORNER_TITLE = "octet on a corner, in a cylinder: 3-fold";
/** What a symmetry needs of the domain. */
const NEEDS: Record<string, string> = {
  "3-fold": `A third of a turn. It needs the lattice “${ON_CORNER_TITLE}” with equal width and depth (Part, domain).`,
  "4-fold": "A quarter of a turn. It needs equal width and depth.",
};

export function limitsPanel(editor: TaskEditor): HTMLElement {
  const { table } = editor.task;
  const limits = table.limits ?? {};
  const put = (changes: Limits): void => {
    const now = editor.task.table;
    const next = cleaned({ ...now.limits, ...changes });
    editor.change(cleaned({ ...now, limits: Object.keys(next).length ? next : undefined }));
  };
  const value = (key: "strain" | "clearance"): Amount | undefined => (typeof limits[key] === "boolean" ? undefined : limits[key]);
  const symmetry = select(isSpatial(table) ? SYMMETRIES_IN_SPACE : SYMMETRIES, limits.symmetry ?? "", (picked) => put({ symmetry: picked || undefined }));
  symmetry.dataset.key = "limit-symmetry";
  symmetry.id = "limit-symmetry";
  const field = (key: keyof Limits, label: string, unit: string, help = ""): HTMLElement =>
    amount(`limit-${key}`, label, unit ? limits[key] as Amount | undefined : ratio(limits[key] as Amount | undefined), unit, (given) => put({ [key]: given }), help);
  const over = h("input", { type: "checkbox", checked: table.tolerance !== undefined, "data-key": "tolerance" });
  over.addEventListener("change", () => editor.change(cleaned({ ...table, tolerance: over.checked ? {} : undefined })));
  return h("div", { class: "content" },
    h("div", { class: "row" },
      amount("limit-strain", "Strain at most", ratio(value("strain")), "", (given) => put({ strain: given }), strainHelp(editor)),
      amount("limit-clearance", "Gap between struts at least", value("clearance"), "mm", (given) => put({ clearance: given }), "empty: they must not touch")),
    h("div", { class: "row" }, field("mass", "Mass at most", "g", "empty: not limited"), field("stable_stroke", "Stable up to", "", "such as 120%; empty: up to the full stroke")),
    h("div", { class: "row" }, field("strut_loss", "Loss of a strut costs at most", "", "such as 30%; empty: not limited"),
      h("div", { class: "field" }, h("label", { for: "limit-symmetry" }, "Symmetry of the design"), symmetry, isSpatial(table) && NEEDS[limits.symmetry ?? ""] && h("small", {}, NEEDS[limits.symmetry ?? ""]))),
    h("label", { class: "tick" }, over, "Design over tolerances of print and drive"),
    table.tolerance !== undefined && toleranceFields(editor, table.tolerance));
}

/** The strain limit that holds while the field is empty, as the material of the task has it. */
function strainHelp({ registries, task: { table: { part, limits } } }: TaskEditor): string {
  if (limits?.strain === false) return "empty: not limited by this task";
  const given = part?.material ?? "ninjaflex";
  const known = typeof given === "string" ? registries?.materials.find(({ name }) => name === given) : { title: `the material ${given.name}`, strain_limit: given.strain_limit ?? null };
  if (!known) return "empty: that of the material";
  return known.strain_limit === null ? `empty: not limited, no limit of ${known.title} is known` : `empty: ${typeof known.strain_limit === "number" ? `${Number((100 * known.strain_limit).toPrecision(3))} %` : String(known.strain_limit)}, that of ${known.title}`;
}

function toleranceFields(editor: TaskEditor, tolerance: Tolerance): HTMLElement {
  const field = (key: keyof Tolerance, label: string, unit: string, help: string): HTMLElement =>
    amount(`tolerance-${key}`, label, unit ? tolerance[key] : ratio(tolerance[key]), unit, (given) =>
      editor.change({ ...editor.task.table, tolerance: cleaned({ ...editor.task.table.tolerance, [key]: given }) }), help);
  const usual = (key: keyof Tolerance): string => `empty: ${editor.registries?.tolerance.find(({ name }) => name === key)?.title ?? "the usual"}`;
  return h("div", {},
    h("div", { class: "row" }, field("width", "All struts alike, width ±", "", `at most, such as 5%; ${usual("width")}`), field("each_width", "Each strut, width ±", "", `standard deviation, such as 2%; ${usual("each_width")}`)),
    h("div", { class: "row" }, field("node", "Each node ±", "mm", `at most, in each coordinate; ${usual("node")}`), field("angle", "Direction of the input ±", "°", `at most; ${usual("angle")}`)),
    h("div", { class: "row" }, field("least_yield", "Prints that pass, at least", "", usual("least_yield")), field("keep", "A print passes if it keeps", "", "of the gain, such as 80%; empty: it passes if it meets all items")),
    h("p", { class: "note" }, `In each random print, widths, nodes and the direction of the input deviate by random amounts up to these. Without this, the tolerance of a result can be computed all the same.`));
}
