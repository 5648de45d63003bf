"""`python -m action_assistant` is the same as `action-assistant`."""

# pathlib would be looked for in the very folder that must not be looked into.
# ruff: noqa: PTH100, PTH109, PTH120

import os
import site
import sys


def _stay_out_of_the_working_folder() -> None:
    """Import nothing from the folder that somebody happens to be in, here and in whatever we start.

    `python -m` and an empty entry of PYTHONPATH put it before everything else, Python's own modules
    too, so this comes before any of these. Started as `python -P -m` even they are safe: nothing of
    ours can come before Python's search for ourselves.
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
    """Run one command; the exit code. What PYTHONPATH offers is put away before anything of ours is
    imported, and comes back for the runner only, as far as it belongs to ROS 2."""
    from action_assistant import ros_workspace

    ros_workspace.hide()
    from action_assistant.cli import main as command

    return command()


if __name__ == "__main__":  # worker processes import it under another name
    sys.exit(main())
