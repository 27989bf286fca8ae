"""Motions that tell parameters well, found before anything moves."""
