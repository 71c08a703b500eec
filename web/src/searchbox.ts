// Settings of a search, and the button that starts it.

import type { ServerError } from "./api";
import { choice, field, h, number, select } from "./dom";
import type { Settings, TaskEditor } from "./editing";
import { sentence } from "./text";

const EFFORTS: [string, string, number, number, string][] = [
  ["quick", "Quick", 4000, 2, "Seconds on a small lattice, for a first impression."],
  ["usual", "Standard", 25000, 2, "About half a minute for the crane. Sufficient in most cases."],
  ["long", "Thorough", 100000, 4, "Minutes, for a part to be built."],
];

export class SearchBox {
  private fault = "";
  private busy = false;
  private expanded = false;

  constructor(private readonly editor: TaskEditor, private readonly refresh: () => void) {}

  /** Return the panel in its current state. */
  make(): HTMLElement {
    const { editor } = this;
    const { settings } = editor;
    const methods = editor.registries?.searches ?? [];
    const update = (changes: Partial<Settings>): void => { editor.settings = { ...editor.settings, ...changes }; this.refresh(); };
    const whole = (key: "steps" | "chains" | "seed", label: string, least: number, most: number): HTMLElement => {
      const input = number(settings[key], { min: least, max: most, step: 1 }, (value) => update({ [key]: Math.min(most, Math.max(least, Math.round(value))) }));
      input.dataset.key = key;
      return field(label, input);
    };
    const effort = EFFORTS.find(([, , steps, chains]) => steps === settings.steps && chains === settings.chains)?.[0] ?? "";
    const forPart = h("input", { type: "checkbox", checked: settings.forPart, "data-key": "for-part" });
    forPart.addEventListener("change", () => { update({ forPart: forPart.checked }); editor.updateModel(); });
    const method = select(methods.map(({ name, title }) => [name, title]), settings.method, (picked) => update({ method: picked }));
    method.dataset.key = "method";
    const width = number(settings.width, { min: 0.1, step: "any" }, (value) => { update({ width: value }); editor.updateModel(); });
    width.dataset.key = "width";
    const { missing } = editor;
    return h("section", { class: "step search open" },
      h("h2", { class: "plain" }, "Search"),
      h("div", { class: "content" },
        choice("Effort", EFFORTS.map(([key, name]) => [key, name]), effort as never, (picked) => {
          const found = EFFORTS.find(([key]) => key === picked)!;
          update({ steps: found[2], chains: found[3] });
        }),
        h("p", { class: "note" }, EFFORTS.find(([key]) => key === effort)?.[4] ?? `${settings.chains} chains of ${settings.steps.toLocaleString("en")} steps.`),
        h("details", { ...(this.expanded ? { open: true } : {}), ontoggle: (event: Event) => { this.expanded = (event.target as HTMLDetailsElement).open; } },
          h("summary", { "data-key": "more" }, "Method, seed, strut width"),
          field("Method", method, "", methods.find(({ name }) => name === settings.method)?.summary ?? ""),
          h("div", { class: "row three" }, whole("steps", "Steps", 1, 2_000_000), whole("chains", "Chains", 1, 64), whole("seed", "Seed", 0, 2 ** 31)),
          h("label", { class: "tick" }, forPart, "Design a part with struts of this width"),
          settings.forPart ? field("Strut width", width, "mm", "Designs are frames of such struts; the best are verified with 8 elements in each strut.")
            : h("p", { class: "note" }, "The discrete model of the paper; its springs are those of struts half as wide as long.")),
        h("button", { type: "button", class: "primary", "data-key": "begin", disabled: !!missing || !!editor.fault || !settings.method || this.busy,
          onclick: () => void this.start() }, "Design it"),
        missing && h("p", { class: "note" }, missing.message),
        this.fault && h("p", { class: "fault", role: "alert" }, this.fault)));
  }

  private async start(): Promise<void> {
    this.busy = true;
    this.fault = "";
    this.refresh();
    try {
      await this.editor.startSearch();
    } catch (error) {
      this.fault = sentence((error as ServerError).message);
    }
    this.busy = false;
    this.refresh();
  }
}
