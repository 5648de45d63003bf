"""The library: every action that some graph uses, and what is said of it."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from action_assistant.editor.app import open_services
from action_assistant.editor.library.action_uses import LibraryAction
from action_assistant.editor.services import EditorServices
from action_assistant.settings import EditorSettings


def file(name: str, **inputs: dict[str, Any]) -> bytes:
    """A graph of one action `Go` with these inputs."""
    go = {
        "name": "Go",
        "instance_id": 0,
        "type": "sync",
        "description": f"goes as {name} says",
        "input_parameters": inputs,
        "output_parameters": {"place": {"x": {"pvf_type": "number"}}},
    }
    end = [{"name": "Go", "instance_id": 0}]
    return msgspec.json.encode(
        {"graph_name": name, "actions": [go], "graph_entry": end, "graph_exit": end}
    )


@pytest.fixture
def settings(tmp_path: Path) -> EditorSettings:
    return EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")


async def known(services: EditorServices) -> list[LibraryAction]:
    return msgspec.json.decode(await services.library.all(), type=list[LibraryAction])


def only(known: list[LibraryAction], name: str) -> LibraryAction:
    (found,) = [each for each in known if each.name == name]
    return found


async def test_an_action_of_two_graphs_is_known_once(settings: EditorSettings) -> None:
    async with open_services(settings) as services:
        speed = {"pvf_type": "number", "pvf_value": 1.5}
        turn = {"pvf_type": "string", "pvf_required": False}
        one, _ = await services.catalogue.bring(file("one", speed=speed), "ada")
        two, _ = await services.catalogue.bring(file("two", speed=speed, turn=turn), "ada")
        go = only(await known(services), "Go")
        assert go.used_in == (one.id, two.id)
        assert go.first_seen == one.made_at
        assert go.description == "goes as two says"
        assert go.type == "sync"
        inputs = {each.path: (each.pvf_type, each.required) for each in go.inputs}
        assert inputs == {"speed": ("number", True), "turn": ("string", False)}
        assert [each.path for each in go.outputs] == ["place/x"]


async def test_an_action_that_no_graph_uses_any_more_is_not_listed(
    settings: EditorSettings,
) -> None:
    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(file("one"), "ada")
        assert only(await known(services), "Go").used_in == (made.id,)
        await services.catalogue.delete(made.id, "ada")
        assert "Go" not in {each.name for each in await known(services)}
        await services.catalogue.recover(made.id, "ada")
        assert only(await known(services), "Go").used_in == (made.id,)


async def test_a_graph_that_has_not_changed_is_not_read_again(settings: EditorSettings) -> None:
    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(file("one"), "ada")
        first = await services.library.all()
        assert await services.library.all() is first
        await services.catalogue.describe(made.id, "ada", name="other", description=None)
        assert await services.library.all() is not first


async def test_a_new_use_begins_with_the_signature_and_no_value(settings: EditorSettings) -> None:
    async with open_services(settings) as services:
        speed = {"pvf_type": "number", "pvf_value": 1.5, "pvf_allowed_values": [1.5, 2.0]}
        await services.catalogue.bring(file("one", speed=speed), "ada")
        (taking,) = only(await known(services), "Go").inputs
        assert taking.text == '{"pvf_type":"number","pvf_allowed_values":[1.5,2.0]}'
