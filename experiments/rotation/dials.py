#!/usr/bin/env python3
"""Share, length and reach of transmission against pressure, friction and exponent: dials.py OUT, from the summaries that
run.sh left in OUT/ensemble and OUT/dials. Prints the README's table, draws OUT/dials.png (python3-matplotlib)."""
import pathlib
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROWS = {
    "share that transmits (5 %)": "share that transmits",
    "load on those, of <f>": "load on those, mean contact forces",
    "decay length, mean": "decay length, mean diameters",
    "influence radius, mean": "influence radius, mean diameters",
    "correlation with W": "correlation with W",
    "slope on W, both at once": "slope on W, both at once",
    "slope on chains across": "slope on chains across",
}
DIALS = [("stages.0.pressure", "pressure [kPa]", 1e-3, 100e3), ("material.friction", "friction", 1, 0.45),
         ("contact.exponent", "exponent", 1, 20)]


def read(path):
    """Label -> (value, low, high) of a summary of `talus rotation`."""
    number = r"(-?[0-9.]+)"
    lines = re.findall(rf"^ *(\S.*?) {{2,}}{number} +\[{number}, {number}\]", path.read_text(), re.M)
    return {label: tuple(map(float, values)) for label, *values in lines}


def main(out):
    at_rest = read(out / "ensemble/summary.txt")
    runs = {}
    for path in sorted(out.glob("dials/*=*/summary.txt")):
        key, value = path.parent.name.split("=")
        runs[key, float(value)] = read(path)
    names = [(key, value) for key, *_ in DIALS for k, value in sorted(runs) if k == key]
    print("| | as above |", " | ".join(f"{key.split('.')[-1]} {value:g}" for key, value in names), "|")
    print("|---" * (len(names) + 2) + "|")
    for label, words in ROWS.items():
        cells = [run.get(label) for run in [at_rest] + [runs[name] for name in names]]
        print(f"| {words} |", " | ".join("" if c is None else "%.2f [%.2f, %.2f]" % c for c in cells), "|")

    shown = list(ROWS)[0], list(ROWS)[2], list(ROWS)[4]
    figure, axes = plt.subplots(len(shown), len(DIALS), figsize=(9, 7), sharey="row", constrained_layout=True)
    for row, label in zip(axes, shown):
        for axis, (key, name, scale, usual) in zip(row, DIALS):
            points = sorted([(usual, at_rest)] + [(v, run) for (k, v), run in runs.items() if k == key], key=lambda p: p[0])
            points = [(x * scale, *run[label]) for x, run in points if label in run]
            x, y, low, high = zip(*points)
            axis.errorbar(x, y, [[b - a for a, b in zip(low, y)], [b - a for a, b in zip(y, high)]], fmt="o-", capsize=3)
            axis.set(xscale="log", xticks=x, xticklabels=[f"{v:g}" for v in x])
            axis.minorticks_off()
            if axis in axes[-1]:
                axis.set_xlabel(name)
        row[0].set_ylabel(ROWS[label], fontsize=9)
        row[0].set_ylim(0, 1.05 * max(line.get_ydata().max() for axis in row for bar in axis.containers for line in bar[1]))
    figure.savefig(out / "dials.png", dpi=120)


main(pathlib.Path(sys.argv[1]))
