// Selection of the page by the address, and the state of the server.

import { get, ServerError, type RunDetails } from "./api";
import { firstTask, TASK_KEY } from "./begin";
import { clear, count, figure, h } from "./dom";
import { ComparePage } from "./compare";
import { Editor } from "./editor";
import { galleryPage, RunsPage } from "./gallery";
import { MachinePage } from "./machine";
import { designSubject, Result } from "./result";
import type { WrittenPlan } from "./plan";
import { RunPage } from "./run";
import { sentence } from "./text";

interface Page { element: HTMLElement; close?: () => void }
interface About { ready: boolean; error: string; running: number; queued: number; version: string }

const place = document.getElementById("page")!;
const server = document.getElementById("server")!;
let current: Page | null = null;
let routes = 0;

async function open(parts: string[]): Promise<Page> {
  const [kind = "draw", ...rest] = parts;
  switch (kind) {
    case "run": return new RunPage(await get<RunDetails>(`/runs/${encodeURIComponent(rest[0] ?? "")}`));
    case "runs": return new RunsPage();
    case "gallery": return { element: await galleryPage() };
    case "machine": return new MachinePage(rest[0] ? await get<WrittenPlan>(`/machines/${encodeURIComponent(rest[0])}`) : null);
    case "compare": return ComparePage.open(rest.map(decodeURIComponent));
    case "design": return designPage(rest[0] ?? "", rest[1] ?? "");
    default: {
      const isFirstVisit = !rest[0] && localStorage.getItem(TASK_KEY) === null;
      const editor = new Editor(await firstTask(rest[0] ?? ""), isFirstVisit);
      if (sessionStorage.getItem("bellcrank-tool") === "hand") editor.choose("hand");
      sessionStorage.removeItem("bellcrank-tool");
      return editor;
    }
  }
}

async function designPage(source: string, key: string): Promise<Page> {
  const subject = await designSubject(source, key);
  const result = new Result(subject);
  const origin = subject.provenance["origin"];
  const element = h("div", { class: "page run" },
    h("div", { class: "intro" }, h("h1", {}, subject.title), h("p", {}, typeof origin === "string" ? origin : sentence(subject.note ?? ""))),
    h("div", { class: "main" }, h("section", { class: "stage", "aria-label": "Design" }, result.player.element)),
    h("div", { class: "side" }, result.element));
  return { element, close: () => result.close() };
}

async function route(): Promise<void> {
  const requested = ++routes;
  const parts = location.hash.replace(/^#\/?/, "").split("/").filter(Boolean);
  const kind = parts[0] ?? "draw";
  for (const link of document.querySelectorAll<HTMLElement>("[data-page]")) {
    const isCurrent = link.dataset.page === kind || (link.dataset.page === "runs" && kind === "run") || (link.dataset.page === "gallery" && kind === "design");
    if (isCurrent) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  let page: Page;
  try {
    page = await open(parts);
  } catch (error) {
    const message = error instanceof ServerError ? error.message : "this page could not be opened";
    page = { element: h("div", { class: "page wide" }, h("div", { class: "intro" }, h("h1", {}, "Page not available"), h("p", { role: "alert" }, sentence(message), " ", h("a", { href: "#/draw" }, "Define a task"), "."))) };
    if (!(error instanceof ServerError)) console.error(error);
  }
  if (requested !== routes) { page.close?.(); return; }
  current?.close?.();
  current = page;
  clear(place, page.element);
  document.title = `${page.element.querySelector("h1")?.textContent ?? "bellcrank"} · bellcrank`;
  scrollTo(0, 0);
}

async function pollServer(): Promise<void> {
  let wait = 3000;
  try {
    const about = await get<About>("/about");
    server.classList.toggle("lost", about.error !== "");
    if (about.error) {
      server.textContent = sentence(about.error);
    } else if (!about.ready) {
      server.textContent = "Preparing the solver, a minute or two after an installation; you can state the task meanwhile";
      wait = 500;
    } else if (about.running + about.queued) {
      server.textContent = `${count(about.running, "search", "searches")} running${about.queued ? `, ${figure(about.queued, 0)} queued` : ""}`;
    } else {
      server.textContent = "";
    }
  } catch {
    server.classList.add("lost");
    server.textContent = "The server cannot be reached";
    wait = 1500;
  }
  setTimeout(() => void pollServer(), wait);
}

addEventListener("hashchange", () => void route());
void route();
void pollServer();
