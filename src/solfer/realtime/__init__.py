"""The real-time layer, in XBotCore's place: executor, life of plugins, scheduling, watchdog, emergency stop."""
