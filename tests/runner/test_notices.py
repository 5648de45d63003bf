"""Events of robots and runs put messages into the outbox, in their transaction, once."""

from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from sqlalchemy import select

from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.runner import projection
from action_assistant.runner.notices import KINDS, with_notices
from action_assistant.runner.queues.entry import QueueReady
from action_assistant.runner.robots.robot_events import EngineBecame
from action_assistant.runner.runs.events import (
    AlarmRaised,
    Ended,
    Held,
    Led,
    PieceOf,
    PieceRest,
    Requested,
    StoredKind,
    draft_of,
)
from action_assistant.runner.runs.question_events import QuestionAsked
from action_assistant.runner.start.approvals import ApprovalQuestion, Approvals
from action_assistant.schema.runner_tables import outbox
from action_assistant.umrf.questions import Question
from action_assistant.web.notifications.messages import Message
from runner.harness import ANN, BEN, EPOCH
from web.notifications.receiving import webhook

CHAT = webhook("https://chat.example/", "chat")
STOPS = webhook("https://stops.example/", "stops", kinds=frozenset({"run.stop_unconfirmed"}))
MINUTE = 60_000_000


def _asked(run: str, number: int, **fields: Any) -> Requested:
    known = {
        "at": EPOCH,
        "run": run,
        "number": number,
        "request_id": run,
        "author": ANN,
        "graph": "g1",
        "graph_name": "Fetch",
        "version": "1",
        "digest": "d",
        "engine": "David",
        "simulated": False,
        "actions": {},
        "umrf": "{}",
    }
    return Requested(**(known | fields))


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """A journal with two receivers, and three runs: on a robot, in the simulator, on two robots."""
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    fold = with_notices(projection.fold, [CHAT, STOPS])
    journal = await Journal.open(url, branch="runner", fold=fold)
    await _store(journal, "run/r1", _asked("r1", 1))
    await _store(journal, "run/r2", _asked("r2", 2, simulated=True))
    led = Led(robots={"": "David", "arm": "Bob"}, players={})
    await _store(journal, "run/r3", _asked("r3", 3, engine="conducted", led=led))
    piece = PieceOf(run="r3", call=1, node="a_0")
    await _store(journal, "run/r4", _asked("r4", 0, piece=piece))
    yield journal
    await journal.close()


async def _store(journal: Journal, stream: str, *events: StoredKind) -> None:
    await journal.append(stream, [draft_of(each) for each in events])


async def _told(journal: Journal) -> list[tuple[str, str]]:
    rows = await journal.query(select(outbox).order_by(outbox.c.due, outbox.c.id))
    return [
        (
            each.id,
            Message(
                id=each.id, kind=each.kind, at=each.at, facts=msgspec.json.decode(each.facts)
            ).text,
        )
        for each in rows
    ]


async def test_a_failed_run_on_a_robot_is_told(journal: Journal) -> None:
    await _store(journal, "run/r1", Ended(EPOCH, "error", "on_error", "a_0 ended with an error."))
    assert await _told(journal) == [
        ("run/r1:2:chat", "Run 1 of Fetch on David has failed: an error. a_0 ended with an error.")
    ]


async def test_runs_that_went_well_or_simulated_and_pieces_are_not_told(journal: Journal) -> None:
    await _store(journal, "run/r1", Ended(EPOCH, "finished", "on_true"))
    await _store(journal, "run/r2", Ended(EPOCH, "error", "on_error"))
    await _store(journal, "run/r3", Ended(EPOCH, "stopped"))
    await _store(journal, "run/r4", Ended(EPOCH, "error", "on_error"))
    assert await _told(journal) == []


async def test_an_unconfirmed_stop_is_told_to_all_who_want_it_and_not_each_second(
    journal: Journal,
) -> None:
    for later in (0, 1, 4 * MINUTE, 11 * MINUTE):
        alarm = AlarmRaised(EPOCH + later, "stop_unconfirmed", f"STOP UNCONFIRMED: {later}.")
        await _store(journal, "run/r3", alarm, AlarmRaised(EPOCH, "H4", "x"))
    told = await _told(journal)
    assert [id_ for id_, _ in told] == [
        "run/r3:2:chat", "run/r3:2:stops", "run/r3:8:chat", "run/r3:8:stops",
    ]  # fmt: skip
    start = "The Stop of run 3 of Fetch on "
    assert told[0][1].startswith(start)
    assert "David" in told[0][1]
    assert "Bob" in told[0][1]


