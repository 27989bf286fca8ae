"""Recordings for the rerun viewer."""

import os

os.environ.setdefault("RUST_LOG", "off")  # read when rerun is loaded: what goes wrong in it we say ourselves, in one line
