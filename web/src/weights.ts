// Weights that act before the input: forces in the first part of the stroke.

import { cleaned, sectionsOf, withSections, type Amount, type InputTable, type LoadTable, type Table } from "./task";

type Range = [Amount, Amount];

/** Parts of the stroke in which a weight begins to act, and in which the input moves. */
const WEIGHT: Range = ["0%", "20%"];
const INPUT: Range = ["20%", "100%"];

const isRange = (given: Range | undefined, wanted: Range): boolean => given !== undefined && String(given) === String(wanted);

/** Whether a load with this range acts before the input. */
export function actsBefore(during: Range | undefined): boolean {
  return isRange(during, WEIGHT);
}

/** The range of a load that acts before the input, or grows with it. */
export function rangeOf(before: boolean): Range | undefined {
  return before ? WEIGHT : undefined;
}

/** A table whose inputs move after the weights of a load case, if it has any, else along the whole stroke. */
export function withInputsAfterWeights(table: Table, loadCase: number): Table {
  const ranges = [...(sectionsOf(table, loadCase, "loads") as LoadTable[]).map((each) => each.during), table.cases[loadCase]?.gravity_during];
  const weighed = ranges.some(actsBefore);
  const inputs = (sectionsOf(table, loadCase, "inputs") as InputTable[]).map((each) =>
    weighed ? { ...each, during: each.during ?? INPUT } : isRange(each.during, INPUT) ? cleaned({ ...each, during: undefined }) : each);
  return withSections(table, loadCase, "inputs", inputs);
}
