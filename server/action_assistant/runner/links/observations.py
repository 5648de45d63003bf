"""Observations of an engine: exact transitions from the simulator, snapshots from robots.

Times are microseconds UTC by this process's clock. Graph and node names are the engine's: a graph's
running name, a node's full name (`NAME_ID`). These values are journaled as they are, so fields are
only ever added, with a default.
"""

from collections.abc import Sequence
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.kept_values import NOTHING_KEPT, KeptValues

_NAMED: Final = 3


#: States in which a node moves, or may move again without a new start.
ACTIVE: Final = frozenset({"RUNNING", "STOPPING", "PAUSE_REQUESTED", "PAUSED"})
#: The progress of an action within one execution, by its state.
FAR: Final = {
    "UNINITIALIZED": 0,
    "INITIALIZED": 0,
    "RUNNING": 1,
    "PAUSE_REQUESTED": 1,
    "PAUSED": 1,
    "STOPPING": 2,
    "FINISHED": 3,
    "ERROR": 3,
}
#: States of a graph in which the engine starts nothing more by itself.
TERMINAL: Final = frozenset({"FINISHED", "HALTED", "STOPPED", "ERROR"})


#: How grave a line of an engine's log is; "" where that was not recorded.
LogLevel: TypeAlias = Literal["", "debug", "info", "warn", "error", "fatal"]


class NodeState(
    msgspec.Struct, frozen=True, gc=False, omit_defaults=True, tag="node_state", tag_field="kind"
):
    """A node changed its state at exactly this time. `inputs`: the values it began with, where they
    could be seen (flat name → JSON text)."""

    at: int
    graph: str
    node: str
    state: str
    inputs: dict[str, str] | None = None


class NodeResult(
    msgspec.Struct, frozen=True, gc=False, omit_defaults=True, tag="node_result", tag_field="kind"
):
    """A node ended with this result (`on_true`, …). `message`: its text, if it gave one."""

    at: int
    graph: str
    node: str
    result: str
    message: str | None = None


class GraphState(msgspec.Struct, frozen=True, gc=False, tag="graph_state", tag_field="kind"):
    """A graph changed its state at exactly this time."""

    at: int
    graph: str
    state: str


class GraphResult(msgspec.Struct, frozen=True, gc=False, tag="graph_result", tag_field="kind"):
    """A graph ended with this result."""

    at: int
    graph: str
    result: str


class Hazard(
    msgspec.Struct, frozen=True, gc=False, omit_defaults=True, tag="hazard", tag_field="kind"
):
    """The engine did something harmful (codes `H1` …, docs/umrf-and-the-engine.md 3). `effect`:
    `crash` and `hang` end all its answers, `goes on` is a warning."""

    at: int
    graph: str
    code: str
    effect: str
    node: str | None = None
    message: str = ""


class Snapshot(
    msgspec.Struct, frozen=True, gc=False, omit_defaults=True, tag="snapshot", tag_field="kind"
):
    """One graph as the engine showed it at `at`; the time between two snapshots is unknown.

    `source`: `get` is an answer to our question sent at `asked_at`, `feedback` comes by itself and
    may be late. `since`, `since_asked`: when the previous answer came and was asked for; changes
    are later than `since_asked`. `run`: the id that the graph carries; None for graphs that others
    started. `messages`: all runtime messages so far, by node (the engine keeps ten). `inputs`:
    values of nodes that move, if readable. `same`: nodes that are not listed are unchanged, also in
    messages. `stoppable`: nodes in ERROR that the graph's own rules may have stopped or paused.
    `spontaneous`: nodes that have begun and begin again by themselves. `kept`: the outputs that the
    keepers of a piece hold (`umrf.kept_values`), which are no nodes here.
    """

    at: int
    graph: str
    state: str
    nodes: dict[str, str]
    source: Literal["get", "feedback"] = "get"
    asked_at: int | None = None
    since: int | None = None
    run: str | None = None
    messages: dict[str, tuple[str, ...]] = {}
    inputs: dict[str, dict[str, str]] = {}
    same: bool = False
    stoppable: tuple[str, ...] = ()
    spontaneous: tuple[str, ...] = ()
    since_asked: int | None = None
    kept: KeptValues = NOTHING_KEPT

    @property
    def active(self) -> bool:
        """True if any node is running, stopping or paused (or asked to pause): it moves, or may
        move again without a new start."""
        return any(state in ACTIVE for state in self.nodes.values())


Exact: TypeAlias = NodeState | NodeResult | GraphState | GraphResult | Hazard
Seen: TypeAlias = Exact | Snapshot


def failed_in(shown: Snapshot) -> list[str]:
    """Return the full names of the actions of a snapshot that are in the state ERROR."""
    return [node for node, state in shown.nodes.items() if state == "ERROR"]


def did_not_obey(names: Sequence[str]) -> str:
    """Return the clause, for people, about the actions `names` that the engine shows as ERROR
    because they did not stop in time; the first ones are named, the others counted."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return (
        f"{', '.join(names[:_NAMED])}{more} did not obey within 5 s, or failed while it was told to "
        "stop: the engine says ERROR, but the code may still run"
    )
