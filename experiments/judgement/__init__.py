"""What to think of a fit: held-out logs, verdicts, and what to check first."""
