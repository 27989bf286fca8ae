"""Options of the commands: plain dataclasses, each with the name of the function that does its work."""
