"""A database whose servers take over from each other: who is asked, and what proves it safe."""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal import failover
from action_assistant.journal.databases import database_of
from action_assistant.journal.failover import Failover, Primary
from journal.proxy import proxy
from journal.servers import Replica, Server, binaries, server
from journal.test_postgres import draft, opened
from support.product import frozen
from support.waiting import wait_until

NOBODY = "127.0.0.1:1"  # where nothing listens


class Patroni(BaseHTTPRequestHandler):
    """Answers as Patroni 3.0.2 does."""

    def do_GET(self) -> None:
        """Answer with the state of the server, or with the settings of the cluster."""
        self.send_response(200)
        self.end_headers()
        self.wfile.write(json.dumps(STATE if self.path == "/patroni" else SETTINGS).encode())

    def log_message(self, *_: object) -> None:
        """Say nothing."""


STATE: dict[str, object] = {}
SETTINGS: dict[str, object] = {}


@pytest.fixture
def patroni() -> Iterator[str]:
    """The address of something that answers as Patroni does."""
    STATE.update(database_system_identifier="42", role="primary", timeline=3)
    SETTINGS.update(synchronous_mode=True)
    with HTTPServer(("127.0.0.1", 0), Patroni) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize(
    ("mode", "identifier", "timeline", "says"),
    [
        (True, "42", 3, ""),
        ("quorum", "42", 4, ""),
        (
            False,
            "42",
            3,
            "a failover could lose what it confirms (synchronous_mode of Patroni is off)",
        ),
        (
            None,
            "42",
            3,
            "a failover could lose what it confirms (synchronous_mode of Patroni is off)",
        ),
        (True, "7", 3, "leads another cluster"),
        (True, "42", 2, "another server has taken over from it"),
    ],
)
async def test_what_patroni_says_decides(
    patroni: str, mode: object, identifier: str, timeline: int, says: str
) -> None:
    SETTINGS["synchronous_mode"] = mode
    for standbys in ("", "two"):
        primary = Primary(standbys, identifier, timeline)
        found = await Failover((f"http://{NOBODY}", patroni)).weakness(primary)
        assert says in found
        assert (found == "") == (says == "")


