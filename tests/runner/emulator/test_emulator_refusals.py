"""Starts that an engine refuses or does not survive, as the real node did on 2026-11-22.

Each case is a life of one node: what it was told, whether its process was there after the next get,
what it then listed, and what its log said.
"""

import json
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import pytest

from action_assistant.runner.emulator.engine import EmulatedEngine
from action_assistant.runner.emulator.messages import (
    EngineTraits,
    FeedbackMessage,
    GetResponse,
    Gone,
    LogMessage,
    Modify,
    Start,
    Stop,
    graph_plan_of,
    index_of,
)
from action_assistant.umrf.semantics import script_from

RUN = [f"{outcome} -> run" for outcome in ("on_true", "on_false", "on_error")]
DAVID = ("David",)


def chain(name: str, *full_names: str, **fields: Any) -> str:
    """A graph of these actions, one after the other, in this order of the file."""
    actions: list[dict[str, Any]] = []
    for full_name in full_names:
        own, _, number = full_name.rpartition("_")
        actions.append({"name": own, "instance_id": int(number), "type": "sync"} | fields)
    names = [{key: each[key] for key in ("name", "instance_id")} for each in actions]
    for (first, second), (above, below) in zip(pairwise(actions), pairwise(names), strict=True):
        first["children"] = [below]
        second["parents"] = [above | {"conditions": RUN}]
    ends = {"graph_entry": names[:1], "graph_exit": [names[-1] | {"conditions": RUN}]}
    return json.dumps({"graph_name": name, "actions": actions} | ends)


INDEX = index_of(
    [json.dumps({"name": name, "type": "sync"}) for name in ("Work", "BadLib", "Fine")],
    [
        chain("SubSeq", "Work_0", "Work_1"),
        chain("Alone", "Work_0", "SubSeq_0"),
        chain("TwiceIn", "SubSeq_0", "SubSeq_1"),
        chain("SubLong", "Slow_0").replace('"Slow"', '"Work"'),
    ],
)
SCRIPT = {"BadLib": [{"no_library": True}], "*": [{"after_s": 0.2}]}


class Life:
    """A node that is told things; each is followed by enough time and, if asked, by a get."""

    def __init__(self, script: Mapping[str, Any] | None = None) -> None:
        behaviours = script_from({"behaviours": {**SCRIPT, **(script or {})}})
        self.node = EmulatedEngine(
            "David", index=INDEX, script=behaviours, quirks=EngineTraits(loss=0.0)
        )
        self.at = 0.0
        self.alive = True
        self.lines: list[str] = []
        self.held: dict[str, tuple[str, dict[str, str]]] | None = None
        self.shown: list[str] = []
        self._pass(10.0)

    def start(self, text: str, *, get: bool = True, wait: float = 1600.0) -> "Life":
        name = json.loads(text)["graph_name"]
        return self._told(Start(graph_name=name, targets=DAVID, graph_json=text), get, wait)

    def by_name(self, name: str, *, wait: float = 1600.0) -> "Life":
        return self._told(Start(graph_name=name, targets=DAVID), True, wait)

    def modify(self, text: str) -> "Life":
        name = json.loads(text)["graph_name"]
        return self._told(Modify(graph_name=name, targets=DAVID, modified_graph=text), True, 1000.0)

    def stop(self, name: str) -> "Life":
        return self._told(Stop(graph_name=name, targets=DAVID), True, 600.0)

    def _told(self, message: Any, get: bool, wait: float) -> "Life":
        self.lines, self.held, self.shown = [], None, []
        self.node.hear(message, self.at)
        self._pass(wait)
        if get and self.alive:
            self.node.ask(1, self.at)
            self._pass(100.0)
        return self

    def _pass(self, wait: float) -> None:
        self.at += wait
        for said in self.node.advance(self.at):
            match said:
                case LogMessage(text=text) if "Received" not in text:
                    self.lines.append(text)
                case FeedbackMessage(history=history):
                    self.shown += [json.loads(text)["graph_state"] for text in history]
                case GetResponse(running=running):
                    graphs = [json.loads(text) for text in running]
                    self.held = {
                        each["graph_name"]: (
                            each["graph_state"],
                            {
                                f"{a['name']}_{a['instance_id']}": a["state"]
                                for a in each["actions"]
                            },
                        )
                        for each in graphs
                    }
                case Gone():
                    self.alive = False
                case _:
                    pass


