// Inputs, outputs and loads of a load case.

import { button, choice, field, h, select, type Child } from "./dom";
import { angleOf } from "./drawing";
import type { TaskEditor } from "./editing";
import { amount } from "./fields";
import {
  cleaned, directionAt, imagesOf, isSpatial, isTurn, nodesOf, QUANTITIES, regionsOf, sectionsOf, vectorInSpace, vectorOf, withSection, withSections,
  type Amount, type Bounds, type CaseTable, type InputTable, type LoadTable, type OutputTable, type QuantityName,
  type Table, type Target,
} from "./task";
import { actsBefore, rangeOf, withInputsAfterWeights } from "./weights";

type Bound = "at_least" | "at_most" | "value" | "target";

/** What a single value of a quantity bounds, an example, and what the quantity is. */
interface Usual { title: string; bound: Bound; example: string; about: string; /** Unit of a bare number. */ unit?: string; /** Whether `about` is always shown. */ isExplained?: boolean }

const USUAL: Record<QuantityName, Usual> = {
  gain: { title: "motion gain", bound: "at_least", example: "2", about: "Motion of the output along its direction, over the stroke of the input." },
  travel: { title: "travel", unit: "mm", bound: "at_least", example: "5 mm", about: "Motion of the output along its direction." },
  off_axis: { title: "off-axis motion", bound: "at_most", example: "10%", about: "Largest motion normal to the direction, over the travel." },
  rotation: { title: "rotation", unit: "°", bound: "value", example: "5 deg", about: "Rotation of the output, counter-clockwise positive." },
  payload: { title: "payload", unit: "N", bound: "at_least", example: "10 g", about: "Load against the direction of the output that grows with the input, as that of a workpiece, and halves the travel. To reach all items under a load, add a force in the step Loads.", isExplained: true },
  dead_load: { title: "dead load", unit: "N", bound: "at_least", example: "10 g", about: "Weight against the direction of the output that acts before the input, and halves the travel. To reach all items under a weight in any direction, add it in the step Loads.", isExplained: true },
  stiffness: { title: "stiffness", unit: "N/mm", bound: "at_least", example: "0.1 N/mm", about: "Stiffness of the output along its direction at the full stroke." },
  blocked_force: { title: "blocked force", unit: "N", bound: "at_least", example: "0.1 N", about: "Force of the output at full stroke on a stop where it rests. To hold an object: ask for the travel up to it, and for this force.", isExplained: true },
  sag: { title: "sag under own weight", bound: "at_most", example: "10%", about: "Motion of the output by the own weight, over its travel." },
};

const INPUT_FORCE: Usual = { title: "input force", unit: "N", bound: "at_most", example: "1 N", about: "Force of the input along its direction." };
const ROTATION_IN_SPACE = "Size of the mean rotation of the output nodes, about whatever axis it has; a rotational symmetry (Limits and tolerance) makes this the vertical axis. Nodes of an input move along its direction only: let the input be the middle of a plate that should turn.";

/** Quantities that may be maximised. */
const MAXIMISED: string[] = ["gain", "travel", "rotation", "payload", "dead_load", "stiffness", "blocked_force"];

/** Quantities that may be minimised, with a bound on the motion beside them. */
const MINIMISED: string[] = ["off_axis", "sag"];

/** What an output begins with that turns, or moves along a direction. */
const TURN = { direction: undefined, gain: undefined, travel: undefined, off_axis: undefined, path: undefined, payload: undefined, dead_load: undefined, sag: undefined, rotation: [{ maximise: true }] };
const MOTION = { direction: "left", rotation: undefined, gain: [{ maximise: true }], off_axis: [{ at_most: "10%" }] };

/** Outputs as they were before another motion was chosen, so that a return to it loses nothing. */
const BEFORE = new WeakMap<TaskEditor, Map<string, OutputTable>>();

