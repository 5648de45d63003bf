"""The question for a second person's yes on the command line."""

import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.runner.start.approvals import HIDDEN_ORDER
from support.command_line import ran
from support.product import TOKEN, running
from support.real_engine import browser

GRAPH = {
    "graph_name": "pair",
    "graph_entry": [{"name": "A"}],
    "graph_exit": [{"name": "A"}],
    "actions": [{"name": "A", "type": "sync"}],
}


@pytest.mark.usefixtures("new_interpreters")  # forks have no rclpy, so no robot for the check
def test_who_is_asked_reads_the_order_in_words_and_says_yes_to_exactly_that(
    tmp_path: Path,
) -> None:
    with (
        running(tmp_path / "data") as product,
        httpx.Client(
            base_url=product.runner_url,
            headers={"authorization": f"Bearer {TOKEN}"},
            trust_env=False,
            timeout=60,
        ) as runner,
    ):
        robot = {"name": "David", "domain": 181, "profile": {"second_person": True}}
        assert runner.post("/api/robots", json=robot).is_success
        (tmp_path / "pair.json").write_text(json.dumps(GRAPH))
        graph = product.cli("import", str(tmp_path / "pair.json")).stdout.split()[0]
        with product.editor() as editor:
            version = editor.post(f"/api/graphs/{graph}/versions", json={})
            assert version.is_success, version.text

        def looked(umrf: dict[str, Any]) -> dict[str, Any]:
            asked = {"umrf": umrf, "engines": ["David"], "graph": graph}
            (look,) = runner.post("/api/preflight", json=asked).json()
            found: dict[str, Any] = look
            return found

        alien, look = looked(GRAPH | {"graph_name": "other"})["order_digest"], looked(GRAPH)
        digest = look["order_digest"]

        def ask(digest: str) -> None:
            question = {"digest": digest, "robots": ["David"], "graph_name": "x", "graph": graph}
            assert runner.post("/api/approvals/asked", json=question).status_code == 202

        ask(digest)
        ask("a" * 64)
        ask(alien)
        lines = product.cli("runs", "second-person", graph).stdout.splitlines()
        assert f"  Graph: the version with the digest {look['tree_digest']}" in lines
        assert any(line.startswith("  How often: each time that a person starts") for line in lines)
        unknown = product.cli("runs", "second-person", graph, "--yes", "a" * 12)
        assert "not known in words" in unknown.stderr
        assert product.cli("runs", "second-person", graph, "--yes", "b" * 12).returncode != 0
        other = product.cli("runs", "second-person", graph, "--yes", alien[:12])
        assert (other.returncode != 0, "no version of this graph" in other.stderr) == (True, True)
        assert runner.get("/api/approvals", params={"digest": alien}).json() == []
        said = product.cli("runs", "second-person", graph, "--yes", digest[:12])
        assert said.returncode == 0, said.stderr
        given = runner.get("/api/approvals", params={"digest": digest}).json()
        assert len(given) == 1


@pytest.mark.usefixtures("new_interpreters")  # forks have no rclpy, so no robot for the check
def test_who_may_not_see_a_graph_of_a_start_reads_who_asks_and_why_they_cannot_say_yes(
    tmp_path: Path,
) -> None:
    inner, ends = GRAPH | {"graph_name": "secret"}, [{"name": "secret"}]
    outer = {"graph_name": "around", "graph_entry": ends, "graph_exit": ends}
    with running(tmp_path / "data") as product, product.editor() as editor:
        hidden = editor.post("/api/graphs", json=inner).json()["id"]
        actions = [{"name": "secret", "type": "sync"}]
        graph = editor.post("/api/graphs", json=outer | {"actions": actions}).json()["id"]
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
        assert product.cli("rights", hidden, "--see", "nobody").returncode == 0
        order = {name: version[name] for name in ("umrf", "subgraphs", "digest", "tree_digest")}
        with product.runner() as runner:
            robot = {"name": "David", "domain": 181, "profile": {"second_person": True}}
            assert runner.post("/api/robots", json=robot).is_success
            asked = {**order, "engines": ["David"], "graph": graph}
            (look,) = runner.post("/api/preflight", json=asked, timeout=60).json()
            digest = look["order_digest"]
            question = {"digest": digest, "robots": ["David"], "graph_name": "x", "graph": graph}
            assert runner.post("/api/approvals/asked", json=question).status_code == 202
        with browser(product, "Bo", is_named=True) as session:
            session.base_url = product.url
            wanted = {"name": "script", "scopes": ["operate"], "days": 1}
            token = session.post("/api/tokens", json=wanted).json()["token"]
        mine = {**product.environment, "ACTION_ASSISTANT_TOKEN": token}
        shown = ran("runs", "second-person", graph, environ=mine)
        first, *others = shown.stdout.splitlines()
        assert (shown.returncode, first.split()[0]) == (0, "-"), shown.stderr
        assert "asks for David" in first
        assert [line.strip() for line in others] == [HIDDEN_ORDER]
        assert "secret" not in shown.stdout
        whole = product.cli("runs", "second-person", graph).stdout
        assert whole.startswith(digest[:12])
        assert HIDDEN_ORDER not in whole
        refused = ran("runs", "second-person", graph, "--yes", digest[:12], environ=mine)
        assert refused.returncode != 0