SUB, SUB_FIRST = chain("g", "Work_0", "SubSeq_0"), chain("g", "SubSeq_0", "Work_0")
PLAIN = chain("g", "Work_0", "Work_1")
NOT_RESOLVED = (
    "origin [in startGraphA]: Could not resolve graph 'g'\n   fwd [in startGraphA]: forwarding\n"
)
FINISHED = ["Graph 'g' finished."]


def test_a_graph_with_a_sub_graph_that_is_started_again_kills_the_engine_at_the_next_get() -> None:
    life = Life().start(SUB)
    assert (life.alive, life.lines) == (True, FINISHED)
    life.start(SUB)
    assert (life.alive, life.held, life.lines) == (False, None, ["map::at"])


def test_the_engine_lives_until_a_get_and_a_plain_graph_of_the_name_repairs_it() -> None:
    life = Life().start(SUB, get=False).start(SUB, get=False)
    assert (life.alive, life.lines) == (True, ["map::at"])
    life.start(PLAIN)
    assert life.alive
    assert life.held is not None
    assert life.held["g"][0] == "FINISHED"


def test_a_restart_builds_nothing_if_the_sub_graph_comes_first_in_the_file() -> None:
    life = Life().start(SUB_FIRST).start(SUB_FIRST)
    assert (life.alive, life.lines) == (True, ["map::at"])
    idle = ("INITIALIZED", {"SubSeq_0": "UNINITIALIZED", "Work_0": "UNINITIALIZED"})
    assert life.held is not None
    assert life.held["g"] == idle
    life.stop("g")
    assert life.lines == ["Stopping UMRF graph 'g' ...", "UMRF graph 'g' stopped."]
    assert life.held["g"] == idle
    assert life.start(SUB_FIRST).lines == ["map::at"]
    assert life.start(PLAIN).lines == FINISHED


@pytest.mark.parametrize(
    ("first", "second", "lives"),
    [
        (PLAIN, SUB, False),
        (SUB, PLAIN, True),
        (PLAIN, PLAIN, True),
        (PLAIN, chain("g", "Work_0", "Nobody_0"), False),
        (PLAIN, chain("g", "Work_0", "BadLib_0"), False),
    ],
)
def test_a_second_start_of_a_held_name_ends_as_on_the_real_node(
    first: str, second: str, lives: bool
) -> None:
    life = Life().start(first).start(second)
    assert life.alive == lives
    assert life.lines == (FINISHED if lives else ["map::at"])


def test_a_graph_that_is_started_by_name_is_looked_up_each_time_but_not_by_its_text() -> None:
    life = Life().by_name("Alone").by_name("Alone")
    assert (life.alive, life.lines) == (True, ["Graph 'Alone' finished."])
    life.start(chain("Alone", "Work_0", "SubSeq_0"))
    assert (life.alive, life.lines) == (False, ["map::at"])


@pytest.mark.parametrize(
    ("text", "lives", "lines"),
    [
        (chain("g", "SubSeq_0", "SubSeq_1"), True, [NOT_RESOLVED]),
        (chain("g", "Work_0", "Nobody_0"), True, [NOT_RESOLVED]),
        (chain("g", "Work_0", "BadLib_0"), True, ["map::at"]),  # the first by name: nothing is built
        (chain("g", "Alone_0", "BadLib_0"), False, ["map::at"]),
        (
            chain("SubSeq", "Work_0"), True,
            ["origin [in startGraphA]: Cannot execute UMRF graph 'SubSeq' because it conflicts with an "
             "indexed graph (graph name not unique).\n   fwd [in startGraphA]: forwarding\n"],
        ),
    ],
)  # fmt: skip
def test_a_first_start_ends_as_on_the_real_node(text: str, lives: bool, lines: list[str]) -> None:
    life = Life().start(text)
    assert (life.alive, life.lines) == (lives, lines)


