// Animation of a design along its computed path, with amplification and colours.

import { isInSpace, isTurning, maximisesRotation, post, type Motion, type Point, type Problem, type ToleranceFound } from "./api";
import { bitsOf } from "./api";
import { binned, BINS, Drawing, markRegions, sectionOf, where, type Group, type LatticeDrawing } from "./drawing";
import { loadSpace } from "./loadspace";
import { outputTips } from "./marks";
import { choice, clear, field, figure, h, icon, s } from "./dom";
import { turnText } from "./specification";
import { sentence } from "./text";

export type Colour = "plain" | "energy" | "stress" | "sensitivity" | "loss";

export interface Picture { points: number[]; cells: number[]; corners: number; stress: number[] }
export interface Sensitivity { efficiency: number; beams: number[]; change: (number | null)[] }

const PERIOD = 3200;

export class Player {
  private drawing: LatticeDrawing | null = null;
  readonly element = h("div", { class: "player" });
  readonly readout = h("div", { class: "readout" });
  private readonly controls = h("div", { class: "transport" });
  private readonly legend = h("p", { class: "legend" });
  private readonly slider = h("input", { type: "range", min: 0, max: 1000, value: "1000", "aria-label": "Fraction of the stroke" });
  private readonly playButton = h("button", { type: "button", class: "round", onclick: () => this.toggle() });
  private readonly stress = s("g", { class: "stress" });
  private readonly paper = h("div", { class: "paper" }, this.readout);
  private inSpace: boolean;
  private drawn = 0;
  private readonly cases = h("div", { class: "cases" });
  private loadCase = "";
  private motion: Motion | null = null;
  private beams: number[] = [];
  private part = 1;
  private times = 1;
  private colour: Colour = "energy";
  private frame = 0;
  private began = 0;
  private updated = 0;
  private sensitivity: Sensitivity | null = null;
  private touching = new Set<number>();
  private losses: ToleranceFound["losses"] | null = null;
  private picture: Picture | null = null;
  private outline: Point[][] = [];
  private screws: Point[][] = [];
  private shares = new Float64Array(0);
  /** Called when the stress is selected before it is computed. */
  onStressRequested: () => void = () => {};
  onError: (message: string) => void = () => {};
  /** Called with the motion when it has been computed. */
  onMotion: (motion: Motion) => void = () => {};

  constructor(private readonly problem: Problem, private readonly mask: string, private readonly scale: number) {
    this.inSpace = isInSpace(problem);
    this.beams = where(bitsOf(mask, problem.beams.length));
    this.slider.addEventListener("input", () => { this.stop(); if (this.colour === "stress") this.paint("energy"); this.part = Number(this.slider.value) / 1000; this.show(); });
    const times = h("input", { type: "range", min: 1, max: 8, step: 0.5, value: "1", "aria-label": "Amplification of the motion" });
    const size = h("output", {}, "× 1");
    times.addEventListener("input", () => { this.times = Number(times.value); size.textContent = `× ${this.times}`; this.show(); });
    this.controls.append(this.playButton, this.slider, this.switcher() ?? "",
      h("span", { class: "amplify" }, field("Amplify", times), size));
    this.element.append(this.cases, this.paper, this.controls,
      h("div", { class: "row between colour" }, this.colours(), this.legend));
    this.setPlaying(false);
    void this.draw();
    void this.load();
  }

  /** Show the design flat, or in space. */
  private async draw(): Promise<void> {
    const asked = ++this.drawn;
    let drawing: LatticeDrawing;
    try {
      drawing = this.inSpace ? await loadSpace("The design", sectionOf(this.problem)) : new Drawing("The design");
    } catch (error) {
      this.inSpace = false;
      this.onError(sentence((error as Error).message));
      return;
    }
    if (asked !== this.drawn) { drawing.close(); return; } // closed, or switched back meanwhile
    this.drawing?.element.remove();
    this.drawing?.close();
    this.drawing = drawing;
    this.paper.append(drawing.element);
    drawing.setLattice(this.problem.positions, this.problem.beams);
    drawing.ghost("rest", this.beams);
    if (drawing instanceof Drawing) {
      drawing.overlay.append(this.stress);
      drawing.printed(this.outline, this.screws);
      drawing.dimensions(this.scale, outputTips(this.problem));
    }
    drawing.element.addEventListener("pointermove", (event) => this.point(event as PointerEvent));
    if (this.motion) this.showMotion(this.motion);
    this.show();
  }

