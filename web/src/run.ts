// The progress of a search, and its result.

import { fetchRegistries, follow, get, isInSpace, modelOf, post, remove, type Registries, type RunUpdate, type ServerError, type Run, type RunDetails } from "./api";
import { bitsOf } from "./api";
import { Chart } from "./chart";
import { Drawing, flatten, projected, where } from "./drawing";
import { announce, button, choice, clear, count, duration, figure, h } from "./dom";
import { Result } from "./result";
import { itemTable, verdictOf } from "./specification";
import { runMessage, REMEDIES, sentence } from "./text";

export class RunPage {
  readonly element = h("div", { class: "page run" });
  private readonly drawing = new Drawing("The best design so far, deformed");
  private readonly chart = new Chart();
  private readonly head = h("div", { class: "intro" });
  private readonly live = h("div", { class: "live" });
  private readonly items = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": "Specification" });
  private readonly stage = h("section", { class: "stage", "aria-label": "Design" });
  private readonly controls = h("div", { class: "buttons" });
  private readonly trouble = h("p", { class: "fault", role: "alert" });
  private readonly readout = h("div", { class: "readout" });
  private readonly watch: HTMLElement;
  private readonly side = h("div", { class: "side" });
  private readonly paper = h("div", { class: "paper" }, this.readout, this.drawing.svg);
  private readonly switcher = h("div", { class: "bar" });
  private result: Result | null = null;
  private shown = "";
  private update: RunUpdate | null = null;
  private chain = "best";
  private readonly leave: () => void;
  private showing: "live" | "human" = "live";
  private shownStatus = "";
  private method: Registries["searches"][number] | null = null;
  private readonly curveNote = h("p", { class: "note" });

