"""Each message is delivered once, as far as its receiver can tell by the id, or shown as failed."""

import asyncio
import logging
import random
import threading
from collections import Counter
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import anyio
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import Executable, insert, select

from action_assistant.errors import NotFound
from action_assistant.journal.events import Draft, Event
from action_assistant.journal.journal import Journal
from action_assistant.kit.clock import utc_us
from action_assistant.schema.editor_tables import outbox
from action_assistant.web.notifications.delivery import NotDelivered
from action_assistant.web.notifications.messages import Message
from action_assistant.web.notifications.outbox import RETRIES_S, DueMessage, id_of, row
from action_assistant.web.notifications.receivers import Receiver
from action_assistant.web.notifications.sender import Notifications
from support.doses import examples
from web.notifications.receiving import http_receiver, mail_server, mailbox, tls, webhook

HOUR = 3_600_000_000
RECEIVERS = (webhook("https://a.example/", "a"), webhook("https://b.example/", "b"))
EVENT = Draft("thing.failed.v1", "", b"{}")


def _fold(event: Event) -> Sequence[Executable]:
    return [
        insert(outbox)
        .prefix_with("OR IGNORE")
        .values(row(id_of(event, each.name), each.name, "run.ended", event.stream, event.at, {}))
        for each in RECEIVERS
    ]


class Clock:
    """A clock that goes on by some minutes with each look at it."""

    def __init__(self) -> None:
        self.now = utc_us()

    def __call__(self) -> int:
        self.now += HOUR // 4
        return self.now


async def _open(folder: Path) -> Journal:
    return await Journal.open(f"sqlite:///{folder / 'editor.db'}", branch="editor", fold=_fold)


async def _rows(journal: Journal) -> list[Any]:
    return await journal.query(select(outbox))


class Network:
    """Receivers that fail by chance. `got`: how often each id was taken; `cut` is set when the sender
    has to be ended before it can record that."""

    def __init__(self, seed: int, fails: float, cuts: float, gone: float) -> None:
        self._random = random.Random(seed)
        self._fails, self._cuts, self._gone = fails, cuts, gone
        self.got: Counter[str] = Counter()
        self.cut = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    def deliver(self, receiver: Receiver, message: Message, page: str) -> None:
        """Take a message, or refuse it."""
        del page
        assert message.id.endswith(f":{receiver.name}")
        if self._random.random() < self._gone:
            raise NotDelivered("Gone.", is_final=True)
        if self._random.random() < self._fails:
            raise NotDelivered("It failed.")
        self.got[message.id] += 1
        if self._random.random() < self._cuts:
            self._loop.call_soon_threadsafe(self.cut.set)


async def _seen_by_all(message: Message) -> bool:
    return bool(message.id)


async def _true(value: object) -> bool:
    return bool(value)


async def _is_off(sender: Notifications) -> bool:
    return bool((await sender.states())[0].off)


async def _is_over(journal: Journal) -> bool:
    return not any(each.due is not None for each in await _rows(journal))


async def _until(seen: Callable[[], Awaitable[bool]]) -> None:
    with anyio.fail_after(20):
        while not await seen():  # noqa: ASYNC110 - the other side is a thread or a database
            await anyio.sleep(0.005)


async def _life(journal: Journal, network: Network, clock: Clock, until: float | None) -> None:
    """Send until all is sent, the network is cut, or `until` seconds have gone."""
    sender = Notifications(
        journal,
        RECEIVERS,
        ["run.ended"],
        "",
        _seen_by_all,
        clock_us=clock,
        deliver=network.deliver,
        look_s=0,
        gap_s=0,
    )
    network.cut.clear()
    with anyio.move_on_after(until):
        async with anyio.create_task_group() as tasks:

            async def end_at_cut() -> None:
                await network.cut.wait()
                tasks.cancel_scope.cancel()

            tasks.start_soon(end_at_cut)
            async with sender.sending():
                await _until(lambda: _is_over(journal))
            tasks.cancel_scope.cancel()