/** What changes when an output is to turn instead of moving, or to move instead of turning. */
function otherMotion(editor: TaskEditor, { index }: Target, each: OutputTable, picked: "moves" | "turns"): Record<string, unknown> {
  const known = BEFORE.get(editor) ?? new Map<string, OutputTable>();
  BEFORE.set(editor, known);
  const key = (motion: string): string => JSON.stringify([motion, editor.loadCase, index, each.at]);
  const before = known.get(key(picked));
  known.set(key(isTurn(each) ? "turns" : "moves"), each);
  const usual: Record<string, unknown> = picked === "turns" ? TURN : MOTION;
  if (!before) return usual;
  const { at: _at, name: _name, ...fields } = before;
  return { ...Object.fromEntries(Object.keys(TURN).map((field) => [field, undefined])), ...fields };
}

/** The panel of the inputs, outputs or loads of the shown load case. */
export function casePanel(editor: TaskEditor, kind: "inputs" | "outputs" | "loads"): HTMLElement {
  const sections = sectionsOf(editor.task.table, editor.loadCase, kind);
  const make = { inputs: inputFields, outputs: outputFields, loads: loadFields }[kind];
  const noun = { inputs: "input", outputs: "output", loads: "load" }[kind];
  const add = (): void => editor.aimAt({ kind, index: sections.length });
  const entries = sections.map((each, index) => {
    const target: Target = { kind, index };
    const isActive = editor.target.kind === kind && editor.target.index === index;
    const nodes = editor.built ? nodesOf(editor.built, editor.loadCase, kind)[index]?.length ?? 0 : 0;
    const drop = (): void => {
      const table = withSections(editor.task.table, editor.loadCase, kind, sections.filter((_, k) => k !== index) as never);
      editor.change(withInputsAfterWeights(table, editor.loadCase));
      editor.aimAt({ kind, index: 0 });
    };
    return h("fieldset", { class: `entry${isActive ? " active" : ""}`, "data-entry": `${kind}-${index}` },
      h("legend", {}, `${noun} ${index + 1}`, h("small", {}, ` ${nodes} ${nodes === 1 ? "node" : "nodes"}`)),
      sections.length > 1 && !isActive && button("Select its nodes", () => editor.aimAt(target), "quiet small", { "data-key": `aim-${kind}-${index}` }),
      ...make(editor, each as never, target),
      kind !== "loads" && imageButton(editor, kind, target),
      kind === "inputs" && middleButton(editor, target),
      kind === "inputs" && nodes > 1 && h("p", { class: "note" }, "All its nodes move along its direction only: they cannot turn or move sideways."),
      h("div", { class: "row between" },
        button("Clear nodes", () => editor.change(withSection(editor.task.table, editor.loadCase, target, { at: [] })), "quiet small", { disabled: !nodes, "data-key": `clear-${kind}-${index}` }),
        (sections.length > 1 || kind === "loads") && button(`Remove ${noun} ${index + 1}`, drop, "quiet small", { "data-key": `drop-${kind}-${index}` })));
  });
  const pending = editor.target.kind === kind && editor.target.index >= sections.length && sections.length > 0;
  return h("div", { class: "content" }, ...entries,
    pending ? h("p", { class: "note" }, `Click the nodes of the new ${noun}.`)
      : sections.length > 0 && button(`Add another ${noun}`, add, "quiet", { "data-key": `add-${kind}` }),
    !sections.length && h("p", { class: "note" }, `Click nodes in the drawing for the first ${noun}.`),
    kind === "loads" && gravity(editor),
    kind === "outputs" && distanceText(editor),
    kind === "outputs" && caseTools(editor));
}

/** The distance between two outputs, as of the jaws of a gripper. */
function distanceText({ built, loadCase, task: { table } }: TaskEditor): HTMLElement | null {
  const [one, two, other] = built ? nodesOf(built, loadCase, "outputs") : [];
  if (!built || !one?.length || !two?.length || other || isSpatial(table)) return null;
  const { lattice: { positions }, part } = built;
  const least = Math.min(...one.flatMap((a) => two.map((b) => Math.hypot(positions[a]![0] - positions[b]![0], positions[a]![1] - positions[b]![1]))));
  const [distance, gap] = [least * part.scale, least * part.scale - part.width].map((each) => each.toFixed(1));
  return h("p", { class: "note" }, `The nearest nodes of the outputs are ${distance} mm apart, with a gap of ${gap} mm between struts of ${part.width} mm.`);
}

