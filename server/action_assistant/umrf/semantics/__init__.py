"""The engine's behaviour as a deterministic step function (docs/umrf-and-the-engine.md 2)."""

from action_assistant.umrf.semantics.engine import Engine, GraphNow
from action_assistant.umrf.semantics.graphs import GraphRefused
from action_assistant.umrf.semantics.parts import Execution
from action_assistant.umrf.semantics.performing import Call, Performer, Returned
from action_assistant.umrf.semantics.script import SCRIPT, Behaviour, Script, script_from
from action_assistant.umrf.semantics.simulate import CUT_OFF, simulate
from action_assistant.umrf.semantics.trace import (
    Dispatch,
    EdgeEval,
    GraphResultEvent,
    GraphStateEvent,
    HazardEvent,
    NodeResultEvent,
    NodeStateEvent,
    NotReady,
    Trace,
)

__all__ = [
    "CUT_OFF",
    "SCRIPT",
    "Behaviour",
    "Call",
    "Dispatch",
    "EdgeEval",
    "Engine",
    "Execution",
    "GraphNow",
    "GraphRefused",
    "GraphResultEvent",
    "GraphStateEvent",
    "HazardEvent",
    "NodeResultEvent",
    "NodeStateEvent",
    "NotReady",
    "Performer",
    "Returned",
    "Script",
    "Trace",
    "script_from",
    "simulate",
]
