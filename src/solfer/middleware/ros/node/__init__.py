"""The rospy node of a process: start, options, clock, master, logs, end."""
