"""Values of every native type go from one real engine to another in a led run. The code of the actions
writes down which ones it got and gave.

Needs ENGINE_LAB, the folder of a built engine, and UMRF_SHARED, which has the program that starts it.
The package that keeps values is written by the command, and compiled by its own CMakeLists.txt.
`TEST_VALUE_LAPS` is how often the values go round (default 6), `TEST_LED_DOMAIN` the first domain.
Figures are printed with `-s`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest

pytest.importorskip(
    "rclpy", reason="rclpy is not here; `make ros-test` brings it", exc_type=ImportError
)

from action_assistant.errors import Conflict
from action_assistant.runner.robots.rights import Rules
from action_assistant.runner.runs.events import PieceEnded
from action_assistant.umrf.kept_values import KEEPER_PACKAGE
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.model import Graph, Parameter
from ros.generated_packages import Workspace, graph_of
from ros.led_engines import ALWAYS, Engines, as_led, ends_of, going_round, led_round, over
from runner.harness import ANN, MemoryJournal, sequence
from support.real_engine import needs_engine
from umrf.packages.sources import NATIVE

DOMAIN = int(os.environ.get("TEST_LED_DOMAIN", "180"))
LAPS = int(os.environ.get("TEST_VALUE_LAPS", "6"))
SOURCE = Path(__file__).with_name("value_actions") / "ox_pass.cpp"
GIVEN = {
    "text": ("string", "begin"),
    "count": ("number", 1),
    "flag": ("bool", True),
    "texts": ("strings", ["", "two words"]),
    "counts": ("numbers", [-2e300, 1.5]),
    "flags": ("bools", [True, False]),
}
PLAIN = {"delay": "number", "result": "string", "silent": "bool"}

pytestmark = [needs_engine, pytest.mark.timeout(0)]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """A workspace with an action of every type, and the package that keeps values."""
    made = Workspace(tmp_path_factory.mktemp("values"), Path(os.environ["ENGINE_LAB"]))
    values = {name: {"pvf_type": kind} for name, (kind, _) in GIVEN.items()}
    plain = {name: {"pvf_type": kind} for name, kind in PLAIN.items()}
    fields: dict[str, Any] = {
        "name": "OxPass",
        "input_parameters": plain
        | {k: leaf | {"pvf_required": False} for k, leaf in values.items()},
        "output_parameters": values,
    }
    (package,) = made.write(graph_of("packages", fields))
    (package / "src" / "ox_pass.cpp").write_text(SOURCE.read_text())
    command = [sys.executable, "-m", "action_assistant", "package", "--values"]
    subprocess.run([*command, "--output", str(made.sources)], check=True)
    made.build([package, made.sources / KEEPER_PACKAGE])
    return made


@pytest.fixture
def engines(tmp_path: Path, workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Engines:
    """Two engines that know the actions of the workspace only."""
    monkeypatch.setenv("ENGINE_LAB", str(workspace.lab))
    return Engines(tmp_path, DOMAIN)


def passing(name: str, *plain: dict[str, Any]) -> Graph:
    """`OxPass` on Scout and Carrier in turn, with these values for `delay`, `result` and `silent`; the
    first one, and every silent one's child, has values of its own."""
    line = sequence(name, len(plain))

    def leaf(kind: str, value: Any) -> str:
        return json.dumps({"pvf_type": kind} | ({} if value is None else {"pvf_value": value}))

    actions = tuple(
        msgspec.structs.replace(
            each,
            name="OxPass",
            actor=("Scout", "Carrier")[number % 2],
            inputs=(
                *(
                    Parameter(
                        key,
                        leaf(
                            kind, {"delay": 0.02, "result": "on_true", "silent": False, **own}[key]
                        ),
                    )
                    for key, kind in PLAIN.items()
                ),
                *(Parameter(key, leaf(kind, value)) for key, (kind, value) in GIVEN.items()),
            ),
            outputs=tuple(Parameter(key, leaf(kind, None)) for key, (kind, _) in GIVEN.items()),
        )
        for number, (each, own) in enumerate(zip(line.actions, plain, strict=True))
    )
    relations = tuple(
        each if each.parent == "entry" else msgspec.structs.replace(each, conditions=ALWAYS)
        for each in line.relations
    )
    return msgspec.structs.replace(line, actions=actions, relations=relations)


def alarms(journal: MemoryJournal) -> set[str]:
    """Return the codes of the alarms of all runs and of their pieces."""
    runs = [each.removeprefix("run/") for each in journal.streams if each.startswith("run/")]
    return {alarm.code for run in runs for alarm in journal.history(run).alarms}


