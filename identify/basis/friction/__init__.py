"""Laws of friction: what the torque of a joint has beside that of the rigid bodies."""
