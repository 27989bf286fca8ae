"""Plain English: idioms that sound translated stay out of pages, messages, docstrings and names."""

import re
import subprocess

IDIOMS = {
    r"see to\b": "check",
    r"\bno noise\b": "is not noise; noise-free",
    r"bodies that can exist": "physically consistent",
    r"\bsurely\b": "significantly",
    r"for the curious": "",
    r"\b(row|equation|joint|simulation) an instant": "per instant",
    r"\bone a joint": "one per joint",
    r"\bwhat is left\b": "the residual",
    r"what no motion": "unidentifiable",
    r"tells? (its|the|their) parameters": "excites",
    r"tells? (well|most|all)\b": "excites",
    r"was told": "",
    r"\bhonest\b": "calibrated",
    r"at the most\b": "at most",
    r"that of the median": "relative to the median",
    r"hang together": "correlated",
    r"unseen motion|has not seen": "held-out",
    r"delay denied": "assuming no delay",
    r"law that was found": "estimated law",
    r"stands beside what": "flags a value",
    r"nothing tells why": "the residuals hide their cause",
    r"sticks? out": "is above",
    r"torque of an ampere": "torque constant",
    r"chance would have": "significant",
    r"floor counts": "floor assumed at",
    r"twice what it is there": "doubling",
    r"holds? the motion back": "active limit",
    r"\bhangs on (the|its|what)\b": "depends on",
    r"leaves? over\b": "residual",
    r"(stands|turns) or (turns|stands)": "rests or reverses",
    r"knows? better": "less noisy",
    r"stands twice": "is given twice",
    r"\b(is|are) told\b": "is reported",
}
"""Each with what to say instead."""


def test_idioms_that_sound_translated_stay_out(root):
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True, check=False).stdout.split("\n")
    files = [root / name for name in listed if name.endswith((".py", ".md", ".toml", ".j2")) and "results/" not in name]
    assert len(files) > 500
    found = []
    for path in files:
        if path.name == "test_words.py" or not path.is_file():
            continue
        for number, line in enumerate(path.read_text().split("\n"), 1):
            for idiom, better in IDIOMS.items():
                if re.search(idiom, line, re.IGNORECASE):
                    found.append(f"{path.relative_to(root)}:{number}: {idiom} (better: {better}): {line.strip()[:80]}")
    assert not found, "\n".join(found)