/** A button that adds the mirror image of an input or output of a symmetric design, where it has none. */
function imageButton(editor: TaskEditor, kind: "inputs" | "outputs", { index }: Target): HTMLElement | null {
  const { task: { table }, built, loadCase } = editor;
  const axis = mirrorAxis(editor);
  if (!built || !axis) return null;
  const other = imageIndex(editor, { kind, index });
  if (other !== null) return h("p", { class: "note" }, `Its mirror image is ${kind.slice(0, -1)} ${other + 1}: amounts and items of both are changed together.`);
  const regions = nodesOf(built, loadCase, kind);
  const nodes = regions[index] ?? [];
  const images = imagesOf(built, axis, nodes);
  const same = (one: number[], two: number[]): boolean => one.length === two.length && one.every((node) => two.includes(node));
  if (!nodes.length || images.includes(-1) || regions.some((each) => same(each, images))) return null;
  const add = (): void => {
    const sections = sectionsOf(table, loadCase, kind) as (InputTable & OutputTable)[];
    const each = sections[index]!;
    const [x, y] = vectorOf(each.direction);
    // Bounds on one side of a rotation would be those of the other side.
    const rotation = each.rotation?.filter(({ value }) => value !== undefined);
    const image = cleaned({
      ...each, name: undefined, at: regionsOf(images, built.lattice.positions, built.part.scale),
      direction: each.direction === undefined ? undefined : directionAt(angleOf(axis === "x" ? [-x, y] : [x, -y])),
      rotation: rotation?.length ? rotation : undefined,
    });
    editor.change(withSections(table, loadCase, kind, [...sections, image] as never));
  };
  return button("Add its mirror image", add, "quiet small", { "data-key": `image-${kind}-${index}` });
}

/** In space, where an input of several nodes keeps an output from turning: a button that keeps its middle node. */
function middleButton(editor: TaskEditor, target: Target): HTMLElement | null {
  const { task: { table }, built, loadCase } = editor;
  const nodes = built ? nodesOf(built, loadCase, "inputs")[target.index] ?? [] : [];
  if (!built || !isSpatial(table) || nodes.length < 2 || !(sectionsOf(table, loadCase, "outputs") as OutputTable[]).some(isTurn)) return null;
  const { positions } = built.lattice;
  const away = (node: number): number => Math.hypot(...[0, 1, 2].map((axis) => positions[node]![axis]! - nodes.reduce((sum, each) => sum + positions[each]![axis]!, 0) / nodes.length));
  const middle = nodes.reduce((a, b) => (away(b) < away(a) - 1e-9 ? b : a));
  return h("div", {},
    h("p", { class: "note" }, "Nodes of an input move along its direction only: they do not turn about it with the output."),
    button("Keep its middle node only", () => set(editor, target, { at: regionsOf([middle], positions, built.part.scale) }), "quiet small", { "data-key": `middle-${target.index}` }));
}

function set(editor: TaskEditor, target: Target, changes: Record<string, unknown>): void {
  let table = withSection(editor.task.table, editor.loadCase, target, changes);
  const image = imageIndex(editor, target);
  const shared = Object.fromEntries(Object.entries(changes).filter(([key, value]) => isShared(key, value)));
  if (image !== null && Object.keys(shared).length) table = withSection(table, editor.loadCase, { ...target, index: image }, shared);
  editor.change(table);
}

/** The axis of a mirror symmetry of a design in the plane; null if it has none, or two. */
function mirrorAxis({ task: { table } }: TaskEditor): "x" | "y" | null {
  const symmetry = table.limits?.symmetry;
  return !isSpatial(table) && (symmetry === "x" || symmetry === "y") ? symmetry : null;
}