  constructor(private run: RunDetails) {
    this.drawing.setLattice(projected(run.problem.positions), run.problem.beams);
    this.chart.configure(run.settings);
    if (run.comparison) this.chart.compare(run.comparison.title, run.comparison.efficiency);
    this.stage.append(this.switcher, this.paper);
    const card = h("section", { class: "card", "aria-label": "Efficiency along the search" },
      h("h2", {}, "Efficiency along the search"), this.chart.svg,
      this.curveNote);
    card.hidden = run.refine;
    this.watch = h("aside", { class: "panel", "aria-label": "Search" },
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Search"), this.live, this.items, this.controls, this.trouble));
    this.side.append(this.watch);
    this.element.append(this.head, h("div", { class: "main" }, this.stage, card), this.side);
    this.show(run);
    this.draw(run.problem.initial, null);
    if (run.mask) void this.open();
    void fetchRegistries().then(({ searches }) => this.describeMethod(searches.find(({ name }) => name === run.method)), () => undefined);
    this.leave = follow(`/runs/${run.id}/live`, (update) => this.receive(update), (lost) => {
      this.trouble.textContent = lost ? "The server cannot be reached. The search continues when it is restarted." : "";
    });
  }

  close(): void {
    this.leave();
    this.result?.close();
  }

  /** Describe the curves and the method, which the registry of searches defines. */
  private describeMethod(search: Registries["searches"][number] | undefined): void {
    if (!search) return;
    this.method = search;
    const curve = search.running_best ? "Best efficiency of each chain so far." : "Efficiency of the current design of each chain.";
    this.curveNote.textContent = `${curve}${this.run.settings.replicas === undefined ? " Shaded: phases of higher temperature." : ""}`;
    this.show(this.run);
  }

  private receive(update: RunUpdate): void {
    if (update.error) { this.trouble.textContent = sentence(update.error.message); return; }
    const before = this.run.status;
    this.update = update;
    this.run = { ...this.run, ...update.run };
    if (Object.keys(update.points).length || update.reset) this.chart.add(update.points, update.reset);
    this.show(this.run);
    if (!this.result) this.drawLive();
    const done = (status: string): boolean => status === "finished" || status === "stopped";
    if (done(this.run.status) && (!this.result || !done(before))) void this.open();
  }

  private drawLive(): void {
    const { update } = this;
    if (this.showing === "human" && this.run.comparison) {
      this.draw(this.run.comparison.mask, null);
      return;
    }
    const chain = this.chain === "best" ? null : update?.chains[this.chain];
    if (chain) this.draw(chain.mask, null);
    else if (update?.moved) this.draw(update.moved.mask, update.moved.displacement);
  }

  private draw(mask: string, given: number[] | null): void {
    const displacement = given && this.flat(given);
    const bits = bitsOf(mask, this.run.problem.beams.length);
    const old = bitsOf(this.shown || mask, bits.length);
    this.drawing.move(null);
    this.drawing.ghost("possible", where(bits, 0));
    this.drawing.ghost("rest", where(bits));
    this.drawing.move(displacement);
    if (displacement) this.drawing.makeRoom(where(bits), displacement);
    const gone = where(Uint8Array.from(bits, (bit, k) => (old[k] && !bit ? 1 : 0)));
    const came = where(Uint8Array.from(bits, (bit, k) => (!old[k] && bit ? 1 : 0)));
    this.drawing.draw([{ name: "plain", beams: where(bits) }, { name: "gone", beams: gone }, { name: "came", beams: came }]);
    for (const name of ["gone", "came"]) {
      const path = this.drawing.path(name);
      path.style.animation = "none";
      path.getBoundingClientRect();
      path.style.animation = "";
    }
    this.drawing.markRegions(this.run.problem);
    this.shown = mask;
  }

  /** A displacement as it is drawn: that of a part in space in oblique view. */
  private flat(displacement: number[]): ArrayLike<number> {
    if (!isInSpace(this.run.problem)) return displacement;
    const moved = Array.from({ length: displacement.length / 3 }, (_, k): [number, number, number] => [displacement[3 * k]!, displacement[3 * k + 1]!, displacement[3 * k + 2]!]);
    return flatten(projected(moved));
  }

  private async open(): Promise<void> {
    const whole = await get<RunDetails>(`/runs/${this.run.id}`);
    this.run = whole;
    if (whole.comparison) this.chart.compare(whole.comparison.title, whole.comparison.efficiency);
    if (!whole.mask) return;
    this.result?.close();
    this.result?.element.remove();
    this.result = new Result({
      title: whole.title, problem: whole.problem, mask: whole.mask, efficiency: whole.efficiency, provenance: whole.provenance,
      comparison: whole.comparison, part: whole.part, history: whole.id, plan: null, task: whole.task, place: ["runs", whole.id],
    });
    clear(this.stage, this.result.player.element);
    this.side.prepend(this.result.element);
    this.element.querySelector(".main")!.append(this.watch);
    this.show(whole);
  }

  private show(run: Run): void {
    const settings = run.settings;
    if (this.shownStatus !== `${run.status}${run.title}`) {
      this.shownStatus = `${run.status}${run.title}`;
      clear(this.head, h("h1", {}, run.title), h("p", {}, h("span", { class: `status ${run.status}` }, run.status),
        run.status === "queued" && run.place > 0 ? `, ${count(run.place, "search", "searches")} ahead` : ""));
      announce(`${run.title}: ${run.status}`);
      this.showControls(run);
      this.showSwitcher();
    }
    const made = Object.values(this.update?.chains ?? {}).reduce((sum, chain) => sum + chain.step, 0);
    const done = run.status === "finished" && !run.refine ? run.total : Math.max(run.done, made);
    const share = run.status === "finished" ? 1 : Math.min(1, done / run.total);
    const running = run.status === "running";
    const specified = Boolean(this.run.problem.specification);
    const tried = this.update?.tried;
    const refined = this.update?.refined;
    const last: [string, string] = refined ? ["refinement", `${count(refined.designs, "design")}, ${count(refined.geometries, "geometry", "geometries")}${refined.objective === null ? "" : `, best ${figure(refined.objective, 2)}`}`]
      : tried ? ["candidates verified", `${tried[0]} of at most ${tried[1]}`] : ["time left", duration(this.update?.left)];
    const rows: [string, string][] = run.refine ? [["refinement", refined ? last[1] : running ? "starting …" : `${done.toLocaleString("en")} geometries`]] : [
      [specified ? "largest objective" : "best so far", this.bestText(run)],
      ["steps", `${done.toLocaleString("en")} of ${run.total.toLocaleString("en")}`],
      ...(running ? [["speed", this.update?.speed ? `${Math.round(this.update.speed).toLocaleString("en")} steps/s` : "starting …"], last] as [string, string][] : []),
      ["method", `${this.method?.title ?? run.method}, ${count(settings.chains, "chain")}, seed ${settings.seed}`],
      ...(settings.goals.length ? [["constraints", settings.goals.join(", ")]] as [string, string][] : []),
    ];
    let bar = this.live.querySelector("progress");
    if (!bar) {
      bar = h("progress", { max: 1, "aria-label": "Progress of the search" });
      this.live.append(bar, h("dl", { class: "facts" }));
    }
    bar.value = share;
    clear(this.live.querySelector("dl")!, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
    const reached = this.update?.moved?.items;
    clear(this.items, !this.result && reached && h("p", { class: `verdict ${reached.every(({ met }) => met) ? "met" : "missed"}` }, `${verdictOf(reached)} by the best design so far, before refinement.`),
      !this.result && reached && itemTable([{ title: "search", items: reached }]));
    if (run.message && run.status !== "running") this.showMessage(run);
    if (!this.result) {
      const moved = this.update?.moved;
      const value = moved?.efficiency ?? run.efficiency ?? this.chart.best;
      clear(this.readout, value !== null && h("strong", {}, figure(value, 3)), h("span", {}, this.stateText(run, value !== null, done)));
    }
  }

  private bestText(run: Run): string {
    const best = run.efficiency ?? this.chart.best;
    return best === null && this.run.problem.specification && this.chart.curves.size ? "no design meets all items yet" : figure(best, 3);
  }

  /** Show why a search has no design, and suggestions. */
  private showMessage(run: Run): void {
    const none = /accepted|found/.test(run.message);
    clear(this.trouble, runMessage(run.message), none && h("span", { class: "advice" }, " Suggestions: ",
      ...REMEDIES.flatMap((text) => [h("br"), text]), h("br"), h("a", { href: "#/draw" }, "Back to the task")));
  }

  private showSwitcher(): void {
    const chains = [["best", "Best"], ...Array.from({ length: Math.min(6, this.run.settings.chains) }, (_, k) => [String(k), `Chain ${k + 1}`])] as [string, string][];
    if (this.run.comparison) chains.push(["human", this.run.comparison.title === "yours" ? "Yours" : "By hand"]);
    if (!this.run.refine) clear(this.switcher, choice("Displayed design", chains, this.showing === "human" ? "human" : this.chain, (picked) => {
      this.showing = picked === "human" ? "human" : "live";
      this.chain = picked === "human" ? "best" : picked;
      this.drawLive();
    }));
  }

  private stateText(run: Run, known: boolean, done: number): string {
    if (run.status !== "running") return run.status;
    if (known) return `best design so far, ${modelOf(this.run.problem)}`;
    return done ? "No admissible design yet." : "Starting …";
  }

  private showControls(run: Run): void {
    const act = (action: string) => async (): Promise<void> => {
      try {
        this.trouble.textContent = "";
        await post(`/runs/${run.id}/${action}`);
      } catch (error) {
        this.trouble.textContent = sentence((error as ServerError).message);
      }
    };
    const erase = async (): Promise<void> => {
      if (!confirm("Delete this search and all its results?")) return;
      await remove(`/runs/${run.id}`);
      location.hash = "#/runs";
    };
    const { status } = run;
    clear(this.controls,
      (status === "running" || status === "queued") && button("Pause", () => void act("pause")()),
      status === "running" && button(run.refine ? "Stop and take the result" : "Stop and choose the best", () => void act("stop")(), "strong"),
      (status === "paused" || status === "stopped" || status === "failed") && button(status === "failed" ? "Retry" : "Continue", () => void act("resume")(), "strong"),
      status === "paused" && !run.refine && button("Choose the best", () => void act("stop")()),
      status !== "running" && button("Delete", () => void erase(), "quiet"));
  }
}
