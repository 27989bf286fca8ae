"""Experiments: what joins simulation and identification, prints the answer and records it."""
