// What stands beside a design: figures, the part it becomes, its files, and where to go from here.

import { fetchBlob, fetchFile, get, post, type Comparison, type Part, type Problem, type Refusal } from "./api";
import { bitsOf, hexOf } from "./api";
import { KEY } from "./begin";
import { button, clear, download, field, figure, h, number, select } from "./dom";
import { Player, type Picture } from "./player";
import { taskOf } from "./task";
import { fileName, REMEDIES, sentence } from "./words";

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
  /** Of the machine that it is, if it comes along. */
  plan: string | null;
}

interface Fem { level: string; status: string; efficiency: number | null; von_mises_MPa: number | null; principal_strain: number | null; input_push_N: number | null; warnings: string[]; doubts: string[]; picture: Picture | null }
interface Remarks { size: [number, number, number]; volume: number; mass: number | null; stroke: number | null; remarks: string[] }

const FILES: [string, string, string][] = [
  ["stl", "STL", "to print"], ["3mf", "3MF", "with units"], ["svg", "SVG", "to cut or draw"], ["dxf", "DXF", "to cut"],
  ["mp4", "MP4", "the motion"], ["gif", "GIF", "the motion"], ["pdf", "Card", "all on a page"], ["json", "design.json", "for bellcrank"],
];
const LEVELS: [string, string, string][] = [["frame", "Frame", "seconds"], ["plane", "Printed outline", "up to a minute"], ["solid", "Solid", "minutes"]];

export class Result {
  readonly player: Player;
  readonly element = h("aside", { class: "panel", "aria-label": "Result" });
  private readonly table = h("table", { class: "figures" });
  private readonly trouble = h("p", { class: "fault", role: "alert" });
  private readonly partBox = h("div", { class: "content" });
  private readonly filesBox = h("div", { class: "content" });
  private part: Part;
  private fems: Record<string, Fem | "asked" | string> = {};
  private remarks: Remarks | null = null;
  private making = "";