/** The input or output whose nodes are the mirror images of those of another; null if there is none. */
function imageIndex(editor: TaskEditor, { kind, index }: Target): number | null {
  const { built, loadCase } = editor;
  const axis = mirrorAxis(editor);
  if (!built || !axis || (kind !== "inputs" && kind !== "outputs")) return null;
  const regions = nodesOf(built, loadCase, kind);
  const images = imagesOf(built, axis, regions[index] ?? []);
  const found = regions.findIndex((each, k) => k !== index && each.length > 0 && each.length === images.length && each.every((node) => images.includes(node)));
  return found < 0 ? null : found;
}

/** Whether a mirror image has the same value: places and directions are mirrored, and bounds of a rotation on one side change sides. */
function isShared(key: string, value: unknown): boolean {
  if (["at", "name", "direction", "path"].includes(key)) return false;
  return key !== "rotation" || !Array.isArray(value) || value.every((bounds: Bounds) => bounds.value !== undefined);
}

function directionFields(editor: TaskEditor, target: Target, given: InputTable["direction"]): HTMLElement {
  const key = `${target.kind}-${target.index}`;
  if (isSpatial(editor.task.table)) return directionInSpace(editor, target, given, key);
  const angle = given === undefined ? undefined : angleOf(vectorOf(given));
  return h("div", { class: "row" },
    amount(`${key}-angle`, "Direction", angle, "°", (value) => set(editor, target, { direction: value === undefined ? undefined : directionAt(Number(value) || 0) })),
    h("div", { class: "directions", role: "group", "aria-label": "Common directions" }, ...(["up", "right", "down", "left"] as const).map((name) =>
      button({ up: "↑", right: "→", down: "↓", left: "←" }[name], () => set(editor, target, { direction: name }), "quiet", { "aria-label": name, title: name, "data-key": `${key}-${name}` }))));
}

/** A direction by name, or by the components of a vector. */
function directionInSpace(editor: TaskEditor, target: Target, given: InputTable["direction"], key: string): HTMLElement {
  const names = ["up", "down", "left", "right", "front", "back"] as const;
  const isVector = Array.isArray(given);
  const pick = select([...names.map((name): [string, string] => [name, name]), ["vector", "vector …"], ...(given === undefined ? [["", "choose …"] as [string, string]] : [])],
    isVector ? "vector" : given ?? "", (picked) => set(editor, target, { direction: picked === "vector" ? vectorInSpace(given) : picked }));
  pick.dataset.key = `${key}-direction`;
  return h("div", { class: "row" }, field("Direction", pick), isVector ? amount(`${key}-vector`, "x, y, z", given.join(", "), "", (value) => {
    const read = String(value ?? "").split(",").map(Number);
    if (read.length === 3 && read.every(Number.isFinite)) set(editor, target, { direction: read });
  }) : null);
}

/** The part of the stroke in which an input or a load grows. */
function rangeFields(editor: TaskEditor, target: Target, during: [Amount, Amount] | undefined): HTMLElement {
  const key = `${target.kind}-${target.index}`;
  const put = (end: 0 | 1) => (value: Amount | undefined): void => {
    const next: [Amount, Amount] = [during?.[0] ?? 0, during?.[1] ?? 1];
    next[end] = value ?? end;
    set(editor, target, { during: next });
  };
  return h("details", { ...(during ? { open: true } : {}) }, h("summary", { "data-key": `${key}-when` }, "In a part of the stroke"),
    h("div", { class: "row" }, amount(`${key}-from`, "From", during?.[0], "", put(0), "0 to 1, or a percentage"), amount(`${key}-to`, "To", during?.[1], "", put(1))));
}

