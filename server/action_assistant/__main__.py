"""`python -m action_assistant` is the same as `action-assistant`."""

# pathlib would be looked for in the very folder that must not be looked into.
# ruff: noqa: PTH100, PTH109, PTH120

import os
import site
import sys


def _stay_out_of_the_working_folder() -> None:
    """Keep Python from importing modules of the working folder, in this process and all that it
    starts. `python -m` and an empty entry of PYTHONPATH put that folder before Python's own
    modules, so this runs before any import of this program. `python -P -m` is safe from the start.
    """
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        here = os.getcwd()
    except OSError:  # it was deleted
        return
    program = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    if here == program:  # a copy that nobody installed: what we start has to find it, too
        os.environ["PYTHONPATH"] = program
    elif here not in {*site.getsitepackages(), os.path.dirname(os.__file__)}:
        sys.path[:] = [each for each in sys.path if os.path.abspath(each) != here]


_stay_out_of_the_working_folder()


def main() -> int:
    """Run the command that the command line names, and return its exit code. PYTHONPATH is removed
    before any module of this program is imported; the runner gets back the parts that belong to ROS
    2."""
    from action_assistant import ros_workspace

    ros_workspace.hide()
    from action_assistant.cli import main as command

    return command()


if __name__ == "__main__":  # worker processes import it under another name
    sys.exit(main())
