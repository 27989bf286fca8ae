"""What a motion must keep: limits of joints, and distance from everything that it could hit."""
