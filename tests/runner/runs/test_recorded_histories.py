"""Recordings of real engine nodes fold into histories that agree with the recordings' index.

`$UMRF_RECORDINGS` names the recordings, see `support/recordings.py`; a few small ones of the same
form, made up after them, are always folded.
"""

from pathlib import Path

import pytest

from action_assistant.runner.runs.fold import key_of
from action_assistant.runner.runs.run import ENDED, Run
from runner.recorded import Index, Told, history, index_of
from support.recordings import facts, family

OWN = Path(__file__).parents[2] / "data" / "recordings"
NODE = family("node")
#: `told`: one engine is given one graph by its text. `started_again`: somebody starts the same graph
#: again, or the engine is not the same any more, so that the last get says nothing of the run.
#: `short`: it was frozen, and the recording ends before it was seen at rest for long enough.
#: `refused`: the engine said no, or held the graph without beginning it, and was seen to for long
#: enough.
FACTS = facts("node").get("histories", {"told": []})
_ENDS = {"FINISHED": "finished", "HALTED": "halted", "STOPPED": "stopped", "ERROR": "error"}
_MOVES = set("RSPQ")
_TAKEN, _SHORT, _REFUSED = (
    tuple(FACTS.get(kind, ())) for kind in ("started_again", "short", "refused")
)


def check(run: Run, told: Index, name: str) -> None:
    """Compare a history with the index, in both directions."""
    check_end(run, told, name)
    for graph in told.feedback.keys() | told.get.keys():
        check_nodes(run, graph, told)
    for action in run.actions.values():
        for visit in action.visits:
            assert visit.not_before <= visit.start
            if visit.until is not None:
                assert visit.not_before <= visit.until
                assert visit.not_after is None or visit.start <= visit.not_after
                assert visit.not_after is None or visit.until <= visit.not_after
            assert visit.result in {None, "error", "stopped"}  # the engine tells no other


def check_end(run: Run, told: Index, name: str) -> None:
    last = (told.last or {}).get(run.graph_name)
    if name.startswith(_TAKEN):
        assert run.state in {"lost", "finished", "error", "stopping", "unknown"}
        assert run.proof_at is None or run.end == "finished"
    elif name.startswith(_REFUSED):
        assert run.end == "refused"
        assert all(action.visits == () for action in run.actions.values())
    elif not told.polled or last not in _ENDS:
        assert run.state not in ENDED - {"lost"}  # no answer has ever proven an end
    elif last == "ERROR":
        assert run.end is None  # the code of its actions may go on
        assert run.unconfirmed
    else:
        is_open = run.end is None and (name.startswith(_SHORT) or bool(run.loading))
        assert run.end == _ENDS[last] or is_open
        assert run.graph_state == last


def check_nodes(run: Run, graph: str, told: Index) -> None:
    nothing = Told({}, told.feedback.keys() != set() or told.get.keys() != set())
    feedback, get = told.feedback.get(graph, nothing), told.get.get(graph, nothing)
    named = feedback.nodes.keys() | get.nodes.keys()
    for node in named:
        letters = feedback.nodes.get(node, "") + get.nodes.get(node, "")
        action = run.actions.get(key_of(run, graph, node))
        visits = action.visits if action is not None else ()
        laps = max(_laps(feedback.nodes.get(node, "")), _laps(get.nodes.get(node, "")))
        assert len(visits) <= max(laps, 1), node
        if not set(letters) & _MOVES:
            assert all(visit.how == "inferred" for visit in visits), node
        if "E" not in letters:
            assert all(visit.result != "error" for visit in visits), node
        if "S" not in letters:
            assert all(visit.result != "stopped" for visit in visits), node
        if run.end in {"finished", "halted", "stopped", "error"} and _laps(letters):
            assert visits, node  # somebody saw it, so it is in the history
    if feedback.whole and get.whole:
        for name, action in run.actions.items():
            if "/" not in name and graph == run.graph_name and name not in named:
                assert action.visits == (), name


def _laps(letters: str) -> int:
    """Return how often an action began at least: each begin shows as R, or as an end without
    one."""
    began, moving = 0, False
    for letter in letters:
        if letter in _MOVES:
            began, moving = began + (not moving), True
        elif letter in "FE":
            began, moving = began + (not moving and began == 0), False
        else:
            moving = False
    return began


@pytest.mark.turns
@pytest.mark.parametrize("name", FACTS["told"])
def test_a_recording_of_a_real_node_is_told_as_its_index_says(name: str) -> None:
    files = [
        path
        for path in NODE.glob(f"{name}*.jsonl")
        if path.name.split(".")[0].split("__")[0] == name
    ]
    assert files
    for file in sorted(files):
        try:
            check(history(file), index_of(file), name)
        except AssertionError as error:
            raise AssertionError(f"{file.name}: {error}") from error


@pytest.mark.parametrize("file", sorted(OWN.glob("*.jsonl")), ids=lambda file: file.stem)
def test_a_small_recording_is_told_as_its_index_says(file: Path) -> None:
    check(history(file), index_of(file), file.stem)
