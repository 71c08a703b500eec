// Settings of a search, and the button that starts it.

import type { ServerError } from "./api";
import { choice, field, h, number, select } from "./dom";
import type { Settings, TaskEditor } from "./editing";
import { sentence } from "./text";

const EFFORTS: [string, string, number, number, string][] = [
  ["quick", "Quick", 2000, 2, "Half a minute of search for a small flat part."],
  ["usual", "Standard", 8000, 2, "A minute or two of search for a small flat part; longer with more nodes and in space."],
  ["long", "Thorough", 25000, 4, "Some ten minutes of search for a small flat part; for tasks that Standard does not meet."],
];

const REFINED = " The refinement of the best designs takes some minutes more; it can be stopped at any time and keeps what it has reached.";

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
    const whole = (key: "steps" | "chains" | "seed", label: string, least: number, most: number, help = ""): HTMLElement => {
      const input = number(settings[key], { min: least, max: most, step: 1 }, (value) => update({ [key]: Math.min(most, Math.max(least, Math.round(value))) }));
      input.dataset.key = key;
      return field(label, input, "", help);
    };
    const effort = EFFORTS.find(([, , steps, chains]) => steps === settings.steps && chains === settings.chains)?.[0] ?? "";
    const method = select(methods.map(({ name, title }) => [name, title]), settings.method, (picked) => update({ method: picked }));
    method.dataset.key = "method";
    return h("section", { class: "step search open" },
      h("h2", { class: "plain" }, "Search"),
      h("div", { class: "content" },
        choice("Effort", EFFORTS.map(([key, name]) => [key, name]), effort as never, (picked) => {
          const found = EFFORTS.find(([key]) => key === picked)!;
          update({ steps: found[2], chains: found[3] });
        }),
        h("p", { class: "note" }, (EFFORTS.find(([key]) => key === effort)?.[4] ?? `${settings.chains} chains of ${settings.steps.toLocaleString("en")} steps.`) + (editor.built?.problem?.specification ? REFINED : "")),
        h("details", { ...(this.expanded ? { open: true } : {}), ontoggle: (event: Event) => { this.expanded = (event.target as HTMLDetailsElement).open; } },
          h("summary", { "data-key": "more" }, "Method, steps, seed"),
          field("Method", method, "", methods.find(({ name }) => name === settings.method)?.summary ?? ""),
          h("div", { class: "row three" }, whole("steps", "Steps", 1, 2_000_000, "of each chain"), whole("chains", "Chains", 1, 64, "searches side by side"), whole("seed", "Seed", 0, 2 ** 31, "another number, another search"))),
        editor.hasHandDesign && h("label", { class: "tick" }, this.fromHand(), "Begin with the design by hand")));
  }

  /** The button that starts the search, which stays in view below the panel. */
  makeButton(): HTMLElement {
    const { editor } = this;
    return h("div", { class: "start-search" },
      h("button", { type: "button", class: "primary", "data-key": "begin", disabled: !editor.built?.problem || !!editor.fault || !editor.settings.method || this.busy,
        onclick: () => void this.start() }, "Design it"),
      editor.missing && h("p", { class: "note" }, "Supports, an input and an output are needed."),
      editor.fault && h("p", { class: "fault" }, editor.fault.text),
      this.fault && h("p", { class: "fault", role: "alert" }, this.fault));
  }

  private fromHand(): HTMLInputElement {
    const { settings } = this.editor;
    const box = h("input", { type: "checkbox", checked: settings.fromHand, "data-key": "from-hand" });
    box.addEventListener("change", () => { this.editor.settings = { ...this.editor.settings, fromHand: box.checked }; });
    return box;
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
