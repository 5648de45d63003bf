"""A name in a message stays a name: it adds no line, no header, and turns no words."""

from email import message_from_bytes, policy
from email.message import EmailMessage

import msgspec
from hypothesis import example, given
from hypothesis import strategies as st

from action_assistant.web.notifications.messages import KINDS, Message, mail, payload
from web.notifications.receiving import NOW, failed_run

DAY = 24 * 3600 * 1_000_000
HEADERS = {"subject", "from", "to", "date", "message-id", "auto-submitted", "mime-version"}
HEADERS |= {"content-type", "content-transfer-encoding"}


def _read(raw: bytes) -> EmailMessage:
    found = message_from_bytes(raw, policy=policy.default)
    assert isinstance(found, EmailMessage)
    return found


@given(st.text(max_size=400), st.sampled_from(sorted(KINDS)))
@example("Fetch\r\nBcc: all@example.org\r\n\r\nHello", "run.ended")
@example("\u202egnp.exe", "mention")
@example("\ud800", "mention")
@example("=?utf-8?q?x=0d=0aBcc:_a@b.c?=", "mention")
@example("שלום", "run.held")
def test_no_name_adds_a_header_or_a_line(name: str, kind: str) -> None:
    facts = dict.fromkeys(
        ("graph", "robot", "lost", "person", "people", "why", "run", "id", "key"), name
    )
    message = Message(id="a:1:lab", kind=kind, at=NOW, facts=facts)
    raw = mail(message, "https://a.org", NOW, sender="r@example.org", to=("lab@example.org",))
    read = _read(raw)
    assert {each.lower() for each in read} == HEADERS
    assert read["to"] == "lab@example.org"
    lines = read.get_content().splitlines()
    assert lines[0] == message.text
    assert len(lines) == (5 if message.link("https://a.org") else 3)
    assert not {"\n", "\r", "\u202e", "\x1b"} & set(message.text)
    if not any(0xD800 <= ord(c) < 0xE000 for c in name):
        msgspec.json.decode(payload(message, "", NOW))


def test_an_old_message_says_when_it_happened() -> None:
    now = NOW + 2 * DAY
    body = msgspec.json.decode(payload(failed_run(), "", now))
    assert body["text"].startswith("Late message, it happened on 2027-01-15 08:00 UTC: Run 12")
    assert body["data"]["late"] is True
    raw = mail(failed_run(), "", now, sender="r@example.org", to=("lab@example.org",))
    assert str(_read(raw)["subject"]).startswith("Late message")


def test_every_kind_is_a_sentence_of_its_facts() -> None:
    for name, kind in KINDS.items():
        assert kind.sentence.strip().endswith((".", "{why}")), name
        assert Message(id="a", kind=name, at=0, facts={}).text
