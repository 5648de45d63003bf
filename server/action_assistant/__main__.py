"""`python -m action_assistant` is the same as `action-assistant`."""

import sys

from action_assistant import sourced


def main() -> int:
    """Run one command; the exit code. What PYTHONPATH offers is put away before anything of ours is
    imported, and comes back for the runner only, as far as it belongs to ROS 2."""
    sourced.hide()
    from action_assistant.cli import main as command

    return command()


if __name__ == "__main__":  # worker processes import it under another name
    sys.exit(main())
