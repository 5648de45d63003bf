"""Choice of the Python that runs the runner: rclpy works only for the one that it was built for."""

import hashlib
import importlib.util
import os
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Literal, TypeAlias

import msgspec

from action_assistant import paths, ros_workspace
from action_assistant.errors import CannotStart
from action_assistant.ros_workspace import Workspace

VARIABLE: Final = "ACTION_ASSISTANT_RUNNER_PYTHON"
#: Variables that a sourced ROS 2 sets. The wheels of `make ros` must not see them.
_SOURCED: Final = ("PYTHONPATH", "AMENT_PREFIX_PATH", "COLCON_PREFIX_PATH", "LD_LIBRARY_PATH")
#: Says that this interpreter has been started anew for the wheels; meant for no other one.
_ANEW: Final = "_ROS_WHEELS_BOOTSTRAP_COMPLETE"

Origin: TypeAlias = Literal["named", "this", "wheels"]


class Interpreter(msgspec.Struct, frozen=True, kw_only=True):
    """A Python interpreter and its origin: named in the environment, the running one, or the one
    that `make ros` made. `remark`: a sentence for people about what could be better."""

    path: Path
    origin: Origin
    remark: str = ""

    def environment(self, environ: Mapping[str, str]) -> dict[str, str]:
        """Return `environ` without the variables that mislead this interpreter, such as those of a
        sourced ROS for the interpreter of `make ros`."""
        drop = {
            "this": (),
            "named": (_ANEW,),
            "wheels": (_ANEW, *(_SOURCED if "AMENT_PREFIX_PATH" in environ else ())),
        }[self.origin]
        return {name: value for name, value in environ.items() if name not in drop}


def for_runner(environ: Mapping[str, str] = os.environ) -> Interpreter:
    """Return the Python interpreter for the runner, the first that exists of these: the program
    that the variable `VARIABLE` names; the running interpreter, if it finds an rclpy that fits; the
    one that `make ros` made, if it is up to date. If there is none, return the running interpreter
    with a remark that says what does not fit. Raise CannotStart if `VARIABLE` names something that
    is not a program."""
    named = environ.get(VARIABLE)
    if named:
        path = Path(named)
        if not os.access(path, os.X_OK) or path.is_dir():
            raise CannotStart(f"{VARIABLE} is {named!r}, which is no program.")
        return Interpreter(path=path, origin="named")
    this = Path(sys.executable)
    if rclpy_fits(environ):
        return Interpreter(path=this, origin="this")
    remark = Workspace.of(environ).other_python()
    wheels = paths.wheels()
    if wheels is None or not (wheels / "bin" / "python").exists():
        return Interpreter(path=this, origin="this", remark=remark)
    if not is_current(wheels):
        stale = f"{wheels} was made for another version of this program; `make ros` renews it."
        return Interpreter(path=this, origin="this", remark=f"{remark} {stale}".strip())
    if remark:
        remark += f" Until then robots are reached with what `make ros` made, in {wheels}."
    return Interpreter(path=wheels / "bin" / "python", origin="wheels", remark=remark)


def rclpy_fits(environ: Mapping[str, str] = os.environ) -> bool:
    """Return whether this interpreter finds an rclpy that was built for it: its own, or that of the
    ROS workspace that `environ` names. The call imports nothing."""
    own = importlib.util.find_spec("rclpy")
    if own is not None and ros_workspace.rclpy_fits(own):
        return True
    return Workspace.of(environ).rclpy() is not None


def is_current(wheels: Path) -> bool:
    """Return whether the environment of `make ros` (the folder `wheels`) has the packages that this
    checkout asks for. An outdated environment may lack a package and would not even start."""
    try:
        made_for = (wheels / ".done").read_text().strip()
        asked = (wheels.parent / "requirements" / "ros.txt").read_bytes()
    except OSError:
        return False
    return made_for == hashlib.sha256(asked).hexdigest()
