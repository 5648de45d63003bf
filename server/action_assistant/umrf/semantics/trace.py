"""Trace events of a running engine, as `simulate --trace` prints them.

See docs/contracts.md 5.1.
"""

from typing import TypeAlias

import msgspec

from action_assistant.safe_text import hold_names


class NodeStateEvent(
    msgspec.Struct, frozen=True, omit_defaults=True, tag_field="kind", tag="node_state"
):
    """An action changed its state. Times are milliseconds on the caller's clock.

    `actor`: the actor that performs the action, here and in other events; "" if none is named. An
    action of a sub-graph that names none belongs to the actor of the action that stands for it.
    """

    t_ms: float
    graph: str
    node: str
    state: str
    actor: str = ""


class GraphStateEvent(msgspec.Struct, frozen=True, tag_field="kind", tag="graph_state"):
    """A graph changed its state."""

    t_ms: float
    graph: str
    state: str


class EdgeEval(msgspec.Struct, frozen=True, tag_field="kind", tag="edge"):
    """A child was asked for its response: `parent => child` was evaluated to `result ->
    response`."""

    t_ms: float
    graph: str
    edge: str
    eval: str


class Dispatch(msgspec.Struct, frozen=True, omit_defaults=True, tag_field="kind", tag="dispatch"):
    """A child was ready, and its response was carried out."""

    t_ms: float
    graph: str
    node: str
    response: str
    actor: str = ""


class NotReady(msgspec.Struct, frozen=True, tag_field="kind", tag="not_ready"):
    """A child waits for inputs or for required parents."""

    t_ms: float
    graph: str
    node: str
    why: str

    def __post_init__(self) -> None:
        hold_names(self, "why")


class GraphResultEvent(msgspec.Struct, frozen=True, tag_field="kind", tag="graph_result"):
    """The exit of a graph was reached with this result."""

    t_ms: float
    graph: str
    value: str


class HazardEvent(msgspec.Struct, frozen=True, omit_defaults=True, tag_field="kind", tag="hazard"):
    """The real engine crashes, hangs or does something unwanted here.

    See docs/umrf-and-the-engine.md 3. `effect`: `crash` ends the trace; after `hang` no command is
    answered; `goes on` warns; `cut off` says that the simulation was not continued.
    """

    t_ms: float
    graph: str
    code: str
    effect: str
    node: str | None = None
    message: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "message")


class NodeResultEvent(
    msgspec.Struct, frozen=True, omit_defaults=True, tag_field="kind", tag="node_result"
):
    """A visit of an action ended with this result; the real engine reports it to no client."""

    t_ms: float
    graph: str
    node: str
    result: str
    message: str | None = None
    actor: str = ""


Trace: TypeAlias = (
    NodeStateEvent
    | GraphStateEvent
    | EdgeEval
    | Dispatch
    | NotReady
    | GraphResultEvent
    | HazardEvent
    | NodeResultEvent
)
