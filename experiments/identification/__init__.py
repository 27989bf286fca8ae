"""One identification: robot, logs, estimates, their judgement, warnings and files."""
