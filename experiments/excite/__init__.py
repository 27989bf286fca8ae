"""Motions that tell parameters well, for any robot: `idbench excite`."""
