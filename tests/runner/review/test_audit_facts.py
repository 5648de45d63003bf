"""The words of the audit for events of the runner."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import get_type_hints

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.journal.databases import ask_once
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.runner.analysis.annotations import IncidentKept, stream_about
from action_assistant.runner.review import audit_facts
from action_assistant.runner.robots import rights
from action_assistant.runner.robots.registration import RobotRegistered
from action_assistant.runner.robots.robot_events import stream_of_robot
from action_assistant.runner.runs.events import (
    Author,
    BreakpointsSet,
    HandedOver,
    Held,
    Released,
    StoredKind,
    draft_of,
)
from action_assistant.runner.runs.question_events import AnswerRefused, QuestionAnswered
from action_assistant.web.audit.rows import AuditFilter
from action_assistant.web.auth.caller import Origin, acting_for, stamped
from action_assistant.web.auth.keys import PersonRef
from support.doses import examples

ADA, BEN = Author("ada", "Ada", "browser"), PersonRef("ben", "Ben")
ROBOT, RUN = stream_of_robot("Carrier"), "run/r1"
LOCK = rights.Lock(PersonRef("ada", "Ada"), 1, "its brake is loose")


@pytest.mark.parametrize(
    ("stream", "event", "text"),
    [
        (
            ROBOT,
            rights.RightsSet(at=1, author=ADA, rules=rights.Rules(baton=True)),
            "set the rules of Carrier",
        ),
        (
            ROBOT,
            rights.BatonPassed(at=1, how="handed", author=ADA, holder=BEN),
            "handed the baton of Carrier to Ben",
        ),
        (
            ROBOT,
            rights.Locked(at=1, author=ADA, reason="its brake is loose", locks=(LOCK,)),
            "took Carrier out of service: its brake is loose",
        ),
        (
            ROBOT,
            rights.Unlocked(at=1, author=ADA, of=BEN, locks=()),
            "put Carrier into service again",
        ),
        (
            RUN,
            HandedOver(at=1, author=ADA, to=Author("ben", "Ben")),
            "handed the run r1 over to Ben",
        ),
        (
            RUN,
            Held(at=1, why="Ada made it wait: Look.", by=ADA, how="wait", reason="Look."),
            "made the run r1 wait: Look.",
        ),
        (
            RUN,
            BreakpointsSet(at=1, author=ADA, breakpoints=()),
            "set the breakpoints of the run r1",
        ),
        (
            RUN,
            Released(at=1, author=ADA, step="Lift_0"),
            "let the run r1 make one step: Lift_0",
        ),
        (
            RUN,
            Released(at=1, author=ADA, until="Lift_0"),
            "let the run r1 make steps until Lift_0",
        ),
        (
            RUN,
            QuestionAnswered(
                at=1, call=1, node="AaConfirm_0", question="q", by=ADA, outcome="on_true"
            ),
            "answered AaConfirm_0 in the run r1",
        ),
        (
            RUN,
            AnswerRefused(at=1, question="q", node="AaConfirm_0", by=ADA, why="lapsed"),
            "answered AaConfirm_0 in the run r1 too late",
        ),
        (
            stream_about("r1"),
            IncidentKept(at=1, author=ADA),
            "keeps the run r1 as an incident",
        ),
    ],
)
async def test_an_event_is_said_in_words_with_its_person_and_connection(
    tmp_path: Path, stream: str, event: StoredKind, text: str
) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=lambda _: ())
    with acting_for("ada", Origin("Ada", "s1", address="10.0.0.7")):
        await journal.append(stream, [draft_of(event, "ada")])
    await journal.close()

    def ask() -> object:
        return ask_once(url, lambda connection: audit_facts.page(AuditFilter(), connection))

    page = await asyncio.to_thread(ask)
    (row,) = msgspec.to_builtins(page)["rows"]
    assert (row["text"], row["person"]["name"]) == (text, "Ada")
    assert row["from"] == {"name": "Ada", "session": "s1", "address": "10.0.0.7"}


def _events(base: type[msgspec.Struct]) -> Iterator[type[msgspec.Struct]]:
    for each in base.__subclasses__():
        is_of_runner = each.__module__.startswith("action_assistant.runner.")
        if is_of_runner and isinstance(getattr(each, "kind", None), str):
            yield each
        yield from _events(each)


@pytest.mark.parametrize("event", sorted(_events(msgspec.Struct), key=lambda each: str(each.kind)))
@settings(max_examples=examples(10), deadline=None)
@given(data=st.data())
def test_the_fields_of_each_event_can_be_read(
    event: type[msgspec.Struct], data: st.DataObject
) -> None:
    told = get_type_hints(audit_facts._Body)
    fields = {name: each for name, each in get_type_hints(event).items() if name in told}
    drawn = data.draw(st.fixed_dictionaries({k: st.from_type(v) for k, v in fields.items()}))
    # A default that is made anew each time may be drawn as its factory.
    text = msgspec.json.encode(drawn, enc_hook=lambda default: default.factory())
    msgspec.json.decode(text, type=audit_facts._Body)


async def test_who_registers_a_robot_is_told_in_words(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=lambda _: [])
    fields = {"domain": 0, "rmw": "", "get_service": "", "profile": dict[str, object]()}
    for led in (False, True):
        event = RobotRegistered(at=1, name="Carrier", led=led, **fields)
        with acting_for("ada", Origin("Ada", "s1")):
            stamp = stamped(msgspec.json.encode(event), "ada")
        await journal.append(ROBOT, [Draft(event.kind, "ada", stamp)])
    await journal.close()
    page = await asyncio.to_thread(audit_facts.page_in_worker, url, AuditFilter())
    rows = msgspec.json.decode(page)["rows"]
    assert [(each["text"], each["person"]["name"]) for each in rows] == [
        ("registered Carrier, or changed its registration", "Ada")
    ] * 2
