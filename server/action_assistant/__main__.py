"""`python -m action_assistant` is the same as `action-assistant`."""

import sys

from action_assistant.cli import main

sys.exit(main())
