"""The OpenAPI of both processes: whole, and the one that the page's types come from."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from support.openapi import documents, texts

KEPT = Path(__file__).parents[1] / "frontend" / "src" / "api" / "schema"
#: Routes that take no body, whatever their method.
WITHOUT_BODY = frozenset(
    {
        "/api/graphs/{graph_id}/recover",
        "/api/invitations/{invitation}/revoke",
        "/api/sessions/{session}/end",
        "/api/people/{person}/sessions/end",
        "/api/members/{person}/end",
        "/api/devices/end",
        "/api/practice",
        "/api/devices/codes",
        "/api/passkeys/challenge",
        "/api/passkeys/confirm/challenge",
        "/api/devices/{session}/end",
        "/api/tokens/{token}/revoke",
        "/api/view-links/{link}/revoke",
        "/api/notifications/{name}/test",
        "/api/repeats/{repeat}/close",
        "/api/queue/{entry}/remove",
        "/api/queue/robots/{name}/close",
        "/api/runs/{run}/pause",
        "/api/robots/{name}/stop",
        "/api/robots/{name}/baton/drop",
        "/api/examples",
    }
)

# Elsewhere the applications are made in processes of their own, where this is no error.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """Return both documents."""
    return documents(tmp_path_factory.mktemp("data"))


def operations(found: dict[str, dict[str, Any]]) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for document in found.values():
        for path, item in document["paths"].items():
            for method, operation in item.items():
                yield method, path, operation


def test_the_page_has_its_types_from_these_documents(tmp_path: Path) -> None:
    kept = {path.name: path.read_text() for path in KEPT.glob("*.json")}
    assert kept == texts(tmp_path), "`make types` renews them"


def test_every_operation_has_an_id_of_its_own(found: dict[str, dict[str, Any]]) -> None:
    for name, document in found.items():
        ids = [operation["operationId"] for _, _, operation in operations({name: document})]
        assert len(ids) == len(set(ids))
        # Litestar makes up ids that begin with a capital letter.
        assert [each for each in ids if not re.fullmatch("[a-z]+([A-Z][a-z]*)*", each)] == []


def test_every_route_says_what_it_takes(found: dict[str, dict[str, Any]]) -> None:
    silent = {
        path
        for method, path, operation in operations(found)
        if method in {"post", "patch"} and "requestBody" not in operation
    }
    assert silent == WITHOUT_BODY


def test_every_route_says_what_it_answers(found: dict[str, dict[str, Any]]) -> None:
    for method, path, operation in operations(found):
        for code, answer in operation["responses"].items():
            for media, content in (answer.get("content") or {}).items():
                assert content["schema"], (method, path, code, media)


def test_fields_that_answers_always_have_are_required(found: dict[str, dict[str, Any]]) -> None:
    runner, editor = (found[name]["components"]["schemas"] for name in ("runner", "editor"))
    assert set(runner["Robot"]["required"]) == set(runner["Robot"]["properties"])
    assert "why" in runner["Robot"]["required"]  # though it has a default
    assert "actions" not in editor["GraphView"]["required"]  # left out while it is not known
    assert editor["GraphView"]["properties"]["actions"] == {"anyOf": [{"type": "integer"}]}
    assert "after" not in editor["KeyChange"]["required"]  # left out when the key goes
    assert runner["Registration"]["required"] == ["name"]  # a body may leave out the rest


def test_bodies_that_are_read_by_hand_are_described_by_the_type_that_reads_them(
    found: dict[str, dict[str, Any]],
) -> None:
    paths = found["runner"]["paths"]
    start = paths["/api/runs"]["post"]["requestBody"]
    assert start["required"] is True
    assert start["content"]["application/json"]["schema"]["$ref"].endswith("/StartRequest")
    assert paths["/api/stop"]["post"]["requestBody"]["required"] is False
    asked = found["runner"]["components"]["schemas"]["StartRequest"]
    assert asked["additionalProperties"] is False
    assert asked["required"] == ["version", "digest", "umrf", "engine", "request_id"]


def test_the_messages_of_the_live_socket_are_described(found: dict[str, dict[str, Any]]) -> None:
    schemas = found["runner"]["components"]["schemas"]
    kinds = schemas["RunnerMessage"]["discriminator"]["mapping"]
    ours = {"hello", "run", "engines", "confirm", "there", "beat", "stopping", "refused", "queue"}
    assert set(kinds) == ours
    assert set(schemas["PageMessage"]["discriminator"]["mapping"]) == {"stop", "here"}
