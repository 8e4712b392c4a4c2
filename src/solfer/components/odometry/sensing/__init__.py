"""What the odometry measures: joints and IMU as one sequence, and the base's orientation."""
