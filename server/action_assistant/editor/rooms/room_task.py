"""What every task of a room begins with."""

from action_assistant.editor.log.graph_events import graph_of
from action_assistant.logs.context import begin
from action_assistant.web.auth.caller import done_for_nobody


def begin_room_task(stream: str) -> None:
    """From here on this task is done for nobody, since whoever came first may leave, and what it logs is
    about the graph of this stream."""
    done_for_nobody()
    begin({"graph": graph_of(stream) or stream})
