// A search that is watched, and its result when it ends.

import { follow, get, post, remove, type News, type Refusal, type Run, type WholeRun } from "./api";
import { bitsOf } from "./api";
import { Chart } from "./chart";
import { Drawing, where } from "./drawing";
import { button, choice, clear, count, duration, figure, h, say } from "./dom";
import { Result } from "./result";
import { plainly, REMEDIES, sentence } from "./words";

const WORDS: Record<Run["status"], string> = {
  queued: "waiting for its turn", running: "searching", paused: "resting", stopped: "stopped early", finished: "finished", failed: "failed",
};

export class RunPage {
  readonly element = h("div", { class: "page run" });
  private readonly drawing = new Drawing("The best design so far, moved");
  private readonly chart = new Chart();
  private readonly head = h("div", { class: "intro" });
  private readonly live = h("div", { class: "live" });
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
  private news: News | null = null;
  private chain = "best";
  private readonly leave: () => void;
  private showing: "live" | "human" = "live";
  private statusSaid = "";

  constructor(private run: WholeRun) {
    this.drawing.setLattice(run.problem.positions, run.problem.beams);
    this.chart.begin(run.settings.steps, run.method, run.settings.hot, run.settings.cold);
    if (run.comparison) this.chart.compare(run.comparison.title, run.comparison.efficiency);
    this.stage.append(this.switcher, this.paper);
    const card = h("section", { class: "card", "aria-label": "Efficiency along the search" },
      h("h2", {}, "Efficiency along the search"), this.chart.svg,
      h("p", { class: "note" }, this.shadingNote()));
    this.watch = h("aside", { class: "panel", "aria-label": "Search" },
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Search"), this.live, this.controls, this.trouble));
    this.side.append(this.watch);
    this.element.append(this.head, h("div", { class: "main" }, this.stage, card), this.side);
    this.show(run);
    this.draw(run.problem.initial, null);
    if (run.mask) void this.open();
    this.leave = follow(`/runs/${run.id}/live`, (news) => this.hear(news), (lost) => {
      this.trouble.textContent = lost ? "The server does not answer; the search goes on with it, and so does this page." : "";
    });
  }

  close(): void {
    this.leave();
    this.result?.close();
  }

  private shadingNote(): string {
    return {
      paper: "Shaded: the annealing, darker where it is hot.",
      "basin-hopping": "The best design of each chain. Shaded: where a chain wanders instead of climbing.",
      tempering: "The coldest replica of each chain.",
    }[this.run.method] ?? "";
  }

  private hear(news: News): void {
    if (news.error) { this.trouble.textContent = sentence(news.error.message); return; }
    const before = this.run.status;
    this.news = news;
    this.run = { ...this.run, ...news.run };
    if (Object.keys(news.points).length || news.reset) this.chart.add(news.points, news.reset);
    this.show(this.run);
    if (!this.result) this.drawLive();
    const done = (status: string): boolean => status === "finished" || status === "stopped";
    if (done(this.run.status) && (!this.result || !done(before))) void this.open();
  }

  private drawLive(): void {
    const { news } = this;
    if (this.showing === "human" && this.run.comparison) {
      this.draw(this.run.comparison.mask, null);
      return;
    }
    const chain = this.chain === "best" ? null : news?.chains[this.chain];
    if (chain) this.draw(chain.mask, null);
    else if (news?.moved) this.draw(news.moved.mask, news.moved.displacement);
  }

  private draw(mask: string, displacement: number[] | null): void {
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

  private async open(): Promise<void> {
    const whole = await get<WholeRun>(`/runs/${this.run.id}`);
    this.run = whole;
    if (whole.comparison) this.chart.compare(whole.comparison.title, whole.comparison.efficiency);
    if (!whole.mask) return;
    this.result?.close();
    this.result?.element.remove();
    this.result = new Result({
      title: whole.title, problem: whole.problem, mask: whole.mask, efficiency: whole.efficiency, provenance: whole.provenance,
      comparison: whole.comparison, part: whole.part, history: whole.id, plan: null,
    });
    clear(this.stage, this.result.player.element);
    this.side.prepend(this.result.element);
    this.element.querySelector(".main")!.append(this.watch);
    this.show(whole);
  }

  private show(run: Run): void {
    const settings = run.settings;
    if (this.statusSaid !== `${run.status}${run.title}`) {
      this.statusSaid = `${run.status}${run.title}`;
      clear(this.head, h("h1", {}, run.title), h("p", {}, h("span", { class: `status ${run.status}` }, WORDS[run.status]),
        run.status === "queued" && run.place > 0 ? `, ${count(run.place, "search", "searches")} before it` : ""));
      say(`${run.title}: ${WORDS[run.status]}`);
      this.showControls(run);
      this.showSwitcher();
    }
    const made = Object.values(this.news?.chains ?? {}).reduce((sum, chain) => sum + chain.step, 0);
    const done = run.status === "finished" ? run.total : Math.max(run.done, made);
    const share = Math.min(1, done / run.total);
    const running = run.status === "running";
    const tried = this.news?.tried;
    const last: [string, string] = tried ? ["trying as parts", `${tried[0]} of ${tried[1]}`] : ["time left", duration(this.news?.left)];
    const rows: [string, string][] = [
      ["best so far", figure(run.efficiency ?? this.chart.best, 3)],
      ["steps", `${done.toLocaleString("en")} of ${run.total.toLocaleString("en")}`],
      ...(running ? [["speed", this.news?.speed ? `${Math.round(this.news.speed).toLocaleString("en")} steps/s` : "starting …"], last] as [string, string][] : []),
      ["method", `${run.method}, ${count(settings.chains, "chain")}, seed ${settings.seed}`],
      ...(settings.goals.length ? [["keeps", settings.goals.join(", ")]] as [string, string][] : []),
    ];
    let bar = this.live.querySelector("progress");
    if (!bar) {
      bar = h("progress", { max: 1, "aria-label": "Part of the search that is done" });
      this.live.append(bar, h("dl", { class: "facts" }));
    }
    bar.value = share;
    clear(this.live.querySelector("dl")!, ...rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, value)]));
    if (run.message && run.status !== "running") this.explain(run);
    if (!this.result) {
      const moved = this.news?.moved;
      const value = moved?.efficiency ?? run.efficiency ?? this.chart.best;
      clear(this.readout, value !== null && h("strong", {}, figure(value, 3)), h("span", {}, this.stateInWords(run, value !== null, done)));
    }
  }

  /** Say why a search has no design to show, and what to try. */
  private explain(run: Run): void {
    const none = /accepted|found/.test(run.message);
    clear(this.trouble, plainly(run.message), none && h("span", { class: "advice" }, " What may help: ",
      ...REMEDIES.flatMap((text) => [h("br"), text]), h("br"), h("a", { href: "#/draw" }, "Back to the drawing")));
  }

  private showSwitcher(): void {
    const chains = [["best", this.run.method === "basin-hopping" ? "Best" : "Leading"], ...Array.from({ length: Math.min(6, this.run.settings.chains) }, (_, k) => [String(k), `Chain ${k + 1}`])] as [string, string][];
    if (this.run.comparison) chains.push(["human", this.run.comparison.title === "yours" ? "Yours" : "By hand"]);
    clear(this.switcher, choice("Which design is shown", chains, this.showing === "human" ? "human" : this.chain, (picked) => {
      this.showing = picked === "human" ? "human" : "live";
      this.chain = picked === "human" ? "best" : picked;
      this.drawLive();
    }));
  }

  private stateInWords(run: Run, known: boolean, done: number): string {
    if (run.status !== "running") return WORDS[run.status];
    if (known) return run.method === "basin-hopping" ? "best design so far, moved" : "the design at hand, moved";
    return done ? "No design that holds together and moves has been found yet." : "The search is starting …";
  }

  private showControls(run: Run): void {
    const act = (deed: string) => async (): Promise<void> => {
      try {
        this.trouble.textContent = "";
        await post(`/runs/${run.id}/${deed}`);
      } catch (error) {
        this.trouble.textContent = sentence((error as Refusal).message);
      }
    };
    const erase = async (): Promise<void> => {
      if (!confirm("Delete this search with everything it has found?")) return;
      await remove(`/runs/${run.id}`);
      location.hash = "#/runs";
    };
    const { status } = run;
    clear(this.controls,
      (status === "running" || status === "queued") && button("Pause", () => void act("pause")()),
      status === "running" && button("Stop and take the best", () => void act("stop")(), "strong"),
      (status === "paused" || status === "stopped" || status === "failed") && button(status === "failed" ? "Try again" : "Go on searching", () => void act("resume")(), "strong"),
      status === "paused" && button("Take the best", () => void act("stop")()),
      status !== "running" && button("Delete", () => void erase(), "quiet"));
  }
}
