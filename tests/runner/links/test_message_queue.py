"""The queue of messages for the event loop is ordered and bounded, and no other message pushes
commands out."""

from action_assistant.runner.links.ros2.message_queue import MessageQueue
from action_assistant.runner.links.ros2.ros_values import LogLine, OverheardCommand, RosValue


def command(graph: str) -> OverheardCommand:
    return OverheardCommand(command="stop", graph=graph, umrf="", targets=("David",), sender="")


def test_messages_are_taken_in_order_and_only_the_first_wakes_the_reader() -> None:
    queue = MessageQueue()
    values: list[RosValue] = [LogLine("a", "1"), command("x"), LogLine("a", "2"), command("y")]
    assert [queue.add(each) for each in values] == [True, False, False, False]
    assert queue.take() == (values, 0, 0)
    assert queue.add(command("z"))
    assert queue.take() == ([command("z")], 0, 0)
    assert queue.take() == ([], 0, 0)


def test_a_flood_of_lines_pushes_out_no_command_and_both_are_bounded_and_counted() -> None:
    queue = MessageQueue()
    queue.add(command("first"))
    for number in range(2_000):
        queue.add(LogLine("a", str(number)))
    taken = queue.take()
    assert taken.values[0] == command("first")
    assert taken.values[-1] == LogLine("a", "1999")
    assert (len(taken.values), taken.dropped, taken.dropped_commands) == (513, 1_488, 0)
    for number in range(600):
        queue.add(command(str(number)))
    taken = queue.take()
    assert taken.values[0] == command("88")
    assert (len(taken.values), taken.dropped, taken.dropped_commands) == (512, 0, 88)
