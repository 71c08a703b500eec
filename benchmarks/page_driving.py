"""A user who states a task on the page: clicks on nodes, and numbers typed into fields."""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, Any

import httpx2 as httpx

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

PAUSE = 0.15
"""Seconds after a click, in which the page answers."""
NAMED = {"up", "down", "left", "right"}
QUANTITIES = (
    "gain", "travel", "off_axis", "rotation", "payload", "dead_load", "stiffness", "blocked_force",
    "sag",
)  # fmt: skip
USUAL = {
    "gain": "at_least", "travel": "at_least", "off_axis": "at_most", "rotation": "value",
    "payload": "at_least", "dead_load": "at_least", "stiffness": "at_least",
    "blocked_force": "at_least", "sag": "at_most", "input_force": "at_most",
}  # fmt: skip
"""Bound with which a quantity begins."""
BOUNDS = ("at_least", "at_most", "target")
"""Other bounds that the field beside its name may have."""
TOOLS = {"supports": "Supports", "inputs": "Inputs", "outputs": "Outputs", "loads": "Loads"}
SCAN = 20
"""Distance of the points, in pixels, at which a drawing in space is searched for nodes."""


class State:
    """The page of a task, and what was done there.

    Attributes
    ----------
    clicks, fields
        Number of clicks, and of fields that were filled or chosen.
    """

    def __init__(self, page: Any, address: str) -> None:
        self.page, self.address = page, address
        self.clicks = self.fields = 0
        self.layer = ""

    def press(self, selector: str) -> None:
        """Click an element."""
        self.page.locator(selector).first.click()
        self.clicks += 1
        time.sleep(PAUSE)

    def fill(self, key: str, value: object) -> None:
        """Type a value into a field and leave it."""
        text = str(value)
        field = self.page.locator(f'[data-key="{key}"]')
        if field.input_value() == text:
            return
        field.fill(text)
        self.page.keyboard.press("Tab")
        self.fields += 1
        time.sleep(PAUSE)

    def choose(self, key: str, value: str) -> None:
        """Choose an option of a list."""
        self.page.locator(f'[data-key="{key}"]').select_option(value)
        self.fields += 1
        time.sleep(PAUSE)

    def pick(self, group: str, text: str) -> None:
        """Press one of the buttons of a choice."""
        self.press(f'[role="radiogroup"][aria-label="{group}"] label:text-is("{text}")')

    def open(self, section: str) -> None:
        """Open a section of the panel."""
        head = self.page.locator(f'[data-key="head-{section}"]')
        if head.get_attribute("aria-expanded") == "false":
            self.press(f'[data-key="head-{section}"]')

    def unfold(self, key: str) -> None:
        """Open a part of a section."""
        summary = self.page.locator(f'[data-key="{key}"]')
        if summary.locator("..").get_attribute("open") is None:
            self.press(f'[data-key="{key}"]')

    def table(self) -> dict[str, Any]:
        """Return the task that the page has stored."""
        found: dict[str, Any] = self.page.evaluate(
            "JSON.parse(sessionStorage.getItem('bellcrank-task')).table"
        )
        return found

    def built(self) -> dict[str, Any]:
        """Return the task of the page as the server builds it."""
        time.sleep(0.5)
        body = {"task": self.table()}
        found: dict[str, Any] = httpx.post(f"{self.address}/api/tasks/build", json=body).json()
        return found

    def click_nodes(self, nodes: Iterable[int], positions: Sequence[Sequence[float]]) -> None:
        """Click nodes of the drawing."""
        wanted = list(nodes)
        if len(positions[0]) == 3:
            self._click_in_space(wanted, positions)
            return
        for node in wanted:
            x, y = self.page.evaluate(
                """([x, y]) => {
                  const svg = document.querySelector("svg.canvas");
                  const p = new DOMPoint(x, -y).matrixTransform(svg.getScreenCTM());
                  return [p.x, p.y];
                }""",
                list(positions[node]),
            )
            self.page.mouse.click(x, y)
            self.clicks += 1
            time.sleep(PAUSE)

    def _click_in_space(self, nodes: list[int], positions: Sequence[Sequence[float]]) -> None:
        """Click nodes that the drawing names under the pointer, layer by layer."""
        scale = self.built()["part"]["scale"]
        layers: dict[float, list[int]] = {}
        for node in nodes:
            layers.setdefault(round(positions[node][2] * scale, 1), []).append(node)
        for height, inside in layers.items():
            every = [k for k, each in enumerate(positions) if abs(each[2] * scale - height) < 0.06]
            label = f"Layer at {height:.1f} mm"
            self.page.locator('[data-key="layer"]').select_option(label=label)
            self.clicks += 1
            time.sleep(PAUSE)
            if set(every) == set(inside):
                self.press('[data-key="whole-layer"]')
                continue
            names = {
                "node at " + ", ".join(f"{v * scale:.1f}" for v in positions[node]) + " mm": node
                for node in inside
            }
            self._find_and_click(names)

    def _find_and_click(self, names: dict[str, int]) -> None:
        box = self.page.locator(".space canvas").bounding_box()
        left = dict(names)
        for y in range(int(box["y"]) + 20, int(box["y"] + box["height"]) - 20, SCAN):
            for x in range(int(box["x"]) + 20, int(box["x"] + box["width"]) - 20, SCAN):
                self.page.mouse.move(x, y)
                tip = self.page.locator(".space-canvas .tip")
                if tip.get_attribute("hidden") is not None:
                    continue
                text = re.sub(r":.*", "", str(tip.inner_text()))
                if text in left:
                    del left[text]
                    self.page.mouse.click(x, y)
                    self.clicks += 1
                    time.sleep(PAUSE)
                if not left:
                    return
        raise LookupError(f"no node {next(iter(left))} in the drawing")


