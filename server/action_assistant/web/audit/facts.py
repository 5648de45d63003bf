"""The events of the streams of the audit in words, for the logs of both processes."""

from collections.abc import Callable, Mapping
from typing import Final

import msgspec

from action_assistant.journal.events import Event
from action_assistant.kit.moments import moment
from action_assistant.web.audit import events
from action_assistant.web.audit.rows import AuditKind, Fact
from action_assistant.web.auth.keys import PersonRef

_HOW: Final[Mapping[str, str]] = {
    "token": "by the link of the owner",
    "link": "by a link",
    "personal": "by a personal link",
    "device": "on another device",
}
_CONFIRMED: Final[Mapping[str, str]] = {
    "device": "on another device",
    "passkey": "by a passkey",
    "oidc": "by signing in again",
    "command": "by the command line",
}
_REFUSED: Final[Mapping[str, str]] = {
    "start": "was refused a start",
    "change": "was refused a change of a run",
    "go_on": "was refused to let a run go on",
    "answer": "was refused to answer a question of a run",
}
_UNLISTED: Final[Mapping[str, str]] = {
    "strangers_refused": "minutes with refused strangers have no row: there were too many that day",
    "repeated": "refused starts and Stops without effect have no row: there were too many that day",
    "lost": "facts of the audit could not be stored in time",
}
_EVENTS: Final = {
    each.kind: each
    for each in (
        events.EditingBegan,
        events.SignedIn,
        events.SessionEnded,
        events.ViewLinkMade,
        events.ViewLinkRevoked,
        events.EndedHere,
        events.OwnerDid,
        events.PersonStored,
        events.ReleaseTold,
        events.Confirmed,
        events.PasskeyChanged,
        events.StartRefused,
        events.StopPressed,
        events.StrangersRefused,
        events.Unlisted,
        events.AuditDropped,
        events.AuditKept,
    )
}


def described(event: Event, graph_name: Callable[[str], str] = str) -> Fact | None:
    """Return an event of an audit stream in words, None for a kind that only a newer version
    knows. `graph_name` returns the name for the id of a graph. Raise msgspec.DecodeError for a
    body that cannot be read."""
    known = _EVENTS.get(event.kind)
    found = None if known is None else msgspec.json.decode(event.body, type=known)
    match found:
        case events.EditingBegan(graph=graph, seq=seq):
            name = graph_name(graph)
            text = f"edited {name}, from change {seq} on"
            return Fact(kind="edits", text=text, graph=graph, graph_name=name, seq=seq)
        case events.SignedIn() as came:
            text = f"signed in {_HOW.get(came.how, came.how)} as {came.role}"
            person = PersonRef(event.author, came.name)
            return Fact(kind="sessions", text=text, person=person)
        case events.SessionEnded(session=session, own=own):
            text = "signed out" if own else f"ended the session {session}"
            return Fact(kind="sessions", text=text)
        case events.ViewLinkMade() | events.ViewLinkRevoked() as link:
            is_made = isinstance(link, events.ViewLinkMade)
            verb = (
                f"made the link {link.link} to look at"
                if is_made
                else f"revoked the link {link.link} to"
            )
            if link.what == "run":
                return Fact(kind="people", text=f"{verb} a run", run=link.thing)
            name = graph_name(link.thing)
            text = f"{verb} the graph {name}"
            return Fact(kind="people", text=text, graph=link.thing, graph_name=name)
        case events.EndedHere() as end:
            text = f"told this process that the {end.what} {end.id} has ended"
            return Fact(kind="sessions" if end.what == "session" else "people", text=text)
        case events.OwnerDid(what="rules_told"):
            return Fact(kind="graphs", text="told this process who may see which graphs")
        case events.OwnerDid(of=of):
            return Fact(kind="other", text=f"sent a test to the receiver {of}")
        case events.ReleaseTold(version=version, withdrawn=withdrawn):
            what = (
                "the release of version {} was withdrawn" if withdrawn else "version {} is released"
            )
            return Fact(kind="graphs", text=f"told this process that {what.format(version)}")
        case events.PersonStored(name=name, role=role):
            return Fact(kind="people", text=f"told this process that {name} is here as {role}")
        case events.Confirmed(session=session, how=how, refused=is_refused):
            if is_refused:
                text = f"said on another device that it is not they who use the session {session}"
            else:
                text = f"confirmed {_CONFIRMED.get(how, how)} who uses the session {session}"
            return Fact(kind="sessions", text=text)
        case events.PasskeyChanged(name=name, what=what):
            if what == "asked":
                text = f"set to {name} min after what time they are asked again as an owner"
            else:
                text = f"{what} the passkey {name}"
            return Fact(kind="people", text=text)
        case events.StartRefused() as refused:
            return _refused(refused)
        case events.StopPressed(robot=robot, run=run, times=times):
            what = f"on {robot}" if robot else "of a run" if run else "of everything"
            robots = (robot,) if robot else ()
            text = f"pressed Stop {what}{_again(times)}; nothing of this program was going on"
            return Fact(kind="stops", text=text, run=run, robots=robots, times=times)
        case events.StrangersRefused() as strangers:
            noun = "request" if strangers.count == 1 else "requests"
            whence = strangers.address or "this computer"
            text = f"{strangers.count} {noun} from {whence} without a sign-in: {strangers.first}"
            times = strangers.count
            return Fact(kind="strangers", text=text, at=strangers.minute, times=times)
        case events.Unlisted(what=what, count=count):
            kind: AuditKind = "strangers" if what == "strangers_refused" else "other"
            return Fact(kind=kind, text=f"{count} {_UNLISTED[what]}")
        case events.AuditDropped() as dropped:
            return Fact(kind="other", text=_dropped(dropped), is_of_program=True)
        case events.AuditKept(run=run, since=since, until=until):
            text = f"keeps the audit from {_minute(since)} to {_minute(until)} for an incident"
            return Fact(kind="starts", text=text, run=run)
    return None


def _minute(at: int) -> str:
    return f"{moment(at):%Y-%m-%d %H:%M} UTC"


def _dropped(dropped: events.AuditDropped) -> str:
    return (
        f"{dropped.rows} rows of {dropped.stream}, from {_minute(dropped.since)} to "
        f"{_minute(dropped.until)}, were dropped by the setting ({dropped.days:g} days). Their chain "
        f"ended at event {dropped.seq} with {dropped.chain}"
    )


def _again(times: int) -> str:
    return f" ({times} times in that minute)" if times > 1 else ""


def _refused(refused: events.StartRefused) -> Fact:
    what = _REFUSED[refused.what]
    of = f" of {refused.graph_name}" if refused.graph_name else ""
    on = f" on {', '.join(refused.engines)}" if refused.engines else ""
    return Fact(
        kind="refused",
        text=f"{what}{of}{on}{_again(refused.times)}: {refused.why}",
        graph=refused.graph,
        graph_name=refused.graph_name,
        run=refused.run,
        robots=refused.engines,
        times=refused.times,
    )