  constructor(private readonly subject: Subject) {
    this.part = { width: 2, thickness: 5, scale: 10, material: "ninjaflex", ...given(subject) };
    this.player = new Player(subject.problem, subject.mask, this.part.scale);
    this.player.note = (text) => { this.trouble.textContent = text; };
    this.player.want = (colour) => { if (colour === "stress") void this.validate("frame"); };
    this.element.append(
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Efficiency"), this.headline(), this.verdict(), this.table, this.trouble),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "The part"), this.partBox),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Take it"), this.filesBox),
      h("section", { class: "step open" }, h("h2", { class: "plain" }, "Go on"), this.onward()));
    this.showTable();
    this.showPart();
    this.showFiles();
    void this.describe();
    if (this.meant) void this.validate("frame", false);
  }

  /** Whether the design was searched for a part, so that frames have chosen it already. */
  private get meant(): boolean { return Boolean(this.subject.part ?? this.subject.provenance["part"]); }

  close(): void { this.player.close(); }

  private headline(): HTMLElement {
    const { efficiency, problem } = this.subject;
    const words = problem.input.drive === "displacement"
      ? "The output moves this many times as far as the input is pushed."
      : "What comes out for what is put in.";
    return h("p", { class: "headline" }, h("strong", {}, figure(efficiency, 2)), h("span", {}, words));
  }

  /** What is to be said about a design that is not what was asked for, and what to try. */
  private verdict(): HTMLElement | null {
    const { efficiency, comparison } = this.subject;
    if (efficiency === null) return null;
    const better = comparison?.efficiency ?? null;
    const said = efficiency <= 0 ? "It moves against its arrow, or not at all."
      : better !== null && better > efficiency ? "The design drawn by hand moves further." : "";
    return said ? h("div", { class: "advice" }, h("p", {}, said), h("ul", {}, ...REMEDIES.map((text) => h("li", {}, text)))) : null;
  }

  private showTable(): void {
    const { efficiency, comparison, mask } = this.subject;
    const beams = bitsOf(mask, this.subject.problem.beams.length).reduce((a, b) => a + b, 0);
    const rows: (HTMLElement | null)[] = [
      h("tr", {}, h("th", { scope: "row" }, "Discrete model"), h("td", {}, figure(efficiency, 3)), h("td", { class: "more" }, `${beams} beams`)),
      comparison && h("tr", {}, h("th", { scope: "row" }, comparison.title === "yours" ? "Your own design" : "Drawn by hand"), h("td", {}, figure(comparison.efficiency, 3)),
        h("td", { class: "more" }, comparison.efficiency && efficiency && comparison.efficiency > 0 && efficiency > comparison.efficiency ? `${figure(efficiency / comparison.efficiency, 1)} times less` : "")),
      ...LEVELS.map(([level, name, time]) => this.femRow(level, name, time)),
    ];
    clear(this.table, h("caption", {}, "Efficiency by level of detail"), h("tbody", {}, ...rows));
  }

  private femRow(level: string, name: string, time: string): HTMLElement {
    const known = this.fems[level];
    const heading = h("th", { scope: "row" }, name);
    if (known === undefined) {
      return h("tr", {}, heading, h("td", { colspan: 2 }, button("Ask finite elements", () => void this.validate(level), "quiet small", { "aria-label": `Ask finite elements: ${name}` }), h("span", { class: "more" }, ` ${time}`)));
    }
    if (known === "asked") return h("tr", {}, heading, h("td", { colspan: 2, class: "more" }, h("span", { class: "working" }), "computing …"));
    if (typeof known === "string") return h("tr", {}, heading, h("td", { colspan: 2, class: "fault" }, known));
    const stress = known.von_mises_MPa === null ? "" : `${figure(known.von_mises_MPa, 2)} MPa, ${figure(100 * (known.principal_strain ?? 0), 0)} % strain`;
    const warning = known.warnings[0];
    const said = known.efficiency === null ? sentence(warning ?? known.status) : warning ? `${stress}. ${sentence(warning)}` : stress;
    return h("tr", {}, heading, h("td", {}, figure(known.efficiency, 3)), h("td", { class: "more" }, said,
      known.picture && h("span", {}, " ", button("Show stress", () => this.player.showStress(known.picture), "quiet small"))));
  }

  private async validate(level: string, show = true): Promise<void> {
    this.fems[level] = "asked";
    this.showTable();
    try {
      const { problem, mask } = this.subject;
      const found = await post<Fem>("/validation", { problem, mask, part: this.part, level });
      this.fems[level] = found;
      if (show && found.picture) this.player.showStress(found.picture);
    } catch (error) {
      this.fems[level] = sentence((error as Refusal).message);
    }
    this.showTable();
  }

  private showPart(fault = ""): void {
    const change = (changes: Partial<Part>): void => {
      this.part = { ...this.part, ...changes };
      this.fems = {};
      this.showTable();
      void this.describe();
    };
    const size = (key: "width" | "thickness" | "scale", label: string): HTMLElement =>
      field(label, number(this.part[key], { min: 0.1, step: "any" }, (value) => change({ [key]: value })), "mm");
    const material = select([["ninjaflex", "NinjaFlex"], ["tpu-95a", "TPU 95A"], ["pla", "PLA"], ["petg", "PETG"]], this.part.material, (picked) => change({ material: picked }));
    const { remarks } = this;
    clear(this.partBox,
      h("div", { class: "row" }, size("width", "Strut width"), size("thickness", "Thickness")),
      h("div", { class: "row" }, size("scale", "Beam length"), field("Material", material)),
      fault && h("p", { class: "fault", role: "alert" }, fault),
      remarks && h("p", { class: "more" }, `${remarks.size.map((v) => figure(v, v % 1 ? 1 : 0)).join(" × ")} mm`,
        remarks.mass === null ? "" : `, ${figure(remarks.mass, 1)} g`, remarks.stroke === null ? "" : `, stroke ${figure(remarks.stroke, 2)} mm`),
      remarks && remarks.remarks.length > 0 && h("details", { class: "remarks" },
        h("summary", {}, `${remarks.remarks.length} ${remarks.remarks.length === 1 ? "remark" : "remarks"} before you print`),
        h("ul", {}, ...remarks.remarks.map((text) => h("li", {}, sentence(text))))));
  }

  private async describe(): Promise<void> {
    const { problem, mask } = this.subject;
    try {
      this.remarks = await post<Remarks>("/part", { problem, mask, part: this.part });
      this.showPart();
    } catch (error) {
      this.remarks = null;
      this.showPart(sentence((error as Refusal).message));
    }
  }

  private showFiles(fault = ""): void {
    clear(this.filesBox,
      h("div", { class: "files" },
        ...FILES.map(([suffix, name, use]) => h("button", {
          type: "button", class: this.making === suffix ? "file busy" : "file", disabled: this.making !== "", "data-file": suffix,
          onclick: () => void this.take(suffix),
        }, h("strong", {}, name), h("span", {}, this.making === suffix ? "making …" : use))),
        this.subject.history && h("button", { type: "button", class: "file", "data-file": "history", disabled: this.making !== "", onclick: () => void this.takeHistory() },
          h("strong", {}, "History"), h("span", {}, "every proposal"))),
      fault && h("p", { class: "fault", role: "alert" }, fault));
  }

  private async take(suffix: string): Promise<void> {
    const { problem, mask, efficiency, provenance, title } = this.subject;
    this.making = suffix;
    this.showFiles();
    try {
      const content = await fetchFile(suffix, { problem, mask, part: this.part, efficiency, provenance });
      download(content, suffix === "json" ? "design.json" : suffix === "pdf" ? `${fileName(title)}-card.pdf` : `${fileName(title)}.${suffix}`);
      this.making = "";
      this.showFiles();
    } catch (error) {
      this.making = "";
      this.showFiles(sentence((error as Refusal).message));
    }
  }

  private async takeHistory(): Promise<void> {
    try {
      download(await fetchBlob(`/runs/${this.subject.history}/history.parquet`), "history.parquet");
    } catch (error) {
      this.showFiles(sentence((error as Refusal).message));
    }
  }

  private onward(): HTMLElement {
    const { problem, mask } = this.subject;
    const open = (byHand: boolean): void => {
      const task = taskOf(problem, null, this.part.scale);
      const whole = hexOf(new Uint8Array(problem.beams.length).fill(1));
      const from = byHand ? { ...task, hand: mask } : { ...task, problem: { ...problem, initial: problem.initial || whole } };
      localStorage.setItem(KEY, JSON.stringify(from));
      if (byHand) sessionStorage.setItem("bellcrank-tool", "hand");
      location.hash = "#/draw";
    };
    const { plan } = this.subject;
    return h("div", { class: "content buttons" },
      plan && button("Open its parts", () => { location.hash = `#/machine/${plan}`; }, "strong"),
      button("Open as a new task", () => open(false)),
      button("Change it by hand", () => open(true)));
  }
}

function given(subject: Subject): Partial<Part> {
  const kept = (subject.part ?? subject.provenance["part"] ?? {}) as Partial<Part>;
  return Object.fromEntries(Object.entries(kept).filter(([key, value]) => ["width", "thickness", "scale", "material"].includes(key) && (typeof value === "number" || typeof value === "string")));
}

/** A design from the gallery. */
export async function designSubject(source: string, key: string): Promise<Subject> {
  const whole = await get<{ title: string; problem: Problem; note: string; mask: string; efficiency: number | null; provenance: Record<string, unknown> }>(`/gallery/${source}/${key}`);
  return { ...whole, comparison: null, part: null, history: null, plan: source === "machines" ? key : null };
}
