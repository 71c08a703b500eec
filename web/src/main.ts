// Which page is shown, and how the server is.

import { get, post, Refusal, type Response, type WholeRun } from "./api";
import { firstTask, KEY } from "./begin";
import { clear, count, figure, h } from "./dom";
import { Editor } from "./editor";
import { galleryPage, RunsPage } from "./gallery";
import { MachinePage } from "./machine";
import { designSubject, Result } from "./result";
import type { WrittenPlan } from "./plan";
import { RunPage } from "./run";
import { sentence } from "./words";

interface Page { element: HTMLElement; close?: () => void }
interface About { ready: boolean; trouble: string; running: number; queued: number; version: string }

const place = document.getElementById("page")!;
const server = document.getElementById("server")!;
let current: Page | null = null;
let visit = 0;

async function open(parts: string[]): Promise<Page> {
  const [kind = "draw", ...rest] = parts;
  switch (kind) {
    case "run": return new RunPage(await get<WholeRun>(`/runs/${encodeURIComponent(rest[0] ?? "")}`));
    case "runs": return new RunsPage();
    case "gallery": return { element: await galleryPage() };
    case "machine": return new MachinePage(rest[0] ? await get<WrittenPlan>(`/machines/${encodeURIComponent(rest[0])}`) : null);
    case "design": return designPage(rest[0] ?? "", rest[1] ?? "");
    default: {
      const fresh = !rest[0] && localStorage.getItem(KEY) === null;
      const editor = new Editor(await firstTask(rest[0] ?? ""), fresh);
      if (sessionStorage.getItem("bellcrank-tool") === "hand") editor.choose("hand");
      sessionStorage.removeItem("bellcrank-tool");
      return editor;
    }
  }
}

async function designPage(source: string, key: string): Promise<Page> {
  const subject = await designSubject(encodeURIComponent(source), encodeURIComponent(key));
  if (subject.efficiency === null) {
    const { problem, mask } = subject;
    const { response } = await post<{ response: Response | null }>("/tasks/check", { problem: { ...problem, initial: mask } });
    subject.efficiency = response?.efficiency ?? null;
  }
  const result = new Result(subject);
  const origin = subject.provenance["origin"];
  const element = h("div", { class: "page run" },
    h("div", { class: "intro" }, h("h1", {}, subject.title), h("p", {}, typeof origin === "string" ? origin : sentence(subject.note ?? ""))),
    h("div", { class: "main" }, h("section", { class: "stage", "aria-label": "Design" }, result.player.element)),
    h("div", { class: "side" }, result.element));
  return { element, close: () => result.close() };
}

async function route(): Promise<void> {
  const asked = ++visit;
  const parts = location.hash.replace(/^#\/?/, "").split("/").filter(Boolean);
  const kind = parts[0] ?? "draw";
  for (const link of document.querySelectorAll<HTMLElement>("[data-page]")) {
    const mine = link.dataset.page === kind || (link.dataset.page === "runs" && kind === "run") || (link.dataset.page === "gallery" && kind === "design");
    if (mine) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  let page: Page;
  try {
    page = await open(parts);
  } catch (error) {
    const said = error instanceof Refusal ? error.message : "this page could not be opened";
    page = { element: h("div", { class: "page wide" }, h("div", { class: "intro" }, h("h1", {}, "Not here"), h("p", { role: "alert" }, sentence(said), " ", h("a", { href: "#/draw" }, "Draw a task"), "."))) };
    if (!(error instanceof Refusal)) console.error(error);
  }
  if (asked !== visit) { page.close?.(); return; }
  current?.close?.();
  current = page;
  clear(place, page.element);
  document.title = `${page.element.querySelector("h1")?.textContent ?? "bellcrank"} · bellcrank`;
  scrollTo(0, 0);
}

async function watch(): Promise<void> {
  let wait = 3000;
  try {
    const about = await get<About>("/about");
    server.classList.toggle("lost", about.trouble !== "");
    if (about.trouble) {
      server.textContent = sentence(about.trouble);
    } else if (!about.ready) {
      server.textContent = "Getting the solver ready …";
      wait = 500;
    } else if (about.running + about.queued) {
      server.textContent = `${count(about.running, "search", "searches")} running${about.queued ? `, ${figure(about.queued, 0)} waiting` : ""}`;
    } else {
      server.textContent = "";
    }
  } catch {
    server.classList.add("lost");
    server.textContent = "The server does not answer";
    wait = 1500;
  }
  setTimeout(() => void watch(), wait);
}

addEventListener("hashchange", () => void route());
void route();
void watch();