  /** Switch between the flat drawing and the extruded part. */
  private switcher(): HTMLElement | null {
    if (isInSpace(this.problem)) return null;
    return choice("Drawing", [["flat", "Flat"], ["space", "3D"]] as ["flat" | "space", string][], this.inSpace ? "space" : "flat", (picked) => {
      this.inSpace = picked === "space";
      if (this.inSpace && this.colour === "stress") this.paint("energy");
      void this.draw();
    });
  }

  get playing(): boolean { return this.frame !== 0; }

  close(): void {
    this.stop();
    this.drawn++;
    this.drawing?.close();
  }

  private colours(): HTMLElement {
    // The sensitivity is that of output / input motion.
    return choice("Colour", [["plain", "Plain"], ["energy", "Strain energy"], ...(maximisesRotation(this.problem) ? [] : [["sensitivity", "Sensitivity"]]), ...(isInSpace(this.problem) ? [] : [["stress", "Stress"]]), ...(this.losses ? [["loss", "Loss of struts"]] : [])] as [Colour, string][],
      this.colour, (picked) => this.paint(picked));
  }

  paint(colour: Colour): void {
    this.colour = colour;
    if (colour === "stress" && !this.picture) this.onStressRequested();
    if (colour === "sensitivity" && !this.sensitivity) void this.loadSensitivity();
    if (colour === "stress") {
      this.stop();
      this.part = 1; // the state of the analysis
      this.slider.value = "1000";
      if (this.inSpace) { // stress is drawn flat
        this.inSpace = false;
        const flat = this.controls.querySelector<HTMLInputElement>('input[value="flat"]');
        if (flat) flat.checked = true;
        void this.draw();
      }
    }
    const input = this.element.querySelector<HTMLInputElement>(`.colour input[value="${colour}"]`);
    if (input) input.checked = true;
    this.show();
  }

  /** Colour the struts by what the loss of each costs. */
  showLosses(losses: ToleranceFound["losses"]): void {
    this.losses = losses;
    const bar = this.element.querySelector(".colour");
    if (bar && !bar.querySelector('input[value="loss"]')) bar.firstElementChild!.replaceWith(this.colours());
  }

  /** Struts by the part of the efficiency that their loss costs. */
  private lossGroups({ beams, cost }: ToleranceFound["losses"]): { name: string; beams: number[] }[] {
    const groups: Record<string, number[]> = { "effect-none": [], "effect-1": [], "effect-2": [], "effect-3": [], "effect-broken": [], "effect-given": [] };
    const known = new Map(beams.map((beam, k) => [beam, cost[k] ?? null]));
    for (const beam of this.beams) {
      if (!known.has(beam)) { groups["effect-given"]!.push(beam); continue; }
      const loss = known.get(beam)!;
      groups[loss === null ? "effect-broken" : loss > 0.5 ? "effect-3" : loss > 0.3 ? "effect-2" : loss > 0.1 ? "effect-1" : "effect-none"]!.push(beam);
    }
    return Object.entries(groups).map(([name, list]) => ({ name, beams: list }));
  }

  /** Mark struts that touch others along the stroke. */
  showTouching(beams: number[]): void {
    this.touching = new Set(beams);
    this.show();
  }

  /** Groups of struts, with those that touch in one of their own. */
  private marked(groups: Group[]): Group[] {
    if (!this.touching.size) return groups;
    const others = groups.map(({ name, beams }) => ({ name, beams: Array.from(beams).filter((beam) => !this.touching.has(beam)) }));
    return [...others, { name: "touching", beams: this.beams.filter((beam) => this.touching.has(beam)) }];
  }

