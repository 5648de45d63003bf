"""Action packages of many kinds, compiled for the real engine as a workspace would compile them."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.packages.naming import snake_case
from runner.harness import sequence
from umrf.packages.sources import HOSTILE, NATIVE, described

#: A value for each native type that is not its default.
VALUES: Final[dict[str, Any]] = {
    "string": 'é "quoted" \\',
    "strings": ["", "two words"],
    "number": 0.1,
    "numbers": [-2e300, 1.5],
    "bool": True,
    "bools": [True, False, True],
}
_OPTIONAL_MODEL: Final = {"pvf_type": "urdf::Model", "pvf_required": False}


def leaf(kind: str, **more: Any) -> dict[str, Any]:
    """A parameter of a native type, with a value."""
    return {"pvf_type": kind, "pvf_value": VALUES[kind], **more}


def _every(prefix: str, *, values: bool) -> dict[str, Any]:
    return {
        f"{prefix}_{kind}": leaf(kind) if values else {"pvf_type": kind} for kind in sorted(NATIVE)
    }


def _nested(depth: int, inner: dict[str, Any]) -> dict[str, Any]:
    for _ in range(depth):
        inner = {"deep": inner}
    return inner


def _choices() -> dict[str, Any]:
    chosen = {kind: leaf(kind, pvf_allowed_values=[VALUES[kind]]) for kind in ("string", "number")}
    return {f"chosen {kind}": value for kind, value in chosen.items()}


_POINT: Final = {axis: leaf("number") for axis in "xyz"}
#: Actions that generators got wrong, names that C++ or the engine reserve, and plain actions.
DESCRIPTIONS: Final[tuple[dict[str, Any], ...]] = (
    {"name": "OpenGripper", "description": "Opens the gripper."},
    {"name": "MoveTCP", "input_parameters": {"tcp": {"position": _POINT, "speed": leaf("number")}}},
    {"name": "TakeAll", "input_parameters": _every("taken", values=True)},
    {"name": "GiveAll", "output_parameters": _every("given", values=False)},
    {
        "name": "HandOn",
        "input_parameters": _every("in", values=True),
        "output_parameters": _every("out", values=False),
    },
    {
        "name": "TwoFrames",
        "input_parameters": {
            "from": {"position": _POINT},
            "goal": {"position": {"x": leaf("string")}},
            "position": {"x": leaf("bools")},
        },
    },
    {"name": "SixtyGroups", "input_parameters": _nested(60, leaf("number"))},
    {
        "name": "AllOptional",
        "input_parameters": {
            kind: {"pvf_type": kind, "pvf_required": False} for kind in sorted(NATIVE)
        },
    },
    {"name": "ChooseOne", "input_parameters": _choices()},
    {
        "name": "AnswerYes",
        "output_parameters": {
            "answer": {"pvf_type": "string", "pvf_allowed_values": ["*/ \"yes\"", "no"]},
            "grade": {"pvf_type": "number", "pvf_allowed_values": [0.1, 2]},
            "sure": {"pvf_type": "bool", "pvf_allowed_values": [True]},
        },
    },
    {
        "name": "TaURDF",
        "input_parameters": {"class": leaf("strings"), "NULL": leaf("bools"), "r": _OPTIONAL_MODEL},
        "output_parameters": {"robot": {"pvf_type": "urdf::Model"}},
    },
    {
        "name": "MapIt",
        "output_parameters": {"map": {"pvf_type": "nav_msgs::msg::OccupancyGrid"}},
    },
    {"name": "SayAnything", "description": "".join(HOSTILE)},
    {
        "name": "OddKeys",
        "description": '*/ "; #error',
        "input_parameters": {
            f"{text.replace(':', '')}{i}": leaf("number") for i, text in enumerate(HOSTILE)
        },
    },
    {
        "name": "SameTypes",
        "input_parameters": {"arm": {"x": leaf("bool")}, "arm_t": leaf("bool")},
    },
    {"name": "UseStd", "input_parameters": {"std": leaf("string"), "boost": leaf("numbers")}},
    {"name": "Continue"},
    {"name": "move_arm", "type": "async", "output_parameters": {"arm": {"ok": {"pvf_type": "bool"}}}},
    {"name": "X9Y", "description": "日本 \u202e 🙂"},
    {"name": "A" + "b" * 98},
)  # fmt: skip


def graph_of(name: str, *described_as: dict[str, Any]) -> Graph:
    """Actions of these descriptions, one after the other."""
    line = sequence(name, len(described_as))
    actions = tuple(
        msgspec.structs.replace(described(**fields), key=like.key)
        for like, fields in zip(line.actions, described_as, strict=True)
    )
    return msgspec.structs.replace(line, actions=actions)


class Workspace:
    """A folder of packages, and an `ENGINE_LAB` of their own for an engine that knows no others."""

    def __init__(self, folder: Path, lab: Path) -> None:
        self.lab, self._folder = folder / "lab", folder
        self.sources = self.lab / "actions"
        self._installed = folder / "install"
        (self._installed / "lib").mkdir(parents=True)
        self.sources.mkdir(parents=True)
        (self.sources / "lib").symlink_to(self._installed / "lib")
        for name in ("wheels", "prefix"):
            (self.lab / name).symlink_to((lab / name).resolve())

    def write(self, graph: Graph, together: str | None = None) -> list[Path]:
        """The packages of the actions of a graph, or one of all, by the command that people use."""
        file = self._folder / f"{graph.name}.umrf.graph.json"
        file.write_text(codec.write(graph, codec.Stamp("g", "v", None)))
        command = [sys.executable, "-m", "action_assistant", "package", str(file)]
        if together is not None:
            command += ["--together", together]
        subprocess.run([*command, "--output", str(self.sources)], check=True)
        if together is not None:
            return [self.sources / together]
        return [self.sources / snake_case(action.name) for action in graph.actions]

    def build(self, packages: list[Path]) -> None:
        """Compile and install them with their own CMakeLists.txt; raises AssertionError with what
        was said."""
        with ThreadPoolExecutor(2) as pool:
            list(pool.map(self._build, packages))

    def _build(self, package: Path) -> None:
        build = str(self._folder / "build" / package.name)
        install = f"-DCMAKE_INSTALL_PREFIX={self._installed}"
        self._run("cmake", "-S", str(package), "-B", build, install, "-DBUILD_TESTING=OFF")
        self._run("cmake", "--build", build)
        self._run("cmake", "--install", build)
        described = list(package.glob("*.umrf.json"))
        assert described
        for file in described:
            library = file.name.removesuffix(".umrf.json")
            assert (self._installed / "lib" / f"lib{library}.so").exists()
            assert (self._installed / "share" / package.name / file.name).exists()

    def test(self, package: Path) -> None:
        """Run its unit tests; raises AssertionError with what was said."""
        build = str(self._folder / "test" / package.name)
        self._run("cmake", "-S", str(package), "-B", build, "-DBUILD_TESTING=ON")
        self._run("cmake", "--build", build)
        self._run("ctest", "--test-dir", build, "--output-on-failure", "--no-tests=error")

    def _run(self, *command: str) -> None:
        wheels, prefix = self.lab / "wheels", self.lab / "prefix"
        found = f"{prefix}:{wheels}"
        environment = {
            name: value for name, value in os.environ.items() if not name.startswith("PYTHON")
        }
        environment |= {
            "PATH": f"{wheels}/bin:{os.environ['PATH']}",
            "LD_LIBRARY_PATH": f"{prefix}/lib:{wheels}/lib",
            "AMENT_PREFIX_PATH": found,
            "CMAKE_PREFIX_PATH": found,
        }
        done = subprocess.run(
            ["nice", *command], env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout}\n{done.stderr}"


#: Code by which a developer's action reports: a line in the file that the engine is given.
_NOTE: Final = """#include <cstdlib>
#include <fstream>

static void note(const std::string& line)
{
  std::ofstream(std::getenv("ENGINE_TRUTH"), std::ios::app) << line << std::endl;
}

"""


def fill_in(package: Path, *, before: str = "", step: str = "", after: str = "") -> None:
    """Write code into `onRun`, as a developer does: before its steps, in each, and after them."""
    (source,) = (package / "src").glob("*.cpp")
    text = source.read_text()
    places = {
        "namespace ": f"{_NOTE}namespace ",
        "    // In place of this": f"    {before}\n    // In place of this",
        "++step)\n    {\n": f"++step)\n    {{\n      {step}\n",
        "    return actionOk();": f"    {after}\n    return actionOk();",
    }
    for place, changed in places.items():
        assert place in text
        text = text.replace(place, changed, 1)
    source.write_text(text)
