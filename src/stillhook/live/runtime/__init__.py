"""The twin's kernel in a process of its own, at absolute deadlines, with shared memory to the servers."""

from stillhook.live.runtime.board import STATUS, Flag
from stillhook.live.runtime.deadlines import Scheduling
from stillhook.live.runtime.kernel import LATE, Task
from stillhook.live.runtime.sink import Event, EventLog, Sink, StateKeeper, event
from stillhook.live.runtime.twin import LiveTwin, Row

__all__ = [
    "LATE",
    "STATUS",
    "Event",
    "EventLog",
    "Flag",
    "LiveTwin",
    "Row",
    "Scheduling",
    "Sink",
    "StateKeeper",
    "Task",
    "event",
]
