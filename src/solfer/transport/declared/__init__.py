"""What components declare besides services, on any middleware: topics, actions and parameters."""

from solfer.transport.declared.action_client import ActionClient, Goal
from solfer.transport.declared.binding import bind
from solfer.transport.declared.goals import GoalStatus
from solfer.transport.declared.publications import Publications

__all__ = ["ActionClient", "Goal", "GoalStatus", "Publications", "bind"]
