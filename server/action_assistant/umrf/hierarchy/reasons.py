"""Reasons for which a hierarchy cannot be made flat, with their place."""

from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant.safe_text import hold_names
from action_assistant.umrf.hierarchy.level_courses import Trouble, TroubleKind
from action_assistant.umrf.model import Key

FlatteningCode: TypeAlias = Literal[
    "faulty", "recursion", "signature", "too-large", "undecided", "actors", "spontaneous", "stops",
    "allowed-values", "never-ends", "left-running", "asks-beside", "begins-again", "bypass",
    "response", "crash", "exits", "entries", "inputs", "outputs", "renaming", "loop",
    "name", "selection", "between", "ways-in", "ways-out", "values", "otherwise",
]  # fmt: skip


class HierarchyLevel(msgspec.Struct, frozen=True):
    """One step on the way down to an action: a graph, and an action of it by key and full name."""

    graph: str
    key: Key
    action: str


#: The levels from the top graph down; the last one is the action that is meant. Empty for the top graph itself.
LevelPath: TypeAlias = tuple[HierarchyLevel, ...]


class FlatteningReason(msgspec.Struct, frozen=True):
    """One reason for which one graph would not do the same as the hierarchy. `at`: the action that
    it concerns."""

    code: FlatteningCode
    message: str
    at: LevelPath = ()

    def __post_init__(self) -> None:
        hold_names(self, "message")


_KINDS: Final[dict[TroubleKind, tuple[FlatteningCode, str]]] = {
    "halts": ("never-ends", "It can end HALTED{when}, and the graph around it is not informed: it stays RUNNING for ever, where one graph would be HALTED."),
    "waits": ("never-ends", "It can wait for ever{when}; the action that it stands for then runs for ever, where one graph would continue."),
    "unready": ("never-ends", "Its exit is asked and waits for outputs{when}, where one graph would continue."),
    "early": ("left-running", "It can be FINISHED while actions in it still run{when}: their ends then start nothing, and would in one graph."),
    "beside": ("asks-beside", "What leads to its exit can ask another action as well{when}, whose end then starts nothing, and would in one graph."),
    "ends": ("left-running", "The graph around it can be FINISHED while it runs{when}: the sub-graph then continues to its end, and one graph would not."),
    "again": ("begins-again", "It can be told to begin a second time{when}: a sub-graph begins anew each time, without the values of its last run, and misses reports that come while it runs."),
    "crossing": ("bypass", "It can be bypassed together with others{when}: which of them reports last would differ."),
    "response": ("response", "It can be told to stop, pause or restart as a whole{when}."),
    "crash": ("crash", "The engine can abort or block itself here{when}."),
    "undecided": ("undecided", "It has more courses than are examined."),
}  # fmt: skip


def of_trouble(trouble: Trouble, at: LevelPath) -> FlatteningReason:
    """Return, as a reason against flattening, a trouble that was found in a course of a graph.
    `at`: the graphs and actions from the top graph down to the action that the trouble concerns."""
    code, message = _KINDS[trouble.kind]
    when = f", for instance when {trouble.by} ends {trouble.result}" if trouble.by else ""
    return FlatteningReason(code, message.format(when=when), at)
