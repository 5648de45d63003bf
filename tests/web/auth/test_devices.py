"""Codes of devices under races and guesses, and when sessions expire."""

import os
import time
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from action_assistant.errors import CannotStart, Conflict, NotFound, TooMany, Unauthenticated
from action_assistant.web.auth.browser_names import browser_name
from action_assistant.web.auth.device_codes import CODE_SECONDS, DeviceCodes
from action_assistant.web.auth.keys import Keys, Session
from action_assistant.web.auth.people_files import PeopleFiles
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.session_limits import DEFAULTS, limits_of
from action_assistant.web.auth.standing import Standings

KEYS = Keys("k" * 43)
DAY = 24 * 3600.0


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def session(name: str = "Ada") -> Session:
    return KEYS.new_session(name, role="operator")


@given(
    steps=st.lists(
        st.sampled_from(["open", "claim", "yes", "no", "collect", "wait", "cancel"]), max_size=25
    )
)
@example(["claim", "yes", "cancel", "collect"])
def test_no_order_of_steps_signs_a_device_in_that_was_not_confirmed(steps: list[str]) -> None:
    clock, mine, other = Clock(), session(), session("Eve")
    codes = DeviceCodes(clock)
    made = codes.open(mine)
    claims: list[str] = []
    confirmed: str | None = None
    collected: set[str] = set()
    for step in steps:
        try:
            if step == "open":
                made, confirmed = codes.open(mine), None
            elif step == "claim":
                claims.append(codes.claim(made.code, "Firefox", "").claim)
            elif step in {"yes", "no"}:
                with pytest.raises(NotFound):
                    codes.answer(made.id, other, is_mine=True)
                codes.answer(made.id, mine, is_mine=step == "yes")
                confirmed = claims[-1] if step == "yes" else None
            elif step == "wait":
                clock.now += CODE_SECONDS
                confirmed = None
            elif step == "cancel":
                codes.cancel(made.id, mine)
                confirmed = None
            else:
                for claim in claims:
                    if codes.confirmed(claim) is not None:
                        assert claim == confirmed
                        assert claim not in collected
                        codes.collect(claim)
                        collected.add(claim)
        except (NotFound, Conflict, Unauthenticated):
            pass


def test_a_code_is_sent_once_whatever_its_form() -> None:
    codes = DeviceCodes()
    made = codes.open(session())
    assert codes.claim(f" {made.code.lower().replace('-', ' ')} ", "Firefox", "").number
    with pytest.raises(Unauthenticated):
        codes.claim(made.code, "Chrome", "")


def test_a_thousand_guesses_are_bounded_and_the_code_stays_good_after_that() -> None:
    clock = Clock()
    codes = DeviceCodes(clock)
    refused = 0
    for number in range(1000):
        with pytest.raises((Unauthenticated, TooMany)) as error:
            codes.claim(f"{number:08d}", "Firefox", f"10.0.0.{number % 100}")
        refused += error.type is TooMany
    assert refused == 700
    made = codes.open(session())  # an owner who is signed in is not disturbed
    clock.now += 60
    assert codes.claim(made.code, "Firefox", "").claim


@pytest.mark.parametrize(
    ("agent", "name"),
    [
        (
            "Mozilla/5.0 (X11; Linux x86_64; rv:140.0) Gecko/20100101 Firefox/140.0",
            "Firefox on Linux",
        ),
        (
            "Mozilla/5.0 (Windows NT 10.0) AppleWebKit/537.36 Chrome/140.0 Safari/537.36 Edg/140.0",
            "Edge on Windows",
        ),
        (
            "Mozilla/5.0 (iPhone; CPU iPhone OS 18_0 like Mac OS X) Version/18.0 Safari/604.1",
            "Safari on iPhone",
        ),
        ("Mozilla/5.0 (Linux; Android 15) Chrome/140.0 Mobile Safari/537.36", "Chrome on Android"),
        ("python-httpx/0.28", "A program"),
        ("", "A program"),
    ],
)
def test_browsers_have_readable_names(agent: str, name: str) -> None:
    assert browser_name(agent) == name


@pytest.mark.parametrize("text", ["owner", "owner=1d", "king=1d/2d", "owner=2d/1d", "owner=0m/1d"])
def test_malformed_limits_of_sessions_stop_the_program(text: str) -> None:
    with pytest.raises(CannotStart, match="ACTION_ASSISTANT_SESSIONS"):
        limits_of(text)


def test_a_session_expires_when_it_was_not_used(tmp_path: Path) -> None:
    limits = limits_of("owner=12h/7d")
    assert (limits["owner"], limits["viewer"]) == ((DAY / 2, 7 * DAY), DEFAULTS["viewer"])
    revoked = Revocations(tmp_path)
    browsers = SessionFiles(tmp_path, revoked)
    standings = Standings(PeopleFiles(tmp_path), browsers, limits)
    mine = KEYS.new_session("Ada")
    assert not standings.of(mine).expired  # not noted, as on a full disk: nobody is signed out
    browsers.note(mine)
    assert [each.id for each in browsers.every()] == [mine.id]
    path = tmp_path / "sessions" / f"{mine.id}.json"
    old = time.time() - DAY
    os.utime(path, (old, old))
    assert standings.of(mine).expired
    assert browsers.every() == []
    assert standings.of(mine).expired  # listing them changes nothing
    # Used in the other process meanwhile.
    SessionFiles(tmp_path, revoked).use(mine.id)
    assert not standings.of(mine).expired
    # Cookies of before sessions could be idle expire by their own end alone.
    os.utime(path, (old, old))
    assert not standings.of(Session(mine.id, mine.person, mine.expires)).expired
