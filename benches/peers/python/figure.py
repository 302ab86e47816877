"""Draws results/peers.svg and writes results/results.md from results/results.csv.

usage: figure.py RESULTS
"""
import csv
import math
import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402

# Okabe and Ito's colours, one a tool; a marker and a dash tell its methods apart
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
    "sundials-adams": ("CVODE, Adams", "#E69F00", "o", "-"),
    "sundials-bdf": ("CVODE, BDF", "#E69F00", "s", "--"),
    "scipy-DOP853": ("SciPy, DOP853 (compiled f)", "#56B4E9", "o", "-"),
    "scipy-RK45": ("SciPy, RK45 (compiled f)", "#56B4E9", "s", "--"),
    "scipy-LSODA": ("SciPy, LSODA (compiled f)", "#56B4E9", "^", "-."),
    "scipy-DOP853-python": ("SciPy, DOP853 (f in Python)", "#56B4E9", "D", "None"),
}
OURS = "wiperlab-taylor"
TARGETS_S = [1e-8, 1e-11]


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


def draw(curves, path):
    matplotlib.rcParams.update({"svg.hashsalt": "peers", "svg.fonttype": "none", "font.size": 9})
    figure, axes = plt.subplots(figsize=(9.5, 6.2), layout="constrained")
    for method, (label, colour, marker, line) in STYLE.items():
        points = [p for p in curves.get(method, []) if p["error"] > 0]
        if not points:
            continue
        axes.plot([p["error"] for p in points], [p["wall"] for p in points], color=colour, ls=line, lw=1.2, zorder=2)
        for p in points:
            face = colour if p["wrong"] == 0 else "white"
            axes.plot(p["error"], p["wall"], marker=marker, ms=5, mec=colour, mfc=face, ls="None", zorder=3)
        axes.plot([], [], color=colour, ls=line, marker=marker, ms=5, label=label)
    axes.set(xscale="log", yscale="log", xlabel="worst error of a transition's time, s", ylabel="wall time of the run, s")
    axes.set_title("Three strokes of a light blade, 2,510 transitions: time against error\n(hollow: transitions missed or invented)", fontsize=10)
    axes.grid(True, which="major", color="#dddddd", lw=0.6)
    axes.invert_xaxis()
    axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.savefig(path, metadata={"Date": None})


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
