"""Logs with one fault each: which cause does a fit name first?

    uv run python tests/benchmarks/faults.py [ROBOT ...] [--noise 0.5 4] [--seeds 3] [--only NAME ...] [--nulls]

prints, for each fault, noise and seed, whether the first cause that is named is right, how much less likely the log is
than the same without the fault (twice the logarithm of the ratio: below 40 it cannot show the fault), seconds of the
diagnosis, and what is named; with --nulls logs without a fault, which are right where nothing is named.
"""

import argparse
import sys
import time
from itertools import product
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "identify"))

from fault_logs import FAULTS, NULLS, Case

from idbench.identify.judge.suspect import Suspect
from idbench.identify.judge.whole_mistakes import DECISIVE


def _named(cause: str, j: int | None) -> str:
    return f"{cause}{'' if j is None else j + 1}"


def _said(s: Suspect) -> str:
    size, others = " ".join(f"{x:.3g}" for x in s.size), ", ".join(_named(*each) for each in s.alternatives[:4])
    gain = f"{s.held_out[0]:.1f} -> {s.held_out[1]:.1f} %"
    return f"{_named(s.cause, s.joint)} {size} (t {s.t:.1f}, {gain}{f', or {others}' if others else ''})"


def run(case: Case) -> tuple[bool, bool]:
    """Print what is named; return whether it is right, and whether the log can show it."""
    begin = time.perf_counter()
    found = case.found()
    right = found[0].cause in case.causes if found else not case.causes
    took, words = time.perf_counter() - begin, "; ".join(map(_said, found))
    shown = case.shown() if case.causes else 0.0
    line = (
        f"{case.robot:9} {case.noise:4} {case.name:20} {case.seed} {'ok' if right else '--'} {shown:8.0f} {took:.1f} s {words}"
    )
    print(line, flush=True)
    return right, right or shown > DECISIVE


def main(argv: list[str] | None = None) -> None:
    """Run all cases that are asked for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("robots", nargs="*", default=["puma560"])
    parser.add_argument("--noise", nargs="*", type=float, default=[4.0])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", nargs="*", default=list(FAULTS))
    parser.add_argument("--nulls", action="store_true")
    asked = parser.parse_args(argv)
    of_all = product(asked.robots, asked.noise, range(asked.seeds))
    if asked.nulls:
        cases = [Case(r, x, name, seed, FAULTS["none"][0], (), NULLS[name]) for r, x, seed in of_all for name in NULLS]
    else:
        cases = [Case(r, x, name, seed, *FAULTS[name]) for r, x, seed in of_all for name in asked.only]
    right, shown = zip(*map(run, cases), strict=True)
    print(f"right: {sum(right)} of {len(right)}, of {sum(shown)} that their logs can show")


if __name__ == "__main__":
    sys.exit(main())