def state_task(state: State, table: Mapping[str, Any]) -> None:
    """State a task from an empty drawing.

    Parameters
    ----------
    state
        The page of a task.
    table
        Table of a bundled task, as the page reads it.
    """
    target = httpx.post(f"{state.address}/api/tasks/build", json={"task": table}).json()
    _state_domain(state, table)
    positions = target["lattice"]["positions"]
    regions = target["regions"]
    for index, section in enumerate(table.get("supports", ())):
        hold = section.get("hold", "all")
        state.press('.tools label:text-is("Supports")')
        in_space = len(positions[0]) == 3
        names = {"all": "Fixed", "x": "Held in x" if in_space else "Slides ↕"}
        names |= {"y": "Held in y" if in_space else "Slides ↔", "z": "Held in z"}
        state.pick("Kind of support", names[hold])
        state.click_nodes(regions["supports"][index], positions)
    for number, case in enumerate(table["cases"]):
        if number:
            state.open("outputs")
            state.unfold("case-more")
            state.press('[data-key="add-case"]')
        nodes = regions["cases"][number]
        for kind in ("inputs", "loads", "outputs"):
            for index, section in enumerate(case.get(kind, ())):
                _state_section(state, kind, index, section, nodes[kind][index], positions)
        state.press('.tools label:text-is("Outputs")')
        for index, output in enumerate(case["outputs"] if len(case["outputs"]) > 1 else ()):
            state.fill(f"outputs-{index}-name", output["name"])
        for index, bounds in enumerate(case.get("input_force", ())):
            state.unfold("case-more")
            state.press('[data-key="add-force"]')
            _state_bounds(state, f"case-force-{index}", "input_force", bounds)
    for number, case in enumerate(table["cases"] if len(table["cases"]) > 1 else ()):
        state.press(f'[aria-label="Load case"] label >> nth={number}')
        state.unfold("case-more")
        state.fill("case-name", case["name"])
    limits = table.get("limits", {})
    if limits:
        state.open("limits")
        for key, value in limits.items():
            if key == "symmetry":
                state.choose("limit-symmetry", value)
            else:
                state.fill(f"limit-{key}", value)


def _state_domain(state: State, table: Mapping[str, Any]) -> None:
    domain, part = table["domain"], table.get("part", {})
    size = domain.get("size")
    state.open("domain")
    state.choose("start", "empty-space" if size and len(size) == 3 else "empty")
    state.fill("name", table["name"])
    for key in ("spacing", "width", "thickness"):
        if key in part:
            state.fill(f"part-{key}", part[key])
    if "material" in part:
        state.choose("part-material", part["material"])
    if size:
        for key, value in zip(
            ("width", "height") if len(size) == 2 else ("width", "depth", "height"),
            size,
            strict=True,
        ):
            state.fill(f"domain-{key}", value)
    elif "problem" in domain:
        state.pick("Kind of domain", "Lattice of the paper")
        state.choose("domain-problem", domain["problem"])
    elif isinstance(domain["outline"], dict):
        state.pick("Kind of domain", "Outline")
        state.pick("Outline", "Circle")
        state.fill("domain-centre", ", ".join(map(str, domain["outline"]["circle"])))
        state.fill("domain-radius", domain["outline"]["radius"])
    else:
        state.pick("Kind of domain", "Outline")
        state.fill("domain-corners", "; ".join(f"{x}, {y}" for x, y in domain["outline"]))
    _state_zones(state, domain)


