"""The bench: robots, trajectories and what a robot would log. The only place for MuJoCo and ruckig."""
