"""Limits count networks of clients: an IPv4 address, and the /64 of an IPv6 address."""

import re
from pathlib import Path

import httpx
import pytest

from action_assistant.editor.app import create_app
from action_assistant.settings import EditorSettings
from action_assistant.web.auth.caller import network_of

SERVER = Path(__file__).parents[3] / "server" / "action_assistant"


@pytest.mark.parametrize(
    ("host", "network"),
    [
        ("192.0.2.7", "192.0.2.7"),
        ("::ffff:192.0.2.7", "192.0.2.7"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::", "2001:db8:1:2::/64"),
        ("2001:db8:1:3::", "2001:db8:1:3::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::1"),
        ("127.0.0.1", "127.0.0.1"),
        ("", ""),
        ("testclient", "testclient"),
    ],
)
def test_a_network(host: str, network: str) -> None:
    assert network_of(host) == network


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
async def test_a_guesser_gains_nothing_by_the_other_addresses_of_their_network(
    tmp_path: Path,
) -> None:
    database = f"sqlite:///{tmp_path / 'editor.db'}"
    app = create_app(EditorSettings(data=tmp_path, database=database, port=8000))

    async def guess(address: str) -> int:
        transport = httpx.ASGITransport(app=app, client=(address, 5000))
        async with httpx.AsyncClient(
            transport=transport, base_url="http://127.0.0.1:8000"
        ) as client:
            return (await client.post("/api/session", json={"token": "wrong"})).status_code

    tried = [await guess(f"2001:db8:1:2::{number:x}") for number in range(1, 64)]
    assert (tried[0], tried[-1]) == (401, 429)
    assert await guess("2001:db8:1:3::1") == 401


def test_no_limit_counts_whole_addresses() -> None:
    found = {
        str(path.relative_to(SERVER))
        for path in SERVER.rglob("*.py")
        if re.search(r"\.client\.host\b", path.read_text())
    }
    assert found == {"web/auth/caller.py"}
