"""Draws results/peers.svg and writes results/results.md from results/results.csv.

usage: figure.py RESULTS
"""
import csv
import html
import math
import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

# The colours of the program's figures, one a tool; a marker and a dash tell its methods apart
STYLE = {
    "wiperlab-taylor": ("wiperlab, Taylor", "#000000", "o", "-"),
    "wiperlab-runge-kutta": ("wiperlab, Runge-Kutta 8(5,3)", "#000000", "s", "--"),
    "heyoka": ("heyoka (from Python)", "#0072B2", "o", "-"),
    "heyoka-without-python": ("heyoka less Python's share", "#0072B2", "^", ":"),
    "diffsol-tsit45": ("diffsol, Tsitouras 5(4)", "#009E73", "o", "-"),
    "differential-equations-dop853": ("differential-equations, DOP853", "#CC79A7", "o", "-"),
    "differential-equations-dop853-own-roots": ("differential-equations, our root finder", "#CC79A7", "s", "--"),
    "sundials-dormand-prince": ("ARKODE, Dormand-Prince 5(4)", "#D55E00", "o", "-"),
    "sundials-fehlberg": ("ARKODE, Fehlberg 8(7)", "#D55E00", "s", "--"),
    "sundials-verner": ("ARKODE, Verner 6(5)", "#D55E00", "^", "-."),
    "sundials-adams": ("CVODE, Adams", "#C48200", "o", "-"),
    "sundials-bdf": ("CVODE, BDF", "#C48200", "s", "--"),
    "scipy-DOP853": ("SciPy, DOP853 (compiled f)", "#3A97D4", "o", "-"),
    "scipy-RK45": ("SciPy, RK45 (compiled f)", "#3A97D4", "s", "--"),
    "scipy-LSODA": ("SciPy, LSODA (compiled f)", "#3A97D4", "^", "-."),
    "scipy-DOP853-python": ("SciPy, DOP853 (f in Python)", "#3A97D4", "D", "None"),
}
OURS = "wiperlab-taylor"
TARGETS_S = [1e-8, 1e-11]
DRAWN = "three strokes of a light blade, 2,510 transitions; hollow: transitions missed or invented"


def read(path):
    curves = {}
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            point = {"error": float(row["worst_error_s"]), "wall": float(row["wall_s"]), "wrong": int(row["missed"]) + int(row["invented"])}
            curves.setdefault(row["method"], []).append(point | {"tolerance": row["tolerance"], "missed": int(row["missed"]), "invented": int(row["invented"])})
    return curves


def wall_at(points, target):
    """Least time at which the curve, straight between its points on logarithmic axes, has this worst error; and whether the lists of
    transitions on both sides are complete."""
    candidates = [(p["wall"], p["wrong"] == 0) for p in points[:1] if p["error"] <= target]
    for a, b in zip(points, points[1:]):
        if a["error"] > target >= b["error"]:
            share = math.log(a["error"] / target) / math.log(a["error"] / b["error"])
            candidates.append((a["wall"] * (b["wall"] / a["wall"]) ** share, a["wrong"] + b["wrong"] == 0))
    return min(candidates, default=None)


def apart(places, least):
    """Ascending places moved so that neighbours are that far apart, each as near to its own as that leaves it."""
    groups = [[place, 1] for place in places]
    merged = []
    for middle, count in groups:
        merged.append([middle, count])
        while len(merged) > 1 and merged[-1][0] - merged[-2][0] < least * (merged[-1][1] + merged[-2][1]) / 2:
            (m, n), (k, l) = merged.pop(), merged.pop()
            merged.append([(m * n + k * l) / (n + l), n + l])
    return [middle + least * (i - (count - 1) / 2) for middle, count in merged for i in range(count)]


