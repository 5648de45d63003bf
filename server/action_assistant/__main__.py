"""`python -m action_assistant` is the same as `action-assistant`."""

import sys

from action_assistant.cli import main

if __name__ == "__main__":  # worker processes import it under another name
    sys.exit(main())
