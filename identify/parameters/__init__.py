"""Which parameters a motion can identify, and which of them bodies can have."""