def test_an_action_with_the_name_of_an_end_kills_the_engine() -> None:
    """The real node begins, and dies when the first action has ended."""
    assert not Life().start(chain("g", "graph_entry_0", "Work_1")).alive


def test_a_refused_start_leaves_nothing_behind() -> None:
    life = Life().start(chain("g", "SubSeq_0", "SubSeq_1"))
    assert life.held == {}
    assert life.start(SUB).lines == FINISHED


def test_a_start_by_name_is_refused_in_other_words() -> None:
    life = Life({"SubLong/Work_0": [{"never": True}]}).by_name("TwiceIn")
    assert life.lines == [
        "origin [in stopGraph]: Cannot stop UMRF graph 'TwiceIn' because it doesn't exist.\n"
    ]
    life.by_name("SubLong").by_name("SubLong")
    assert life.lines[-1] == (
        "origin [in startGraph]: Cannot execute UMRF graph 'SubLong' because it's already active "
        "(RUNNING)\n   fwd [in startGraph]: forwarding\n"
    )
    assert life.held is not None
    assert life.held["SubLong"][0] == "STOPPED"


def test_a_graph_of_two_robots_stays_in_the_engine_and_is_shown_once() -> None:
    text = chain("g", "Work_0", "Work_1", actor="David")
    text = text.replace('"actor": "David"', '"actor": "Carol"', 1)
    life = Life().start(text)
    assert life.lines == [
        "origin [in startGraph]: Cannot execute UMRF graph 'g': actor synchronizer not initialized.\n"
        "   fwd [in startGraph]: forwarding\n   fwd [in startGraphA]: forwarding\n"
    ]
    assert life.shown == ["INITIALIZED"]
    assert life.held is not None
    assert life.held["g"][0] == "INITIALIZED"


def test_a_change_with_a_sub_graph_in_it_kills_the_engine_also_when_it_was_there_before() -> None:
    slow = {"Work_0": [{"after_s": 30}]}
    life = Life(slow).start(chain("g", "Work_0", "Work_1"), wait=300)
    longer = chain("g", "Work_0", "Work_1", "Work_2")
    life.modify(longer)
    assert (life.alive, life.lines[-1]) == (True, "UMRF graph 'g' modified.")
    life.modify(chain("g", "Work_0", "Work_1", "SubSeq_0"))
    assert (life.alive, life.lines[-1]) == (False, "UMRF graph 'g' modified.")
    life = Life(slow).start(SUB, wait=300).modify(SUB)
    assert (life.alive, life.lines[-1]) == (False, "UMRF graph 'g' modified.")


def test_a_refused_change_is_told_with_where_it_came_from() -> None:
    life = Life({"Work_0": [{"after_s": 30}]}).start(chain("g", "Work_0", "Work_1"), wait=300)
    life.modify(chain("g", "Work_1"))
    assert life.lines[-1] == (
        "origin [in modifyGraph]: Cannot modify graph 'g': Action 'Work_0' cannot be deleted, because "
        "it is in an active state (PAUSED)\n   fwd [in modifyGraph]: forwarding\n"
    )


def test_attributes_of_an_action_come_back_also_where_its_number_is_cut() -> None:
    mark = {"action_assistant": {"run": "r1"}}
    sent = json.loads(chain("g", "Work_1", gui_attributes=mark))
    sent["actions"][0]["instance_id"] = 1.5
    assert graph_plan_of(json.dumps(sent)).attributes == {"Work_1": mark}
