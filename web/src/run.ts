// The progress of a search, and its result.

import { fetchRegistries, follow, get, isInSpace, modelOf, post, remove, type ItemState, type Problem, type Registries, type RunUpdate, type ServerError, type Run, type RunDetails } from "./api";
import { bitsOf } from "./api";
import { Chart } from "./chart";
import { outputTips } from "./marks";
import { Drawing, markRegions, sectionOf, where, type LatticeDrawing } from "./drawing";
import { loadSpace } from "./loadspace";
import { announce, button, choice, clear, count, duration, figure, h, percent } from "./dom";
import { Result } from "./result";
import { itemTable, otherObjective, verdictOf } from "./specification";
import { runMessage, REMEDIES, sentence, statusName } from "./text";

/** Titles of the button that ends a refinement or a search. */
const TAKE = "Stop and take the result";
const CHOOSE = "Stop and choose the best";

export class RunPage {
  readonly element = h("div", { class: "page run" });
  private drawing: LatticeDrawing | null = null;
  private readonly chart = new Chart();
  private readonly head = h("div", { class: "intro" });
  private readonly live = h("div", { class: "live" });
  private readonly items = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": "Specification" });
  private readonly stage = h("section", { class: "stage", "aria-label": "Design" });
  private readonly controls = h("div", { class: "buttons" });
  private readonly trouble = h("p", { class: "fault", role: "alert" });
  private readonly notice = h("p", { class: "note", role: "status" });
  private readonly readout = h("div", { class: "readout" });
  private readonly watch: HTMLElement;
  private readonly card: HTMLElement;
  private readonly side = h("div", { class: "side" });
  private readonly paper = h("div", { class: "paper" }, this.readout);
  private readonly switcher = h("div", { class: "bar" });
  private result: Result | null = null;
  private shown = "";
  /** Problem of the drawn design, if it is refined. */
  private refined: Problem | null = null;
  private isAtRest = false;
  private isClosed = false;
  /** What the user has asked for that the server has not done yet. */
  private asked = "";
  private update: RunUpdate | null = null;
  private chain = "best";
  private readonly leave: () => void;
  private showing: "live" | "human" = "live";
  private shownStatus = "";
  private method: Registries["searches"][number] | null = null;
  private readonly curveTitle = h("h2");
  private readonly curveNote = h("p", { class: "note" });

