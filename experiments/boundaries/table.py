"""The tables of this experiment from the runs that are there: table.py RUNS; Markdown, printed and kept in RUNS/table.md.

Mean +- standard error over the samples; differences from `pressure` are of the same sample, in which all boundaries start
from the same state."""
import sys
from pathlib import Path

import numpy as np

import measures
from figures import ORDERS, SIZES

PERCENT = 100
QUANTITIES = (
    ("peak volumetric strain [%]", lambda run: PERCENT * measures.peak(run)[0]),
    ("axial strain there [%]", lambda run: PERCENT * measures.peak(run)[1]),
    ("least volumetric strain [%]", lambda run: PERCENT * measures.curve(run)[1].min()),
    ("volumetric strain at 19-20 % [%]", lambda run: PERCENT * mean(run, measures.curve(run), 0.19, 0.20)),
    ("dilation by solid fraction at 19-20 % [%]", lambda run: PERCENT * mean(run, measures.dilation(run), 0.19, 0.20)),
    ("local peaks of the volumetric strain", lambda run: len(measures.local_peaks(run))),
    ("the first from 5 % on, at [%]", lambda run: PERCENT * local_peak(run, 0.05)),
    ("stress ratio, 1-3 %", lambda run: mean(run, measures.curve(run, "stress_ratio"), 0.01, 0.03)),
    ("stress ratio, 15-20 %", lambda run: mean(run, measures.curve(run, "stress_ratio"), 0.15, 0.20)),
    ("localisation, 10-14 %", measures.localisation),
    ("persistence, 10-12-14 %", measures.persistence),
    ("p near the ends", lambda run: stresses(run)[0]),
    ("p near the sides", lambda run: stresses(run)[1]),
    ("variation of p", lambda run: stresses(run)[2]),
    ("strain-rate error / rate", measures.rate_error),
    ("shape index, 5 %", lambda run: shape(run, 0.05)),
    ("shape index, 10 %", lambda run: shape(run, 0.10)),
    ("shape index, 20 %", lambda run: shape(run, 0.20)),
    ("turn at 20 % [degrees]", lambda run: turn(run, 0.20)),
    ("most grains outside", lambda run: measures.rows(run)["outside"].max()),
    ("ledger's residual", lambda run: run.series["energy_residual"][-1]),
    ("CPU per step / pressure", None),
    ("CPU to 20 % / pressure", None),
)
kept = {}


def mean(run, curve, begin, end):
    """Mean of a curve over a window of axial strain."""
    strain, value = curve
    inside = (strain >= begin * measures.scale(run)) & (strain <= end * measures.scale(run))
    return value[inside].mean() if inside.any() else np.nan


def local_peak(run, begin):
    found = [s for s in measures.local_peaks(run) if s >= begin * measures.scale(run)]
    return found[0] if found else np.nan


def stresses(run):
    if run.folder not in kept:
        kept[run.folder] = measures.concentration(run)
    return kept[run.folder]


def shape(run, strain):
    return measures.shape(run, *measures.frames(run, (strain,)))


def turn(run, strain):
    """Size of the rotation in the mean deformation gradient of the first loop."""
    first, last = run.begin(measures.STAGE), *measures.frames(run, (strain,))
    loop = measures.first_loop(first, last)
    h = measures.talus.loop_gradient(first.centres[loop], measures.talus.displacement(first, last)[loop])
    return np.degrees(abs(np.arctan2(h[1, 0] - h[0, 1], 2 + h[0, 0] + h[1, 1])))


def to_the_end(run):
    """CPU seconds of the stage up to 20 %: the penalty's run is longer."""
    strain = measures.rows(run)["axial_strain"]
    return run.info["stages"][measures.STAGE]["cpu_time"] * min(1, 0.2 * measures.scale(run) / strain[-1])


def entry(values):
    middle, error = measures.mean_and_error(values)
    if not np.isfinite(middle):
        return ""
    return f"{middle:.4g}" if not np.isfinite(error) else f"{middle:.4g} +- {error:.2g}"


def table(head, lines):
    yield "| " + " | ".join(head) + " |"
    yield "|" + "---|" * len(head)
    for line in lines:
        yield "| " + " | ".join(line) + " |"
    yield ""


def boundaries(folder):
    kinds = {kind: runs for kind, runs in ((k, measures.load(folder, k)) for k in measures.KINDS) if runs}
    base = kinds.get("pressure", {})
    values = {}
    for name, take in QUANTITIES:
        for kind, runs in kinds.items():
            if take:
                values[name, kind] = {seed: take(run) for seed, run in runs.items()}
            else:
                price = measures.cost if "step" in name else to_the_end
                values[name, kind] = {seed: price(run) / price(base[seed]) for seed, run in runs.items() if seed in base}
    head = [f"{measures.KINDS[kind]} ({len(runs)})" for kind, runs in kinds.items()]
    yield from table(["quantity (samples)"] + head,
                     ([name] + [entry(list(values[name, kind].values())) for kind in kinds] for name, _ in QUANTITIES))
    others = [kind for kind in kinds if kind != "pressure"]
    if base and others:
        yield "Less `pressure`:\n"
        yield from table(["quantity"] + [measures.KINDS[kind] for kind in others],
                         ([name] + [entry([value - values[name, "pressure"][seed] for seed, value in
                                           values[name, kind].items() if seed in base]) for kind in others]
                          for name, take in QUANTITIES if take))


def shapes(folder, name, groups):
    """Shape index at the end of the runs by group and order."""
    lines = []
    for label, kind in groups:
        line = [label]
        for order in ORDERS:
            runs = measures.load(folder, kind.format(order)).values()
            line.append(entry([measures.shape(run, run.frame()) if "size" in kind or "circle" in kind else shape(run, 0.10)
                               for run in runs]) + f" ({len(runs)})")
        if any("(0)" not in cell for cell in line[1:]):
            lines.append(line)
    if lines:
        yield name + "\n"
        yield from table(["sample"] + [f"order {order} (samples)" for order in ORDERS], lines)


def main(folder):
    groups = [(f"N = {count}", f"size{count}-order{{}}") for count in SIZES] + [("N = 3279", "order{}")]
    text = "\n".join([*boundaries(folder), *shapes(folder, "Shape index at 10 % axial strain:", groups),
                      *shapes(folder, "Shape index of the circle after its shear:", [("circle", "circle-order{}")])])
    (Path(folder) / "table.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main(sys.argv[1])
