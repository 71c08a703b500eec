"""The page about tasks: every example is valid, and every key is documented."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

from bellcrank.task import bundled_tasks, schema, task_from_dict

PAGE = (Path(__file__).parents[2] / "docs" / "tasks.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)
TABLES = [
    each
    for each in vars(schema).values()
    if isinstance(each, type) and issubclass(each, BaseModel) and each.__module__ == schema.__name__
]
SHOWN_WITHOUT_KEY = {"value", "description"}
"""Keys of the classes that a file does not have, or that need no explanation."""


@pytest.mark.parametrize("text", EXAMPLES, ids=[tomllib.loads(each)["name"] for each in EXAMPLES])
def test_an_example_of_the_page_is_a_valid_task(text: str) -> None:
    data = tomllib.loads(text)
    assert task_from_dict(data).problem.name == data["name"]


def test_every_key_is_explained_on_the_page() -> None:
    known = {
        field.alias or name
        for table in TABLES
        for name, field in table.model_fields.items()
        if name not in SHOWN_WITHOUT_KEY
    }
    explained = set(re.findall(r"`([a-z_]+)`", PAGE)) | set(re.findall(r"`\[+([a-z.]+)\]+`", PAGE))
    assert len(known) > 50
    assert sorted(known - explained - {"schema", "domain", "part", "limits", "cases"}) == []


def test_every_key_is_used_in_an_example() -> None:
    text = "\n".join(EXAMPLES)
    unused = [
        field.alias or name
        for table in TABLES
        for name, field in table.model_fields.items()
        if name not in SHOWN_WITHOUT_KEY
        and not re.search(rf"\b{re.escape(field.alias or name)}\b", text)
    ]
    assert unused == []


@pytest.mark.parametrize("name", bundled_tasks())
def test_every_bundled_task_is_listed_with_its_description(name: str) -> None:
    data = tomllib.loads(bundled_tasks()[name].read_text(encoding="utf-8"))
    assert data["name"] == name
    assert f"| `{name}` | {data['description']} |" in PAGE