def _state_zones(state: State, domain: Mapping[str, Any]) -> None:
    """Draw holes and zones, and correct their numbers."""
    titles = {"holes": "Hole", "keep_out": "Free", "solid": "Solid"}
    for kind, title in titles.items():
        for index, shape in enumerate(domain.get(kind, ())):
            state.press('.tools label:text-is("Zones")')
            state.open("domain")
            state.pick("Kind of zone", title)
            form = "circle" if "circle" in shape else "box"
            state.pick("Shape of zone", form.capitalize())
            box = state.page.locator("svg.canvas").bounding_box()
            x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
            state.page.mouse.move(x, y)
            state.page.mouse.down()
            state.page.mouse.move(x + 60, y + 40, steps=4)
            state.page.mouse.up()
            state.clicks += 1
            time.sleep(2 * PAUSE)
            key = f"zone-{kind}-{index}"
            state.fill(f"{key}-{form}", ", ".join(map(str, shape[form])))
            if form == "circle":
                state.fill(f"{key}-radius", shape["radius"])


def _state_section(
    state: State,
    kind: str,
    index: int,
    section: Mapping[str, Any],
    nodes: Iterable[int],
    positions: Sequence[Sequence[float]],
) -> None:
    """Select the nodes of an input, load or output, and fill its fields."""
    state.press(f'.tools label:text-is("{TOOLS[kind]}")')
    known = state.table()["cases"]
    number = len(known) - 1
    if index and len(known[number].get(kind, ())) <= index:
        state.press(f'[data-key="add-{kind}"]')
    key = f"{kind}-{index}"
    if section.get("at") is not None:
        state.click_nodes(nodes, positions)
    if section.get("direction") is not None:
        _state_direction(state, key, section["direction"], len(positions[0]) == 3)
    if kind == "inputs":
        if "force" in section:
            state.press(f'fieldset[data-entry="{key}"] label:text-is("force")')
        state.fill(f"{key}-amount", section.get("displacement", section.get("force")))
        if "during" in section:
            state.unfold(f"{key}-when")
            state.fill(f"{key}-from", section["during"][0])
            state.fill(f"{key}-to", section["during"][1])
    if kind == "loads":
        state.fill(f"{key}-amount", section["force"])
    if kind == "outputs":
        _state_output(state, index, section)


def _state_direction(state: State, key: str, direction: Any, in_space: bool) -> None:
    if in_space:
        is_named = isinstance(direction, str)
        state.choose(f"{key}-direction", direction if is_named else "vector")
        if not is_named:
            state.fill(f"{key}-vector", ", ".join(map(str, direction)))
    elif direction in NAMED:
        state.press(f'[data-key="{key}-{direction}"]')
    else:
        state.fill(f"{key}-angle", direction)


def _state_output(state: State, index: int, section: Mapping[str, Any]) -> None:
    key = f"outputs-{index}"
    made = state.table()["cases"][-1]["outputs"][index]
    for name in QUANTITIES:  # those that a new output begins with
        for number in reversed(range(len(made.get(name, ())))):
            state.press(f'[data-key="{key}-{name}-{number}-drop"]')
    for name in QUANTITIES:
        for number, bounds in enumerate(section.get(name, ())):
            state.choose(f"{key}-add", name)
            _state_bounds(state, f"{key}-{name}-{number}", name, bounds)
    if "path" in section:
        _state_path(state, key, section["path"])
    if "spring" in section:
        state.unfold(f"{key}-workpiece")
        state.fill(f"{key}-spring", section["spring"])


def _state_path(state: State, key: str, path: Mapping[str, Any]) -> None:
    state.choose(f"{key}-add", "path")
    if "arc" in path:
        state.fill(f"{key}-path-radius", path["arc"][0])
        state.fill(f"{key}-path-turn", path["arc"][1])
    else:
        state.press(f'fieldset[data-entry="{key}"] label:text-is("corners")')
        corners = "; ".join(f"{x:g}, {y:g}" for x, y in path["points"])
        state.fill(f"{key}-path-points", corners)
    if "error" in path:
        state.fill(f"{key}-path-error", path["error"])


def _state_bounds(state: State, key: str, name: str, bounds: Mapping[str, Any]) -> None:
    """Fill the bounds of a quantity, which begin with an example."""
    given = dict(bounds)
    usual = USUAL[name]
    maximised = bool(given.pop("maximise", False)) or given.get("value") == "maximise"
    if given.get("value") == "maximise":
        del given["value"]
    elif "value" in given and usual != "value":
        given.setdefault(usual, given.pop("value"))
    box = state.page.locator(f'[data-key="{key}-maximise"]')
    if not maximised and box.is_visible() and box.is_checked():
        state.press(f'[data-key="{key}-maximise"]')
    first = next((each for each in (usual, *BOUNDS) if each in given), None)
    if first not in {None, usual}:
        state.choose(f"{key}-bound", str(first))
    state.fill(key, "" if first is None else given.pop(first))
    if given or (maximised and not box.is_visible()):
        state.unfold(f"{key}-more")
    if maximised and not box.is_checked():
        state.press(f'[data-key="{key}-maximise"]')
    for other, value in given.items():
        if other == "of":
            state.choose(f"{key}-of", value)
        else:
            state.fill(f"{key}-{other}", value)
