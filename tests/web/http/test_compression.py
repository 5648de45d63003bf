"""Answers with the facts of one graph or run are compressed, and no answers of other routes are."""

import gzip
import re
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from litestar import Litestar, get
from litestar.response import Response, Stream

from action_assistant.web.http.compression import COMPRESSED

TEXT = b'{"names": ["' + b"Lift the crate, " * 5_000 + b'"]}'
SERVER = Path(__file__).parents[3] / "server/action_assistant"


@get("/large", middleware=[COMPRESSED])
async def large() -> Response[bytes]:
    return Response(TEXT, media_type="application/json", headers={"x-seq": "7"})


@get("/small", middleware=[COMPRESSED])
async def small() -> Response[bytes]:
    return Response(TEXT[:200], media_type="application/json")


@get("/stream", middleware=[COMPRESSED])
async def stream() -> Stream:
    async def parts() -> AsyncIterator[bytes]:
        for _ in range(3):
            yield TEXT

    return Stream(parts())


@get("/plain")
async def plain() -> Response[bytes]:
    return Response(TEXT, media_type="application/json")


async def asked(path: str, accepted: str) -> tuple[httpx.Response, bytes]:
    """Return the answer and its body as it came over the wire."""
    app: Any = Litestar([large, small, stream, plain])
    transport = httpx.ASGITransport(app)
    async with (
        httpx.AsyncClient(transport=transport, base_url="http://lab") as client,
        client.stream("GET", path, headers={"accept-encoding": accepted}) as answer,
    ):
        return answer, b"".join([part async for part in answer.aiter_raw()])


@pytest.mark.parametrize("accepted", ["gzip", "br, gzip;q=0.5"])
async def test_a_large_answer_is_compressed_for_whoever_accepts_that(accepted: str) -> None:
    answer, body = await asked("/large", accepted)
    assert answer.headers["content-encoding"] == "gzip"
    assert answer.headers["content-length"] == str(len(body))
    assert answer.headers["vary"] == "accept-encoding"
    assert answer.headers["x-seq"] == "7"
    assert gzip.decompress(body) == TEXT
    assert len(body) < len(TEXT) / 10


@pytest.mark.parametrize(
    ("path", "accepted", "text"),
    [
        ("/large", "", TEXT),
        ("/large", "br", TEXT),
        ("/large", "gzip;q=0", TEXT),
        ("/small", "gzip", TEXT[:200]),
        ("/stream", "gzip", TEXT * 3),
        ("/plain", "gzip", TEXT),
    ],
)
async def test_other_answers_are_sent_as_they_are(path: str, accepted: str, text: bytes) -> None:
    answer, body = await asked(path, accepted)
    assert answer.status_code == 200
    assert "content-encoding" not in answer.headers
    assert body == text


def test_only_answers_of_one_graph_or_one_run_are_compressed() -> None:
    routes = re.compile(r'@(\w+)\(\n\s+"([^"]+)",((?:(?!async def).)*)', re.DOTALL)
    found = {
        (method, path)
        for file in SERVER.rglob("api/*.py")
        for method, path, declared in routes.findall(file.read_text())
        if "COMPRESSED" in declared
    }
    assert len(found) > 10
    named = sum(file.read_text().count("[COMPRESSED]") for file in SERVER.rglob("*.py"))
    assert named == len(found)
    for method, path in found:
        assert method == "get"
        assert re.match(r"/api/(graphs|versions|runs)/\{", path), path
