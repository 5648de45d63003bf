"""The kinds of messages, with one sentence each, and the form of a message for people and programs."""

import re
from collections.abc import Mapping
from datetime import UTC
from email.header import Header
from email.mime.text import MIMEText
from email.policy import compat32
from email.utils import format_datetime
from string import Formatter
from typing import Any, Final
from urllib.parse import quote

import msgspec
from msgspec.structs import replace

from action_assistant.kit.moments import moment
from action_assistant.safe_text import one_line

#: After which a message is no news any more, and says when it happened.
LATE_US: Final = 24 * 3600 * 1_000_000
_LONGEST: Final = 500  # characters of one fact
_SUBJECT: Final = 150
#: Stands for the name of a graph in messages, which are for many readers.
_RESTRICTED: Final = "a graph that not everybody may see"
_BLANKS: Final = re.compile(r"\s+")


class Kind(msgspec.Struct, frozen=True):
    """A kind of message. `sentence`: for people, with the names of facts in braces. `path`: the place
    on the page, "" for none."""

    sentence: str
    path: str = ""


_RUN: Final = "run {number} of {graph} on {robot}"
#: All kinds of messages.
KINDS: Final[Mapping[str, Kind]] = {
    "run.ended": Kind(f"R{_RUN[1:]} has failed: {{state}}. {{why}}", "/runs/{run}"),
    "run.stop_unconfirmed": Kind(
        f"The Stop of {_RUN} is unconfirmed: {{robot}} may still be moving. {{why}}", "/runs/{run}"
    ),
    "robot.lost": Kind(
        "{lost} {how}, and run {number} of {graph} is not over. {why}", "/runs/{run}"
    ),
    "run.held": Kind(
        f"R{_RUN[1:]} waits for a person, who lets it go on or stops it. {{why}}", "/runs/{run}"
    ),
    "answer.asked": Kind(f"R{_RUN[1:]} waits for the answer of a person. {{why}}", "/runs/{run}"),
    "approval.asked": Kind(
        "{person} asks a second person to say yes to {graph} for {robot}.", "/graphs/{id}"
    ),
    "queue.ready": Kind(
        "It is the turn of {graph} on {robot}, which {person} has put into the queue.",
        "/runs/queue",
    ),
    "server.fault": Kind("The server needs a person. {why}", "/admin"),
    "mention": Kind(
        "{person} has mentioned {people} in a comment on {graph}.", "/graphs/{id}?comment={key}"
    ),
}
#: The kind of a message that an owner sends by hand.
TEST: Final = "test"
_TEST: Final = Kind("This is a test of the receiver {receiver}, sent by {person}.")


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """A message for one receiver. `id`: the same at each try; `at`: when it happened, in
    microseconds UTC; `facts`: the words of its sentence; `left`: the mail addresses that have refused
    it so far while others took it, empty for all."""

    id: str
    kind: str
    at: int
    facts: Mapping[str, Any]
    left: tuple[str, ...] = ()

    @property
    def unnamed(self) -> "Message":
        """Return the message without the name of its graph, and without reasons, which name actions."""
        words = {"graph": _RESTRICTED, "why": ""}
        shown = {name: words.get(name, value) for name, value in self.facts.items()}
        return replace(self, facts=shown)

    @property
    def text(self) -> str:
        """Return the sentence, in one line. Names in it are without control characters, and turn no
        words around them."""
        return _filled(_kind(self.kind).sentence, self.facts, _shown)

    def link(self, page: str) -> str:
        """Return the URL of the place that it is about. `page`: the public URL of the page; "" if
        there is none, which gives no link."""
        path = _kind(self.kind).path
        if not page or not path:
            return ""
        return page + _filled(
            path, self.facts, lambda value: quote(str(value), safe="", errors="replace")
        )


def payload(message: Message, page: str, now: int) -> bytes:
    """Return the body of a webhook: JSON with the fields of Standard Webhooks, and the sentence as
    `text`, which chat programs show. `now`: microseconds UTC."""
    return msgspec.json.encode(
        {
            "type": message.kind,
            "timestamp": moment(message.at),
            "text": _in_time(message, now),
            "data": {
                **message.facts,
                "link": message.link(page),
                "late": now - message.at > LATE_US,
            },
        }
    )


def mail(message: Message, page: str, now: int, *, sender: str, to: tuple[str, ...]) -> bytes:
    """Return the message as a mail. `now`: microseconds UTC; `sender` and `to`: addresses that the
    administrator has set. It is text only, and no name can add a header to it."""
    text = _in_time(message, now)
    happened = moment(message.at).astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    lines = [message.text, "", f"It happened on {happened}."]
    if link := message.link(page):
        lines += ["", link]
    made = MIMEText("\n".join(lines) + "\n", "plain", "utf-8")
    subject = text if len(text) <= _SUBJECT else f"{text[:_SUBJECT]}…"
    # Encoded in any case: `EmailMessage` decodes a name that looks encoded, and then writes its line breaks.
    made["Subject"] = Header(subject, "utf-8")  # type: ignore[assignment]  # compat32 takes one
    made["From"] = sender
    made["To"] = ", ".join(to)
    made["Date"] = format_datetime(moment(now))
    made["Message-ID"] = f"<{quote(message.id, safe='')}@{sender.rpartition('@')[2].strip('> ')}>"
    made["Auto-Submitted"] = "auto-generated"
    return made.as_bytes(policy=compat32.clone(linesep="\r\n"))


def _in_time(message: Message, now: int) -> str:
    """Return the sentence of a message. If the message is older than `LATE_US` at `now` (µs UTC),
    the sentence begins with the time at which it happened."""
    if now - message.at <= LATE_US:
        return message.text
    happened = moment(message.at).astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"Late message, it happened on {happened}: {message.text}"


def _kind(name: str) -> Kind:
    if name == TEST:
        return _TEST
    return KINDS.get(name, Kind(f"{name.capitalize()}."))


def _shown(value: object) -> str:
    text = _BLANKS.sub(" ", one_line(str(value))).strip()
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


def _filled(pattern: str, facts: Mapping[str, Any], shown: Any) -> str:
    """Return a pattern with the facts in their places; missing ones are left out."""
    parts = []
    for text, name, _, _ in Formatter().parse(pattern):
        parts.append(text)
        if name is not None:
            parts.append(shown(facts.get(name) or ""))
    return "".join(parts).strip()
