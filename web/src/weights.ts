// Weights that act before the input: forces in the first part of the stroke.

import { cleaned, sectionsOf, withSections, type Amount, type InputTable, type LoadTable, type Table } from "./task";

type Range = [Amount, Amount];

/** Parts of the stroke in which a weight begins to act, and in which the input moves. */
const WEIGHT: Range = ["0%", "20%"];
const INPUT: Range = ["20%", "100%"];

const isRange = (given: Range | undefined, wanted: Range): boolean => given !== undefined && String(given) === String(wanted);

/** Whether a load acts before the input. */
export function isWeight(load: LoadTable): boolean {
  return isRange(load.during, WEIGHT);
}

/** What makes a load act before the input, or grow with it. */
export function whenActs(before: boolean): Pick<LoadTable, "during"> {
  return { during: before ? WEIGHT : undefined };
}

/** A table whose inputs move after the weights of a load case, if it has any, else along the whole stroke. */
export function withInputsAfterWeights(table: Table, loadCase: number): Table {
  const weighed = (sectionsOf(table, loadCase, "loads") as LoadTable[]).some(isWeight);
  const inputs = (sectionsOf(table, loadCase, "inputs") as InputTable[]).map((each) =>
    weighed ? { ...each, during: each.during ?? INPUT } : isRange(each.during, INPUT) ? cleaned({ ...each, during: undefined }) : each);
  return withSections(table, loadCase, "inputs", inputs);
}
