"""Places of the files that this program carries, and of those that it keeps."""

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parent.parent


def _carried(name: str, in_checkout: Path) -> Path:
    """Return the folder `in_checkout` if this program runs from a checkout, else the folder `name`
    inside the installed package."""
    return in_checkout if (_CHECKOUT / "pyproject.toml").is_file() else _PACKAGE / name


def migrations() -> Path:
    """Return the folder of the Alembic scripts, which change the tables of a database."""
    return _carried("migrations", _CHECKOUT / "migrations")


def page() -> Path:
    """Return the folder of the built page. The folder does not exist if the page was not built."""
    return _carried("static", _CHECKOUT / "frontend" / "dist")


def page_sources() -> Path | None:
    """Return the folder of the page's sources in a checkout; None outside of one."""
    return _CHECKOUT / "frontend" / "src" if checkout() is not None else None


def checkout() -> Path | None:
    """Return the top folder of the checkout from which this program runs; None if it runs from an
    installed package."""
    return _CHECKOUT if (_CHECKOUT / "pyproject.toml").is_file() else None


def help_site() -> Path:
    """Return the folder of the built documentation. The folder does not exist if the documentation
    was not built."""
    return _carried("help", _CHECKOUT / "build" / "help")


def wheels() -> Path | None:
    """Return the folder of the Python environment that `make ros` makes in a checkout; None if this
    program does not run from a checkout."""
    return _CHECKOUT / ".venv-ros" if checkout() is not None else None


def examples() -> Path:
    """Return the folder of the example graphs that a new user gets."""
    return _PACKAGE / "examples"


def data() -> Path:
    """Return the default data folder: ACTION_ASSISTANT_DATA, else a folder in the user's XDG data
    directory."""
    named = os.environ.get("ACTION_ASSISTANT_DATA")
    if named:
        return Path(named)
    base = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(base) / "temoto-action-assistant"


def config() -> Path:
    """Return the folder of this user's settings, in their XDG configuration directory."""
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "temoto-action-assistant"
