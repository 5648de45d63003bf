"""Lists and requests of commands with two runners, other than a Stop: each site is asked, each has its own."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec
from commands.test_sites import GRAPH, Halls
from runner.api.test_questions import question_of
from runner.execution.test_questions import asked_of, asking, line
from runner.process import over, started
from support.product import Product
from support.two_sites import HALL_A, HALL_B, two_sites

DIGEST = "d" * 64


@pytest.fixture(scope="module")
def halls(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Halls]:
    """One server with two runners for the module."""
    with two_sites(tmp_path_factory.mktemp("halls")) as found:
        yield found


def robots_of(client: Any) -> set[str]:
    return {each["name"] for each in client.get("/api/robots").json()}


def imported(product: Product, folder: Path) -> str:
    """The id of the graph in the editor."""
    (folder / "graph.json").write_text(json.dumps(GRAPH))
    return product.cli("import", str(folder / "graph.json")).stdout.split()[0]


def finished_at(client: Any, graph: str, version: str, name: str) -> Any:
    """A run on the simulator of a runner, as JSON, when it has finished."""
    order = {"version": version, "digest": digest(codec.read(json.dumps(GRAPH)).graph)}
    order |= {"umrf": GRAPH, "engine": "simulator", "request_id": name, "graph": graph}
    answer = client.post("/api/runs", json=order)
    assert answer.is_success, answer.text
    run = over(client, answer.json()["id"])
    assert run["state"] == "finished"
    return run


def test_a_robot_that_two_sites_have_is_taken_away_at_the_one_that_is_named(halls: Halls) -> None:
    product, second = halls
    robot = {"name": "Carl", "domain": 184, "profile": {}}
    with product.runner() as first, second.client() as other:
        for client in (first, other):
            assert client.post("/api/robots", json=robot).is_success
        which = product.cli("robots", "remove", "Carl")
        assert which.returncode == 1
        assert f"Carl is registered at {HALL_A} and at {HALL_B}" in which.stderr
        assert f"robots remove Carl --site '{HALL_B}'" in which.stderr
        assert product.cli("robots", "remove", "Carl", "--site", HALL_B).returncode == 0
        assert ("Carl" in robots_of(first), "Carl" in robots_of(other)) == (True, False)
        assert product.cli("robots", "remove", "Carl").returncode == 0
        assert "Carl" not in robots_of(first)


def test_a_start_for_the_queue_goes_to_the_site_of_its_robot(halls: Halls, tmp_path: Path) -> None:
    product, _ = halls
    graph = imported(product, tmp_path)
    added = product.cli("robots", "add", "Dora", "--domain", "185", "--site", HALL_B)
    assert added.returncode == 0, added.stderr
    put = product.cli("run", graph, "--engine", "Dora", "--queue")
    assert "No link to Dora" in put.stderr  # as only the runner says that has it
    assert product.cli("robots", "remove", "Dora").returncode == 0


def test_questions_to_people_are_listed_and_answered_at_each_site(halls: Halls) -> None:
    product, second = halls
    graph = line(asking("AaConfirm", question="Is it clear?"))
    with second.client() as other:
        run = started(other, asked_of(graph))["id"]
        question = question_of(other, run)["question"]["id"]
        listed = product.cli("runs", "questions")
        assert [line.split()[:2] for line in listed.stdout.splitlines()] == [[run, question]]
        entries = json.loads(product.cli("runs", "questions", "--json").stdout)["questions"]
        assert [(each["run"], each["site"]) for each in entries] == [(run, HALL_B)]
        answered = product.cli("runs", "answer", run, question, "--yes")
        assert answered.returncode == 0, answered.stderr


def test_the_questions_for_a_second_person_are_those_of_all_sites(
    halls: Halls, tmp_path: Path
) -> None:
    product, second = halls
    graph = imported(product, tmp_path)
    question = {"digest": DIGEST, "robots": ["Dora"], "graph_name": "x", "graph": graph}
    with second.client() as other:
        assert other.post("/api/approvals/asked", json=question).status_code == 202
    listed = product.cli("runs", "second-person", graph)
    assert (listed.returncode, listed.stdout.split()[0]) == (0, DIGEST[:12]), listed.stderr
    second.end()
    try:
        missing = product.cli("runs", "second-person", graph)
        repeats = product.cli("runs", "repeats")
    finally:
        second.start()
    for each in (missing, repeats):
        assert each.returncode == 1
        assert f"{HALL_B} does not answer, and is left out" in each.stderr


def test_the_last_run_that_went_well_may_be_at_another_site_and_is_found_by_its_time(
    halls: Halls, tmp_path: Path
) -> None:
    product, second = halls
    graph = imported(product, tmp_path)
    with product.editor() as editor, product.runner() as first, second.client() as other:
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()["id"]
        for name in ("b 1", "b 2"):  # so that the numbers of both say nothing about each other
            good = finished_at(other, graph, version, name)
        bad = finished_at(first, graph, version, "a")
        assert good["number"] > bad["number"]
        found = product.cli("runs", "since", bad["id"])
        assert "No edit explains it" in found.stdout, found.stderr
        expected = {"run": good["id"], "name": "of hall B"}
        assert other.post("/api/expectations", json=expected).status_code == 201
    verified = product.cli("runs", "verify", "--graph", graph)
    assert (verified.returncode, len(verified.stdout.splitlines())) == (0, 2), verified.stderr
    assert "of hall B (now)" in verified.stdout
    second.end()
    try:
        missing = product.cli("runs", "verify")
    finally:
        second.start()
    assert missing.returncode == 1
    assert f"{HALL_B} does not answer, and is left out" in missing.stderr


@pytest.mark.usefixtures("new_interpreters")  # forks have no rclpy, so no robot for the check
def test_a_yes_of_a_second_person_is_told_to_all_sites(tmp_path: Path) -> None:
    with two_sites(tmp_path) as (product, second), product.runner() as first:
        graph = imported(product, tmp_path)
        with product.editor() as editor:
            assert editor.post(f"/api/graphs/{graph}/versions", json={}).is_success
        robot = {"name": "Eve", "domain": 186, "profile": {"second_person": True}}
        assert first.post("/api/robots", json=robot).is_success
        wanted = {"umrf": GRAPH, "engines": ["Eve"], "graph": graph}
        (look,) = first.post("/api/preflight", json=wanted, timeout=60).json()
        digest = look["order_digest"]
        question = {"digest": digest, "robots": ["Eve"], "graph_name": "x", "graph": graph}
        assert first.post("/api/approvals/asked", json=question).status_code == 202
        said = product.cli("runs", "second-person", graph, "--yes", digest[:12])
        assert said.returncode == 0, said.stderr
        with second.client() as other:
            for client in (first, other):
                given = client.get("/api/approvals", params={"digest": digest}).json()
                assert len(given) == 1
