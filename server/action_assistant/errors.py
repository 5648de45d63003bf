"""Define every refusal of this program, as one tree of exceptions.

    Refused                         400  the request cannot be served
    ├── BadInput                    400  the bytes or values sent are not what the route takes
    │   └── NotUmrf                 422  readable, but not a UMRF graph
    ├── Unauthenticated             401  no valid credentials
    │   └── Withdrawn               401  credentials that were valid until they were revoked
    ├── Forbidden                   403  valid credentials, not allowed
    │   ├── WrongHost               403
    │   └── WrongOrigin             403
    ├── NotFound                    404  no such thing
    ├── Conflict                    409  the thing is not in a state that allows it
    │   └── Overtaken               409  it is another one by now; the same request may be sent again
    ├── TooLarge                    413  over a stated limit
    ├── TooMany                     429  too often
    ├── Misrouted                   502  a proxy sends requests of the other process here
    └── Unavailable                 503  a part that this process needs does not answer
    CannotStart                          the process cannot begin its work; one sentence, exit 2
    ├── AnothersDatabase                 a database that another program made
    └── NewerSchema                      one that a newer version of this program made
    RequestRefused                       a server refused what a command asked; one sentence, exit 1

On the wire, `title` stands for the class and `detail` for one instance.
"""

from typing import ClassVar

from action_assistant.safe_text import sentence


class Refused(Exception):
    """A request that the server refuses. `where` names the place of the fault in the input, if it is known."""

    title: ClassVar[str] = "Request refused"
    status: ClassVar[int] = 400

    def __init__(self, detail: str, *, where: dict[str, object] | None = None) -> None:
        detail = sentence(detail)
        super().__init__(detail)
        self.detail = detail
        self.where = where

    @property
    def type(self) -> str:
        """Return a stable name for programs, for example `not-found`."""
        return _type_of(type(self))


def _type_of(kind: type[Refused]) -> str:
    return "".join(f"-{c.lower()}" if c.isupper() else c for c in kind.__name__).lstrip("-")


def refused_elsewhere(type_: str, detail: str, where: dict[str, object] | None) -> Refused:
    """Return the refusal that another process of this program has answered, by its `type`; Unavailable for a
    type that is unknown here."""
    kinds = [Refused]
    for kind in kinds:  # it grows meanwhile
        if _type_of(kind) == type_:
            return kind(detail, where=where)
        kinds += kind.__subclasses__()
    return Unavailable(detail, where=where)


class BadInput(Refused):
    """The bytes or values sent do not have the form that the route accepts."""

    title = "What was sent cannot be read"


class NotUmrf(BadInput):
    """The input can be read, but is no UMRF graph."""

    title = "Not a UMRF graph"
    status = 422


class Unauthenticated(Refused):
    """The request has no valid credentials."""

    title = "Sign in first"
    status = 401


class Withdrawn(Unauthenticated):
    """The credentials were valid until a person revoked them."""

    title = "Your invitation was revoked"


class Forbidden(Refused):
    """The credentials are valid, but do not allow this request."""

    title = "Not allowed"
    status = 403


class WrongHost(Forbidden):
    """The Host header names a host that this server does not have."""

    title = "Unknown host name"


class WrongOrigin(Forbidden):
    """The page that sent the request is of another origin."""

    title = "Unknown origin"


class NotFound(Refused):
    """The address names nothing that exists."""

    title = "No such thing"
    status = 404


class Conflict(Refused):
    """The object exists, but its state does not allow the request."""

    title = "Not possible in this state"
    status = 409


class Overtaken(Conflict):
    """The object has changed since the request was worked out; nothing was done, and it may be sent again."""

    title = "Others were faster"


class TooLarge(Refused):
    """The input is over a stated limit of size."""

    title = "Too large"
    status = 413


class TooMany(Refused):
    """The client sends more requests than its limit allows."""

    title = "Too many requests"
    status = 429


class Misrouted(Refused):
    """A proxy sends requests here that belong to the other process."""

    title = "A proxy leads to the wrong place"
    status = 502


class Unavailable(Refused):
    """A part that this process needs does not answer."""

    title = "Not available now"
    status = 503


class OutcomeUnknown(Refused):
    """The request may have taken effect or not: its answer was lost."""

    title = "Nobody knows whether it was done"
    status = 504


class CannotStart(Exception):
    """A process or command cannot begin its work, or go on with it; the message gives the reason in one
    sentence."""


class AnothersDatabase(CannotStart):
    """Another program has made the database, so it is left as it is."""


class NewerSchema(CannotStart):
    """A newer version of this program has made the tables of the database."""


class RequestRefused(Exception):
    """A server refused the request of a command. `status`: the HTTP status; 0 if no request was sent.
    `kind`: the `type` of the refusal, if it names one."""

    def __init__(self, why: str, status: int = 0, kind: str = "") -> None:
        super().__init__(why)
        self.status = status
        self.kind = kind
