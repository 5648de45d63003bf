"""What a running engine does, event by event, as `simulate --trace` prints it.

See docs/contracts.md 5.1.
"""

from typing import TypeAlias

import msgspec

from action_assistant.safe_text import hold_names


class NodeStateEvent(msgspec.Struct, frozen=True, tag_field="kind", tag="node_state"):
    """An action changed its state. Times are milliseconds as the caller counts them."""

    t_ms: float
    graph: str
    node: str
    state: str


class GraphStateEvent(msgspec.Struct, frozen=True, tag_field="kind", tag="graph_state"):
    """A graph changed its state."""

    t_ms: float
    graph: str
    state: str


class EdgeEval(msgspec.Struct, frozen=True, tag_field="kind", tag="edge"):
    """One relation was asked: `parent => child`, and what came of it: `result -> response`."""

    t_ms: float
    graph: str
    edge: str
    eval: str


class Dispatch(msgspec.Struct, frozen=True, tag_field="kind", tag="dispatch"):
    """A child was ready and the response was carried out."""

    t_ms: float
    graph: str
    node: str
    response: str


class NotReady(msgspec.Struct, frozen=True, tag_field="kind", tag="not_ready"):
    """A child waits for inputs or for required parents."""

    t_ms: float
    graph: str
    node: str
    why: str

    def __post_init__(self) -> None:
        hold_names(self, "why")


class GraphResultEvent(msgspec.Struct, frozen=True, tag_field="kind", tag="graph_result"):
    """The exit of a graph was satisfied with this result."""

    t_ms: float
    graph: str
    value: str


class HazardEvent(msgspec.Struct, frozen=True, omit_defaults=True, tag_field="kind", tag="hazard"):
    """Here the real engine crashes, hangs or does something that nobody wants.

    See docs/umrf-and-the-engine.md 3.

    `effect`: `crash` ends the trace; after `hang` no command is answered; `goes on` warns; `cut off`
    says that it was not simulated any further.
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
    """How a visit of an action ended; the real engine tells nobody."""

    t_ms: float
    graph: str
    node: str
    result: str
    message: str | None = None


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
