"""The views of where a run began, and of what it takes for granted."""

from datetime import datetime

import msgspec

from action_assistant.kit.moments import moment
from action_assistant.runner.links.parameter_texts import shortened
from action_assistant.runner.runs.earlier import Choice, Earlier, StartFrom, UnderWay
from action_assistant.runner.runs.visits import Outcome
from action_assistant.umrf.partial_runs import EndedBy


class StartFromShown(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The place where a run began, if not at the entry. `run`, `number`: the earlier run whose outcomes and values
    count, "" and 0 for none; `at`: the actions with which it began, none if it continued that run where
    it ended; `only`: it played nothing else."""

    run: str = ""
    number: int = 0
    at: tuple[str, ...] = ()
    only: bool = False


class AssumedShown(msgspec.Struct, frozen=True):
    """An action that counts as ended. `outcome`: of the earlier run, null if no run shows one, and `at`
    when it came; `by`: the person who stated it, "" if it was seen."""

    action: str
    outcome: Outcome | None
    at: datetime | None
    by: str


class TakenValueShown(msgspec.Struct, frozen=True):
    """A value of an earlier run, with which the input `name` of `action` begins. `source`: the action that
    gave it, and `at` when; `text`: the value as JSON."""

    action: str
    name: str
    source: str
    text: str
    at: datetime


class EarlierShown(msgspec.Struct, frozen=True, kw_only=True):
    """The outcomes and values that a run takes for granted. `number`: of the earlier run, 0 for none; `begins`: the actions
    with which it begins; `assumed`, `values`: outcomes and values of before; `skipped`: what it does not
    play; `ended_by`: what only a skipped action would stop; `under_way`: the actions that had begun and
    had no outcome, for each of which a person chooses (`choices`, with the reason of their word)."""

    number: int
    begins: tuple[str, ...]
    assumed: tuple[AssumedShown, ...]
    values: tuple[TakenValueShown, ...]
    skipped: tuple[str, ...]
    ended_by: tuple[EndedBy, ...]
    under_way: tuple[UnderWay, ...]
    choices: dict[str, Choice]
    reason: str


def start_from_view(start: StartFrom, earlier: Earlier | None) -> StartFromShown:
    """Return the view of where a run began. `earlier`: what it takes for granted."""
    number = 0 if earlier is None else earlier.number
    return StartFromShown(run=start.run, number=number, at=start.at, only=start.only)


def earlier_view(earlier: Earlier, start: StartFrom | None) -> EarlierShown:
    """Return the view of what a run takes for granted. `start`: where it begins, with the choices of the
    person."""
    return EarlierShown(
        number=earlier.number,
        begins=earlier.begins,
        assumed=tuple(
            AssumedShown(
                each.action,
                _outcome_view(each.outcome),
                None if each.at is None else moment(each.at),
                each.by,
            )
            for each in earlier.assumed
        ),
        values=tuple(
            TakenValueShown(
                each.action, each.name, each.source, shortened(each.text), moment(each.at)
            )
            for each in earlier.values
        ),
        skipped=earlier.skipped,
        ended_by=earlier.ended_by,
        under_way=earlier.under_way,
        choices={} if start is None else start.choices,
        reason="" if start is None else start.reason,
    )


def _outcome_view(outcome: str) -> Outcome | None:
    told = outcome.removeprefix("on_")
    return msgspec.convert(told, Outcome) if told else None
