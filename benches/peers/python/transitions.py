"""Lists of transitions and how far two of them are apart."""
import csv
from dataclasses import dataclass
from pathlib import Path
from statistics import median


@dataclass
class Transition:
    time_s: float
    kind: str


def read(path):
    with open(path, newline="") as file:
        return [Transition(float(row["time_s"]), f"{row['from']} {row['to']}") for row in csv.DictReader(file)]


def write(path, transitions):
    """Writes (time, from, to) rows with 17 significant digits."""
    lines = ["time_s,from,to"] + [f"{t:.17g},{a},{b}" for t, a, b in transitions]
    Path(path).write_text("\n".join(lines) + "\n")


@dataclass
class Comparison:
    worst_s: float
    median_s: float
    missed: int
    invented: int


def compare(found, reference):
    """Every reference transition owns the time from halfway to the one before to halfway to the one after.

    The nearest transition of its kind found there matches it; without one it is missed, and what matches nothing is invented.
    """
    errors, matched, cursor = [], 0, 0
    for i, expected in enumerate(reference):
        low = (reference[i - 1].time_s + expected.time_s) / 2 if i > 0 else float("-inf")
        high = (reference[i + 1].time_s + expected.time_s) / 2 if i + 1 < len(reference) else float("inf")
        while cursor < len(found) and found[cursor].time_s < low:
            cursor += 1
        inside = cursor
        distances = []
        while inside < len(found) and found[inside].time_s < high:
            if found[inside].kind == expected.kind:
                distances.append(abs(found[inside].time_s - expected.time_s))
            inside += 1
        cursor = inside
        if distances:
            errors.append(min(distances))
            matched += 1
    nothing = float("nan")
    return Comparison(max(errors, default=nothing), median(errors) if errors else nothing, len(reference) - matched, len(found) - matched)
