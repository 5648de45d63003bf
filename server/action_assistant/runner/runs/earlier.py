"""The things that a run takes over from an earlier one, as its first event stores them.

A run is continued where an earlier one ended, or begins at some actions of its graph. Either way it is
a run of its own.
"""

from collections.abc import Iterable
from typing import Annotated, Final, Literal, TypeAlias

import msgspec

from action_assistant.umrf.model import Precondition
from action_assistant.umrf.partial_runs import AssumedOutcome, AssumedValue, EndedBy
from action_assistant.umrf.semantics import Returned

_Name = Annotated[str, msgspec.Meta(max_length=1000)]
#: The choice for an action that was under way: it begins again, it has ended so by the word of the
#: person, or nothing goes on from it.
Choice: TypeAlias = Literal["again", "true", "false", "error", "leave"]
#: The choices by which a person states an outcome.
WORDS: Final[frozenset[Choice]] = frozenset({"true", "false", "error"})


class StartFrom(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, kw_only=True
):
    """The place where a start begins, if not at the entry. `run`: the earlier run whose outcomes and values count,
    "" for none. `at`: the actions with which it begins, by full name; without any it is continued where
    that run ended. `only`: nothing but these actions is played. `choices`: for each action that was
    under way when that run ended, by full name; `reason`: how the person knows the outcomes among
    them."""

    run: Annotated[str, msgspec.Meta(max_length=100)] = ""
    at: Annotated[tuple[_Name, ...], msgspec.Meta(max_length=200)] = ()
    only: bool = False
    choices: Annotated[dict[_Name, Choice], msgspec.Meta(max_length=200)] = {}
    reason: Annotated[str, msgspec.Meta(max_length=1000)] = ""

    @property
    def continues(self) -> bool:
        """True if the earlier run is continued where it ended."""
        return not self.at

    @property
    def has_words(self) -> bool:
        """True if the person states the outcome of an action."""
        return bool(WORDS & set(self.choices.values()))


class UnderWay(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An action that had begun and had no outcome when the earlier run was stopped. `robot`: that played
    it; `seen`: the outcome that was seen after the Stop, "" for none."""

    action: str
    robot: str
    seen: Precondition | Literal[""] = ""


class Earlier(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The outcomes and values that a run takes for granted. `number`: of the earlier run, 0 for none; `begins`: the
    actions with which it begins; `assumed`, `values`: outcomes and values of before; `skipped`: actions
    that it does not play; `ended_by`: actions that only one of these would stop; `under_way`: a person
    chose for each of these."""

    number: int = 0
    begins: tuple[str, ...] = ()
    assumed: tuple[AssumedOutcome, ...] = ()
    values: tuple[AssumedValue, ...] = ()
    skipped: tuple[str, ...] = ()
    ended_by: tuple[EndedBy, ...] = ()
    under_way: tuple[UnderWay, ...] = ()


class PastEnd(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The end of a call in an earlier run. `ms`: after the start of the graph; `at`: µs UTC; `outcome`:
    as people saw it, `returned`: as the engine of the whole graph is told; `by`: the name of the person
    who stated it."""

    ms: float
    at: int
    node: str
    outcome: Precondition
    returned: Returned
    by: str = ""


class Before(msgspec.Struct, frozen=True, kw_only=True):
    """The course of the run that is continued: it brings the engine of the whole graph to where that
    run ended. `ends`: in order; `calls`: all calls so far, with the full names of their actions;
    `took_ms`: how long it went on."""

    ends: tuple[PastEnd, ...]
    calls: dict[int, str]
    took_ms: float


class Ending(msgspec.Struct, frozen=True, kw_only=True):
    """The point that an ended run had reached. `before`: its course, with the `choices` of a person where they are
    given; `under_way`: the actions for which a person has to choose; `begins`: the actions that begin
    at once if it is continued; `assumed`: the newest outcome of each action, `values`: those that the
    actions in `begins` take; `lacks`: why a choice is not possible, "" if all are."""

    before: Before
    under_way: tuple[UnderWay, ...]
    begins: tuple[str, ...]
    assumed: tuple[AssumedOutcome, ...]
    values: tuple[AssumedValue, ...]
    lacks: str = ""


def newest_of(ends: Iterable[PastEnd]) -> dict[str, PastEnd]:
    """Return the newest end of each action, by full name."""
    return {each.node: each for each in ends}
