#!/usr/bin/python3
"""Displacement relative to the affine one, answering P's Figs. 2.6 and 2.7: fluctuations.py RUNS-FOLDER [FROM:TO...]

One panel per scheme that has run (I, II, III, ours) with seed 1, one row per window of axial strain (0:0.02 0:0.05
0.05:0.1), for 983 and, where they are, 3970 disks. In each panel: the correlation of its arrows with those of the benchmark III (of ours
where there is no III). Needs python3-h5py, python3-matplotlib."""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
import talus

STRETCH = 3  # of displacements over a window of 5 %


def fluctuation(run, window):
    """First centres [n, 2] and displacements relative to the affine one [n, 2]; None before the run has come so far."""
    first, last = (run.frame(strain=s) for s in window)
    if abs(last.axial_strain - first.axial_strain - window[1] + window[0]) > 0.2 * (window[1] - window[0]):
        return None
    return first.centres, talus.relative_to_affine(first, last)


def correlation(a, b):
    return np.sum(a * b) / np.sqrt(np.sum(a * a) * np.sum(b * b))


def draw(runs, windows, path):
    found = [(w, {name: f for name, run in runs.items() if (f := fluctuation(run, w))}) for w in windows]
    found = [(w, panels) for w, panels in found if len(panels) > 1]
    if not found:
        return
    columns = max(len(panels) for _, panels in found)
    figure, axes = plt.subplots(len(found), columns, figsize=(4.2 * columns, 7.5 * len(found)), squeeze=False)
    for row, (window, panels) in zip(axes, found):
        reference = panels.get("III") or panels["ours"]
        for axis in row:
            axis.axis("off")
        for axis, (name, (centres, moved)) in zip(row, panels.items()):
            stretch = 0.05 / (window[1] - window[0]) * STRETCH
            axis.quiver(*centres.T, *(stretch * moved.T), angles="xy", scale_units="xy", scale=1, width=0.0025)
            axis.set_aspect("equal")
            axis.set_title(f"{name}, {100 * window[0]:g} to {100 * window[1]:g} % strain\n"
                           f"correlation {correlation(moved, reference[1]):.2f}, arrows × {stretch:g}", fontsize=11)
    figure.tight_layout()
    figure.savefig(path, dpi=90)
    plt.close(figure)
    print(path)


def main():
    folder = Path(sys.argv[1])
    windows = [tuple(map(float, w.split(":"))) for w in sys.argv[2:] or ("0:0.02", "0:0.05", "0.05:0.1")]
    (folder / "figures").mkdir(exist_ok=True)
    for prefix in ("", "big-"):
        runs = {name: talus.Run(folder / f"{prefix}{name}-1") for name in ("I", "II", "III", "ours")
                if (folder / f"{prefix}{name}-1" / "fields").is_dir()}
        draw(runs, windows, folder / "figures" / f"{prefix}fluctuations.png")


main()
