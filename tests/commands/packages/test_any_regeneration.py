"""Whatever people edit, and however the action changes: each edit stays, or nothing is written."""

import io
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.cli import main
from action_assistant.umrf.packages.generating import is_source, package_files
from commands.packages.trees import everything
from support.doses import examples
from umrf.packages.sources import NATIVE, described

PACKAGE: Final = "ta_try"
BASE: Final = ".generated.json"


@pytest.fixture(autouse=True, scope="module")
def no_waiting_for_the_disk() -> Iterator[None]:
    """Thousands of files are written, and none has to outlast a power cut."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda file: None)
        yield


#: Side, group (or none) and key of a parameter.
PLACES: Final = [
    (side, group, key)
    for side in ("input_parameters", "output_parameters")
    for group in ("", "pose")
    for key in ("a", "b", "c", "d")
]
KINDS: Final = (*NATIVE, "geometry_msgs/Pose")

#: A description and the types of the parameters that are there.
actions = st.tuples(
    st.sampled_from(["", "Opens.", "Closes.", "One.\n\nTwo."]),
    st.dictionaries(st.sampled_from(PLACES), st.sampled_from(KINDS), max_size=6),
)


@st.composite
def changed(draw: st.DrawFn, before: tuple[str, dict[Any, str]]) -> tuple[str, dict[Any, str]]:
    """The action with another description, or a parameter more, less, renamed or of another type."""
    text, kinds = before
    if draw(st.booleans()):
        return draw(actions)[0], kinds
    after = dict(kinds)
    kind = after.pop(draw(st.sampled_from(sorted(after))), None) if after else None
    if kind is None or draw(st.booleans()):
        place = draw(st.sampled_from([place for place in PLACES if place not in after]))
        after[place] = draw(st.sampled_from(KINDS)) if kind is None else kind
    return text, after


def fields(action: tuple[str, dict[Any, str]]) -> dict[str, Any]:
    """Return an action's fields as a file has them."""
    found: dict[str, Any] = {"description": action[0]} if action[0] else {}
    for (side, group, key), kind in action[1].items():
        at = found.setdefault(side, {})
        (at.setdefault(group, {}) if group else at)[key] = {"pvf_type": kind}
    return found


class Developer:
    """A developer who writes marks into files, and knows which must still be there."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.marks: dict[str, set[str]] = {}
        self.deleted: set[str] = set()
        self.count = 0

    def edit(self, data: st.DataObject) -> None:
        """Inserts a line somewhere, or writes it over others; or deletes a source."""
        path = data.draw(st.sampled_from(sorted(set(everything(self.folder)) - {BASE})), "file")
        if is_source(path) and data.draw(st.booleans(), "delete"):
            (self.folder / path).unlink()
            self.deleted.add(path)
            self.marks.pop(path, None)
            return
        lines = (self.folder / path).read_text().split("\n")
        first = data.draw(st.integers(0, len(lines) - 1), "line")
        self.count += 1
        mark = f"edit {self.count};"
        lines[first : first + data.draw(st.integers(0, 2), "over")] = [mark]
        (self.folder / path).write_text("\n".join(lines))
        known = {*self.marks.get(path, ()), mark}
        self.marks[path] = {each for each in known if each in lines}

    def prove_nothing_is_lost(self) -> None:
        """Check that all marks are there, and that deleted files are not."""
        for path, marks in self.marks.items():
            assert marks <= set((self.folder / path).read_text().split("\n")), path
        assert not any((self.folder / path).exists() for path in self.deleted)


def call(root: Path, action: tuple[str, dict[Any, str]], *options: str) -> int:
    """Runs the command on the action."""
    file = root / "given.json"
    file.write_text(json.dumps({"name": "TaTry", "type": "sync", **fields(action)}))
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        return main(["package", str(file), "--output", str(root / "out"), *options])


@settings(max_examples=examples(40))
@given(st.data())
def test_every_edit_survives_or_nothing_is_written(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        folder = root / "out" / PACKAGE
        action = data.draw(actions, "action")
        assert call(root, action) == 0
        somebody = Developer(folder)
        for _ in range(data.draw(st.integers(1, 4), "rounds")):
            for _ in range(data.draw(st.integers(0, 2), "edits")):
                somebody.edit(data)
            action = data.draw(changed(action), "change")
            before = everything(folder)
            code = call(root, action)
            after = everything(folder)
            somebody.prove_nothing_is_lost()
            if code != 0:
                assert code == 1
                assert somebody.marks
                assert after == before
                continue
            for path, content in package_files(described(**fields(action))).items():
                if path not in somebody.marks and not is_source(path):
                    assert after[path] == content
                if is_source(path):
                    assert after.get(path) == before.get(path)
            assert call(root, action, "--check") == 0


@settings(max_examples=examples(40))
@given(st.data())
def test_without_edits_every_change_arrives(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        action = data.draw(actions, "action")
        assert call(root, action) == 0
        for _ in range(3):
            action = data.draw(changed(action), "change")
            assert call(root, action) == 0
        ours = {
            path: content
            for path, content in package_files(described(**fields(action))).items()
            if not is_source(path)
        }
        there = everything(root / "out" / PACKAGE)
        assert {path for path in there if not is_source(path)} == {*ours, BASE}
        assert {path: there[path] for path in ours} == ours
