"""`runs log` lists lines from a level on, and those of an unknown level always."""

import json

from action_assistant.commands.run_log import lines_from


def _event(kind: str, **body: str) -> bytes:
    return json.dumps({"kind": kind, "at": "2026-11-30T10:00:00Z", "body": body}).encode()


EVENTS = [
    _event("run.requested.v1", text="no line"),
    _event("run.engine_said.v1", text="one", level="info"),
    _event("run.engine_said.v1", text="two", level="warn"),
    _event("run.engine_said.v1", text="three"),
    _event("run.engine_said.v1", text="four", level="fatal"),
]


def test_lines_are_listed_from_a_level_on_and_unknown_ones_always() -> None:
    listed = {
        level: [each["text"] for each in lines_from(EVENTS, level)]
        for level in ("debug", "warn", "error")
    }
    assert listed == {
        "debug": ["one", "two", "three", "four"],
        "warn": ["two", "three", "four"],
        "error": ["three", "four"],
    }
    unknown = [each for each in lines_from(EVENTS, "debug") if "level" not in each]
    assert [each["text"] for each in unknown] == ["three"]