async def test_a_robot_is_lost_only_while_a_run_is_open_on_it(journal: Journal) -> None:
    for name, state in (("Bob", "gone"), ("Eve", "gone"), ("Bob", "restarted"), ("Bob", "busy")):
        await _store(journal, f"robot/{name}", EngineBecame(at=EPOCH, state=state, why="No."))
    assert await _told(journal) == [
        ("robot/Bob:1:chat", "Bob does not answer any more, and run 3 of Fetch is not over. No.")
    ]
    await _store(journal, "run/r3", Ended(EPOCH, "stopped"))
    await _store(journal, "robot/Bob", EngineBecame(at=EPOCH + 20 * MINUTE, state="gone"))
    assert len(await _told(journal)) == 1


async def test_a_question_to_people_is_told_when_it_is_first_asked(journal: Journal) -> None:
    door = Question(kind="confirm", text="Is the door open?")
    first = QuestionAsked(at=EPOCH, call=1, node="a_0", visit=1, question="q1", asks=door)
    again = msgspec.structs.replace(first, question="q2", again="q1")
    for run in ("run/r2", "run/r3"):
        await _store(journal, run, first, again)
    assert [text for _, text in await _told(journal)] == [
        "Run 3 of Fetch on David, Bob waits for the answer of a person. Is the door open?"
    ]


async def test_a_run_that_waits_for_a_person_is_told_once(journal: Journal) -> None:
    await _store(journal, "run/r3", Held(at=EPOCH, why="Ben holds it.", by=BEN))
    rest = PieceRest(
        at=EPOCH, piece="r4", node="a_0", engine="Bob", state="proven", since=EPOCH, asks=True
    )
    await _store(journal, "run/r3", rest, rest)
    assert [text for _, text in await _told(journal)] == [
        "Run 3 of Fetch on David, Bob waits for a person, who lets it go on or stops it. "
        "a_0 on Bob has ended, and a person has to say how."
    ]
    await _store(journal, "run/r3", Held(at=EPOCH + 1, why="Bob is lost."))
    assert len(await _told(journal)) == 2


async def test_who_asks_for_a_second_person_is_told_once_in_ten_minutes(journal: Journal) -> None:
    now = [EPOCH]
    approvals = Approvals(journal, lambda: now[0])
    question = ApprovalQuestion(digest="a" * 64, robots=("David",), graph_name="Fetch", graph="g1")
    for later in (0, 1, 11):
        now[0] = EPOCH + later * MINUTE
        await approvals.ask(question, ANN)
    assert [text for _, text in await _told(journal)] == [
        "Ann asks a second person to say yes to Fetch for David."
    ] * 2
    assert await approvals.given_for("a" * 64) == ()


async def test_whose_turn_it_is_in_a_queue_is_told_once_in_ten_minutes(journal: Journal) -> None:
    for later in (0, 1, 11):
        at = EPOCH + later * MINUTE
        ready = QueueReady(at=at, person="Ann", graph="g1", graph_name="Fetch", robots=("David",))
        await _store(journal, "queue/e1", ready)
    assert [text for _, text in await _told(journal)] == [
        "It is the turn of Fetch on David, which Ann has put into the queue."
    ] * 2


async def test_tables_that_are_made_again_send_nothing_again(journal: Journal) -> None:
    await _store(journal, "run/r1", Ended(EPOCH, "error", "on_error", "It fell."))
    before = await journal.query(select(outbox))
    await journal.derive(
        lambda connection: connection.execute(outbox.update().values(due=None, sent_at=EPOCH))
    )
    await journal.rebuild()
    after = await journal.query(select(outbox))
    assert [(each.id, each.due, each.sent_at) for each in after] == [(before[0].id, None, EPOCH)]


def test_every_kind_of_the_runner_has_its_sentence() -> None:
    from action_assistant.web.notifications.messages import KINDS as ALL

    assert set(KINDS) == set(ALL) - {"mention"}


async def test_without_receivers_the_fold_is_as_it_was() -> None:
    assert with_notices(projection.fold, []) is projection.fold


def test_an_event_is_folded_whatever_becomes_of_the_message_about_it() -> None:
    tables = select(outbox)
    event = Event("run/r1", 1, Ended.kind, "", EPOCH, b"[]", 1)
    assert with_notices(lambda _: [tables], [CHAT])(event) == (tables,)
