"""Links between the runner and engines."""

import importlib
import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from typing import Final

from action_assistant import ros_workspace
from action_assistant.runner.links.port import Reach