async def _story(
    folder: Path, lives: list[int], seed: int, fails: float, cuts: float, gone: float
) -> None:
    network, clock, appended = Network(seed, fails, cuts, gone), Clock(), 0
    for count in lives:
        journal = await _open(folder)
        for _ in range(count):
            await journal.append("run/x.y", [EVENT])
        appended += count
        await _life(journal, network, clock, 0.02)
        await journal.close()
    journal = await _open(folder)
    while not await _is_over(journal):
        await _life(journal, network, clock, None)
    rows = await _rows(journal)
    assert len(rows) == 2 * appended
    for each in rows:
        if each.sent_at is not None:
            assert network.got[each.id] >= 1
            assert not each.error
        else:
            assert each.error
    if not cuts:  # only an end of the process has a message sent again
        assert max(network.got.values(), default=0) <= 1 + len(lives)
        assert {each.id for each in rows if each.sent_at is not None} <= set(network.got)
    before = network.got.copy()
    await journal.rebuild()
    assert await _is_over(journal)
    await _life(journal, network, clock, None)
    assert network.got == before
    await journal.close()


@settings(max_examples=examples(25), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    lives=st.lists(st.integers(0, 3), min_size=1, max_size=3),
    seed=st.integers(0, 2**32),
    fails=st.sampled_from([0, 0.3, 0.9, 1]),
    cuts=st.sampled_from([0, 0.3]),
    gone=st.sampled_from([0, 0, 0.2]),
)
def test_each_message_is_taken_once_or_shown_as_failed(
    lives: list[int], seed: int, fails: float, cuts: float, gone: float
) -> None:
    with TemporaryDirectory() as folder:
        asyncio.run(_story(Path(folder), lives, seed, fails, cuts, gone))


async def test_a_receiver_is_tried_as_often_as_agreed_and_then_switched_off(tmp_path: Path) -> None:
    journal, clock = await _open(tmp_path), Clock()
    await journal.append("run/x", [EVENT])
    network = Network(1, 1, 0, 0)
    await _life(journal, network, clock, None)
    assert {each.tries for each in await _rows(journal)} == {len(RETRIES_S) + 1}
    await journal.append("run/x", [EVENT])
    await _life(journal, network, clock, None)
    newest = max(await _rows(journal), key=lambda each: each.id)
    assert newest.error.startswith("Not sent: It failed.")
    assert newest.tries == 0
    await journal.close()


async def test_a_test_that_arrives_switches_a_receiver_on_again(tmp_path: Path) -> None:
    journal = await _open(tmp_path)
    with http_receiver() as receiver:
        chat = webhook(f"http://127.0.0.1:{receiver.port}/", "a")
        sender = Notifications(
            journal, [chat], ["run.ended"], "", _seen_by_all, gap_s=0, look_s=0.01
        )
        receiver.answers = [410]
        await journal.append("run/x", [EVENT])
        async with sender.sending():
            await _until(lambda: _is_off(sender))
            assert (await sender.states())[0].error.startswith("It answered 410")
            receiver.answers = [500]
            failed = await sender.test("a", "Ann")
            assert failed.off.startswith("It answered 410")
            assert failed.error.startswith("It answered 500")
            works = await sender.test("a", "Ann")
            assert (works.off, works.error, works.failed) == ("", "", 1)
            await journal.append("run/x", [EVENT])
            await _until(lambda: _true(len(receiver.got) == 4))
        ids = [headers["webhook-id"] for headers, _ in receiver.got]
        assert ids[3] == "run/x:2:a"
        assert receiver.got[2][1]["text"] == "This is a test of the receiver a, sent by Ann."
        with pytest.raises(NotFound):
            await sender.test("b", "Ann")
    await journal.close()


