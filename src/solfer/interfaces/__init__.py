"""What components offer to others and need of them: declarations, ports, and the messages that they share."""
