"""Each code of `doctor` is caused by a test, and reported with a remedy."""

from pathlib import Path

from action_assistant.system.diagnostics import CODES

ROOT = Path(__file__).parents[3]
#: Codes that no test can cause for real, and why.
UNPLANTED: dict[str, str] = {}


def test_every_code_is_told_by_the_program() -> None:
    server = ROOT / "server" / "action_assistant"
    sources = [*(server / "commands" / "doctor").glob("*.py"), *server.rglob("checkup.py")]
    told = "".join(each.read_text() for each in sources)
    assert [code for code in CODES if f'"{code}"' not in told] == []


def test_every_code_is_planted_by_a_test() -> None:
    files = [
        *(ROOT / "tests" / "commands" / "doctor").glob("test_*.py"),
        *(ROOT / "tests" / "ros").glob("test_*.py"),
        *(ROOT / "tests" / "runner" / "links").glob("test_checkup.py"),
    ]
    asserted = "".join(each.read_text() for each in files if each.name != Path(__file__).name)
    missing = {code for code in CODES if code not in asserted}
    assert missing == set(UNPLANTED)
