"""Simulated runs with behaviours, in a real runner: what they return, give and say."""

import os
from pathlib import Path
from typing import Any

import httpx
import pytest

from runner.harness import order
from runner.links.behaviours.driven import QUICK, messages, result, start
from runner.links.behaviours.written import (
    OK,
    action,
    chain,
    parameter,
    write,
)
from runner.process import over, started

pytestmark = pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="behaviours need Linux")


def test_the_return_value_of_a_behaviour_is_the_result_of_its_action(
    client: httpx.Client, folder: Path
) -> None:
    write(
        folder,
        yes=OK,
        no="def run(action):\n    return False\n",
        nothing="def run(action):\n    action.message('done')\n",
        fails="def run(action):\n    raise RuntimeError('gripper jammed')\n",
    )
    done = over(client, start(client, chain("Yes", "No", "Nothing", "Fails", "Scripted")))
    assert done["state"] == "finished"
    ends = {name: result(done, f"{name}_0") for name in ("Yes", "No", "Nothing", "Fails")}
    assert ends == {"Yes": "true", "No": "false", "Nothing": "true", "Fails": "error"}
    assert messages(done, "Nothing_0") == "done"
    assert "RuntimeError: gripper jammed (fails.py, line 2)" in messages(done, "Fails_0")
    assert result(done, "Scripted_0") == "true"  # without a file, as the script says


def test_without_the_choice_the_script_says_what_is_done(
    client: httpx.Client, folder: Path
) -> None:
    write(folder, no="def run(action):\n    return False\n")
    run = started(client, order(chain("No"), script=QUICK))
    assert result(over(client, run["id"]), "No_0") == "true"


TYPES: dict[str, Any] = {
    "string": "grüß \N{SNOWMAN} \"'\n",
    "strings": ["a", "", "b"],
    "number": -1.5e300,
    "numbers": [0.0, 1.5, 3.0],
    "bool": True,
    "bools": [True, False],
}


def test_values_of_every_native_type_come_in_and_go_on_to_the_next_action(
    client: httpx.Client, folder: Path
) -> None:
    write(
        folder,
        gives="""
            def run(action):
                for name, value in action.inputs.items():
                    action.outputs[name.replace("in::", "out::")] = value
            """,
        takes="""
            import json
            def run(action):
                action.message(json.dumps(action.inputs, sort_keys=True))
            """,
    )
    first = action(
        "Gives",
        [parameter(f"in::{kind}", kind, value) for kind, value in TYPES.items()],
        [parameter(f"out::{kind}", kind) for kind in TYPES],
    )
    second = action("Takes", [parameter(f"out::{kind}", kind) for kind in TYPES])
    done = over(client, start(client, chain(first, second)), 15)
    assert done["state"] == "finished"
    told = httpx.Response(200, text=messages(done, "Takes_0")).json()
    assert told == {f"out::{kind}": value for kind, value in TYPES.items()}


@pytest.mark.long
@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("action.outputs['count'] = 'three'", "is a number, not str"),
        ("action.outputs['count'] = True", "is a number, not bool"),
        ("action.outputs['other'] = 3", "no output “other”"),
        ("action.outputs['count'] = float('nan')", "not JSON compliant"),
        ("action.outputs['count'] = {1, 2}", "not JSON serializable"),
        ("return 'yes'", "returned str"),
        ("import sys; sys.exit(0)", "SystemExit"),
        ("import os; os._exit(0)", "ended with code 0 before it had a result"),
        ("import os; os.kill(os.getpid(), 11)", "SIGSEGV"),
        ("import os; os.write(1, b'x'); raise MemoryError", "it may have 512 MB"),
        ("hold = [bytearray(1 << 20) for _ in range(10**6)]", "it may have 512 MB"),
    ],
)
def test_a_forbidden_act_of_a_behaviour_ends_its_action_with_an_error_that_says_so(
    client: httpx.Client, folder: Path, line: str, why: str
) -> None:
    write(folder, odd=f"def run(action):\n    {line}\n    action.sleep(3600)\n")
    node = action("Odd", outputs=[parameter("count", "number")])
    done = over(client, start(client, chain(node, "After")), 15)
    assert result(done, "Odd_0") == "error"
    assert why in messages(done, "Odd_0")


def test_numbers_stay_numbers(client: httpx.Client, folder: Path) -> None:
    """The engine takes a whole number in a file as a double."""
    write(
        folder,
        doubles="""
            def run(action):
                action.outputs["count"] = 3
                action.message(repr(action.inputs["count"]))
            """,
        shows="def run(action):\n    action.message(repr(action.inputs['count']))\n",
    )
    first = action("Doubles", [parameter("count", "number", 2)], [parameter("count", "number")])
    second = action("Shows", [parameter("count", "number")])
    done = over(client, start(client, chain(first, second)), 15)
    assert (messages(done, "Doubles_0"), messages(done, "Shows_0")) == ("2.0", "3.0")
