"""The stand-in for XBotCore: shared memory between processes, without ROS."""
