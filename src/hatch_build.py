"""Builds the C of the package when it is installed, with the machine's compiler, or that of ziglang (a wheel) if it has none.

IDBENCH_PLATFORM names the platform of a wheel that another machine uses, one of PLATFORMS.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PLATFORMS = {
    "manylinux_2_17_x86_64": "x86_64-linux-gnu.2.17",
    "manylinux_2_17_aarch64": "aarch64-linux-gnu.2.17",
    "macosx_11_0_x86_64": "x86_64-macos.11.0",
    "macosx_11_0_arm64": "aarch64-macos.11.0",
    "win_amd64": "x86_64-windows-gnu",
}
"""Tags of wheels, and what ziglang calls their platforms."""

# No contraction to fused multiply-add: the same bits everywhere where libm has the same.
FLAGS = ["-O2", "-std=c11", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared"]


def compiler(target: str | None) -> list[str] | None:
    """Command of the machine's own compiler; None if it has none, or the code is for another platform."""
    found = None if target or os.name == "nt" else next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    return [found] if found else None


class CustomBuildHook(BuildHookInterface):  # type: ignore[type-arg]  # its name is hatchling's
    """Compiles all C into src/idbench/compiled.so, .dylib or .dll."""

    @property
    def _platform(self) -> str | None:
        platform = os.environ.get("IDBENCH_PLATFORM") or None
        if platform and platform not in PLATFORMS:
            raise ValueError(f"IDBENCH_PLATFORM = {platform!r} must be one of {', '.join(PLATFORMS)}")
        return platform

    def dependencies(self) -> list[str]:
        """What building needs beside hatchling."""
        wheel = self.target_name == "wheel"
        return ["ziglang>=0.13"] if wheel and compiler(self._platform) is None else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and say what the wheel is for."""
        if self.target_name != "wheel":
            return
        root, target = Path(self.root), PLATFORMS[self._platform] if self._platform else None
        kind = self._platform or {"win32": "win", "darwin": "macosx"}.get(sys.platform, "linux")
        suffix = {"w": ".dll", "m": ".dylib", "l": ".so"}["l" if kind.startswith("manylinux") else kind[0]]
        # What is for another platform must not replace what this one uses.
        folder = Path(tempfile.mkdtemp()) if target else root / "src" / "idbench"
        out = folder / ("compiled" + suffix)
        sources = sorted(str(path) for room in ("identify", "sim") for path in (root / room).rglob("*.c"))
        zig = [sys.executable, "-m", "ziglang", "cc", *(["-target", target] if target else [])]
        command = [*(compiler(target) or zig), *FLAGS, *sources, "-o", str(out), *([] if suffix == ".dll" else ["-lm"])]
        newest = max(path.stat().st_mtime for path in [Path(__file__), *map(Path, sources), *(root / "sim").rglob("*.h")])
        if not out.exists() or out.stat().st_mtime < newest:
            subprocess.run(command, check=True)
        tag = self._platform or sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"], build_data["tag"] = False, f"py3-none-{tag}"
        if version == "standard":
            build_data["force_include"][str(out)] = f"idbench/{out.name}"