async def test_a_wrong_password_is_shown_repeated_and_logged_nowhere(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    journal, clock = await _open(tmp_path), Clock()
    context, ca = tls(tmp_path / "tls", "localhost")
    with mail_server(context, passwords={"robots": "the-Right-1"}) as (mails, port):
        wrong = mailbox(port, name="a", ca=ca, user="robots", password="the-Wrong-1é")
        sender = Notifications(
            journal, [wrong], ["run.ended"], "", _seen_by_all, clock_us=clock, gap_s=0, look_s=0.01
        )
        await journal.append("run/x", [EVENT])
        async with sender.sending():
            await _until(lambda: _is_off(sender))
        (state,) = await sender.states()
        assert state.error == "It does not take the user or the password (535)."
        assert mails.signed_in == [("PLAIN", False)] * (len(RETRIES_S) + 1)
        right = mailbox(port, name="a", ca=ca, user="robots", password="the-Right-1")
        sender = Notifications(journal, [right], ["run.ended"], "", _seen_by_all, gap_s=0)
        assert (await sender.test("a", "Ann")).off == ""
    assert len(mails.raw) == 1
    own = [each for each in caplog.records if each.name.startswith("action_assistant")]
    said = "\n".join([logging.Formatter().format(each) for each in own])
    assert "It does not take the user or the password" in said
    assert "-Wrong-" not in said + repr(await _rows(journal))
    assert "-Right-" not in said + repr(await _rows(journal))
    await journal.close()


async def test_a_message_about_no_graph_keeps_its_reason(tmp_path: Path) -> None:
    journal, told = await _open(tmp_path), list[str]()
    facts = {"what": "disk", "why": "Little is left."}
    values = row("fault/disk:1:a", "a", "server.fault", "disk", utc_us(), facts)
    await journal.derive(lambda c: c.execute(insert(outbox).values(values)))

    async def hidden(_: Message) -> bool:
        return False

    sender = Notifications(
        *(journal, RECEIVERS[:1], ["server.fault"], "", hidden),
        deliver=lambda _, message, __: told.append(message.text),
        gap_s=0,
        look_s=0.01,
    )
    async with sender.sending():
        await _until(lambda: _true(told))
    assert told == ["The server needs a person. Little is left."]
    await journal.close()


async def test_a_slow_receiver_delays_nothing_else(tmp_path: Path) -> None:
    journal = await _open(tmp_path)
    with http_receiver() as slow, http_receiver() as quick:
        slow.drips = True
        both = [
            webhook(f"http://127.0.0.1:{each.port}/", name)
            for each, name in ((slow, "a"), (quick, "b"))
        ]
        sender = Notifications(journal, both, ["run.ended"], "", _seen_by_all, gap_s=0, look_s=0.01)
        async with sender.sending():
            await journal.append("run/x", [EVENT])
            await _until(lambda: _true(slow.got and quick.got))
            await journal.append("run/x", [EVENT])  # a commit goes on meanwhile
            await _until(lambda: _true(len(quick.got) == 2))
        # The end does not wait for the slow one either: this line is reached before its time is up.
        assert len(slow.got) == 1
    await journal.close()


async def test_no_message_that_cannot_be_read_or_sent_ends_the_process_or_keeps_the_next_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal, took = await _open(tmp_path), Counter[str]()
    deep = "[" * 100_000
    for n, facts in enumerate(('{"run": ' + deep, "[]", "no JSON")):
        values = row(f"bad{n}:a", "a", "run.ended", "run/x", utc_us() - 10 + n, facts)
        await journal.derive(lambda c, v=values: c.execute(insert(outbox).values(v)))
    await journal.append("run/x", [EVENT])
    sender = Notifications(
        *(journal, RECEIVERS[:1], ["run.ended"], "", _seen_by_all),
        deliver=lambda _, message, __: took.update([message.id]),
        gap_s=0,
        look_s=0.01,
    )
    first, real = [RuntimeError("can't start new thread")], threading.Thread.start

    def start(thread: threading.Thread) -> None:
        if first and thread.name == "to a":
            raise first.pop()
        real(thread)

    monkeypatch.setattr(threading.Thread, "start", start)
    async with sender.sending():
        await _until(lambda: _true(took))
    assert took == {"run/x:1:a": 1}
    assert not first
    errors = {each.id: each.error for each in await _rows(journal) if each.id.startswith("bad")}
    assert errors == dict.fromkeys(["bad0:a", "bad1:a", "bad2:a"], "It cannot be read.")
    await journal.close()


async def test_a_message_on_which_this_program_fails_switches_no_receiver_off(
    tmp_path: Path,
) -> None:
    journal, took = await _open(tmp_path), Counter[str]()

    def deliver(receiver: Receiver, message: Message, page: str) -> None:
        del receiver, page
        if message.id == "run/x:1:a":
            raise ZeroDivisionError
        took[message.id] += 1

    sender = Notifications(
        *(journal, RECEIVERS[:1], ["run.ended"], "", _seen_by_all),
        clock_us=Clock(),
        deliver=deliver,
        look_s=0,
        gap_s=0,
    )
    await journal.append("run/x", [EVENT])
    async with sender.sending():
        await _until(lambda: _is_over(journal))
        await journal.append("run/x", [EVENT])
        await _until(lambda: _true(took["run/x:2:a"]))
    assert [(each.off, each.failed) for each in await sender.states()] == [("", 1)]
    await journal.close()


async def test_another_address_of_a_receiver_is_tried_again(tmp_path: Path) -> None:
    journal = await _open(tmp_path)
    old = Notifications(
        journal, [webhook("https://a.example/", "a")], ["run.ended"], "", _seen_by_all
    )
    message = Message(id="run/x:1:a", kind="run.ended", at=utc_us(), facts={})
    due, receiver = DueMessage(message, 0), old.receivers[0]
    await old.outbox.failed(due, "Gone.", utc_us(), is_final=True, of=receiver)
    assert (await old.states())[0].off == "Gone."
    new = Notifications(
        journal, [webhook("https://c.example/", "a")], ["run.ended"], "", _seen_by_all
    )
    await new.outbox.open(new.receivers)
    assert (await new.states())[0].off == ""
    await journal.close()


async def test_where_one_address_refuses_a_mail_only_that_one_gets_it_again(tmp_path: Path) -> None:
    journal, clock = await _open(tmp_path), Clock()
    with mail_server() as (mails, port):
        lab = mailbox(port, name="a", security="none", to=("old@example.org", "lab@example.org"))
        mails.unknown = {"old@example.org"}

        def sender() -> Notifications:
            return Notifications(
                *(journal, [lab], ["run.ended"], "", _seen_by_all),
                clock_us=clock,
                look_s=0,
                gap_s=0,
            )

        for _ in range(2):
            await journal.append("run/x", [EVENT])
        async with sender().sending():
            await _until(lambda: _true(mails.refused["old@example.org"] > 4))
        async with sender().sending():  # a restart does not forget it
            await _until(lambda: _mail_is_over(journal))
        assert mails.got == {"lab@example.org": 2}
        assert mails.refused["old@example.org"] >= 2 * (len(RETRIES_S) + 1)
        (state,) = await sender().states()
        assert (state.off, state.error) == ("", "It refused old@example.org.")
        mails.unknown.clear()
        await journal.append("run/x", [EVENT])
        async with sender().sending():
            await _until(lambda: _mail_is_over(journal))
        assert mails.got == {"lab@example.org": 3, "old@example.org": 1}
    await journal.close()


async def _mail_is_over(journal: Journal) -> bool:
    return not any(each.due is not None for each in await _rows(journal) if each.receiver == "a")


@pytest.mark.parametrize("fails", [False, True])
async def test_a_graph_that_not_everybody_may_see_is_not_named(tmp_path: Path, fails: bool) -> None:
    journal, texts = await _open(tmp_path), dict[str, str]()
    facts = {"run": "r1", "number": 3, "graph": "Secret", "robot": "David", "state": "an error"}
    for run in ("r1", "r2"):
        values = row(
            run, "a", "run.ended", run, utc_us(), {**facts, "run": run, "why": "At Vault."}
        )
        await journal.derive(lambda c, v=values: c.execute(insert(outbox).values(v)))

    async def seen_by_all(message: Message) -> bool:
        if fails:
            raise NotFound("The run cannot be read.")
        return message.facts["run"] == "r2"

    sender = Notifications(
        *(journal, RECEIVERS[:1], ["run.ended"], "", seen_by_all),
        deliver=lambda _, message, __: texts.update({message.id: message.text}),
        look_s=0,
        gap_s=0,
    )
    async with sender.sending():
        await _until(lambda: _true(len(texts) == 2))
    unnamed = "Run 3 of a graph that not everybody may see on David has failed: an error."
    named = "Run 3 of Secret on David has failed: an error. At Vault."
    assert texts == {"r1": unnamed, "r2": unnamed if fails else named}
    await journal.close()
