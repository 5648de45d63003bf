"""The editor and the runner, as far as they run: whether they are ours, of one version and one token."""

import ssl
from collections.abc import Iterator
from typing import Final

from action_assistant.commands.doctor.answers import ProcessAnswer, at_port, listens
from action_assistant.commands.doctor.certificate_checks import certificate_fits
from action_assistant.commands.doctor.database_checks import span
from action_assistant.commands.doctor.installation import Installation
from action_assistant.errors import CannotStart
from action_assistant.journal import lock
from action_assistant.share_links import is_ours
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.version import VERSION
from action_assistant.web.auth.keys import Keys
from action_assistant.web.network.certificate import Certificate

_CLOCK_S: Final = 5.0


def processes_fit(place: Installation) -> Iterator[Diagnostic]:
    """What listens at both ports; and who holds the databases."""
    for name, port in place.processes:
        where = f"{place.host}:{port}"
        answer = at_port(place.host, port)
        if answer is not None and answer.version:
            problems = [*_ours(place, name, where, answer)]
            yield from problems
            if not problems:
                yield fine(where, f"The {name} runs there.")
        elif answer is not None or listens(place.host, port):
            yield found(
                "port-taken",
                where,
                f"Another program listens where the {name} should.",
                f"End it (`ss -ltnp 'sport = {port}'` names it), or serve on another --port.",
            )
        else:
            yield fine(where, f"The port is free; no {name} runs there.")
        yield from _held(place, name, runs=bool(answer and answer.version))


def _ours(
    place: Installation, name: str, where: str, answer: ProcessAnswer
) -> Iterator[Diagnostic]:
    if answer.version != VERSION:
        yield found(
            "version-differs",
            where,
            f"The {name} that runs is version {answer.version}, this program is {VERSION}: they may not "
            "understand each other.",
            "Once no robot moves, start it again, so that editor, runner and commands are of one installation.",
        )
    if answer.clock_s is not None and abs(answer.clock_s) > _CLOCK_S:
        yield clock_differs(name, where, answer.clock_s)
    if answer.base.startswith("https"):
        yield from certificate_fits(where, answer.base, Certificate(place.data).trusting_too())
    try:
        keys = Keys.known(place.data)
    except CannotStart:  # told where the token is looked at
        return
    if not is_ours(answer.base, keys, _any_certificate()):
        yield found(
            "token-differs",
            where,
            f"The {name} that runs does not know the token of {place.data}: it has another data "
            "folder, or another ACTION_ASSISTANT_TOKEN.",
            "Name its folder with --data; editor and runner need the same token.",
        )


def clock_differs(name: str, where: str, ahead_s: float) -> Diagnostic:
    """The clock of a process is not ours."""
    way = "ahead of" if ahead_s > 0 else "behind"
    return found(
        "clock-differs",
        where,
        f"The clock of the {name} is {span(ahead_s)} {way} the one here: times of edits, runs and "
        "sessions do not fit together.",
        "Set both clocks by one source (`timedatectl set-ntp true`, chrony), here and there.",
    )


def _held(place: Installation, name: str, *, runs: bool) -> Iterator[Diagnostic]:
    """Who holds the lock of a database, if that is not the process that answers."""
    file = place.data / f"{name}.db"
    holder = lock.holder(file)
    if holder is None:
        return
    if not lock.is_program(holder.pid):
        yield found(
            "journal-held",
            f"{file}.lock",
            f"Process {holder}, which is not this program, holds the lock of the database: the {name} "
            "does not start.",
            f"Look what it is (`ps -p {holder.pid}`), and end it.",
        )
    elif not runs:
        yield found(
            "served-elsewhere",
            f"{file}.lock",
            f"Process {holder} of this program holds the database, and does not answer at port "
            f"{dict(place.processes)[name]}: it serves at another one, or hangs.",
            f"Name its port with --port; if it hangs, see that no robot moves, end it (`kill {holder.pid}`) "
            "and start anew.",
        )


def _any_certificate() -> ssl.SSLContext:
    """For a challenge, with which nothing secret is sent; certificates are looked at by themselves."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context
