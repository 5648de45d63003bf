"""Modules of the standard library that only POSIX systems have; None elsewhere. Nobody else imports
them, so that every module of ours can be imported on Windows."""

import importlib
from typing import Any, Final


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


fcntl: Final = _module("fcntl")
pwd: Final = _module("pwd")
resource: Final = _module("resource")
