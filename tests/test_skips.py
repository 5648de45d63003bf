"""Skipped tests: told in one line, and accepted by CI only from the list."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from support import doses, skips

TESTS = Path(__file__).parent


def test_each_accepted_reason_is_one_that_a_test_gives() -> None:
    sources = [*TESTS.rglob("*.py"), *TESTS.glob("recordings/*/facts.json")]
    text = "".join(path.read_text() for path in sources if path != Path(__file__))
    for reason, why in skips.accepted().items():
        assert f'"{reason}' in text, reason
        assert why


def test_the_closing_line_names_the_most_frequent_reason_first() -> None:
    told = skips.closing_line(Counter({"b is missing": 1, "a is missing": 20}))
    assert told == "21 tests were skipped: 20 × a is missing; 1 × b is missing"
    assert skips.closing_line({"a": 1}) == "1 test was skipped: 1 × a"


@pytest.mark.parametrize(("processes", "ci"), [("0", False), ("1", True)])
def test_ci_fails_when_a_test_is_skipped_for_a_reason_that_nobody_accepted(
    tmp_path: Path, processes: str, ci: bool
) -> None:
    (tmp_path / "test_one.py").write_text(
        "import pytest\n\n\n"
        "def test_it_runs():\n    pass\n\n\n"
        "def test_it_does_not():\n    pytest.skip('because')\n"
    )
    (tmp_path / "test_two.py").write_text(
        "import pytest\n\npytest.skip('it is late', allow_module_level=True)\n"
    )
    options = ["-p", "conftest", "-p", "no:cacheprovider", "-n", processes]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", f"--rootdir={tmp_path}", *options, "."],
        cwd=tmp_path,
        env={k: v for k, v in os.environ.items() if k not in {"CI", "PYTEST_XDIST_WORKER"}}
        | {"PYTHONPATH": str(TESTS)}
        | ({"CI": "true"} if ci else {}),
        capture_output=True,
        text=True,
        check=False,
    )
    assert "2 tests were skipped: 1 × because; 1 × it is late" in done.stdout
    assert ("CI may not skip this (tests/skips.toml): because" in done.stdout) == ci
    assert done.returncode == int(ci), done.stdout


def test_each_file_with_turns_is_tried_on_one_day_of_three(monkeypatch: pytest.MonkeyPatch) -> None:
    for file in (file for row in doses.FILES for file in row):
        assert (TESTS.parent / file).is_file(), file
        tried = []
        for day in ("0", "1", "2"):
            monkeypatch.setenv("TEST_DAY", day)
            tried.append(not doses.waits_with_its_file(f"{file}::test_one"))
        assert sorted(tried) == [False, False, True], file


def test_a_test_with_turns_is_tried_every_third_day_or_when_its_file_is_named(
    tmp_path: Path,
) -> None:
    (tmp_path / "test_many.py").write_text(
        "import pytest\n\n\n"
        "@pytest.mark.turns\n"
        "@pytest.mark.parametrize('n', range(30))\n"
        "def test_it(n):\n    pass\n"
    )

    def tried(day: int, where: str) -> int:
        options = ["-p", "conftest", "-p", "no:cacheprovider", "-o", "markers=turns"]
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", f"--rootdir={tmp_path}", *options, where],
            cwd=tmp_path,
            env={k: v for k, v in os.environ.items() if k != "TEST_LONG"}
            | {"PYTHONPATH": str(TESTS), "TEST_DAY": str(day)},
            capture_output=True,
            text=True,
            check=True,
        )
        return int(done.stdout.splitlines()[-1].split(" passed")[0])

    days = [tried(day, ".") for day in range(3)]
    assert sum(days) == 30
    assert all(days)
    assert tried(0, "test_many.py") == 30
