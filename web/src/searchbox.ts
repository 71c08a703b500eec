// How a design is searched, and the button that begins.

import type { Refusal } from "./api";
import { choice, field, h, number, select } from "./dom";
import type { Editor } from "./editor";
import { sentence } from "./words";

const METHODS: [string, string, string][] = [
  ["basin-hopping", "Basin hopping", "Climbs, disturbs a part, climbs again. The best in most cases."],
  ["tempering", "Tempering", "Chains at several temperatures that exchange designs."],
  ["paper", "The paper", "Single random flips, as Bonfanti et al. (2020) published it."],
];
const EFFORTS: [string, string, number, number, string][] = [
  ["quick", "Quick", 4000, 2, "Seconds on a small lattice: to see what can be had."],
  ["usual", "Usual", 20000, 4, "About a minute. Good in most cases."],
  ["long", "Thorough", 100000, 4, "Minutes: for what you mean to build."],
];

export class SearchBox {
  private fault = "";
  private busy = false;
  private more = false;

  constructor(private readonly editor: Editor, private readonly refresh: () => void) {}

  /** Return it as it is now. */
  make(): HTMLElement {
    const { editor } = this;
    const { settings } = editor;
    const update = (changes: Partial<typeof settings>): void => { editor.settings = { ...editor.settings, ...changes }; this.refresh(); };
    const whole = (key: "steps" | "chains" | "seed", label: string, least: number, most: number): HTMLElement => {
      const input = number(settings[key], { min: least, max: most, step: 1 }, (value) => update({ [key]: Math.min(most, Math.max(least, Math.round(value))) }));
      input.dataset.key = key;
      return field(label, input);
    };
    const effort = EFFORTS.find(([, , steps, chains]) => steps === settings.steps && chains === settings.chains)?.[0] ?? "";
    const real = h("input", { type: "checkbox", checked: settings.real, "data-key": "real" });
    real.addEventListener("change", () => { update({ real: real.checked }); editor.restiffen(); });
    const method = select(METHODS.map(([key, name]) => [key, name]), settings.method, (picked) => update({ method: picked }));
    method.dataset.key = "method";
    const width = number(settings.width, { min: 0.1, step: "any" }, (value) => { update({ width: value }); editor.restiffen(); });
    width.dataset.key = "width";
    const { missing } = editor;
    return h("section", { class: "step search open" },
      h("h2", { class: "plain" }, "Search"),
      h("div", { class: "content" },
        choice("How long", EFFORTS.map(([key, name]) => [key, name]), effort as never, (picked) => {
          const found = EFFORTS.find(([key]) => key === picked)!;
          update({ steps: found[2], chains: found[3] });
        }),
        h("p", { class: "note" }, EFFORTS.find(([key]) => key === effort)?.[4] ?? `${settings.steps.toLocaleString("en")} steps of ${settings.chains} chains.`),
        h("details", { ...(this.more ? { open: true } : {}), ontoggle: (event: Event) => { this.more = (event.target as HTMLDetailsElement).open; } },
          h("summary", { "data-key": "more" }, "Method, seed, strut width"),
          field("Method", method, "", METHODS.find(([key]) => key === settings.method)![2]),
          h("div", { class: "row three" }, whole("steps", "Steps", 1, 2_000_000), whole("chains", "Chains", 1, 64), whole("seed", "Seed", 0, 2 ** 31)),
          h("label", { class: "tick" }, real, "For a part with struts this wide"),
          settings.real ? field("Strut width", width, "mm", "The best designs are tried as such a part, and the best part is taken.")
            : h("p", { class: "note" }, "The springs have the stiffness of the task, the paper's by default.")),
        h("button", { type: "button", class: "primary", "data-key": "begin", disabled: !!missing || !!editor.fault || this.busy,
          onclick: () => void this.begin() }, "Design it"),
        missing && h("p", { class: "note" }, missing.message),
        this.fault && h("p", { class: "fault", role: "alert" }, this.fault)));
  }

  private async begin(): Promise<void> {
    this.busy = true;
    this.fault = "";
    this.refresh();
    try {
      await this.editor.begin();
    } catch (error) {
      this.fault = sentence((error as Refusal).message);
    }
    this.busy = false;
    this.refresh();
  }
}