def truth(engines: Engines) -> list[dict[str, Any]]:
    """Return the entries of the code of all actions about the values that it got and gave, oldest first."""
    found: list[dict[str, Any]] = []
    for name in engines.names:
        path = engines.folder / f"truth-{name}"
        found += (
            [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
        )
    return sorted(found, key=lambda each: float(each["at"]))


def check_chain(engines: Engines) -> int:
    """Check that each visit after the first got the values that the one before it gave; return how many
    there were."""
    told = truth(engines)
    gave, got = ([each for each in told if each["event"] == what] for what in ("gave", "got"))
    assert got[0]["values"] == {name: value for name, (_, value) in GIVEN.items()}
    for one, other in zip(gave, got[1:], strict=False):
        assert set(one["values"]) == set(GIVEN)
        assert other["values"] == one["values"], (one, other)
    return len(got) - 1


def test_values_of_every_type_go_round_in_a_loop(engines: Engines) -> None:
    loop = going_round(passing("round", {}, {"result": "on_false"}))

    async def main() -> list[PieceEnded]:
        async with engines.led() as (control, journal):
            found = await led_round(control, journal, loop, LAPS)
            assert alarms(journal) == set()
            return found

    ends = anyio.run(main)
    assert {(e.node, e.outcome) for e in ends[: 2 * LAPS]} == {  # then Stop was pressed
        ("OxPass_0", "on_true"),
        ("OxPass_1", "on_false"),
    }
    gave = [each["values"] for each in truth(engines) if each["event"] == "gave"]
    for each, values in zip(ends[: 2 * LAPS], gave, strict=False):
        assert {name: json.loads(text) for name, text in each.outputs.items()} == values
        assert each.unset == ()
    sys.stdout.write(f"\n{check_chain(engines)} hand-overs of {len(GIVEN)} values\n")
    gaps = {
        node: sorted(
            1000 * (b["at"] - a["at"])
            for a, b in zip(truth(engines), truth(engines)[1:], strict=False)
            if a["event"] == "gave" and a["node"] == node
        )
        for node in ("OxPass_0", "OxPass_1")
    }
    for node, found in gaps.items():
        sys.stdout.write(
            f"{node} gave → the next got, ms: n={len(found)} p50={found[len(found) // 2]:.0f} max={found[-1]:.0f}\n"
        )


def test_outcomes_stay_right_with_values_kept(engines: Engines) -> None:
    meant = ["on_true", "on_false", "on_error", "on_false", "on_error", "on_false", "on_true"]
    graph = passing(
        "mixed", *({"result": result, "delay": 0.01 * n} for n, result in enumerate(meant))
    )

    async def main() -> list[PieceEnded]:
        async with engines.led() as (control, journal):
            run = (await control.start(as_led(graph), ANN)).run.id
            assert await over(control, run, 60) == "finished"
            return ends_of(journal, run)

    ends = anyio.run(main)
    assert [each.outcome for each in ends] == meant
    told = truth(engines)
    gave = [each for each in told if each["event"] == "gave"]
    assert len(gave) == sum(each != "on_error" for each in meant)
    given = [each for each in ends if each.outcome != "on_error"]
    for each, known in zip(given, gave, strict=True):
        assert {name: json.loads(text) for name, text in each.outputs.items()} == known["values"]


def test_an_output_that_is_not_set_is_told_and_hands_nothing_on(engines: Engines) -> None:
    graph = passing("silent", {"silent": True}, {}, {"silent": True, "result": "on_false"}, {})

    async def main() -> tuple[list[PieceEnded], set[str]]:
        async with engines.led() as (control, journal):
            run = (await control.start(as_led(graph), ANN)).run.id
            assert await over(control, run, 60) == "finished"
            return ends_of(journal, run), alarms(journal)

    ends, told = anyio.run(main)
    assert [each.outcome for each in ends] == ["on_true", "on_true", "on_false", "on_true"]
    assert [set(each.unset) for each in ends] == [set(GIVEN), set(), set(GIVEN), set()]
    assert told == {"led_unset"}
    got = [each["values"] for each in truth(engines) if each["event"] == "got"]
    own = {name: value for name, (_, value) in GIVEN.items()}
    assert got[1] == own
    assert got[3] == own


def test_a_number_outside_a_limit_reaches_no_code_and_stops_the_run(engines: Engines) -> None:
    loop = going_round(passing("limited", {}, {"result": "on_false"}))
    limited = Rules(limits=(Limit(parameter="count", most=20),))

    async def main() -> tuple[str, set[str]]:
        async with engines.led() as (control, journal):
            for name in engines.names:
                await control.rights.set_rules(name, limited, ANN)
            run = (await control.start(as_led(loop), ANN)).run.id
            end = await over(control, run, 60)
            sys.stdout.write(f"\n{journal.history(run).alarms[-1].text}\n")
            return end, alarms(journal)

    assert anyio.run(main) == ("stopped", {"led_limit"})
    told = truth(engines)
    gave, got = (
        [each["values"]["count"] for each in told if each["event"] == what]
        for what in ("gave", "got")
    )
    sys.stdout.write(f"the code got {got}, and gave {gave[-1]} at last\n")
    assert len(got) > 3
    assert max(got) <= 20 < gave[-1]


def test_a_robot_without_the_package_is_refused_with_the_arrow(
    tmp_path: Path, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = Workspace(tmp_path / "bare", Path(os.environ["ENGINE_LAB"]))
    (bare.sources / "ox_pass").symlink_to(workspace.sources / "ox_pass")
    monkeypatch.setenv("ENGINE_LAB", str(bare.lab))

    async def main() -> None:
        async with Engines(tmp_path, DOMAIN).led() as (control, _):
            with pytest.raises(Conflict) as refused:
                await control.start(as_led(passing("refused", {}, {})), ANN)
            assert "OxPass_0 hands" in refused.value.detail
            assert KEEPER_PACKAGE in refused.value.detail

    anyio.run(main)
    assert {kind for kind, _ in GIVEN.values()} == set(NATIVE)