async def test_a_patroni_whose_answer_never_ends_keeps_no_other_from_being_heard(
    patroni: str,
) -> None:
    gone = asyncio.Event()

    async def trickle(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            writer.write(b"HTTP/1.1 200 OK\r\ncontent-length: 100000\r\n\r\n")
            while True:
                writer.write(b" ")
                await writer.drain()
                await asyncio.sleep(0.1)
        writer.close()
        gone.set()

    async with await asyncio.start_server(trickle, "127.0.0.1", 0) as endless:
        port = endless.sockets[0].getsockname()[1]
        both = Failover((f"http://127.0.0.1:{port}", patroni))
        async with asyncio.timeout(60):
            assert "has taken over" in await both.weakness(Primary("two", "42", 2))
            await gone.wait()


async def test_without_an_answer_of_patroni_the_primary_itself_must_wait_for_a_replica() -> None:
    silent = Failover((f"http://{NOBODY}",))
    assert await silent.weakness(Primary("two", "42", 1)) == ""
    assert (
        await silent.weakness(Primary("", "42", 1)) == f"Patroni does not answer at http://{NOBODY}"
    )


@pytest.fixture
def replicated() -> Iterator[tuple[Server, Replica]]:
    """A server, and a replica that its commits wait for."""
    if binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with server() as primary:
        primary.sql("CREATE DATABASE aa")
        replica = Replica(primary)
        try:
            primary.sql("ALTER SYSTEM SET synchronous_standby_names = '*'")
            primary.sql("SELECT pg_reload_conf()")
            yield primary, replica
        finally:
            replica.stop()


@pytest.mark.parametrize("level", ["notice", "error"])
async def test_a_commit_whose_wait_for_the_replica_was_cancelled_is_not_acknowledged(
    replicated: tuple[Server, Replica], level: str
) -> None:
    """Postgres answers it with success and a warning, where nobody has told it to keep that to itself."""
    primary, replica = replicated
    primary.sql(f"ALTER ROLE aa SET client_min_messages = {level}")
    journal = await opened(f"{primary.url('aa')}?failover=synchronous")
    await journal.append("a", [draft("both have it")])
    replica.freeze()
    waiting = asyncio.create_task(journal.append("a", [draft("one has it")]))

    def who_waits() -> str:
        return primary.ask("SELECT pid FROM pg_stat_activity WHERE wait_event = 'SyncRep'")

    await wait_until(who_waits)
    pid = who_waits()
    primary.sql(f"SELECT pg_cancel_backend({pid})")
    await wait_until(lambda: who_waits() not in {"", pid})  # it asks again, by another connection
    assert not waiting.done()
    replica.thaw()
    assert await waiting == 2
    assert await journal.verify() == []
    await journal.close()


@pytest.mark.parametrize(
    ("old", "delay"), [("lives on", 0.0), ("lives on", 0.6), ("is frozen", 0.0)]
)
async def test_writer_and_readers_leave_an_old_primary(
    replicated: tuple[Server, Replica],
    patroni: str,
    monkeypatch: pytest.MonkeyPatch,
    old: str,
    delay: float,
) -> None:
    """The replica is promoted by force, while the old primary still confirms commits alone, or stands
    still. `delay`: seconds that each new connection to the new primary takes."""
    monkeypatch.setattr(failover, "_WATCH_S", 0.2)
    primary, replica = replicated
    STATE.update(
        database_system_identifier=primary.ask("SELECT system_identifier FROM pg_control_system()"),
        timeline=1,
    )
    async with contextlib.AsyncExitStack() as ending:
        way = await ending.enter_async_context(proxy(replica.port, lambda _: "pass"))
        url = f"postgresql://aa@/aa?host=127.0.0.1:{primary.port}&host=127.0.0.1:{way.port}&patroni={patroni}"
        journal = await opened(url)
        ending.push_async_callback(journal.close)
        await journal.append("a", [draft("both have it")])
        assert len(await journal.read("a")) == 1  # a reader is connected to the old primary
        primary.sql("ALTER SYSTEM RESET synchronous_standby_names")
        primary.sql("SELECT pg_reload_conf()")
        replica.promote()
        STATE["timeline"] = 2
        if old == "is frozen":
            for each in primary.processes():
                ending.enter_context(frozen(each))
        way.delay = delay
        # The watch ends when it has heard of the new primary.
        await wait_until(
            lambda: "failover watch" not in {each.name for each in threading.enumerate()}
        )
        async with asyncio.timeout(20):
            while True:
                with contextlib.suppress(Unavailable):
                    await journal.append("a", [draft("the new one has it")])
                    break
                await asyncio.sleep(0.1)
        async with asyncio.timeout(20):  # a statement to a frozen server would take longer
            bodies = [each.body for each in await journal.read("a")]
        assert bodies == [b"both have it", b"the new one has it"]
        assert replica.ask("SELECT count(*) FROM event", "aa") == "2"


@pytest.mark.parametrize("query", ["failover=synchronous", f"host={NOBODY}"])
async def test_a_primary_that_waits_for_no_replica_is_refused(postgres: Server, query: str) -> None:
    url = postgres.new_database()
    name = url.rpartition("/")[2]
    if "host" in query:
        url = f"postgresql://aa@/{name}?host=127.0.0.1:{postgres.port}"
    else:
        url += "?"
    with pytest.raises(CannotStart, match="could lose what it confirms"):
        await opened(f"{url}&{query}")


async def test_a_server_that_is_silent_takes_no_time_of_the_others(postgres: Server) -> None:
    """One host is down, another accepts connections and never answers, as a frozen one does."""
    name = postgres.new_database().rpartition("/")[2]
    silent = socket.create_server(("127.0.0.1", 0))
    port = silent.getsockname()[1]
    hosts = [NOBODY, f"127.0.0.1:{port}", f"127.0.0.1:{postgres.port}"]
    database = database_of(f"postgresql://aa@/{name}?" + "&".join(f"host={each}" for each in hosts))
    async with asyncio.timeout(4):  # less than one of them may take
        assert await database.ask(lambda each: each.exec_driver_sql("SELECT 7").scalar()) == 7
    await database.close()
    silent.close()


async def test_servers_that_cannot_be_written_are_named() -> None:
    with pytest.raises(CannotStart) as caught:
        await opened(f"postgresql://aa:secret@/lab?host={NOBODY}&host=127.0.0.1:2")
    assert f"{NOBODY}: the database server does not answer (nothing listens there)" in str(
        caught.value
    )
    assert "127.0.0.1:2:" in str(caught.value)
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("query", "says"),
    [
        ("failover=maybe", "failover in the URL of --database is `synchronous`"),
        ("patroni=db1:8008", "is an address such as http://db1:8008"),
        ("patroni=http://db1:8008&patroni=file:///x", "is an address such as"),
    ],
)
def test_a_url_that_says_it_wrongly_is_refused(query: str, says: str) -> None:
    with pytest.raises(CannotStart, match=says):
        database_of(f"postgresql://aa@db1/aa?{query}")


def test_a_name_for_people_has_the_servers_and_no_password() -> None:
    database = database_of("postgresql://aa:secret@/lab?host=db1:5432&host=db2:5432")
    assert database.name == "The database postgresql://db1:5432,db2:5432/lab"