function inputFields(editor: TaskEditor, each: InputTable, target: Target): HTMLElement[] {
  const key = `inputs-${target.index}`;
  const isForce = each.force !== undefined;
  return [
    directionFields(editor, target, each.direction),
    h("div", { class: "row" },
      isForce ? amount(`${key}-amount`, "Force", each.force, "N", (value) => set(editor, target, { force: value ?? 1 }))
        : amount(`${key}-amount`, "Stroke", each.displacement, "mm", (value) => set(editor, target, { displacement: value ?? 3 })),
      choice("Prescribed", [["displacement", "motion"], ["force", "force"]] as ["displacement" | "force", string][], isForce ? "force" : "displacement", (picked) =>
        set(editor, target, picked === "force" ? { force: 1, displacement: undefined } : { displacement: 3, force: undefined }), `prescribed-${target.index}`)),
    rangeFields(editor, target, each.during),
  ];
}

function loadFields(editor: TaskEditor, each: LoadTable, target: Target): Child[] {
  const isSpring = each.spring !== undefined;
  const put = (changes: Partial<LoadTable>): void =>
    editor.change(withInputsAfterWeights(withSection(editor.task.table, editor.loadCase, target, changes), editor.loadCase));
  return [
    directionFields(editor, target, each.direction),
    h("div", { class: "row" },
      isSpring ? amount(`loads-${target.index}-amount`, "Stiffness", each.spring, "N/mm", (value) => set(editor, target, { spring: value ?? 0.1 }))
        : amount(`loads-${target.index}-amount`, "Force or mass", each.force, "", (value) => set(editor, target, { force: value ?? "10 g" }), "with its unit: 0.5 N, 50 g"),
      choice("Kind of load", [["force", "force"], ["spring", "spring"]] as ["force" | "spring", string][], isSpring ? "spring" : "force", (picked) =>
        put(picked === "spring" ? { spring: 0.1, force: undefined, during: undefined } : { force: "10 g", spring: undefined }), `load-${target.index}`)),
    ...(isSpring ? [] : [
      ...whenItActs(each.during, (during) => put({ during }), `when-${target.index}`),
      actsBefore(each.during) ? null : rangeFields(editor, target, each.during)]),
  ];
}

/** A choice of when a load acts, before the input or with it, and what the former means. */
function whenItActs(during: LoadTable["during"], put: (during: LoadTable["during"]) => void, key: string): Child[] {
  const names: ["with" | "before", string][] = [["with", "grows with the input"], ["before", "before the input"]];
  return [
    choice("When it acts", names, actsBefore(during) ? "before" : "with", (picked) => put(rangeOf(picked === "before")), key),
    actsBefore(during) && h("p", { class: "note" }, "A weight that hangs on the part before it is pushed: it acts in the first fifth of the stroke, the input moves in the rest. Motions count from the part as drawn."),
  ];
}

function gravity(editor: TaskEditor): HTMLElement {
  const { gravity: given, gravity_during: during } = editor.task.table.cases[editor.loadCase]!;
  const put = (changes: Partial<CaseTable>): void =>
    editor.change(withInputsAfterWeights(withCase(editor, changes), editor.loadCase));
  const box = h("input", { type: "checkbox", checked: given !== undefined, "data-key": "gravity" });
  box.addEventListener("change", () =>
    put(box.checked ? { gravity: "down", gravity_during: rangeOf(true) } : { gravity: undefined, gravity_during: undefined }));
  return h("div", {}, h("label", { class: "tick" }, box, "The own weight acts, downwards"),
    ...(given === undefined ? [] : whenItActs(during, (range) => put({ gravity_during: range }), "when-gravity")));
}

/** The table with changes of the shown load case. */
function withCase(editor: TaskEditor, changes: Partial<CaseTable>): Table {
  const cases = editor.task.table.cases.map((each, k) => (k === editor.loadCase ? cleaned({ ...each, ...changes }) : each));
  return { ...editor.task.table, cases };
}

