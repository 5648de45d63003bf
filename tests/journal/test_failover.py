"""A database whose servers take over from each other: who is asked, and what proves it safe."""

import asyncio
import json
import socket
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from action_assistant.errors import CannotStart
from action_assistant.journal.databases import database_of
from action_assistant.journal.failover import Failover
from journal.servers import Server
from journal.test_postgres import opened

NOBODY = "127.0.0.1:1"  # where nothing listens


class Patroni(BaseHTTPRequestHandler):
    """Answers as Patroni 3.0.2 does, for the settings of its server."""

    def do_GET(self) -> None:
        """Answer with the identifier of the cluster, or with its settings."""
        content = {"database_system_identifier": "42"} if self.path == "/patroni" else SETTINGS
        self.send_response(200)
        self.end_headers()
        self.wfile.write(json.dumps(content).encode())

    def log_message(self, *_: object) -> None:
        """Say nothing."""


SETTINGS: dict[str, object] = {}


@pytest.fixture
def patroni() -> Iterator[str]:
    """The address of something that answers as Patroni does."""
    with HTTPServer(("127.0.0.1", 0), Patroni) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.mark.parametrize(
    ("mode", "identifier", "says"),
    [
        (True, "42", ""),
        ("quorum", "42", ""),
        (
            False,
            "42",
            "a failover could lose what it confirms (synchronous_mode of Patroni is off)",
        ),
        (None, "42", "a failover could lose what it confirms (synchronous_mode of Patroni is off)"),
        (True, "7", "leads another cluster"),
    ],
)
async def test_what_patroni_says_decides(
    patroni: str, mode: object, identifier: str, says: str
) -> None:
    SETTINGS["synchronous_mode"] = mode
    for standbys in ("", "two"):
        found = await Failover((f"http://{NOBODY}", patroni)).weakness(standbys, identifier)
        assert says in found
        assert (found == "") == (says == "")


async def test_without_an_answer_of_patroni_the_primary_itself_must_wait_for_a_replica() -> None:
    silent = Failover((f"http://{NOBODY}",))
    assert await silent.weakness("two", "42") == ""
    assert await silent.weakness("", "42") == f"Patroni does not answer at http://{NOBODY}"


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
    frozen = socket.create_server(("127.0.0.1", 0))
    port = frozen.getsockname()[1]
    hosts = [NOBODY, f"127.0.0.1:{port}", f"127.0.0.1:{postgres.port}"]
    database = database_of(f"postgresql://aa@/{name}?" + "&".join(f"host={each}" for each in hosts))
    async with asyncio.timeout(4):  # less than one of them may take
        assert await database.ask(lambda each: each.exec_driver_sql("SELECT 7").scalar()) == 7
    await database.close()
    frozen.close()


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
