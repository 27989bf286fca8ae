"""Payloads, and gains of drives: from logs, and from simulated robots whose payload and gains are known."""
