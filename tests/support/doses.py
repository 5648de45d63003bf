"""Decide how many generated examples one run of a property takes, and which tests wait for another day."""

import os
import zlib
from datetime import UTC, datetime
from typing import Final

#: A factor of the number that a test asks for: `make test` takes a fifth of it, `make soak` twenty times it.
_SHARE: Final = float(os.environ.get("TEST_EXAMPLES", "0.2"))
_LEAST: Final = 10 if _SHARE >= 1 else 5
#: Of tests with the mark `turns`, each day takes one part of so many.
_PARTS: Final = 3
#: Files of which each day tries one row. They take 4 s of a processor and more, and are far from Stop, starts,
#: rights and stored edits; the rows take about the same time.
FILES: Final = (
    (
        *("tests/test_wheel.py", "tests/test_room_clients.py", "tests/commands/test_remote.py"),
        *("tests/commands/test_logins.py", "tests/commands/doctor/test_postgres_faults.py"),
        *("tests/editor/catalogue/test_graph_pages.py", "tests/editor/api/test_subgraphs.py"),
        *("tests/editor/history/test_change_index.py", "tests/runner/analysis/test_replay.py"),
        "tests/umrf/packages/test_sources.py",
    ),
    (
        *("tests/test_platforms.py", "tests/test_working_folder.py"),
        *("tests/commands/test_owner_link.py", "tests/commands/test_simulate_behaviours.py"),
        *("tests/commands/doctor/test_machine_faults.py", "tests/journal/copies/test_copying.py"),
        *("tests/editor/catalogue/test_folders.py", "tests/editor/catalogue/test_graph_checks.py"),
        "tests/editor/people/test_identity_provider.py",
        "tests/web/audit/test_audit_retention.py",
    ),
    (
        *("tests/test_warm.py", "tests/commands/sync/test_sync.py"),
        *("tests/commands/test_head_line.py", "tests/commands/services/test_unit.py"),
        *("tests/commands/doctor/test_folder_faults.py", "tests/editor/api/test_provider.py"),
        *("tests/editor/history/drafts/test_drafts.py", "tests/web/http/test_hostile_texts.py"),
        *("tests/editor/interchange/test_edited_text.py", "tests/web/monitoring/test_running.py"),
        "tests/editor/log/test_database_location.py",
    ),
)
_ROW_OF: Final = {file: row for row, files in enumerate(FILES) for file in files}


def examples(usual: int) -> int:
    """Return on how many generated examples a property is tried that asks for `usual` of them."""
    return max(_LEAST, round(usual * _SHARE))


def is_share(found: int, drawn: int, share: float) -> bool:
    """Return whether more than a share of the drawn examples was found; of few examples, whether any was.

    How many of few examples are found is a matter of chance.
    """
    return found > (drawn * share if drawn >= 150 else 0)


def has_its_turn(test: str) -> bool:
    """Return whether a test with the mark `turns` is tried today: every third day, by UTC. `TEST_DAY`
    names another day by its number."""
    return (zlib.crc32(test.encode()) + _today()) % _PARTS == 0


def waits_with_its_file(test: str) -> bool:
    """Return whether a test is in one of `FILES`, and its row has its turn on another day."""
    row = _ROW_OF.get(test.partition("::")[0])
    return row is not None and (row + _today()) % _PARTS != 0


def _today() -> int:
    return int(os.environ.get("TEST_DAY", datetime.now(UTC).date().toordinal()))
