"""Some messages are sent to a socket at once; others wait their turn."""

from action_assistant.editor.crdt import messages
from action_assistant.editor.rooms.member import Member
from action_assistant.web.auth.keys import Person
from action_assistant.web.server.direct import framed

NEWS = framed(messages.change(b"\x00\x00"))


def writing(*, acks: bool = True) -> tuple[Member, list[bytes]]:
    """A member in sync whose socket takes everything, and what was written to it."""
    written: list[bytes] = []
    member = Member(Person("ada", "Ada"), acks=acks)
    member.synced = True
    member.write_now = lambda data: written.append(data) is None
    return member, written


async def test_an_acknowledgement_goes_in_one_write_with_the_news() -> None:
    member, written = writing()
    member.edit_handled()
    assert member.send_now(NEWS, 7)
    assert written == [NEWS + framed(messages.acks(1, 7))]


async def test_a_moment_is_acknowledged_only_once() -> None:
    member, written = writing()
    assert member.send_now(b"", 7)
    assert member.send_now(b"", 7)
    member.post_ack(7)
    assert (len(written), member.has_news) == (1, False)


async def test_an_acknowledgement_never_overtakes_what_waits() -> None:
    member, written = writing()
    member.post(messages.BEAT)
    assert not member.send_now(NEWS, 7)
    member.post(messages.change(b"\x00\x00"))
    member.post_ack(7)
    assert written == []
    assert member.gather() == [messages.BEAT, messages.change(b"\x00\x00"), messages.acks(0, 7)]


async def test_news_that_could_not_be_written_is_sent_later() -> None:
    member, _ = writing()
    member.write_now = lambda _: False
    assert not member.send_now(NEWS, 7)
    member.post_ack(7)
    assert member.gather() == [messages.acks(0, 7)]


async def test_a_client_without_acknowledgements_gets_only_the_updates() -> None:
    member, written = writing(acks=False)
    assert member.send_now(NEWS, 7)
    assert written == [NEWS]
