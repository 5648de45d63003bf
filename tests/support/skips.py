"""Lists skipped tests with their reasons, and those that CI accepts: `tests/skips.toml`."""

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest

LIST = Path(__file__).parents[1] / "skips.toml"


def accepted() -> dict[str, str]:
    """Return the accepted beginnings of reasons, and why they are accepted."""
    return {each["reason"]: each["why"] for each in tomllib.loads(LIST.read_text())["skip"]}


def reasons(reports: Iterable[pytest.TestReport | pytest.CollectReport]) -> Counter[str]:
    """Return how often each reason was given; a file that was skipped as a whole counts once."""
    found: Counter[str] = Counter()
    for report in reports:
        told = report.longrepr
        text = told[2] if isinstance(told, tuple) else str(told)
        found[text.removeprefix("Skipped: ")] += 1
    return found


def closing_line(found: Mapping[str, int]) -> str:
    """Return all reasons in one line, the most frequent first."""
    each = sorted(found.items(), key=lambda pair: (-pair[1], pair[0]))
    number = sum(found.values())
    tests = "1 test was skipped" if number == 1 else f"{number} tests were skipped"
    return f"{tests}: " + "; ".join(f"{count} × {reason}" for reason, count in each)


def unaccepted(found: Iterable[str]) -> list[str]:
    """Reasons that CI does not accept."""
    return sorted(reason for reason in found if not reason.startswith(tuple(accepted())))