/** Bounds on the input force, and adding or removing load cases. */
function caseTools(editor: TaskEditor): HTMLElement {
  const { table } = editor.task;
  const own = table.cases[editor.loadCase]!;
  const forces = own.input_force ?? [];
  const addCase = (): void => {
    const named = table.cases.map((each, k) => ({ ...each, name: each.name ?? `case ${k + 1}` }));
    editor.change({ ...table, cases: [...named, { name: `case ${named.length + 1}`, inputs: [], outputs: [] }] });
    editor.showCase(named.length);
  };
  const dropCase = (): void => {
    editor.change({ ...table, cases: table.cases.filter((_, k) => k !== editor.loadCase) });
    editor.showCase(0);
  };
  return h("details", { class: "more-case", ...(forces.length || table.cases.length > 1 ? { open: true } : {}) }, h("summary", { "data-key": "case-more" }, "Input force, load cases"),
    ...forces.map((bounds, index) => itemRow(`case-force-${index}`, "input_force", INPUT_FORCE, bounds, (next) => editor.change(withCase(editor, { input_force: replaced(forces, index, next) })))),
    button("Bound the input force", () => editor.change(withCase(editor, { input_force: [...forces, { at_most: INPUT_FORCE.example }] })), "quiet", { "data-key": "add-force" }),
    table.cases.length > 1 && nameField(editor, own),
    h("div", { class: "buttons" },
      button("Add a load case", addCase, "", { "data-key": "add-case" }),
      table.cases.length > 1 && button("Remove this load case", dropCase, "quiet", { "data-key": "drop-case" })));
}

function nameField(editor: TaskEditor, own: CaseTable): HTMLElement {
  return amount("case-name", "Name of the load case", own.name, "", (value) => editor.change(withCase(editor, { name: value === undefined ? undefined : String(value) })));
}

function outputFields(editor: TaskEditor, each: OutputTable, target: Target): Child[] {
  const key = `outputs-${target.index}`;
  const several = sectionsOf(editor.task.table, editor.loadCase, "outputs").length > 1;
  const turns = isTurn(each);
  // Of an output that turns, the text is above its items.
  const usual = (name: QuantityName): Usual => (name === "rotation" && isSpatial(editor.task.table) ? { ...USUAL[name], about: ROTATION_IN_SPACE, isExplained: !turns } : USUAL[name]);
  const rows = QUANTITIES.flatMap((name) => (each[name] ?? []).map((bounds, index) => itemRow(`${key}-${name}-${index}`, name, usual(name), bounds, (next) => set(editor, target, { [name]: replaced(each[name], index, next) }))));
  const options: [string, string][] = [["", "choose …"], ...QUANTITIES.map((name): [string, string] => [name, `${USUAL[name].title}${each[name]?.length ? ", in another range" : ""}`]), ...(each.path || isSpatial(editor.task.table) ? [] : [["path", "path"] as [string, string]])];
  const add = select(options, "", (name) => {
    if (!name) return;
    if (name === "path") { set(editor, target, { path: { arc: [20, 60] } }); return; }
    const { bound, example } = USUAL[name as QuantityName];
    const known = each[name as QuantityName] ?? [];
    // What turns as far as possible, or by an angle at least, has further bounds of that kind.
    const isLarge = name === "rotation" && known.some(({ maximise, at_least, value }) => maximise || at_least !== undefined || value === "maximise");
    set(editor, target, { [name]: [...known, name === "gain" && !known.length ? { maximise: true } : { [isLarge ? "at_least" : bound]: example }] });
  });
  add.dataset.key = `${key}-add`;
  add.setAttribute("aria-label", "Ask for");
  return [
    ...(several ? [amount(`${key}-name`, "Name", each.name, "", (value) => set(editor, target, { name: value === undefined ? undefined : String(value) }))] : []),
    choice("Motion of the output", [["moves", "moves"], ["turns", "turns"]] as ["moves" | "turns", string][], turns ? "turns" : "moves", (picked) => editor.change(withSection(editor.task.table, editor.loadCase, target, otherMotion(editor, target, each, picked))), `motion-${target.index}`),
    turns && h("p", { class: "note" }, isSpatial(editor.task.table) ? ROTATION_IN_SPACE : "The mean rotation of its nodes counts: counter-clockwise is positive."),
    // The direction of an output that turns matters for its off-axis motion alone.
    (!turns || each.off_axis) && directionFields(editor, target, each.direction ?? "up"),
    turns && each.off_axis && h("p", { class: "note" }, "Off-axis motion is the mean motion of its nodes normal to this direction, over that along it."),
    h("div", { class: "wanted" }, ...rows, each.path ? pathRow(editor, each, target) : null,
      h("div", { class: "ask" }, h("span", {}, "Ask for"), add)),
    h("details", { ...(each.spring !== undefined ? { open: true } : {}) }, h("summary", { "data-key": `${key}-workpiece` }, "Workpiece that resists"),
      amount(`${key}-spring`, "Stiffness", each.spring, "N/mm", (value) => set(editor, target, { spring: value }), "of an object that the output pushes from its first motion on; empty for none")),
  ];
}

