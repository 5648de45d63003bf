"""Every refusal of this program, as one tree of exceptions.

    Refused                         400  something was asked that cannot be done
    ├── BadInput                    400  the bytes or values sent are not what the route takes
    │   └── NotUmrf                 422  readable, but not a UMRF graph
    ├── Unauthenticated             401  no valid credentials
    │   └── Withdrawn               401  credentials that were valid until they were revoked
    ├── Forbidden                   403  valid credentials, not allowed
    │   ├── WrongHost               403
    │   └── WrongOrigin             403
    ├── NotFound                    404  no such thing
    ├── Conflict                    409  the thing is not in a state that allows it
    ├── TooLarge                    413  over a stated limit
    ├── TooMany                     429  too often
    ├── Misrouted                   502  a proxy leads here what is the other process's
    └── Unavailable                 503  something this process needs does not answer
    CannotStart                          the process cannot begin its work; one sentence, exit 2
    ├── AnothersDatabase                 a database that another program made
    └── NewerSchema                      one that a newer version of this program made

The class docstring is the title on the wire, the instance's message the detail.
"""

from typing import ClassVar

from action_assistant.safe_text import sentence


class Refused(Exception):
    """Request refused"""

    status: ClassVar[int] = 400

    def __init__(self, detail: str, *, where: dict[str, object] | None = None) -> None:
        detail = sentence(detail)
        super().__init__(detail)
        self.detail = detail
        self.where = where

    @property
    def type(self) -> str:
        """A stable name for programs, e.g. `not-found`."""
        name = type(self).__name__
        return "".join(f"-{c.lower()}" if c.isupper() else c for c in name).lstrip("-")

    @property
    def title(self) -> str:
        """One line that fits every instance of the class."""
        return (type(self).__doc__ or "Refused").strip().splitlines()[0].rstrip(".")


class BadInput(Refused):
    """What was sent cannot be read"""


class NotUmrf(BadInput):
    """Not a UMRF graph"""

    status = 422


class Unauthenticated(Refused):
    """Sign in first"""

    status = 401


class Withdrawn(Unauthenticated):
    """Your invitation was revoked"""


class Forbidden(Refused):
    """Not allowed"""

    status = 403


class WrongHost(Forbidden):
    """Unknown host name"""


class WrongOrigin(Forbidden):
    """Unknown origin"""


class NotFound(Refused):
    """No such thing"""

    status = 404


class Conflict(Refused):
    """Not possible in this state"""

    status = 409


class TooLarge(Refused):
    """Too large"""

    status = 413


class TooMany(Refused):
    """Too many requests"""

    status = 429


class Misrouted(Refused):
    """A proxy leads to the wrong place"""

    status = 502


class Unavailable(Refused):
    """Not available now"""

    status = 503


class OutcomeUnknown(Refused):
    """Nobody knows whether it was done"""

    status = 504


class CannotStart(Exception):
    """The process cannot begin its work; the message says why in one sentence."""


class AnothersDatabase(CannotStart):
    """Another program has made the database, so it is left as it is."""


class NewerSchema(CannotStart):
    """A newer version of this program has made the tables of the database."""