  /** Draw the outline of the printed part at rest, whose last loops are screw holes; `scale` is the length of a unit in mm. */
  showOutline(loops: Point[][], screws: number, scale: number): void {
    this.outline = loops.map((loop) => loop.map(([x, y]): Point => [x / scale, y / scale]));
    this.screws = this.outline.slice(this.outline.length - screws);
    if (this.drawing instanceof Drawing) this.drawing.printed(this.outline, this.screws);
  }

  showStress(picture: Picture | null): void {
    this.picture = picture;
    this.paint("stress");
  }

  private async load(): Promise<void> {
    try {
      this.motion = await post<Motion>("/motion", { problem: this.problem, mask: this.mask, case: this.loadCase });
      this.showCases(this.motion);
      this.showMotion(this.motion);
      this.show();
      this.element.dataset.ready = "yes";
      this.onMotion(this.motion);
      if (!matchMedia("(prefers-reduced-motion: reduce)").matches) this.play();
    } catch (error) {
      this.onError(sentence((error as Error).message));
    }
  }

  /** Offer the load cases of a task that has several. */
  private showCases({ cases }: Motion): void {
    if (cases.length < 2) return;
    clear(this.cases, choice("Load case", cases.map((name): [string, string] => [name, name]), this.loadCase || cases[0]!, (picked) => {
      this.loadCase = picked;
      this.stop();
      void this.load();
    }));
  }

  /** Make room for the motion, and draw the path of each output. */
  private showMotion({ displacement, outputs }: Motion): void {
    const { drawing } = this;
    if (!drawing) return;
    drawing.makeRoom(this.beams, displacement.at(-1)!);
    const dimension = isInSpace(this.problem) ? 3 : 2;
    const mean = (nodes: number[], moved: number[], axis: number): number =>
      nodes.reduce((sum, node) => sum + drawing.rest[dimension * node + axis]! + moved[dimension * node + axis]!, 0) / nodes.length;
    drawing.trace(Object.values(outputs).map((nodes) =>
      displacement.map((moved) => Array.from({ length: dimension }, (_, axis) => mean(nodes, moved, axis)))));
  }

  private async loadSensitivity(): Promise<void> {
    try {
      this.sensitivity = await post<Sensitivity>("/sensitivity", { problem: this.problem, mask: this.mask });
      this.show();
    } catch (error) {
      this.onError(sentence((error as Error).message));
    }
  }

  toggle(): void { if (this.playing) this.stop(); else this.play(); }