/** What is wanted of a quantity: one bound, whether it is maximised, and everything else on demand. */
function itemRow(key: string, name: string, { title, bound: usual, example, about, unit = "", isExplained }: Usual, bounds: Bounds, put: (next: Bounds | null) => void): HTMLElement {
  const isMaximised = bounds.maximise === true || bounds.value === "maximise";
  // Only a rotation has a single value that means a bound on both sides.
  const offered: [Bound, string][] = [["at_least", "at least"], ["at_most", "at most"], ["target", "equal to"]];
  if (usual === "value") offered.unshift(["value", "at most ±"]);
  const given = bounds.value === "maximise" ? undefined : bounds.value;
  const known = cleaned({ ...bounds, value: undefined, [given === undefined || usual === "value" ? "value" : usual]: given, maximise: isMaximised || undefined }) as Bounds;
  const bound = [usual, ...offered.map(([each]) => each)].find((each) => known[each] !== undefined) ?? (isMaximised && usual === "value" ? "at_least" : usual);
  const value = known[bound];
  const change = (changes: Bounds): void => put(cleaned({ ...known, ...changes }) as Bounds);
  const kind = select(offered.map(([each, text]): [string, string] => [each, text]), bound, (picked) => change({ [bound]: undefined, [picked]: value ?? example }));
  kind.dataset.key = `${key}-bound`;
  kind.setAttribute("aria-label", `Bound of the ${title}`);
  // Of an output that moves, a large rotation is not wanted.
  const isOffered = MAXIMISED.includes(name) && (name !== "rotation" || isMaximised);
  const maximise = h("input", { type: "checkbox", checked: isMaximised, "data-key": `${key}-maximise` });
  maximise.addEventListener("change", () => change({ maximise: maximise.checked || undefined, ...(maximise.checked || value !== undefined ? {} : { [bound]: example }) }));
  const minimise = h("input", { type: "checkbox", checked: known.minimise === true, "data-key": `${key}-minimise` });
  minimise.addEventListener("change", () => change({ minimise: minimise.checked || undefined }));
  const extra: (keyof Bounds)[] = ["at_least", "at_most", "target", "tolerance", "from", "to", "scale"];
  const labels: Record<string, string> = { at_least: "at least", at_most: "at most", target: "equal to", tolerance: "tolerance", from: "from (stroke)", to: "to (stroke)", scale: "scale" };
  const hasMore = extra.some((other) => other !== bound && known[other] !== undefined) || known.of !== undefined;
  const of = select([["", "every value"], ["largest", "the largest"], ["smallest", "the smallest"], ["spread", "the spread"]], known.of ?? "", (picked) => change({ ...(picked === "spread" ? plain(known) : {}), of: picked || undefined } as Bounds));
  of.dataset.key = `${key}-of`;
  // A load is in N or g, so that its unit is written; a spread is a ratio.
  const own = (next: Amount | undefined): Amount | undefined => (typeof next === "number" && unit.startsWith("N") && known.of !== "spread" ? `${next} ${unit}` : next);
  const input = amount(key, "", value, typeof value === "string" || known.of === "spread" ? "" : unit, (next) => change({ [bound]: own(next) }), value === undefined && !isMaximised ? `such as ${example}` : "");
  input.querySelector("label")!.remove();
  input.querySelector("input")!.setAttribute("aria-label", title);
  return h("div", { class: "item", "data-item": name },
    h("div", { class: "ask-line" },
      h("span", { class: "quantity", title: about }, title), kind, input,
      button("✕", () => put(null), "quiet small", { "data-key": `${key}-drop`, "aria-label": `Remove ${title}`, title: "Remove" })),
    isOffered && h("label", { class: "tick" }, maximise, "as large as possible"),
    MINIMISED.includes(name) && h("label", { class: "tick" }, minimise, "as small as possible"),
    isExplained && h("p", { class: "note" }, about),
    h("details", { ...(hasMore ? { open: true } : {}) }, h("summary", { "data-key": `${key}-more` }, "Other bounds"),
      !isExplained && h("p", { class: "note" }, about),
      isOffered ? null : h("label", { class: "tick" }, maximise, "as large as possible"),
      h("div", { class: "row" }, ...extra.filter((other) => other !== bound).map((other) =>
        amount(`${key}-${other}`, labels[other]!, known[other] as Amount | undefined, "", (next) => change({ [other]: ["at_least", "at_most", "target"].includes(other) ? own(next) : next } as Bounds))),
      field("In the range, bounds", of))));
}

