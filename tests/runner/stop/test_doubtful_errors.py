"""Some errors of an engine leave open whether an action's code goes on."""

import msgspec
import pytest

from action_assistant.runner.links.engine_text import snapshot
from action_assistant.runner.links.observations import Snapshot
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors


def _shown(state: str, **nodes: str) -> Snapshot:
    return Snapshot(at=1, graph="g", state=state, nodes=nodes)


def test_an_error_from_before_any_stop_stays_the_action_s_own() -> None:
    doubts = DoubtfulErrors(reached=False)
    assert doubts.look([_shown("RUNNING", A_0="ERROR", B_0="RUNNING")]) == ""
    doubts.reach()
    assert doubts.look([_shown("STOPPED", A_0="ERROR", B_0="FINISHED")]) == ""
    assert "B_0 did not obey" in doubts.look([_shown("STOPPED", A_0="ERROR", B_0="ERROR")])


def test_an_action_that_began_again_since_is_looked_at_anew() -> None:
    doubts = DoubtfulErrors(reached=False)
    doubts.look([_shown("RUNNING", A_0="ERROR")])
    doubts.look([_shown("RUNNING", A_0="RUNNING")])
    doubts.reach()
    assert "A_0 did not obey" in doubts.look([_shown("STOPPED", A_0="ERROR")])


def test_a_graph_in_error_names_somebody_even_when_no_action_is() -> None:
    assert "g did not obey" in DoubtfulErrors(reached=False).look([_shown("ERROR", A_0="FINISHED")])


def test_a_sub_graph_in_error_counts_and_a_doubt_stays() -> None:
    doubts = DoubtfulErrors(reached=False)
    part = Snapshot(at=1, graph="g__Sub__0", state="ERROR", nodes={"C_0": "ERROR"})
    assert "C_0 did not obey" in doubts.look([_shown("STOPPED", Sub_0="FINISHED"), part])
    assert "C_0 did not obey" in doubts.look([_shown("STOPPED", Sub_0="FINISHED")])


@pytest.mark.parametrize(
    ("conditions", "type_", "expected"),
    [
        (["on_true -> run"], "sync", ()),
        (["on_true -> run", "on_error->stop"], "sync", ("B_0",)),
        (["on_true -> pause"], "sync", ("B_0",)),
        (["on_true -> run"], "spontaneous", ("B_0",)),
    ],
)
def test_an_answer_tells_which_errors_its_graph_may_have_caused_itself(
    conditions: list[str], type_: str, expected: tuple[str, ...]
) -> None:
    parent = {"name": "A", "instance_id": 0, "conditions": conditions}
    actions = [
        {"name": "A", "type": type_, "state": "FINISHED"},
        {"name": "B", "type": "sync", "state": "ERROR", "parents": [parent]},
    ]
    text = msgspec.json.encode({"graph_name": "g", "graph_state": "RUNNING", "actions": actions})
    assert snapshot(text.decode(), at=1, source="get").stoppable == expected