def draw(curves, path):
    """Error over time on the axes of `work-precision.svg`: wiperlab's curves thick, the others thin, each named at its end."""
    matplotlib.rcParams.update({"svg.hashsalt": "peers", "svg.fonttype": "none", "font.size": 9})
    figure, axes = plt.subplots(figsize=(9.5, 6.2), layout="constrained")
    ends = []
    for method, (label, colour, marker, line) in STYLE.items():
        points = [p for p in curves.get(method, []) if p["error"] > 0]
        if not points:
            continue
        ours = method.startswith("wiperlab")
        axes.plot([p["wall"] for p in points], [p["error"] for p in points], color=colour, ls=line, lw=2.6 if ours else 0.9, zorder=3 if ours else 2)
        for p in points:
            face = colour if p["wrong"] == 0 else "white"
            axes.plot(p["wall"], p["error"], marker=marker, ms=6 if ours else 3.5, mec=colour, mfc=face, mew=1, ls="None", zorder=4 if ours else 3)
        end = min(points, key=lambda p: (p["error"], p["wall"]))
        ends.append((math.log10(end["error"]), end, label, colour, ours))
    axes.set(xscale="log", yscale="log", xlabel="wall time of the run, s", ylabel="worst error of a transition's time, s")
    axes.grid(True, which="major", color="#dddddd", lw=0.6)
    axes.set_title(claim(curves) + "\n", fontsize=11, fontweight="bold", loc="left")
    axes.text(0, 1.01, DRAWN, transform=axes.transAxes, va="bottom")
    low, high = (math.log10(end) for end in axes.get_ylim())
    ends.sort(key=lambda end: end[0])
    for place, (_, end, label, colour, ours) in zip(apart([end[0] for end in ends], (high - low) / 26), ends):
        axes.annotate(
            label, (end["wall"], end["error"]), xytext=(1.03, (place - low) / (high - low)), textcoords="axes fraction", va="center",
            color=colour, fontweight="bold" if ours else "normal", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "lw": 0.5, "shrinkA": 0, "shrinkB": 3},
        )  # fmt: skip
    axes.set_ylim(10**low, 10**high)
    figure.savefig(path, metadata={"Date": None})
    name = html.escape(f"{claim(curves)}. {DRAWN}")
    path.write_text(path.read_text().replace("<svg ", f'<svg role="img" aria-label="{name}" ', 1))


def claim(curves):
    """The heading: the times of wiperlab and of the fastest other method for the least target that one of those reaches with complete lists."""
    for target in reversed(TARGETS_S):
        own = wall_at(curves.get(OURS, []), target)
        others = [(wall_at(points, target), method) for method, points in curves.items() if not method.startswith("wiperlab")]
        others = [(found[0], method) for found, method in others if found and found[1]]
        if own and others:
            wall, method = min(others)
            names = f"{STYLE[OURS][0]}, takes {milliseconds(own[0])} ms, {STYLE[method][0]} {milliseconds(wall)} ms"
            return f"To 1e{round(math.log10(target))} s, {names}"
    return "No other method reaches the targets with a complete list of transitions"


def milliseconds(seconds):
    return f"{seconds * 1e3:.3g}" if seconds < 0.1 else f"{seconds * 1e3:,.0f}"


def times(ratio):
    return f"{ratio:.1f}" if ratio < 10 else f"{ratio:.0f}"


def table(curves):
    ours = [wall_at(curves.get(OURS, []), t) for t in TARGETS_S]
    exponents = [f"1e{round(math.log10(t))}" for t in TARGETS_S]
    lines = [
        "Time of the run at equal worst error of a transition's time (interpolated on logarithmic axes), and how many times wiperlab's that is.",
        "`*`: the list of transitions on one side of that error is not complete, which leaves the hardest errors out and flatters the method; `-`: the error is not reached at any tolerance from 1e-4 to 1e-12.",
        "",
        "| method | " + " | ".join(f"at {e} s, ms | times wiperlab's" for e in exponents) + " | complete from tolerance | worst list (missed, invented) |",
        "| --- | " + "--: | --: | " * len(TARGETS_S) + "--: | --: |",
    ]
    for method, (label, *_) in STYLE.items():
        points = curves.get(method)
        if not points:
            continue
        cells = []
        for target, own in zip(TARGETS_S, ours):
            found = wall_at(points, target)
            cells.append(f"{milliseconds(found[0])}{'' if found[1] else '*'}" if found else "-")
            cells.append(times(found[0] / own[0]) if found and own else "-")
        wrong = [i for i, p in enumerate(points) if p["wrong"]]
        after = wrong[-1] + 1 if wrong else 0
        complete = points[after]["tolerance"] if after < len(points) else "never"
        worst = max(points, key=lambda p: p["wrong"])
        cells += [complete, f"{worst['missed']:,}, {worst['invented']:,} at {worst['tolerance']}" if worst["wrong"] else "none"]
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main():
    results = Path(sys.argv[1])
    curves = read(results / "results.csv")
    draw(curves, results / "peers.svg")
    (results / "results.md").write_text(table(curves))


main()
