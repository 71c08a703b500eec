// The panel beside a design: its specification, figures, part, files and next steps.

import { bitsOf, fetchBlob, fetchFile, fetchRegistries, get, isInSpace, isTurning, maximisesRotation, post, session, type Collection, type Comparison, type ItemState, type Part, type PartFigures, type PartReport, type Point, type Problem, type Registries, ServerError, type ToleranceFound } from "./api";
import { compareAddress } from "./address";
import { openTask } from "./begin";
import { button, clear, count, download, duration, field, figure, h, number, percent, select } from "./dom";
import { where } from "./drawing";
import { Player, type Picture } from "./player";
import { figureTables, FRAMES, itemTable, otherObjective, verdictOf, type Column } from "./specification";
import { strokeCharts } from "./strokechart";
import type { Table } from "./task";
import { fileName, REMEDIES, sentence, tilted } from "./text";

export interface Subject {
  title: string;
  note?: string;
  problem: Problem;
  mask: string;
  efficiency: number | null;
  provenance: Record<string, unknown>;
  comparison: Comparison | null;
  part: Part | null;
  history: string | null;
  /** Name of the plan, if it is a bundled machine. */
  plan: string | null;
  /** Table of the task that it was searched for, if there is one. */
  task: Record<string, unknown> | null;
  /** Source and key in the gallery. */
  place: [string, string] | null;
}

interface Fem { level: string; status: string; efficiency: number | null; off_axis: number | null; output_rotation_deg: number | null; von_mises_MPa: number | null; principal_strain: number | null; input_push_N: number | null; warnings: string[]; doubts: string[]; picture: Picture | null; items: ItemState[] | null; figures: PartFigures[] | null }
interface Remarks { size: [number, number, number]; /** Box that holds the part along the stroke, mm. */ swept: number[]; volume: number; mass: number | null; stroke: number | null; remarks: string[]; touching: number[]; /** Centres of screw holes, mm. */ screws: Point[]; /** Loops of the outline with plate and pads, mm; the last are the screw holes. */ outline: Point[][] }
interface Print { minutes: number | null; layers: number; layer_mm: number; mass: number | null; slicer: string; profile: string }

/** The level of the printed body, in which a specification is checked; that of a part in space takes minutes. */
const FLAT_BODY = { level: "plane", title: "2D solid", words: "the 2D solid, the printed outline" };
const SPACE_BODY = { level: "solid", title: "3D solid", words: "the 3D solid, the printed body" };

/** Deviation of the direction of the input that is usual, degrees. */
const USUAL_ANGLE = 5;
const FEW_PRINTS = "The part as drawn meets the specification, but too few random prints do: see Tolerance below.";
/** Time between two questions after what is computed, milliseconds. */
const SHARE_PERIOD = 2000;

/** Status of the answer to a computation that was stopped on request. */
const STOPPED = 409;

/** Part of the random prints that is to meet all items for a green verdict, where the task does not say which. */
const LEAST_YIELD = 0.9;
/** Number of remarks on printing that are shown at once. */
const FEW_REMARKS = 3;

/** Effort of a search that begins with a design. */
const CONTINUED = { steps: 8000, chains: 2 };

interface Grips { plate: boolean; screws: number; pad: boolean; output_pad: boolean }
/** The additions that were chosen, by design. */
const gripsOf = new Map<string, Grips>();

/** What was computed of a part. */
interface Known { fems: Record<string, Fem | "running" | string>; tolerance: ToleranceFound | "running" | string | null; print: Print | "running" | string | null; shares: Record<string, Share | null> }
/** The share of a computation that is done, seconds since it began, and those left if they can be estimated. */
interface Share { share: number | null; seconds: number | null; left: number | null; /** The computation before it, in words; empty if it starts. */ waits_for?: string }
/** What the server knows of a slow computation: its result, or what is done. */
type Computation<Found> = { result: Found } | Share | null;
interface Computations { validation: Record<string, Computation<Fem>>; tolerance: Computation<ToleranceFound>; print: Computation<Print> }

export class Result {
  readonly player: Player;
  readonly element = h("aside", { class: "panel", "aria-label": "Result" });
  private readonly headline = h("p", { class: "headline" });
  private readonly verdict = h("p", { class: "verdict", role: "status" });
  private readonly reportBox = h("div", { class: "report", tabindex: 0, role: "region", "aria-label": "Specification" });
  private readonly warnings = h("ul", { class: "warnings", role: "alert" });
  private readonly advice = h("div", { class: "advice" });
  private readonly table = h("table", { class: "figures" });
  private readonly trouble = h("p", { class: "fault", role: "alert" });
  private readonly toleranceBox = h("div", { class: "content" });
  private readonly partBox = h("div", { class: "content" });
  private readonly fileNote = h("p", { class: "note content" });
  private readonly filesBox = h("div", { class: "content" });
  private part: Part;
  private report: PartReport | string | null = null;
  /** Curves of this report, which stay open or closed when it is shown again. */
  private charts: HTMLElement | null = null;
  private reports = 0;
  private registries: Registries | null = null;
  private remarks: Remarks | null = null;
  private hasSlicer = false;
  private writing = "";
  private readonly knownOf = new Map<string, Known>();
  private following = false;
  private closed = false;
  /** Ends the requests of this result when it is left: a browser has few connections to a server, which goes on with what it computes. */
  private readonly requests = new AbortController();
  /** The part with the plate and the pads; a text says why it cannot be made. */
  private gripped: Remarks | string | null = null;