  constructor(private run: RunDetails) {
    this.chart.configure(run.settings);
    if (run.comparison) this.chart.compare(run.comparison.title, run.comparison.efficiency);
    this.stage.append(this.switcher, this.paper);
    this.card = h("section", { class: "card", "aria-label": "Progress of the search" }, this.curveTitle, this.chart.svg, this.curveNote);
    this.curveTitle.textContent = !run.problem.specification ? "Efficiency along the search" : `${this.hasObjective ? "Objective" : "Smallest margin of the items"} along the search, before refinement`;
    this.card.hidden = run.refine;
    this.watch = h("aside", { class: "panel", "aria-label": "Search" },
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Search"), this.live, this.items, this.controls, this.notice, this.trouble));
    this.side.append(this.watch);
    this.element.append(this.head, h("div", { class: "main" }, this.stage, this.card), this.side);
    this.show(run);
    void this.openDrawing();
    if (run.mask) void this.open();
    void fetchRegistries().then(({ searches }) => this.describeMethod(searches.find(({ name }) => name === run.method)), () => undefined);
    this.leave = follow(`/runs/${run.id}/live`, (update) => this.receive(update), (lost) => {
      this.trouble.textContent = lost ? "The server cannot be reached. The search continues when it is restarted." : "";
    });
  }

  close(): void {
    this.isClosed = true;
    this.leave();
    this.drawing?.close();
    this.result?.close();
  }

  /** Describe the curves and the method, which the registry of searches defines. */
  private describeMethod(search: Registries["searches"][number] | undefined): void {
    if (!search) return;
    this.method = search;
    const curve = search.running_best ? "The best design of each chain so far, that of the best chain in blue." : "The current design of each chain.";
    const missed = this.run.problem.specification ? " Only designs that meet the items, or miss them by what a refinement mends, have a point in the chart." : "";
    // Struts of the drawing may carry no load yet.
    this.curveNote.textContent = `Struts without load are removed from the result. ${curve}${missed}${this.run.settings.replicas === undefined ? " Shaded: steps that also accept worse designs." : ""}`;
    this.show(this.run);
  }

  private receive(update: RunUpdate): void {
    if (update.error) { this.trouble.textContent = sentence(update.error.message); return; }
    const before = this.run.status;
    this.update = { ...update, moved: update.moved ?? this.update?.moved ?? null };
    this.run = { ...this.run, ...update.run };
    this.chart.unit = this.unit.size;
    if (update.refined?.objective != null) this.chart.setRefined(update.refined.objective);
    if (Object.keys(update.points).length || update.reset) this.chart.add(update.points, update.reset);
    this.show(this.run);
    if (!this.result) this.drawLive();
    const done = (status: string): boolean => status === "finished" || status === "stopped";
    if (done(this.run.status) && (!this.result || !done(before))) void this.open();
  }

  private drawLive(): void {
    const { update } = this;
    if (this.showing === "human" && this.run.comparison) {
      this.draw(this.run.comparison.mask, null, null);
      return;
    }
    const chain = this.chain === "best" ? null : update?.chains[this.chain];
    if (chain) this.draw(chain.mask, null, null);
    else if (update?.moved) this.draw(update.moved.mask, update.moved.displacement, update.moved.problem);
  }

  /** Open the drawing, flat or in space, with the design that the search begins with. */
  private async openDrawing(): Promise<void> {
    const { problem } = this.run;
    const label = "The best design so far, deformed";
    try {
      const drawing = isInSpace(problem) ? await loadSpace(label, sectionOf(problem)) : new Drawing(label);
      if (this.isClosed) { drawing.close(); return; }
      this.drawing = drawing;
    } catch (error) {
      this.trouble.textContent = sentence((error as Error).message);
      return;
    }
    this.drawing.setLattice(problem.positions, problem.beams);
    if (this.drawing instanceof Drawing && this.run.part) this.drawing.dimensions(this.run.part.scale, outputTips(problem));
    this.paper.append(this.drawing.element);
    this.draw(problem.initial, null, null);
    this.drawLive();
  }

  /** Draw a design; `refined` is its problem if its nodes have moved. */
  private draw(mask: string, displacement: number[] | null, refined: Problem | null): void {
    const { drawing } = this;
    if (!drawing || (mask === this.shown && refined === this.refined && !displacement && this.isAtRest)) return;
    if (refined !== this.refined) {
      const shape = refined ?? this.run.problem;
      drawing.setGeometry(shape.positions, sectionOf(shape));
      this.refined = refined;
    }
    const bits = bitsOf(mask, this.run.problem.beams.length);
    const old = bitsOf(this.shown || mask, bits.length);
    this.isAtRest = !displacement;
    drawing.ghost("possible", drawing instanceof Drawing ? where(bits, 0) : []);
    drawing.ghost("rest", where(bits));
    drawing.at = displacement ? Float64Array.from(drawing.rest, (value, k) => value + displacement[k]!) : drawing.rest;
    if (displacement) drawing.makeRoom(where(bits), displacement);
    const gone = where(Uint8Array.from(bits, (bit, k) => (old[k] && !bit ? 1 : 0)));
    const came = where(Uint8Array.from(bits, (bit, k) => (!old[k] && bit ? 1 : 0)));
    if (drawing instanceof Drawing) {
      drawing.draw([{ name: "plain", beams: where(bits) }, { name: "gone", beams: gone }, { name: "came", beams: came }]);
      for (const name of ["gone", "came"]) {
        const path = drawing.path(name);
        path.style.animation = "none";
        path.getBoundingClientRect();
        path.style.animation = "";
      }
    } else drawing.draw([{ name: "plain", beams: where(bits) }]);
    markRegions(drawing, this.run.problem);
    this.shown = mask;
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
    // The drawing stays in view beside the result.
    this.side.append(this.card, this.watch);
    this.show(whole);
  }

  private show(run: Run): void {
    const settings = run.settings;
    if (this.shownStatus !== `${run.status}${run.title}`) {
      this.shownStatus = `${run.status}${run.title}`;
      clear(this.head, h("h1", {}, run.title), h("p", {}, h("span", { class: `status ${run.status}` }, statusName(run.status)),
        run.status === "queued" && run.place > 0 ? `, ${count(run.place, "search", "searches")} ahead` : ""));
      announce(`${run.title}: ${statusName(run.status)}`);
      this.showControls(run);
      this.showSwitcher();
    }
    const made = Object.values(this.update?.chains ?? {}).reduce((sum, chain) => sum + chain.step, 0);
    const done = run.status === "finished" && !run.refine ? run.total : Math.max(run.done, made);
    const refinedShare = this.update?.refined ? this.update.refined.geometries / this.update.refined.most : 0;
    const triedShare = this.update?.tried ? this.update.tried[0] / this.update.tried[1] : 0;
    // Phases after the search have a bar of their own; both may end before it is full.
    const share = run.status === "finished" ? 1 : Math.min(1, run.refine ? done / run.total : refinedShare || triedShare || done / run.total);
    const running = run.status === "running";
    if (!running && this.asked) { this.asked = ""; this.showControls(run); }
    const specified = Boolean(this.run.problem.specification);
    const tried = this.update?.tried;
    const refined = this.update?.refined;
    // A refinement ends when it gains nothing more, often long before its largest number of geometries.
    const pace = running && refined?.seconds != null && refined.geometries < refined.most ? `, at most about ${duration(refined.seconds * (refined.most - refined.geometries))} more` : "";
    const bound = refined && refined.geometries < refined.most ? ` of at most ${run.refine ? "" : "about "}${refined.most.toLocaleString("en")}` : "";
    const refining = refined && `${count(refined.designs, "design")}, ${refined.geometries.toLocaleString("en")}${bound} geometries${pace}${refined.sheets ? `, ${count(refined.sheets, "check")} ${isInSpace(this.run.problem) ? "with deviations of the print" : "in the 2D solid"}` : ""}`;
    const phase = refined ? "refinement" : tried ? "verification" : "search";
    const phases = ["search", "verification", ...(specified ? ["refinement"] : [])];
    const rows: [string, string][] = run.refine ? [["refinement", refining || (running ? "starting …" : `${count(done, "geometry", "geometries")} computed`)], ...this.printsRow()] : [
      ...(running ? [["phase", `${phases.indexOf(phase) + 1} of ${phases.length}: ${phase}`]] as [string, string][] : []),
      [!specified ? "best so far" : this.hasObjective ? "best value of the search" : "largest margin of the search", this.bestText(run)],
      ["steps", `${done.toLocaleString("en")} of ${run.total.toLocaleString("en")}`],
      ...(running && phase === "search" ? [["speed", this.update?.speed ? `${Math.round(this.update.speed).toLocaleString("en")} steps/s` : "starting …"], ["left of this phase", duration(this.update?.left)]] as [string, string][] : []),
      ...(running && tried && !refined ? [["candidates verified", `${tried[0]} of at most ${tried[1]}`]] as [string, string][] : []),
      ...(refining ? [["refinement", refining]] as [string, string][] : []),
      ...this.printsRow(),
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
    const isMet = reached?.every(({ met }) => met);
    const few = this.missedPrints;
    clear(this.items, !this.result && reached && h("p", { class: `verdict ${isMet && few === null ? "met" : "missed"}` }, `${verdictOf(reached)} by the ${this.update!.moved!.problem ? "best refined design so far" : "best design so far, before refinement"}${isMet && few !== null ? ` as drawn, but by ${few} % of random prints only` : ""}${isMet && run.status === "running" ? `; “${run.refine ? TAKE : CHOOSE}” is possible` : ""}.`),
      !this.result && reached && itemTable([{ title: "frames", items: [...reached, ...this.printsItem()] }]));
    if (run.message && run.status !== "running") this.showMessage(run);
    if (!this.result) {
      const moved = this.update?.moved;
      const objective = otherObjective(moved?.objectives ?? []);
      const value = moved?.efficiency ?? run.efficiency ?? this.chart.best;
      if (objective) this.curveTitle.textContent = `Objective along the search, before refinement: ${objective.label}${this.unit.name && `, ${this.unit.name}`}`;
      else if (moved?.objectives.length) this.curveTitle.textContent = `Objective along the search, before refinement: ${moved.objectives[0]!.label}`;
      clear(this.readout, value !== null && h("strong", {}, objective?.reached ?? figure(value, 3)),
        h("span", {}, `${value === null || run.status !== "running" ? "" : `${objective ? objective.label : "output / input motion"} of the `}${this.stateText(run, value !== null, done)}`));
    }
  }

  /** Part of the random prints that meets all items, and the part that is needed. */
  private get prints(): { share: number; needed: number } | null {
    const share = this.update?.refined?.share ?? null, { tolerances } = this.run.problem.specification ?? {};
    return share === null || !tolerances ? null : { share, needed: tolerances.least_yield };
  }

  /** The percentage of random prints that meets all items, if it is less than needed. */
  private get missedPrints(): string | null {
    const { prints } = this;
    return prints && prints.share < prints.needed ? percent(prints.share) : null;
  }

  /** What the specification asks of random prints, as an item. */
  private printsItem(): ItemState[] {
    const needed = this.run.problem.specification?.tolerances?.least_yield;
    if (needed === undefined) return [];
    const share = this.prints?.share ?? null;
    return [{ name: "tolerance", label: "random prints", wanted: `${percent(needed)} % pass`, reached: share === null ? "in the refinement" : `${percent(share)} %`, margin: share === null ? null : share - needed, met: share === null ? null : share >= needed }];
  }

  private printsRow(): [string, string][] {
    const { prints } = this;
    if (!prints) return [];
    const met = `${prints.share < prints.needed ? "" : "at least "}${percent(prints.share)} %`;
    return [["random prints", `${met} meet all items with slightly larger deviations than those of the task; ${percent(prints.needed)} % are needed`]];
  }

  /** Whether a quantity is maximised; else the smallest margin of the items is. */
  private get hasObjective(): boolean { return Boolean(this.run.problem.specification?.maximise?.length); }

  /** Name and size of the unit of the objective of a search, where it is of a motion. */
  private get unit(): { name: string; size: number } {
    const quantity = this.run.problem.specification?.maximise?.[0]?.quantity;
    if (quantity === "rotation") return { name: "deg", size: 1 };
    return quantity === "travel" ? { name: "mm", size: this.run.part?.scale ?? 1 } : { name: "", size: 1 };
  }

  private bestText(run: Run): string {
    const { best } = this.chart;
    if (!this.run.problem.specification) return figure(run.efficiency ?? best, 3);
    return best !== null ? `${figure(best * this.unit.size, 3)} ${this.unit.name}`.trim() : this.chart.curves.size ? "no design meets all items before refinement" : "–";
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
    if (run.status !== "running") return statusName(run.status);
    if (known) return `best ${this.update?.moved?.problem ? "refined design" : "design"} so far, ${modelOf(this.run.problem)}`;
    return done ? "No admissible design yet." : "Starting …";
  }

  private showControls(given: Run): void {
    const run = { ...this.run, ...given };
    const act = (action: string, asked = "") => async (): Promise<void> => {
      try {
        this.trouble.textContent = "";
        this.asked = asked;
        this.showControls(this.run);
        await post(`/runs/${run.id}/${action}`);
      } catch (error) {
        this.asked = "";
        this.trouble.textContent = sentence((error as ServerError).message);
        this.showControls(this.run);
      }
    };
    const keep = async (): Promise<void> => {
      const { moved } = this.update ?? {};
      if (!moved) { this.trouble.textContent = "There is no design yet."; return; }
      try {
        const { source, key } = await post<{ source: string; key: string }>("/gallery", {
          problem: moved.problem ?? run.problem, mask: moved.mask, title: `${run.title}, best so far`.slice(0, 120), provenance: { kind: "machine", part: run.part, task: run.task },
        });
        open(`#/design/${source}/${key}`, "_blank", "noopener");
        this.notice.textContent = "The best design so far is kept in the gallery, and open in another tab.";
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
    if (this.asked) { clear(this.controls, h("p", { class: "note", role: "status" }, h("span", { class: "working" }), ` ${this.asked}`)); return; }
    const refines = Boolean(run.problem.specification) && !run.refine;
    clear(this.controls,
      (status === "running" || status === "queued") && button("Pause", () => void act("pause", "Pausing …")()),
      status === "running" && button(run.refine ? TAKE : CHOOSE, () => void act("stop", run.refine ? "Stopping the refinement …" : "Choosing and verifying the best design …")(), "strong"),
      status === "running" && !run.refine && button("Open the best so far", () => void keep(), "", { title: "Store it in the gallery, and open it in another tab; the search goes on" }),
      (status === "paused" || (status === "stopped" && !run.refine) || status === "failed") && button(status === "failed" ? "Retry" : "Continue", () => void act("resume")(), "strong"),
      status === "paused" && !run.refine && button("Choose the best", () => void act("stop")()),
      status === "running" && refines && h("p", { class: "note" }, "A search that is stopped keeps what its refinement has reached; its design can be refined further later."),
      status !== "running" && button("Delete", () => void erase(), "quiet"));
  }
}
