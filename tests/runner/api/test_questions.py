"""Questions to people over HTTP and the live socket of a real runner, with a photo, also after it was
killed."""

import threading
import time
from typing import Any

import httpx
import msgspec

from runner.execution.test_questions import asked_of, asking, line
from runner.process import RunnerProcess, over, started

_JPEG = b"\xff\xd8\xff\xe0" + bytes(4_000_000)


def question_of(client: httpx.Client, run: str) -> dict[str, Any]:
    """Wait until a question of a run is open, and return what the list of all runs says of it."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        waiting = client.get("/api/questions").json()["questions"]
        if found := [each for each in waiting if each["run"] == run]:
            return dict(found[0])
        time.sleep(0.05)
    raise AssertionError("no question")


def go_on(client: httpx.Client, run: str) -> None:
    deadline = time.monotonic() + 60
    while (held := client.get(f"/api/runs/{run}").json()["held"]) is None:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    answer = client.post(f"/api/runs/{run}/go_on", json={"since": held["since"]})
    assert answer.status_code == 202, answer.text


def is_removed(client: httpx.Client, run: str, photo: str) -> None:
    """Wait until a photo is there no more."""
    deadline = time.monotonic() + 20
    while client.get(f"/api/runs/{run}/photos/{photo}").status_code != 404:
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_people_answer_over_http_the_first_counts_and_a_restart_asks_again(
    own_process: RunnerProcess,
) -> None:
    process = own_process
    graph = line(
        asking("AaConfirm", question="Is it clear?"),
        asking("AaAskPhoto", 1, question="What do you see?"),
    )
    with process.client() as client:
        run = started(client, asked_of(graph))["id"]
        first = question_of(client, run)
        assert first["may"]
        assert first["question"]["text"] == "Is it clear?"
        with process.live() as socket:
            hello = msgspec.json.decode(socket.recv(timeout=10))
            (shown,) = [each for each in hello["runs"] if each["id"] == run]
            assert [each["id"] for each in shown["questions"]] == [first["question"]["id"]]
        path = f"/api/runs/{run}/questions"
        answer = f"{path}/{first['question']['id']}/answer"
        found: list[int] = []

        def press(value: bool) -> None:
            with process.client() as own:
                found.append(own.post(answer, json={"value": value}).status_code)

        people = [threading.Thread(target=press, args=(each,)) for each in (True, False)]
        for each in people:
            each.start()
        for each in people:
            each.join()
        assert sorted(found) == [200, 409]
        second = question_of(client, run)["question"]
        photo = client.post(f"{path}/{second['id']}/photo", content=b"no picture")
        assert photo.status_code == 400
        photo = client.post(f"{path}/{second['id']}/photo", content=_JPEG)
        assert photo.status_code == 200, photo.text
        assert client.post(
            f"{path}/{second['id']}/photo", content=bytes(8 * 1024 * 1024 + 1)
        ).status_code in {400, 413}
        name = photo.json()["photo"]
    process.kill()
    process.start()
    with process.client() as client:
        late = client.post(f"{path}/{second['id']}/answer", json={"value": name})
        assert late.status_code == 409
        assert late.json()["where"]["why"] == "restarted"
        assert client.post(f"{path}/{second['id']}/photo", content=_JPEG).status_code == 409
        go_on(client, run)
        third = question_of(client, run)["question"]
        assert third["id"] != second["id"]
        assert client.post(f"{path}/{third['id']}/answer", json={"value": name}).status_code == 400
        again = client.post(f"{path}/{third['id']}/photo", content=_JPEG).json()["photo"]
        other = client.post(f"{path}/{third['id']}/photo", content=_JPEG + b"other").json()
        taken = client.post(f"{path}/{third['id']}/answer", json={"value": again})
        assert taken.status_code == 200, taken.text
        ended = over(client, run)
        assert ended["state"] == "finished"
        visit = ended["actions"]["AaAskPhoto_1"]["visits"][-1]
        assert visit["robot"] == "people"
        assert visit["answered"]["value"] == again
        picture = client.get(f"/api/runs/{run}/photos/{again}")
        assert picture.content == _JPEG
        assert picture.headers["content-type"] == "image/jpeg"
        assert picture.headers["x-content-type-options"] == "nosniff"
        assert "default-src 'none'" in picture.headers["content-security-policy"]
        is_removed(client, run, other["photo"])  # nobody has answered with it
        assert client.get(f"/api/runs/{run}/photos/{again}").content == _JPEG
        assert client.get(f"/api/runs/{run}/photos/%2e%2e%2ftoken").status_code == 404
        closed = client.get(path).json()["closed"]
        assert [each.get("why") for each in closed] == [None, "restarted", None]
