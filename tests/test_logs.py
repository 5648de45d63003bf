"""Lines of a log: whatever strangers write stays in its line, and no secret is in any."""

import json
import logging
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from action_assistant.errors import CannotStart
from action_assistant.logs import (
    ConsoleLog,
    JsonLog,
    LogSettings,
    about,
    begin,
    is_about,
    log_settings,
    request_id,
    subjects,
)
from action_assistant.random_ids import random_id
from action_assistant.web.auth.keys import Keys

EVIL = "\x1b[2J\nERROR root: all robots are stopped\r\u202e"
OWN = "a token of one's own, which nobody would guess"
KEYS = Keys("t" * 43)
SECRETS = {
    "the token": OWN,
    "a generated token": "Zk3" * 14 + "Q",
    "a password in a URL": "postgresql://ada:S3CRET/pass@db/graphs",
    "a session": f"aa_8000={KEYS.sealed(KEYS.new_session('Ada'))}",
    "an invitation": f"{random_id()}.{'s' * 43}",
    "a header": "Authorization: Bearer abcdef",
}


@contextmanager
def clean() -> Iterator[None]:
    """Begin each test with log lines that have no subject."""
    begin({})
    yield
    begin({})


def record(text: str, *args: object, error: Exception | None = None) -> logging.LogRecord:
    raised = (type(error), error, None) if error is not None else None
    return logging.LogRecord("x", logging.WARNING, "", 0, text, args, raised)


@pytest.mark.parametrize("formatter", [ConsoleLog(OWN), JsonLog("editor", OWN)])
def test_a_hostile_text_is_one_line(formatter: logging.Formatter) -> None:
    with clean(), about("graph", EVIL):
        line = formatter.format(record("refused %s", EVIL))
    assert "\n" not in line
    assert "\x1b" not in line
    assert "\r" not in line


@pytest.mark.parametrize("what", SECRETS)
@pytest.mark.parametrize("formatter", [ConsoleLog(OWN), JsonLog("editor", OWN)])
def test_no_secret_is_written_wherever_it_comes_from(
    formatter: logging.Formatter, what: str
) -> None:
    secret = SECRETS[what]
    hidden = {"a password in a URL": "S3CRET", "a header": "abcdef"}.get(what, secret)
    with clean(), about("graph", secret):
        line = formatter.format(record("at %s", secret, error=ValueError(secret)))
    assert hidden not in line
    assert hidden.partition(".")[2][:20] not in line or "." not in hidden


def test_json_says_when_who_what_and_what_it_is_about() -> None:
    with clean():
        is_about("request", "r1")
        with about("run", "R"):
            line = json.loads(
                JsonLog("runner").format(record("sent %s", "it", error=OSError("no")))
            )
        assert dict(subjects()) == {"request": "r1"}
        assert request_id() == "r1"
    assert line["time"].endswith("Z")
    assert (line["level"], line["process"], line["logger"]) == ("warning", "runner", "x")
    assert (line["message"], line["request"], line["run"]) == ("sent it", "r1", "R")
    assert "OSError: no" in line["error"]


def test_a_line_for_people_says_behind_itself_what_it_is_about() -> None:
    with clean(), about("run", "R"):
        assert ConsoleLog().format(record("sent")).endswith("x: sent [run=R]")
    assert ConsoleLog().format(record("sent")).endswith("x: sent")


def test_the_command_line_counts_before_the_environment() -> None:
    environ = {"ACTION_ASSISTANT_LOG_FORMAT": "json", "ACTION_ASSISTANT_LOG_LEVEL": "DEBUG"}
    assert log_settings(None, None, environ) == LogSettings("json", "debug")
    assert log_settings("console", None, environ) == LogSettings("console", "debug")
    with pytest.raises(CannotStart, match="one of console, json, not 'xml'"):
        log_settings(None, None, {"ACTION_ASSISTANT_LOG_FORMAT": "xml"})
    with pytest.raises(CannotStart, match="not 'loud'"):
        log_settings(None, None, {"ACTION_ASSISTANT_LOG_LEVEL": "loud"})


def test_uncaught_errors_are_logged_as_json_too() -> None:
    code = (
        "import warnings, threading; from action_assistant.logs import *;"
        "set_up('editor', LogSettings('json')); warnings.warn('old');"
        "t = threading.Thread(target=lambda: 1 / 0); t.start(); t.join(); say('bye'); {}['x']"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    lines = [json.loads(line) for line in done.stderr.splitlines()]
    assert [each["level"] for each in lines] == ["warning", "critical", "info", "critical"]
    assert "ZeroDivisionError" in lines[1]["error"]
    assert "KeyError" in lines[3]["error"]


def test_a_worker_writes_as_its_parent_does() -> None:
    code = (
        "import logging; from action_assistant.logs import *;"
        "from action_assistant.web.workers.lanes import child;"
        "hand_on(LogSettings('json', 'warning'));"
        "work = logging.getLogger('action_assistant.x').warning;"
        "child(work, 'hello', name='files', nice=1, preloaded=[]).join()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    (line,) = map(json.loads, done.stderr.splitlines())
    assert (line["process"], line["message"]) == ("worker files", "hello")