/** Bounds without the unit that was added to a number. */
function plain(bounds: Bounds): Bounds {
  const keys = ["at_least", "at_most", "target"] as const;
  return Object.fromEntries(keys.flatMap((key) => {
    const given = /^([\d.]+) N(\/mm)?$/.exec(String(bounds[key] ?? ""));
    return given ? [[key, Number(given[1])]] : [];
  })) as Bounds;
}

/** A list of bounds with one of them replaced, or removed. */
function replaced(list: Bounds[] | undefined, index: number, next: Bounds | null): Bounds[] | undefined {
  const found = (list ?? []).flatMap((old, k) => (k === index ? (next ? [cleaned(next)] : []) : [old]));
  return found.length ? found : undefined;
}

function pathRow(editor: TaskEditor, each: OutputTable, target: Target): HTMLElement {
  const key = `outputs-${target.index}-path`;
  const path = each.path!;
  const isArc = path.arc !== undefined;
  const put = (next: OutputTable["path"]): void => set(editor, target, { path: next && cleaned(next) });
  const corners = (path.points ?? []).map((point) => point.join(", ")).join("; ");
  const input = amount(`${key}-points`, "Corners from rest, mm", corners || undefined, "", (value) => {
    const points = String(value ?? "").split(";").map((text) => text.split(",").map(Number) as [number, number]).filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
    if (points.length) put({ ...path, points });
  }, "such as 0, 0; −8, 0; −8, −8".replaceAll("−", "-"));
  return h("div", { class: "item", "data-item": "path" },
    h("div", { class: "ask-line" }, h("span", { class: "quantity" }, "path"),
      choice("Kind of path", [["arc", "arc"], ["points", "corners"]] as ["arc" | "points", string][], isArc ? "arc" : "points", (picked) =>
        put(picked === "arc" ? { arc: [20, 60], error: path.error } : { points: [[0, 0], [-10, 0]], error: path.error }), `${key}-kind`),
      button("Remove", () => put(undefined), "quiet small", { "data-key": `${key}-drop`, "aria-label": "Remove path" })),
    isArc ? h("div", { class: "row" },
      amount(`${key}-radius`, "Radius", path.arc![0], "mm", (value) => put({ ...path, arc: [value ?? 20, path.arc![1]] })),
      amount(`${key}-turn`, "Angle", path.arc![1], "°", (value) => put({ ...path, arc: [path.arc![0], value ?? 60] }))) : input,
    amount(`${key}-error`, "Error at most", path.error, "", (value) => put({ ...path, error: value }), "a part of its length, 1% by default"));
}
