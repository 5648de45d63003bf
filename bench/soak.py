"""Run tests for longer, or with more examples, than `make test` has time for: `make soak`."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Final, NamedTuple

REPOSITORY: Final = Path(__file__).parents[1]


PYTEST: Final = (sys.executable, "-m", "pytest", "-q", "--timeout=0")
PLAYWRIGHT: Final = (
    "scripts/with-node",
    "npm",
    "--prefix",
    "frontend",
    "run",
    "--silent",
    "e2e",
    "--",
)


VITEST: Final = (
    "scripts/with-node",
    "npm",
    "--prefix",
    "frontend",
    "run",
    "--silent",
    "test",
    "--",
)


class Part(NamedTuple):
    """One part of the soak: a description, the doses as environment variables, and the tests."""

    what: str
    dose: dict[str, str]
    tests: tuple[str, ...]
    runner: tuple[str, ...] = PYTEST


PARTS: Final[dict[str, Part]] = {
    "reported": Part(
        "200 histories each of a hardware stop that is reported, of pages that have to be visible, and of "
        "limits; a grid of 60 runs of which one fails",
        {
            "TEST_STOP_HISTORIES": "200",
            "TEST_PAGE_HISTORIES": "200",
            "TEST_LIMIT_HISTORIES": "200",
            "TEST_LONG": "1",
        },
        (
            *("-s", "tests/runner/execution/test_hardware_stops.py"),
            *(
                "tests/runner/execution/test_operator_pages.py",
                "tests/runner/execution/test_led_limits.py",
            ),
            *("tests/runner/repeats/test_repeats.py", "-k"),
            "random_histories or sixty or page_is_missing or no_value_outside",
        ),
    ),
    "parquet": Part(
        "tables as Parquet, read back with pyarrow",
        {},
        ("tests/runner/repeats/test_tables.py", "tests/runner/repeats/test_repeat_routes.py"),
    ),
    "kills": Part(
        "1,000 × kill -9 of a process at 8 chosen points and at any",
        {"TEST_KILLS": "1000"},
        ("tests/editor/test_kill.py", "-k", "wherever"),
    ),
    "images": Part(
        "10,000 images of a disk after a power cut",
        {"SOAK_IMAGES": "10000"},
        ("tests/journal/test_power.py", "-k", "power_cut"),
    ),
    "moves": Part(
        "50 × kill -9 in a move, a migration, a backup, a restore each; 20 who write before and after a "
        "move",
        {
            "TEST_MOVE_KILLS": "50",
            "TEST_MIGRATION_KILLS": "50",
            "TEST_BACKUP_KILLS": "50",
            "TEST_WRITERS": "20",
            "TEST_WRITING_S": "10",
        },
        (
            "tests/commands/databases",
            "tests/commands/backups/test_kills.py",
            "tests/test_upgrades.py",
            "-k",
            "(killed or many_wrote) and not killed_anywhere",
        ),
    ),
    "back": Part(
        "50 × kill -9 at the steps of a `migrate --back`, 50 at any moment; 10 of one on Postgres",
        {"TEST_BACK_KILLS": "50"},
        ("-s", "tests/commands/databases/test_going_back.py", "-k", "killed"),
    ),
    "faults": Part(
        "500 writes that fail, full disks",
        {"SOAK_FAULTS": "500"},
        ("tests/journal/test_power.py", "-k", "not power_cut"),
    ),
    "stops": Part(
        "100 immediate stops of Postgres under load",
        {"SOAK_STOPS": "100"},
        ("tests/journal/test_postgres.py", "-k", "immediate_stops"),
    ),
    "failover": Part(
        "6 failovers of two Postgres servers under Patroni, by lost power and by a frozen server, under the load "
        "of a journal and of an editor with people",
        {"SOAK_FAILOVERS": "6", "TEST_LONG": "1"},
        ("-s", "tests/journal/test_patroni.py"),
    ),
    "cuts": Part(
        "1,000 connections to Postgres cut at any moment",
        {"SOAK_CUTS": "1000"},
        ("tests/journal/test_postgres.py", "-k", "cuts_anywhere"),
    ),
    "overtaken": Part(
        "20 times three writers on one Postgres without its lock, whose connections are cut",
        {"SOAK_OVERTAKEN": "60", "SOAK_SEEDS": "20"},
        ("tests/journal/test_overtaken.py", "-k", "three_writers"),
    ),
    "several": Part(
        "20 times three editors' writers on one Postgres, whose connections are cut",
        {"SOAK_OVERTAKEN": "60", "SOAK_SEEDS": "20"},
        ("tests/journal/test_several_writers.py", "-k", "are_cut"),
    ),
    "cluster": Part(
        "100,000 schedules of a model of several editors",
        {"SOAK_CLUSTER": "100000"},
        ("tests/editor/cluster/test_model.py",),
    ),
    "schedules": Part(
        "50 schedules of three editors on a real Postgres",
        {"SOAK_SCHEDULES": "50"},
        ("tests/editor/cluster/test_schedules.py",),
    ),
    "flips": Part(
        "10,000 flipped bytes of a log",
        {"SOAK_FLIPS": "10000"},
        ("tests/journal/test_verify.py",),
    ),
    "reconnects": Part(
        "10,000 reconnects, a thousand at once; floods of upgrades",
        {"TEST_RECONNECTS": "10000"},
        ("tests/editor/test_floods.py",),
    ),
    "mutants": Part(
        "1,000,000 mutated updates against the scanner",
        {"TEST_MUTANTS": "1000000"},
        ("tests/editor/crdt/test_scan_fuzz.py",),
    ),
    "files": Part(
        "10,000 generated files through every reader",
        {"FUZZ_EXAMPLES": "10000"},
        ("tests/fuzz",),
    ),
    "packages": Part(
        "500 generated packages and those of all real actions compiled, 5,000 texts in sources",
        {"TEST_EXAMPLES": "12.5"},
        ("-s", "tests/umrf/packages"),
    ),
    "properties": Part(
        "20 times as many generated graphs, files, edits and histories for every property",
        {"TEST_EXAMPLES": "20"},
        ("-m", "hypothesis", "tests/umrf", "tests/editor", "tests/runner", "tests/test_wire.py"),
    ),
    "hostile": Part(
        "1,000 Stops while 20 people press hard on every route, beside 2,000 silent strangers",
        {"TEST_HOSTILE_STOPS": "1000", "TEST_HOSTILE_SILENT": "2000"},
        ("-s", "tests/test_nobody_delays_stop.py"),
    ),
    "matrix": Part(
        "each role and scope at every route and socket, with each kind of graph, run and robot, before and after "
        "each kind of revocation",
        {"TEST_MATRIX": "1"},
        ("-s", "tests/web/auth/test_matrix.py"),
    ),
    "guesses": Part(
        "codes, links and tokens guessed 1,000 times each from 100 addresses, beside the owner and Stops",
        {"TEST_GUESSES": "1000"},
        ("-s", "tests/web/auth/test_guesses.py"),
    ),
    "audit": Part(
        "1,000 deeds of 20 people, all of which are found in the audit",
        {"TEST_DEEDS": "1000", "TEST_SEED": "2"},
        ("tests/test_audit.py", "-k", "20_people"),
    ),
    "texts": Part(
        "each hostile text at every place of both processes that takes one",
        {"TEST_LONG": "1"},
        ("tests/web/http/test_hostile_texts.py",),
    ),
    "schemas": Part(
        "what schemathesis makes of both OpenAPI documents, as owner, operator and stranger",
        {},
        ("bench/schemas.py",),
        (sys.executable,),
    ),
    "schemas-postgres": Part(
        "the same of the editor with its graphs in Postgres",
        {},
        ("bench/schemas.py", "postgres"),
        (sys.executable,),
    ),
    "robots": Part(
        "10,000 histories of runs with false confirmations, 1,000 stops and races, 300 clicks on Stop, "
        "12,000 races for a baton",
        {
            "TEST_HISTORIES": "10000",
            "TEST_BATON_RACES": "4000",
            "TEST_STOPS": "1000",
            "TEST_RACES": "1000",
            "TEST_STOP_CLICKS": "300",
        },
        (
            "-s",
            "tests/runner/stop/test_false_confirmations.py",
            "tests/runner/stop/test_stops_and_starts.py",
            "tests/runner/start/test_rights_registry.py",
            "tests/test_stop_latency.py",
        ),
    ),
    "conducted": Part(
        "10,000 random graphs led on three robots, and 4,000 histories of led runs with faults",
        {"TEST_EXAMPLES": "250"},
        (
            "tests/runner/execution/test_conducted_courses.py",
            "tests/runner/execution/test_conducted_nested_courses.py",
            "tests/runner/execution/test_conducted_faults.py",
            "tests/runner/execution/test_led_presses.py",
            "tests/runner/execution/test_led_simulated_histories.py",
            "tests/runner/execution/test_led_simulated_faults.py",
        ),
    ),
    "continued": Part(
        "200 histories of runs that are continued, begun in the middle, queued, killed and stopped, and "
        "240 of runs that ask people",
        {"TEST_EXAMPLES": "20"},
        (
            *("-s", "tests/runner/execution/test_continued_histories.py"),
            "tests/runner/execution/test_question_histories.py",
        ),
    ),
    "sync": Part(
        "1,000 schedules of a folder that is edited while it is kept in step with a server, with and "
        "without hard links; and rounds of it that end at each of their steps",
        {"TEST_EXAMPLES": "100"},
        ("tests/commands/sync/test_sync.py", "-k", "anybody_wrote or any_step"),
    ),
    "archives": Part(
        "kill -9 at every step of putting runs and raw messages into archives",
        {"SOAK_ARCHIVE_EVERY": "1"},
        ("tests/runner/archives/test_retention.py", "-k", "kill"),
    ),
    "long": Part(
        "what CI has no time for: one more product, database or command each",
        {"TEST_LONG": "1"},
        ("-m", "long or turns", "tests"),
    ),
    "documents": Part(
        "every command of the documents that takes seconds",
        {"TEST_LONG": "1"},
        ("tests/docs",),
    ),
    "lines": Part(
        "25 times as many generated scenes and layouts for lines of the canvas, and plays of undo",
        {"TEST_EXAMPLES": "5"},
        (
            "--testTimeout=0",
            "src/canvas/arrows",
            "src/canvas/geometry",
            "src/canvas/laid-out-lines",
            "src/graph/edit/undo-history",
        ),
        VITEST,
    ),
    "browser": Part(
        "browser tests that CI has no time for",
        {"TEST_LONG": "1"},
        (),
        PLAYWRIGHT,
    ),
    "pictures": Part(
        "whether the pictures of the documents show the page of today",
        {},
        ("bench/picture_age.py",),
        (sys.executable,),
    ),
    "clients": Part(
        "stock clients in a room that is silent for a minute",
        {"TEST_IDLE_SECONDS": "61"},
        ("tests/test_room_clients.py",),
    ),
}


def main(names: list[str]) -> int:
    """Run these parts, or all; return 1 when one failed, 2 for an unknown name."""
    if unknown := [name for name in names if name not in PARTS]:
        sys.stderr.write(f"no part: {', '.join(unknown)}; there are {', '.join(PARTS)}\n")
        return 2
    failed = [name for name in names or PARTS if not passes(name, PARTS[name])]
    return 1 if failed else 0


def passes(name: str, part: Part) -> bool:
    """Run one part, write how long it took, and return whether it passed."""
    start = time.monotonic()
    done = subprocess.run(
        [*part.runner, *part.tests], cwd=REPOSITORY, env={**os.environ, **part.dose}, check=False
    )
    word = "passed" if done.returncode == 0 else "FAILED"
    took = time.monotonic() - start
    sys.stdout.write(f"{name}: {part.what}: {word} after {took:.0f} s\n")
    sys.stdout.flush()
    return done.returncode == 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