  /** Plate and pads, as they were chosen for this design before. */
  private get grips(): Grips { return gripsOf.get(this.subject.mask) ?? { plate: false, screws: 0, pad: false, output_pad: false }; }
  private set grips(given: Grips) { gripsOf.set(this.subject.mask, given); void this.describeGripped(); }

  constructor(private readonly subject: Subject) {
    this.part = partOf(subject);
    this.player = new Player(subject.problem, subject.mask, this.part.scale);
    this.player.onError = (text) => { this.trouble.textContent = text; };
    this.player.onStressRequested = () => void this.validate("frame");
    this.element.append(
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Result"), this.headline, this.verdict, this.warnings, this.advice, this.reportBox, this.table, this.trouble),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Tolerance"), this.toleranceBox),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Part"), this.partBox),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Download"), this.fileNote, this.filesBox),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Next steps"), this.nextSteps()));
    this.showTable();
    this.showTolerance();
    this.showPart();
    this.showFiles();
    void this.describe();
    void this.describeGripped();
    void this.loadReport();
    void get<{ slicer: boolean }>("/about").then(({ slicer }) => { this.hasSlicer = slicer; this.showPart(); }, () => undefined);
    const resumed = this.resume().then(() => { if (this.isPart && !this.known.fems["frame"]) void this.validate("frame", false); });
    void fetchRegistries().then(async (found) => {
      this.registries = found;
      await resumed;
      const { level } = this.body;
      const isQuick = this.body === FLAT_BODY && found.levels.some(({ name, missing }) => name === level && !missing);
      const { specification } = this.subject.problem;
      if (specification && isQuick && !this.known.fems[level]) void this.validate(level, false);
      // Random prints are an item of such a specification.
      if (specification?.tolerances && this.known.tolerance === null) void this.computeTolerance();
      this.showTable();
      this.showPart();
      this.showFiles();
    }, (error: ServerError) => { this.trouble.textContent = sentence(error.message); });
  }

  /** What is known of the part with its present size and material. */
  private get known(): Known {
    const key = JSON.stringify(this.part);
    let found = this.knownOf.get(key);
    if (!found) { found = { fems: {}, tolerance: null, print: null, shares: {} }; this.knownOf.set(key, found); }
    return found;
  }

  /** Show what the server has computed before, and follow what it still computes. */
  private async resume(): Promise<void> {
    const { known } = this;
    const stored = await this.askComputations(true);
    for (const [level, found] of Object.entries(stored?.validation ?? {})) {
      if (found && "result" in found) known.fems[level] = found.result;
      else if (found) void this.validate(level, false);
    }
    if (stored?.tolerance && "result" in stored.tolerance) {
      known.tolerance = stored.tolerance.result;
      this.player.showLosses(known.tolerance.losses);
    } else if (stored?.tolerance) void this.computeTolerance();
    if (stored?.print && "result" in stored.print) known.print = stored.print.result;
    else if (stored?.print) void this.slice();
    this.showTable();
    this.showTolerance();
    this.showPart();
  }

  private async askComputations(results: boolean): Promise<Computations | null> {
    const { problem, mask } = this.subject;
    return post<Computations>("/computations", { problem, mask, part: this.part, results }).catch(() => null);
  }

  /** Show the shares of what is computed, until all is done. */
  private async follow(): Promise<void> {
    if (this.following) return;
    this.following = true;
    // The part may be changed meanwhile.
    const isRunning = (): boolean => this.known.tolerance === "running" || Object.values(this.known.fems).includes("running");
    while (isRunning() && !this.closed) {
      await new Promise((resolve) => { setTimeout(resolve, SHARE_PERIOD); });
      if (!isRunning() || this.closed) break;
      const { known } = this;
      const found = await this.askComputations(false);
      const shareOf = (each: Computation<unknown> | undefined): Share | null => each && "share" in each ? each : null;
      known.shares = { tolerance: shareOf(found?.tolerance), ...Object.fromEntries(Object.entries(found?.validation ?? {}).map(([level, each]) => [level, shareOf(each)])) };
      // Only the texts change: buttons are not replaced while they are pressed.
      for (const each of this.element.querySelectorAll<HTMLElement>("[data-share]")) each.textContent = this.shareText(each.dataset["share"]!);
    }
    this.following = false;
  }

  /** The text of what is done of a computation, kept up to date while it runs. */
  private share(name: string): HTMLElement { return h("span", { "data-share": name }, this.shareText(name)); }

  /** How much of a computation is done and how long it still takes. */
  private shareText(name: string): string {
    const found = this.known.shares[name];
    if (found === undefined) return " …";
    if (found === null || found.share === null) return found?.waits_for ? `, waiting for ${found.waits_for} …` : ", starting …";
    if (found.share === 0 && name !== "tolerance") return `, ${duration(found.seconds)} so far for the mesh and the first state …`;
    if (found.share >= 0.995 && name !== "tolerance") return `, full stroke reached; stress, strain and picture follow, ${duration(found.seconds)} so far …`;
    const left = found.left === null ? "" : `, about ${duration(found.left)} left`;
    return `, ${Math.round(100 * found.share)} % in ${duration(found.seconds)}${left} …`;
  }

  /** The model of the printed body. */
  private get body(): typeof FLAT_BODY { return isInSpace(this.subject.problem) ? SPACE_BODY : FLAT_BODY; }

  /** Whether a level or a file is for parts of this dimension. */
  private readonly isOffered = ({ in_space }: { in_space: boolean }): boolean => in_space || !isInSpace(this.subject.problem);

  /** Whether the design was selected by frame analysis of its part. */
  private get isPart(): boolean { return Boolean(this.subject.part ?? this.subject.provenance["part"]); }

  close(): void { this.closed = true; this.requests.abort(); this.player.close(); }

  private async loadReport(): Promise<void> {
    const asked = ++this.reports;
    this.report = this.charts = null;
    this.showTable();
    const { problem, mask } = this.subject;
    let found: PartReport | string;
    try {
      found = await post<PartReport>("/report", { problem, mask, part: this.part });
    } catch (error) {
      found = sentence((error as ServerError).message);
    }
    if (asked !== this.reports) return;
    this.report = found;
    this.showTable();
  }

  /** Show the figures of the part, and whether it meets its specification. */
  private showReport(): void {
    const { report } = this;
    const frame = this.known.fems["frame"];
    const warnings = typeof frame === "object" ? [...frame.warnings, ...frame.doubts] : [];
    clear(this.warnings, ...warnings.map((text) => h("li", {}, sentence(text))));
    if (report === null || typeof report === "string") {
      clear(this.headline, h("strong", {}, "–"), h("span", {}, report ?? h("span", {}, h("span", { class: "working" }), "computing the part …")));
      clear(this.verdict);
      clear(this.reportBox);
      return;
    }
    const { level, title, words } = this.body;
    const found = this.known.fems[level];
    const solid = typeof found === "object" ? found : null;
    const first = report.figures[0];
    const objective = otherObjective(report.objectives);
    clear(this.headline, h("strong", {}, objective?.reached ?? figure(first?.efficiency, 2)),
      h("span", {}, h("b", { class: "model" }, FRAMES), h("br"),
        `${objective ? sentence(objective.label).slice(0, -1) : "Output / input motion"} of the part with ${this.strutText()} struts`,
        solid?.efficiency != null && h("span", {}, h("br"), this.turns ? `${figure(solid.output_rotation_deg, 1)}° in ${words}` : `${figure(solid.efficiency, 2)} as output / input motion in ${words}`)));
    const columns: Column[] = [];
    // The model of the search is that of the frames, with fewer elements.
    if (report.items.frames) columns.push({ title: "frames", items: report.items.frames });
    else if (report.items.search) columns.push({ title: "search", items: report.items.search });
    if (solid?.items) columns.push({ title, items: solid.items });
    const prints = this.printsItem(report);
    if (prints) for (const [k, column] of columns.entries()) column.items = [...column.items, k ? { ...prints, reached: "–" } : prints];
    const last = columns.at(-1)?.items ?? null;
    const unstable = !first || first.efficiency === undefined || (report.specified && !report.items.frames);
    const isMet = last !== null && columns.every(({ items }) => items.every(({ met }) => met)) && !unstable;
    const isSure = solid?.items && this.hasYield;
    this.verdict.className = `verdict ${!report.specified && !unstable ? "none" : isMet ? (isSure ? "met" : "met pending") : "missed"}`;
    const pending = found === "running" ? `; ${words}, is being computed` : !solid ? `; not checked in ${words}` : !solid.items ? `; not stable in ${words}` : "";
    const by = solid?.items ? ` by frames and in ${words}` : " by frames";
    // Random prints are computed by frames alone.
    const missedBy = !solid?.items ? by : solid.items.every(({ met }) => met) && prints?.met === false ? "" : ` in ${words}`;
    clear(this.verdict, ...unstable ? ["The part snaps or collapses before the full stroke, by frames with 8 elements in each strut."]
      : last ? [`${verdictOf(last)}${isMet ? by : missedBy}${pending}`, found === "running" ? this.share(level) : ".", this.printedText()] : ["No specification: the task says nothing about straightness, rotation or load."]);
    const models: [string, PartFigures[]][] = [["frames", report.figures]];
    if (solid?.figures) models.push([title, solid.figures]);
    const conditions = columns.length > 0 && h("p", { class: "note" }, `Items with ${report.conditions.join("; ")}.`);
    this.charts ??= strokeCharts(report.figures, (name) => isTurning(this.subject.problem, name));
    clear(this.reportBox, columns.length > 0 && itemTable(columns), conditions, ...figureTables(models), models.length > 1 && h("p", { class: "note" }, `–: computed by frames alone, not in ${words}.`), this.charts);
    const better = this.subject.comparison?.efficiency ?? null;
    const defect = unstable ? "The part has no stable path to the full stroke."
      : last && !isMet ? (prints && columns.every(({ items }) => items.every(({ met, name }) => met || name === prints.name)) ? FEW_PRINTS : "The specification is not met.")
      : !last && (first.efficiency ?? 0) <= 0 ? "The output does not move in its direction."
      : better !== null && this.subject.efficiency !== null && better > this.subject.efficiency ? "The design drawn by hand has a higher efficiency." : "";
    clear(this.advice, defect && h("p", {}, defect), defect && defect !== FEW_PRINTS && h("ul", {}, ...REMEDIES.map((text) => h("li", {}, text))));
  }

  /** What random prints do, where the specification asks for it and the tolerance is known. */
  private printsItem({ tolerance: wanted }: PartReport): ItemState | null {
    const { tolerance: found } = this.known;
    if (!wanted || !found || typeof found === "string" || !found.prints) return null;
    const share = found.met / found.prints;
    return { ...wanted, reached: `${percent(share)} %`, margin: share - this.leastYield, met: share >= this.leastYield };
  }

  /** Part of the random prints that is to meet all items. */
  private get leastYield(): number { return this.subject.problem.specification?.tolerances?.least_yield ?? LEAST_YIELD; }

  /** Whether the tolerance is known, and hardly any random print misses it. */
  private get hasYield(): boolean {
    const { tolerance } = this.known;
    return typeof tolerance === "object" && tolerance !== null && tolerance.met >= this.leastYield * tolerance.prints;
  }

  /** How many random prints meet all items, if the tolerance is known. */
  private printedText(): string {
    const { tolerance } = this.known;
    if (!tolerance) return " Not checked over tolerances.";
    if (tolerance === "running") return " The tolerance is being computed.";
    return typeof tolerance === "object" && tolerance.prints ? ` Of ${tolerance.prints} random prints, ${tolerance.met} (${percent(tolerance.met / tolerance.prints)} %) ${tolerance.met_words}${tolerance.met < this.leastYield * tolerance.prints ? "; see Tolerance below" : ""}.` : "";
  }

  /** Whether nodes and widths are those of a refinement; also of one that was stopped. */
  private get isRefined(): boolean { return "refinement" in this.subject.provenance || Boolean(this.subject.problem.widths); }

  /** The task of the design, if it is known. */
  private get task(): Table | null { return (this.subject.task ?? this.subject.provenance["task"] ?? null) as Table | null; }

  /** Whether the rotation of the output is what counts. */
  private get turns(): boolean { return maximisesRotation(this.subject.problem); }

  private showTable(): void {
    this.showReport();
    this.fileNote.textContent = this.unchecked;
    const { efficiency, comparison, mask } = this.subject;
    const beams = bitsOf(mask, this.subject.problem.beams.length).reduce((a, b) => a + b, 0);
    const rows: (HTMLElement | null)[] = [
      h("tr", {}, h("th", { scope: "row" }, this.subject.problem.section ? "As searched" : "Spring model"), h("td", {}, this.turns ? "" : figure(efficiency, 3)), h("td", { class: "more" }, this.subject.problem.section ? count(beams, "strut") : `${beams} beams`)),
      comparison && h("tr", {}, h("th", { scope: "row" }, comparison.title === "yours" ? "Your design" : "Drawn by hand"), h("td", {}, figure(comparison.efficiency, 3)),
        h("td", { class: "more" }, comparison.efficiency && efficiency && comparison.efficiency > 0 && efficiency > comparison.efficiency ? `${figure(comparison.efficiency / efficiency, 2)} of the result` : "")),
      ...(this.registries?.levels ?? []).filter(this.isOffered).map((level) => this.femRow(level)),
    ];
    clear(this.table, h("caption", {}, this.turns ? "Rotation of the output by model, at full stroke" : "Output / input motion by model, at full stroke"), h("tbody", {}, ...rows));
  }

  private femRow({ name, title, duration, missing }: Registries["levels"][number]): HTMLElement {
    const known = this.known.fems[name];
    const heading = h("th", { scope: "row" }, title);
    if (missing) return h("tr", {}, heading, h("td", { colspan: 2, class: "more" }, "not installed on the server"));
    if (known === undefined) {
      return h("tr", {}, heading, h("td", { colspan: 2 }, button("Check with finite elements", () => void this.validate(name), "quiet small", { "aria-label": `Check with finite elements: ${title}` }), h("span", { class: "more" }, ` ${duration}`)));
    }
    if (known === "running") return h("tr", {}, heading, h("td", { colspan: 2, class: "more" }, h("span", { class: "working" }), "computing", this.share(name), " ", this.stopButton("validation", title, name)));
    if (typeof known === "string") return h("tr", {}, heading, h("td", { colspan: 2, class: "fault" }, known));
    const figures = [
      known.off_axis === null ? "" : `${figure(100 * known.off_axis, 0)} % off-axis`,
      known.output_rotation_deg === null || this.turns ? "" : `${figure(known.output_rotation_deg, 1)}° rotation`,
      known.von_mises_MPa === null ? "" : `${figure(known.von_mises_MPa, 2)} MPa`,
      known.principal_strain === null ? "" : `${figure(100 * known.principal_strain, 0)} % strain`,
    ].filter(Boolean).join(", ");
    // Warnings of the frame are shown below the headline.
    const details = known.efficiency === null ? sentence(known.status) : figures;
    const text = [details, ...(name === "frame" ? [] : known.warnings.map(sentence))].filter(Boolean).join(" ");
    return h("tr", {}, heading, h("td", {}, this.turns ? `${figure(known.output_rotation_deg, 1)}°` : figure(known.efficiency, 3)), h("td", { class: "more" }, text,
      known.picture && h("span", {}, " ", button("Show stress", () => this.player.showStress(known.picture), "quiet small"))));
  }

  private async validate(level: string, show = true): Promise<void> {
    const { known } = this;
    known.fems[level] = "running";
    this.showTable();
    void this.follow();
    try {
      const { problem, mask } = this.subject;
      const found = await post<Fem>("/validation", { problem, mask, part: this.part, level }, this.requests.signal);
      known.fems[level] = found;
      if (show && found.picture) this.player.showStress(found.picture);
    } catch (error) {
      if (wasStopped(error)) delete known.fems[level];
      else known.fems[level] = sentence((error as ServerError).message);
    }
    this.showTable();
  }

  /** A button that stops a computation, here and in other windows. */
  private stopButton(computation: "validation" | "tolerance", title: string, level = "frame"): HTMLElement {
    const stop = async (): Promise<void> => {
      const { problem, mask } = this.subject;
      await post("/computations/stop", { problem, mask, part: this.part, computation, level }).catch((error: ServerError) => { this.trouble.textContent = sentence(error.message); });
    };
    return button("Stop", () => void stop(), "quiet small", { "aria-label": `Stop: ${title}`, "data-key": `stop ${computation} ${level}` });
  }

  private async computeTolerance(): Promise<void> {
    const { known } = this;
    known.tolerance = "running";
    this.showTolerance();
    void this.follow();
    const { problem, mask } = this.subject;
    try {
      known.tolerance = await post<ToleranceFound>("/tolerance", { problem, mask, part: this.part }, this.requests.signal);
      this.player.showLosses(known.tolerance.losses);
    } catch (error) {
      known.tolerance = wasStopped(error) ? null : sentence((error as ServerError).message);
    }
    this.showTolerance();
    this.showTable();
  }

  /** What the part does when print and drive deviate, and which struts it needs. */
  private showTolerance(): void {
    const { tolerance } = this.known;
    if (tolerance === null) {
      clear(this.toleranceBox, h("p", { class: "note" }, "Widths, nodes, direction and stroke deviate, and single struts are lost: some 350 scenarios."),
        button("Compute the tolerance", () => void this.computeTolerance(), "", { "data-key": "tolerance" }), h("span", { class: "more" }, " ten seconds to some minutes"));
      return;
    }
    if (tolerance === "running") { clear(this.toleranceBox, h("p", { class: "more" }, h("span", { class: "working" }), "computing", this.share("tolerance"), " ", this.stopButton("tolerance", "Tolerance"))); return; }
    if (typeof tolerance === "string") { clear(this.toleranceBox, h("p", { class: "fault", role: "alert" }, tolerance)); return; }
    const [head, ...rows] = tolerance.rows;
    // The panel is narrow: the worst values of each item are a line below it.
    const first = ["drawn", "95 %", "yield"];
    const worst = head!.map((name, k) => ({ name, k })).filter(({ name }) => ![...first, "item", "wanted"].includes(name));
    clear(this.toleranceBox, h("ul", { class: "sentences" }, ...tolerance.sentence.split("; ").map((text) => h("li", {}, sentence(text)))),
      h("p", { class: "note" }, `All values are by frames with one element in each strut, where the result has eight. 95 %: the value that 95 of 100 random prints reach. Yield: the part of the prints that meet an item. Worst values are those for ${tolerance.deviations}, and of the prints. Other deviations can be set in the task, under Limits and tolerance.`),
      h("table", { class: "items tolerance" }, h("caption", {}, "Values as drawn, and in the scenarios"),
        h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "item"), ...first.map((name) => h("th", { scope: "col" }, name)))),
        ...rows.map((row) => h("tbody", {},
          h("tr", {}, h("th", { scope: "rowgroup" }, row[0]!, h("small", {}, row[1]!)), ...first.map((name) => h("td", {}, row[head!.indexOf(name)]!))),
          h("tr", { class: "worst" }, h("td", { colspan: 4 }, "worst: ", worst.map(({ name, k }) => `${name} ${row[k]}`).join(", ")))))),
      this.lossText(tolerance.losses),
      ...this.toleranceStep(tolerance));
  }

  /** The next step where too few random prints meet all items. */
  private toleranceStep({ met, prints }: ToleranceFound): HTMLElement[] {
    if (!this.subject.problem.specification || !prints || met >= this.leastYield * prints) return [];
    return [h("p", { class: "note" }, `Refine over tolerances moves the nodes of this design and changes its widths until the items are met with deviations, too, where that is possible. The direction of the push deviates in random prints, too. ${tilted(this.subject.problem.specification.tolerances?.angle ?? USUAL_ANGLE)} No refinement changes that: a wider bound or smaller deviations are set in the task.`),
      button("Refine over tolerances", () => void this.begin({ refine: true, tolerant: true }), "", { "data-key": "refine-tolerant" })];
  }

  private lossText({ measure = "efficiency", cost }: ToleranceFound["losses"]): HTMLElement {
    const needed = cost.filter((each) => each === null).length;
    const half = cost.filter((each) => each !== null && each > 0.5).length;
    if (cost.length && !needed && !half) return h("p", { class: "note" }, `Without any one of its struts the part reaches the full stroke, with at least half of the ${measure}.`);
    const texts = [
      needed && `${needed} of ${count(cost.length, "strut")} ${needed === 1 ? "is" : "are each"} needed: without it the part does not reach the full stroke.`,
      half && `${half}${needed ? " other" : ""} ${half === 1 ? "strut carries" : "struts each carry"} much: without it the part has less than half of the ${measure}.`,
    ].filter(Boolean);
    return h("p", { class: "note" }, `${texts.join(" ")} “Loss of struts” in the drawing colours them.`);
  }

  private showPart(fault = ""): void {
    const change = (changes: Partial<Part>): void => {
      this.part = { ...this.part, ...changes };
      this.showTolerance();
      void this.describe();
      void this.describeGripped();
      void this.loadReport();
      void this.resume();
    };
    const size = (key: "width" | "thickness" | "scale", label: string): HTMLElement =>
      field(label, number(this.part[key], { min: 0.1, step: "any" }, (value) => change({ [key]: value })), "mm");
    const { material: given } = this.part;
    const own: [string, string][] = typeof given === "string" ? [] : [["", given.name]];
    const material = select([...own, ...(this.registries?.materials ?? []).map(({ name, title }): [string, string] => [name, title])],
      typeof given === "string" ? given : "", (picked) => change({ material: picked || given }));
    const { remarks } = this;
    const inSpace = isInSpace(this.subject.problem);
    clear(this.partBox,
      // A specification is for the part that it was written for.
      ...(this.subject.problem.specification ? [this.fixedPart()] : [
        h("div", { class: "row" }, size("width", inSpace ? "Strut diameter" : "Strut width"), inSpace ? null : size("thickness", "Thickness")),
        h("div", { class: "row" }, size("scale", "Spacing of nodes"), field("Material", material))]),
      fault && h("p", { class: "fault", role: "alert" }, fault),
      remarks && h("p", { class: "more" }, `${remarks.size.map((v) => figure(v, v % 1 ? 1 : 0)).join(" × ")} mm`,
        remarks.mass === null ? "" : `, ${figure(remarks.mass, 1)} g`, remarks.stroke === null ? "" : `, stroke ${figure(remarks.stroke, 2)} mm`),
      remarks && h("p", { class: "note" }, `${this.sweptText(remarks)}${this.excessText(remarks.size)}`),
      remarks && this.hasSlicer && this.printTime(),
      remarks && remarks.remarks.length > 0 && h("details", { class: "remarks", open: remarks.remarks.length <= FEW_REMARKS },
        h("summary", {}, `${remarks.remarks.length} ${remarks.remarks.length === 1 ? "remark" : "remarks"} on printing`),
        h("ul", {}, ...remarks.remarks.map((text) => h("li", {}, sentence(text))))));
  }

  /** The space that the part needs while it moves. */
  private sweptText({ swept }: Remarks): string {
    const first = (this.subject.problem.specification?.cases?.length ?? 0) > 1 ? ", in its first load case" : "";
    return `It moves within ${swept.map((v) => figure(v, v % 1 ? 1 : 0)).join(" × ")} mm${first}. `;
  }

  /** That the part is larger than the domain of its task; empty if it is not. */
  private excessText(size: [number, number, number]): string {
    const domain = this.task?.domain?.size;
    if (!domain || !domain.some((length, axis) => typeof length === "number" && size[axis]! > length + 0.05)) return "";
    return `Larger than the domain of ${domain.join(" × ")} mm.`;
  }

  /** The printing time, which the slicer takes some seconds to estimate. */
  private printTime(): HTMLElement {
    const { print } = this.known;
    if (print === null) return h("p", {}, button("Compute the print time", () => void this.slice(), "quiet small", { "data-key": "print" }));
    if (print === "running") return h("p", { class: "more" }, h("span", { class: "working" }), "slicing …");
    if (typeof print === "string") return h("p", { class: "fault", role: "alert" }, print);
    return h("p", { class: "more", "data-print": "yes" }, `Printed in ${duration(print.minutes === null ? null : 60 * print.minutes)}`,
      `, ${count(print.layers, "layer")} of ${print.layer_mm} mm${print.mass === null ? "" : `, ${figure(print.mass, 1)} g`} (${print.slicer}, profile ${print.profile})`);
  }

  private async slice(): Promise<void> {
    const { problem, mask } = this.subject;
    const { known } = this;
    known.print = "running";
    this.showPart();
    try {
      known.print = await post<Print>("/print", { problem, mask, part: this.part }, this.requests.signal);
    } catch (error) {
      known.print = sentence((error as ServerError).message);
    }
    this.showPart();
  }

  /** Width of the struts, as they were refined. */
  private strutText(): string {
    const { problem: { widths }, mask } = this.subject;
    if (!widths) return `${this.part.width} mm`;
    const own = where(bitsOf(mask, widths.length)).map((beam) => widths[beam]! * this.part.scale);
    const [low, high] = [Math.min(...own), Math.max(...own)];
    return high - low < 0.005 ? `${figure(high, 1)} mm` : `${figure(low, 1)} to ${figure(high, 1)} mm`;
  }

  private fixedPart(): HTMLElement {
    const { thickness, scale, material } = this.part;
    const named = typeof material === "string" ? this.registries?.materials.find(({ name }) => name === material)?.title ?? material : material.name;
    const struts = isInSpace(this.subject.problem) ? `Round struts, diameter ${this.strutText()}` : `Struts ${this.strutText()} wide, ${thickness} mm thick`;
    return h("p", {}, `${struts}, nodes ${scale} mm apart, ${named}. ${this.isRefined ? "The refinement has changed the widths. " : ""}Another part is another task.`);
  }

  private async describe(): Promise<void> {
    const { problem, mask } = this.subject;
    try {
      this.remarks = await post<Remarks>("/part", { problem, mask, part: this.part });
      this.player.showTouching(this.remarks.touching);
      this.showPart();
    } catch (error) {
      this.remarks = null;
      this.showPart(sentence((error as ServerError).message));
    }
  }

  /** Why the files may not be those of a part that meets its specification; empty if they are. */
  private get unchecked(): string {
    const { body: { level, words }, report } = this;
    if (!this.subject.problem.specification || report === null || typeof report === "string") return "";
    const found = this.known.fems[level];
    const solid = typeof found === "object" ? found : null;
    if (!report.items.frames?.every(({ met }) => met)) return "This part does not meet its specification.";
    if (!solid) return `This part is ${found === "running" ? "being checked" : "not checked"} in ${words}.`;
    return solid.items?.every(({ met }) => met) ? "" : `This part does not meet its specification in ${words}.`;
  }

  private showFiles(fault = ""): void {
    clear(this.filesBox,
      !isInSpace(this.subject.problem) && this.gripFields(),
      fault && h("p", { class: "fault", role: "alert" }, fault),
      h("div", { class: "files" },
        ...(this.registries?.files ?? []).filter(this.isOffered).map(({ name: suffix, title, purpose }) => h("button", {
          type: "button", class: this.writing === suffix ? "file busy" : "file", disabled: this.writing !== "", "data-file": suffix,
          onclick: () => void this.downloadFile(suffix),
        }, h("strong", {}, title), h("span", {}, this.writing === suffix ? "writing …" : purpose))),
        this.subject.history && h("button", { type: "button", class: "file", "data-file": "history", disabled: this.writing !== "", onclick: () => void this.downloadHistory() },
          h("strong", {}, "History"), h("span", {}, "all proposals"))));
  }

  /** How the printed part is held and pushed. */
  private gripFields(): HTMLElement {
    const tick = (key: "plate" | "pad" | "output_pad", text: string): HTMLElement => {
      const box = h("input", { type: "checkbox", checked: this.grips[key], "data-key": key });
      box.addEventListener("change", () => {
        this.grips = { ...this.grips, [key]: box.checked, ...(key === "plate" && !box.checked ? { screws: 0 } : {}) };
        this.showFiles();
      });
      return h("label", { class: "tick" }, box, text);
    };
    const screws = number(this.grips.screws, { min: 0, max: 12, step: 1 }, (value) => {
      this.grips = { ...this.grips, screws: Math.min(12, Math.max(0, Math.round(value))) };
    });
    screws.dataset.key = "screws";
    return h("div", { class: "grips" }, tick("plate", "Fill the supports to a plate for clamping"),
      this.grips.plate && field("Number of screw holes (3.4 mm)", screws), tick("pad", "Fill the input to a pad for pushing"), tick("output_pad", "Fill each output to a pad for mounting"),
      this.hasGrips && h("p", { class: "note", "data-gripped": "yes" }, this.grippedText()));
  }

  private get hasGrips(): boolean { return this.grips.plate || this.grips.pad || this.grips.output_pad; }

  /** Size and mass of the part with plate and pads, as it is downloaded. */
  private grippedText(): string {
    const { gripped } = this;
    if (gripped === null) return "Computing the size with these additions …";
    if (typeof gripped === "string") return gripped;
    const size = gripped.size.map((v) => figure(v, v % 1 ? 1 : 0)).join(" × ");
    const mass = gripped.mass === null ? "" : `, ${figure(gripped.mass, 1)} g`;
    const holes = gripped.screws.length ? ` Centres of the holes in the files: ${gripped.screws.map(([x, y]) => `(${figure(x, 1)}, ${figure(y, 1)})`).join(", ")} mm.` : "";
    return `With these additions ${size} mm${mass}. A row of nodes at a side gets a plate outside of the part. They are in the files and drawn at rest; the print time is without them.${holes}`;
  }

  private async describeGripped(): Promise<void> {
    const { problem, mask } = this.subject;
    const { grips } = this;
    this.gripped = null;
    if (!this.hasGrips) { this.player.showOutline([], 0, this.part.scale); return; }
    let found: Remarks | string;
    try {
      found = await post<Remarks>("/part", { problem, mask, part: this.part, ...grips });
    } catch (error) {
      found = sentence((error as ServerError).message);
    }
    if (grips !== this.grips) return;
    this.gripped = found;
    if (typeof found === "string") this.player.showOutline([], 0, this.part.scale);
    else this.player.showOutline(found.outline, found.screws.length, this.part.scale);
    this.showFiles();
  }

  private async downloadFile(suffix: string): Promise<void> {
    const { problem, mask, efficiency, provenance, title } = this.subject;
    this.writing = suffix;
    this.showFiles();
    try {
      const content = await fetchFile(suffix, { problem, mask, part: this.part, efficiency, provenance, ...(isInSpace(problem) ? {} : this.grips) });
      download(content, suffix === "json" ? "design.json" : suffix === "pdf" ? `${fileName(title)}-card.pdf` : `${fileName(title)}.${suffix}`);
      this.writing = "";
      this.showFiles();
    } catch (error) {
      this.writing = "";
      this.showFiles(sentence((error as ServerError).message));
    }
  }

  private async downloadHistory(): Promise<void> {
    try {
      download(await fetchBlob(`/runs/${this.subject.history}/history.parquet`), "history.parquet");
    } catch (error) {
      this.showFiles(sentence((error as ServerError).message));
    }
  }

  private nextSteps(): HTMLElement {
    const { problem, mask } = this.subject;
    const open = async (byHand: boolean): Promise<void> => {
      try {
        const table = this.task ?? await post<Table>("/tasks/from-problem", { problem, part: this.part });
        openTask({ table, hand: byHand ? mask : null });
        if (byHand) sessionStorage.setItem("bellcrank-tool", "hand");
        location.hash = "#/draw";
      } catch (error) {
        this.trouble.textContent = sentence((error as ServerError).message);
      }
    };
    const { plan, place } = this.subject;
    const others = select([["", "choose …"]], "", (picked) => {
      const [source, key] = picked.split("/") as [string, string];
      if (place && picked) location.hash = compareAddress(place, [source, key]);
    });
    others.id = "compare";
    if (place) void this.offer(others, place);
    return h("div", {}, h("div", { class: "content buttons" },
      plan && button("Open its plan", () => { location.hash = `#/machine/${plan}`; }, "strong"),
      problem.specification && button("Refine", () => void this.begin({ refine: true })),
      button("Search on", () => void this.begin({})),
      button("Open its task", () => void open(false)),
      button("Change by hand", () => void open(true))),
      h("p", { class: "note content" }, problem.specification ? "Refine moves the nodes of this design and changes its widths until it meets all items with a larger objective. " : "",
        "Search on begins a new search with this design. Both keep this one.",
        this.isRefined && this.task ? " Change by hand shows these struts on the nodes of the task, with its widths: as they were before the refinement." : ""),
      place && h("div", { class: "content" }, field("Compare with", others)));
  }

  /** Begin a search at this design, or its refinement. */
  private async begin({ refine = false, tolerant = false }: { refine?: boolean; tolerant?: boolean }): Promise<void> {
    const { problem, mask, title } = this.subject;
    // The struts of a refined design belong to its own nodes, not to those of its task.
    const task = refine || this.isRefined ? null : this.task;
    try {
      const { id } = await post<{ id: string }>("/runs", {
        title: `${title.replace(/, (refined|searched on)$/, "")}, ${refine ? "refined" : "searched on"}`.slice(-120), session: session(), start: mask, refine, tolerant,
        ...(task ? { task } : { problem, part: this.part }), steps: CONTINUED.steps, chains: CONTINUED.chains, seed: Math.floor(Math.random() * 2 ** 31),
      });
      location.hash = `#/run/${id}`;
    } catch (error) {
      this.trouble.textContent = sentence((error as ServerError).message);
    }
  }

  /** List the own designs and the bundled ones of a choice. */
  private async offer(others: HTMLSelectElement, [source, key]: [string, string]): Promise<void> {
    const collections = await get<Collection[]>("/gallery").catch(() => []);
    for (const { entries, title } of collections.filter(({ source: each }) => ["runs", "kept", "builtin", "machines"].includes(each))) {
      const options = entries.filter((each) => each.source !== source || each.key !== key);
      if (options.length) others.append(h("optgroup", { label: title }, ...options.map((each) => h("option", { value: `${each.source}/${each.key}` }, each.title, each.note && `, ${each.note}`))));
    }
  }
}

/** Whether a computation was stopped on request. */
function wasStopped(error: unknown): boolean { return error instanceof ServerError && error.status === STOPPED; }

/** The part of a design; that of 2 mm struts if none is recorded. */
export function partOf(subject: Pick<Subject, "part" | "provenance">): Part {
  return { width: 2, thickness: 5, scale: 10, material: "ninjaflex", ...(subject.part ?? subject.provenance["part"] as Partial<Part> | undefined) };
}

/** Load a design of the gallery. */
export async function designSubject(source: string, key: string): Promise<Subject> {
  const whole = await get<{ title: string; problem: Problem; note: string; mask: string; efficiency: number | null; provenance: Record<string, unknown> }>(`/gallery/${encodeURIComponent(source)}/${encodeURIComponent(key)}`);
  return { ...whole, comparison: null, part: null, history: null, plan: source === "machines" && !isInSpace(whole.problem) ? key : null, task: null, place: [source, key] };
}
