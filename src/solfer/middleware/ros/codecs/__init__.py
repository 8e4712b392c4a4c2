"""ROS messages to named numbers and back."""
