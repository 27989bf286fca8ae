"""Options of the commands: plain dataclasses, each with the name of the function that does its work."""

from importlib import import_module

FILES = ("jobs", "tools")  # Each registers its commands, in the order of the help: first those that people need first

for _file in FILES:
    import_module(f"{__name__}.{_file}")