  play(): void {
    if (!this.motion || this.playing) return;
    if (this.colour === "stress") this.paint("energy");
    this.began = performance.now() - (Math.acos(1 - 2 * this.part) / (2 * Math.PI)) * PERIOD;
    const step = (now: number): void => {
      this.part = 0.5 - 0.5 * Math.cos((2 * Math.PI * (now - this.began)) / PERIOD);
      this.show();
      this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
    this.setPlaying(true);
  }

  stop(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    this.setPlaying(false);
  }

  private setPlaying(yes: boolean): void {
    this.playButton.replaceChildren(icon(yes ? "pause" : "play"));
    this.playButton.setAttribute("aria-label", yes ? "Pause the motion" : "Play the motion");
  }

  private show(): void {
    const { drawing, motion } = this;
    if (!drawing) return;
    // Text that changes sixty times a second is not readable, and each change costs a layout.
    const now = performance.now();
    const calm = this.playing && now - this.updated < 100;
    if (!calm) this.updated = now;
    let energy: ArrayLike<number> | null = null;
    if (motion) {
      const place = this.part * (motion.part.length - 1);
      const k = Math.min(motion.part.length - 2, Math.floor(place));
      const t = place - k;
      const [before, after] = [motion.displacement[k]!, motion.displacement[k + 1]!];
      if (drawing.at === drawing.rest) drawing.at = drawing.rest.slice();
      for (let n = 0; n < drawing.at.length; n++) {
        drawing.at[n] = drawing.rest[n]! + this.times * (before[n]! + t * (after[n]! - before[n]!));
      }
      const [e0, e1] = [motion.energy[k]!, motion.energy[k + 1]!];
      if (this.shares.length !== e0.length) this.shares = new Float64Array(e0.length);
      for (let b = 0; b < e0.length; b++) this.shares[b] = e0[b]! + t * (e1[b]! - e0[b]!);
      energy = this.shares;
      const value = Math.round(1000 * this.part);
      if (!calm && this.slider.valueAsNumber !== value) this.slider.value = String(value);
      if (!calm) this.showReadout(motion, k, t);
    }
    const stressed = this.colour === "stress" && this.picture !== null;
    if (stressed) this.drawStress(this.picture!);
    else if (this.stress.childNodes.length) this.stress.replaceChildren();
    if (stressed) drawing.draw([]);
    else if (this.colour === "sensitivity" && this.sensitivity) drawing.draw(this.effects(this.sensitivity));
    else if (this.colour === "loss" && this.losses) drawing.draw(this.lossGroups(this.losses));
    else if (this.colour === "energy" && energy) drawing.draw(this.marked(binned(this.beams, energy)));
    else drawing.draw(this.marked([{ name: "plain", beams: this.beams }]));
    if (stressed) for (const name of ["support", "input", "output"]) drawing.mark(name, []);
    else if (motion) {
      drawing.mark("support", motion.supports);
      drawing.mark("input", motion.input);
      drawing.mark("output", Object.values(motion.outputs).flat());
    } else markRegions(drawing, this.problem);
    if (!calm) this.showLegend();
  }

  private showReadout(motion: Motion, k: number, t: number): void {
    const near = t > 0.5 ? k + 1 : k;
    const moved = motion.moved === null ? null : this.scale * ((1 - t) * motion.moved[k]! + t * motion.moved[Math.min(k + 1, motion.moved.length - 1)]!);
    const stroke = moved === null ? `${figure(100 * this.part, 0)} % of the force` : `${figure(moved, 2)} mm in`;
    const efficiency = motion.efficiency[near] ?? null;
    const out = efficiency === null || moved === null ? "" : `${figure(moved * efficiency, 2)} mm out`;
    const turned = motion.rotation[near];
    const turns = turned != null && isTurning(this.problem, this.loadCase || motion.cases[0]!);
    const axis = motion.axis[near];
    const about = axis ? ` ${turnText(axis)}` : "";
    const lines = turns ? [`${figure(turned, 1)}°`, `rotation of the output${about}, ${motion.model}`, stroke, "", "", motion.snapped[near] ? "after a snap-through" : ""]
      : [figure(efficiency, 3), `output / input motion, ${motion.model}`, stroke, out, turned == null ? "" : `output turned by ${figure(turned, 1)}°${about}`, motion.snapped[near] ? "after a snap-through" : ""];
    if (this.readout.childElementCount !== 6) {
      clear(this.readout, h("strong"), h("span"), h("span"), h("span"), h("span"), h("span", { class: "alarm" }));
    }
    lines.forEach((text, n) => {
      const line = this.readout.children[n]!;
      if (line.textContent !== text) line.textContent = text;
    });
  }

  private effects(found: Sensitivity): { name: string; beams: number[] }[] {
    const change = new Map(found.beams.map((beam, k) => [beam, found.change[k] ?? null]));
    const present = new Set(this.beams);
    const scale = Math.abs(found.efficiency) || 1;
    const groups: Record<string, number[]> = { "effect-none": [], "effect-1": [], "effect-2": [], "effect-3": [], "effect-broken": [], "effect-harm": [], "effect-add": [], "effect-given": [] };
    for (const beam of this.beams) {
      if (!change.has(beam)) { groups["effect-given"]!.push(beam); continue; }
      const value = change.get(beam)!;
      const loss = value === null ? null : -value / scale;
      const name = loss === null ? "effect-broken" : loss > 0.5 ? "effect-3" : loss > 0.1 ? "effect-2" : loss > 0.005 ? "effect-1" : loss < -0.005 ? "effect-harm" : "effect-none";
      groups[name]!.push(beam);
    }
    for (const [beam, value] of change) if (!present.has(beam) && value !== null && value / scale > 0.005) groups["effect-add"]!.push(beam);
    return Object.entries(groups).map(([name, beams]) => ({ name, beams }));
  }

  private point(event: PointerEvent): void {
    if (this.colour !== "sensitivity" || !this.sensitivity || !this.drawing) return;
    const beam = this.drawing.beamAt(event);
    const k = this.sensitivity.beams.indexOf(beam);
    if (beam < 0 || k < 0) { this.legend.dataset.beam = ""; this.showLegend(); return; }
    const change = this.sensitivity.change[k] ?? null;
    const there = this.beams.includes(beam);
    const after = change === null ? "no admissible design" : figure(this.sensitivity.efficiency + change, 3);
    this.legend.dataset.beam = `${there ? "Without" : "With"} beam ${beam}: ${figure(this.sensitivity.efficiency, 3)} → ${after}`;
    this.showLegend();
  }

  private showLegend(): void {
    const texts: Record<Colour, string> = {
      plain: "Grey: at rest. Orange: input. Blue: output.",
      energy: "Strain energy of each beam, increasing from pale to red.",
      sensitivity: this.sensitivity ? (this.legend.dataset.beam || "Dark: removal lowers the efficiency most. Dashed: addition raises it. Point at a beam for its values.") : "Evaluating the removal of each beam …",
      loss: `The loss of a strut costs: pale up to 10 % of the ${this.losses?.measure ?? "efficiency"}, then up to 30 %, up to 50 %, darkest more. Violet: the full stroke is not reached without it.`,
      stress: this.picture ? `Von Mises stress, up to ${figure(Math.max(...sample(this.picture.stress)), 2)} MPa.` : "Check with finite elements to compute the stress.",
    };
    const touching = this.touching.size && (this.colour === "plain" || this.colour === "energy") ? ` Bright red: ${this.touching.size} struts touch others along the stroke; a bound on the clearance does not count struts that meet in a node.` : "";
    const text = `${texts[this.colour]}${touching}`;
    if (this.legend.textContent !== text) this.legend.textContent = text;
  }

  private drawStress({ points, cells, corners, stress }: Picture): void {
    if (this.stress.childNodes.length) return;
    const peak = Math.max(...sample(stress)) || 1;
    const paths: string[] = Array.from({ length: BINS }, () => "");
    const perCell = stress.length * corners === cells.length;
    for (let c = 0; c < cells.length; c += corners) {
      let value = 0;
      let d = "";
      for (let k = 0; k < corners; k++) {
        const v = cells[c + k]!;
        d += `${k ? "L" : "M"}${(points[2 * v]! / this.scale).toFixed(3)} ${(-points[2 * v + 1]! / this.scale).toFixed(3)}`;
        if (!perCell) value += stress[v]! / corners;
      }
      if (perCell) value = stress[c / corners]!;
      paths[Math.min(BINS - 1, Math.floor((value / peak) * BINS))] += corners > 2 ? `${d}Z` : d;
    }
    this.stress.replaceChildren(...paths.map((d, bin) =>
      s("path", { d, class: `${corners > 2 ? "facet" : "strut"} heat-${bin}` })));
  }
}

/** Reduce many values to block maxima, since a call has a limited number of arguments. */
function sample(values: number[]): number[] {
  if (values.length < 5000) return values;
  return Array.from({ length: Math.ceil(values.length / 5000) }, (_, k) =>
    values.slice(5000 * k, 5000 * (k + 1)).reduce((a, b) => Math.max(a, b), 0));
}
