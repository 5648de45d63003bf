"""Refusals in the log."""

import pytest
from litestar import Litestar, get
from litestar.params import FromQuery
from litestar.testing import TestClient

from action_assistant.errors import BadInput, Unavailable
from action_assistant.web.http import problems


def test_a_part_that_is_away_is_logged_once_however_often_clients_try_again(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def said() -> list[str]:
        return [each.message for each in caplog.records if each.name == problems.log.name]

    @get("/store", sync_to_thread=False)
    def store(why: FromQuery[str]) -> None:
        raise Unavailable(why)

    @get("/wrong", sync_to_thread=False)
    def wrong() -> None:
        raise BadInput("No graph has this name.")

    caplog.set_level("INFO", problems.log.name)
    app = Litestar(
        [store, wrong], exception_handlers=problems.problem_handlers(), logging_config=None
    )
    with TestClient(app) as client:
        for _ in range(5):
            assert client.get("/store", params={"why": "It is down."}).status_code == 503
            assert client.get("/store", params={"why": "It starts."}).status_code == 503
        assert len(said()) == 2
        for _ in range(3):
            assert client.get("/wrong").status_code == 400
        assert len(said()) == 5, "what a client does wrong is said each time"
        monkeypatch.setattr(problems, "_AGAIN_S", 0.0)
        client.get("/store", params={"why": "It is down."})
        assert len(said()) == 6
