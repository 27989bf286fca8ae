"""What identification is given: logs, and the kinematics of a robot."""
