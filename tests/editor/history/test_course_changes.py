"""Since when a graph goes another way: the edit that did it is named, whatever was edited around it."""

import json
import random
from typing import Any

import pytest
from pycrdt import Doc, Map

from action_assistant.editor.documents.document import fill
from action_assistant.editor.history.course_search import Followed, followed
from action_assistant.editor.history.key_changes import LoggedChange, observed
from action_assistant.journal.events import Event
from action_assistant.umrf.files import codec
from action_assistant.umrf.semantics import Script, script_from
from support.doses import examples

NAMES = [f"Step{n}" for n in range(6)]
CHAIN = {
    "graph_name": "chain",
    "graph_entry": [{"name": NAMES[0]}],
    "graph_exit": [{"name": NAMES[-1]}],
    "actions": [
        {
            "name": name,
            "type": "sync",
            "input_parameters": {"speed": {"pvf_type": "number", "pvf_value": 1}},
            "parents": [{"name": NAMES[n - 1]}] if n else [],
            "children": [{"name": NAMES[n + 1]}] if n < 5 else [],
        }
        for n, name in enumerate(NAMES)
    ],
}
SCRIPT = script_from({"behaviours": {name: [{"after_s": n + 1.0}] for n, name in enumerate(NAMES)}})


class Past:
    """A chain of six actions that somebody edits; each edit is an event."""

    def __init__(self, seed: int = 0) -> None:
        self.dice = random.Random(seed)
        self._doc: Doc[Any] = Doc()
        self._updates: list[bytes] = []
        self._doc.observe(lambda event: self._updates.append(event.update))
        fill(self._doc, codec.read(json.dumps(CHAIN)).graph)
        self.keys = sorted(k for k in self.map("actions") if "|" not in k)

    def map(self, root: str) -> "Map[Any]":
        """A root map."""
        found: Map[Any] = self._doc.get(root, type=Map)
        return found

    @property
    def seq(self) -> int:
        """The number of the last event."""
        return len(self._updates)

    def harmless(self) -> None:
        """An edit that no course notices."""
        key = self.dice.choice(self.keys)
        match self.dice.randrange(5):
            case 0:
                self.map("positions")[key] = [self.dice.random(), 1.0]
            case 1:
                self.map("actions")[f"{key}|description"] = str(self.dice.random())
            case 2:
                text = f'{{"pvf_type":"number","pvf_value":{self.dice.random()}}}'
                self.map("actions")[f"{key}|in/speed"] = text
            case 3:
                self.map("actions")[key] = f"Called{self.dice.randrange(10**9)}"
            case _:
                self.map("meta")["name"] = str(self.dice.random())

    def answer(self, response: str, n: int | None = None) -> None:
        """Change the response to the end of the third action, or of another one."""
        arrows = sorted(k for k in self.map("relations") if k.endswith("|on_true"))
        inner = [k for k in arrows if not k.startswith("entry") and ">exit" not in k]
        self.map("relations")[inner[self.dice.randrange(5) if n is None else n]] = response

    def followed(self, script: Script = SCRIPT, budget_s: float = 60.0) -> Followed:
        """The answer about all of it."""
        events = [
            Event("graph/g", n + 1, "graph.updated.v1", f"person {n + 1}", n, update, n)
            for n, update in enumerate(self._updates)
        ]
        base, rest = observed(b"", events[:1]), None
        assert base is not None
        changes: list[LoggedChange] = []
        document = base.document
        for start in range(1, len(events), 500):
            rest = observed(document, events[start : start + 500])
            assert rest is not None
            document = rest.document
            changes += rest.changes
        return followed(base.changes, changes, script, 1, budget_s)


@pytest.mark.parametrize("seed", range(examples(20) // 2))
def test_a_breaking_edit_among_a_thousand_is_named(seed: int) -> None:
    past = Past(seed)
    planted = past.dice.randrange(1, 1000)
    for n in range(1000):
        if n == planted:
            past.answer("ignore")
            broken = past.seq
        else:
            past.harmless()
    found = past.followed()
    (one,) = found.partings
    assert (one.seq, one.author, one.parts) == (broken, f"person {broken}", True)
    assert (found.same, found.looked < 150) == (False, True)
    (change,) = one.changes.relations
    assert [(f.field, f.before, f.after) for f in change.fields] == [("on_true", "run", "ignore")]


def test_every_change_of_the_course_is_named() -> None:
    past = Past()
    for _ in range(20):
        past.harmless()
    places = []
    for response in ("ignore", "run", "stop"):
        past.answer(response, 2)
        places.append(past.seq)
        for _ in range(20):
            past.harmless()
    found = past.followed()
    assert [(each.seq, each.parts) for each in found.partings] == [
        (places[0], True),
        (places[1], False),
        (places[2], True),
    ]
    assert (found.exact, found.same) == (True, False)


def test_a_course_that_changed_and_changed_back_is_the_same_course() -> None:
    past = Past()
    past.answer("ignore", 2)
    past.answer("run", 2)
    found = past.followed()
    assert (found.same, len(found.partings)) == (True, 2)


def test_edits_that_the_engine_does_not_notice_are_not_named() -> None:
    past = Past()
    for _ in range(100):
        past.harmless()
    found = past.followed()
    assert (found.same, found.exact, found.partings) == (True, True, ())


def test_the_step_in_which_the_courses_part_is_told() -> None:
    past = Past()
    past.answer("ignore", 2)
    (one,) = past.followed().partings
    assert one.place > 1
    assert one.before.startswith("Step")
    assert one.before != one.after


def test_a_search_that_runs_out_of_time_says_that_it_is_not_exact() -> None:
    past = Past()
    for _ in range(60):
        past.harmless()
    past.answer("ignore", 2)
    broken = past.seq
    found = past.followed(budget_s=-1.0)
    assert [each.seq for each in found.partings] == [broken]
    assert (found.exact, found.looked < 20) == (False, True)


def test_the_script_follows_actions_that_are_called_otherwise() -> None:
    past = Past()
    failing = {"behaviours": {"Step2": [{"result": "on_false"}]}}
    for key in past.keys:
        past.map("actions")[key] = f"Later{past.dice.randrange(10**9)}"
    found = past.followed(script_from(failing))
    assert (found.same, found.partings) == (True, ())
