"""By which connection each edit of a graph came, as the audit has it."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.editor.rooms.batch import SubmittedEdit
from action_assistant.editor.rooms.sittings import EditSittings
from action_assistant.web.audit.events import EditingBegan, is_of_month
from action_assistant.web.auth.caller import Origin, origin_in

WAYS = (None, Origin("Ada", "s1"), Origin("Ada", "s2", address="10.0.0.7"))
STEPS = st.lists(
    st.tuples(
        st.integers(0, 400),  # seconds before it
        st.lists(st.tuples(st.sampled_from(("ada", "ben")), st.sampled_from(WAYS)), max_size=4),
    ),
    max_size=12,
)


@settings(max_examples=60, deadline=None)
@given(STEPS)
def test_each_edit_has_the_connection_of_the_newest_event_before_it(
    steps: list[tuple[int, list[tuple[str, Origin | None]]]],
) -> None:
    now, seq = 1000.0, 0
    sittings = EditSittings()
    began: list[tuple[str, int, Origin | None]] = []  # author, first edit, connection
    edits: list[tuple[str, int, Origin | None]] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("action_assistant.editor.rooms.sittings.time.monotonic", lambda: now)
        for pause, batch in steps:
            now += pause
            submitted = [SubmittedEdit(b"", who, origin=origin) for who, origin in batch]
            for addition in sittings.begun("g", submitted, seq + 1):
                assert is_of_month(addition.stream)
                for draft in addition.drafts:
                    event = msgspec.json.decode(draft.body, type=EditingBegan)
                    began.append((draft.author, event.seq, origin_in(draft.body)))
            for who, origin in batch:
                seq += 1
                edits.append((who, seq, origin))
    for who, at, origin in edits:
        found = [known for author, first, known in began if author == who and first <= at]
        assert (found[-1] if found else None) == origin
    assert len(began) <= len(edits)
