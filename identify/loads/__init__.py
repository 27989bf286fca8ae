"""What the arm carries: payloads, and the gains of drives that a known one gives."""
