"""The figures of this experiment from the runs that are there: figures.py RUNS [SEED], into RUNS/figures.

Maps are of one sample (SEED, or the first that has finished), curves are means over all of them with a band of one standard
error. A figure whose runs are missing is left out, which is said."""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import EllipseCollection, LineCollection, PolyCollection  # noqa: E402

import measures  # noqa: E402

COLOURS = {"pressure": "#000000", "membrane": "#e69f00", "penalty": "#009e73", "order0": "#56b4e9", "order1": "#0072b2",
           "order3": "#cc79a7"}
ORDERS = (0, 1, 3)
SIZES = (120, 2100, 3970, 5034)  # 120: of `run.sh --short`
MILLI = 1e3
plt.rcParams.update({"font.size": 8, "axes.titlesize": 8, "figure.dpi": 130, "savefig.bbox": "tight"})


# Drawing


def maps(count, frame, columns=None):
    """A row of panels without axes, as high as the sample is."""
    columns = columns or count
    x, y = inside(frame).T
    height = 2.6 * np.ptp(y) / np.ptp(x)
    lines = -(-count // columns)
    figure, axes = plt.subplots(lines, columns, figsize=(2.9 * columns, (height + 0.35) * lines), squeeze=False)
    for axis in axes.flat:
        axis.set_aspect("equal")
        axis.axis("off")
    return figure, list(axes.flat)


def fit(axis, points, margin=2.0):
    low, high = MILLI * points.min(axis=0) - margin, MILLI * points.max(axis=0) + margin
    axis.set_xlim(low[0], high[0])
    axis.set_ylim(low[1], high[1])


def disks(axis, centres, radii, colours, edge="#888888"):
    axis.add_collection(EllipseCollection(2e3 * radii, 2e3 * radii, np.zeros(len(radii)), units="xy", offsets=MILLI * centres,
                                          offset_transform=axis.transData, facecolors=colours, edgecolors=edge,
                                          linewidths=0.1))


def closed(axis, points, **style):
    points = MILLI * np.append(points, points[:1], axis=0)
    axis.plot(points[:, 0], points[:, 1], **style)


def outline(axis, frame, **style):
    closed(axis, frame.centres[frame["loop/node"]], **{"color": "#444444", "lw": 0.6, **style})


def inside(frame):
    """Centres of the grains that are not outside the loop."""
    return frame.centres[np.unique(frame["cells/corner"])]


def beads(axis, frame):
    """Draws the membrane, if there is one; all that the picture has to show."""
    if "membrane/x" in frame and len(frame["membrane/x"]):
        at = np.stack([frame["membrane/x"], frame["membrane/y"]], axis=1)
        disks(axis, at, frame["membrane/r"], "#222222")
        return np.concatenate([at, inside(frame)])
    return inside(frame)


def percent(frame):
    return f"{100 * frame.axial_strain:.1f} %"


def band(axis, x, curves, colour, label):
    """Mean of curves on one grid, and one standard error about it where there are two."""
    mean = np.mean(curves, axis=0)
    axis.plot(x, mean, color=colour, lw=1.2, label=f"{label} ({len(curves)})")
    if len(curves) > 1:
        error = np.std(curves, axis=0, ddof=1) / np.sqrt(len(curves))
        axis.fill_between(x, mean - error, mean + error, color=colour, alpha=0.25, lw=0)


def on_grid(x, y, bins=160):
    """The curve averaged over bins of x from 0 to its end."""
    edges = np.linspace(0, x.max(), bins + 1)
    at = np.clip(np.digitize(x, edges) - 1, 0, bins - 1)
    count = np.bincount(at, minlength=bins)
    mean = np.bincount(at, y, minlength=bins) / np.maximum(count, 1)
    middle = (edges[1:] + edges[:-1]) / 2
    return np.interp(middle, middle[count > 0], mean[count > 0])


class Figures:
    def __init__(self, folder, seed=None):
        self.folder, self.seed = Path(folder), seed
        self.to = self.folder / "figures"
        self.to.mkdir(exist_ok=True)
        self.kinds = {kind: measures.load(folder, kind) for kind in measures.KINDS}

    def sample(self, kind):
        """One run of a kind, or None."""
        runs = self.kinds[kind] if kind in self.kinds else measures.load(self.folder, kind)
        if self.seed is not None:
            return runs.get(self.seed)
        return runs[min(runs)] if runs else None

    def samples(self, kinds):
        return {kind: run for kind in kinds if (run := self.sample(kind)) is not None}

    def save(self, figure, name):
        figure.savefig(self.to / (name + ".png"))
        plt.close(figure)
        print(self.to / (name + ".png"))

    # P Figs. 3.3 and 3.6: curves

    def curves(self, name, kinds, take, ylabel, factor=1.0, extra=None):
        runs = {kind: list(self.kinds[kind].values()) for kind in kinds if self.kinds[kind]}
        if not runs:
            return print(name, "left out: no runs")
        figure, axis = plt.subplots(figsize=(4.6, 3.2))
        for kind, group in runs.items():
            data = [take(run) for run in group]
            end = min(np.max(strain) for strain, _ in data)
            grid = np.linspace(0, 100 * end, 161)
            grid = (grid[1:] + grid[:-1]) / 2
            kept = [on_grid(strain[strain <= end], value[strain <= end]) for strain, value in data]
            band(axis, grid, factor * np.array(kept), COLOURS[kind], measures.KINDS[kind])
        axis.set_xlabel("axial strain [%]")
        axis.set_ylabel(ylabel)
        if extra:
            extra(axis)
        axis.legend(frameon=False, title="boundary (samples)", fontsize=7, title_fontsize=7)
        self.save(figure, name)

    def strain_rates(self):
        self.curves("3.3-strain-rate", ("penalty", "order0"), measures.rate_ratio, "actual / imposed strain rate")

    def volumetric(self):
        self.curves("3.6-volumetric-strain", measures.KINDS, measures.curve, "volumetric strain [%], dilation +", 100,
                    lambda axis: axis.axhline(0, color="#bbbbbb", lw=0.5, zorder=0))
        self.curves("3.6-solid-fraction", measures.KINDS, measures.dilation, "dilation by solid fraction [%]", 100,
                    lambda axis: axis.axhline(0, color="#bbbbbb", lw=0.5, zorder=0))
        self.curves("stress-ratio", measures.KINDS, lambda run: measures.curve(run, "stress_ratio"), "stress ratio yy / xx")

    # P Fig. 3.4: circles

    def circles_sheared(self):
        runs = self.samples(f"circle-order{order}" for order in ORDERS)
        if not runs:
            return print("3.4-circle left out: no runs")
        figure, axes = maps(len(runs), next(iter(runs.values())).frame())
        for axis, (kind, run) in zip(axes, runs.items()):
            first, last = run.begin(measures.STAGE), run.frame()
            self.deformed(axis, run, first, last)
            shear = measures.rows(run)["shear_strain"][-1]
            axis.set_title(f"order {kind[-1]}, shear {100 * abs(shear):.1f} %\n"
                           f"shape index {measures.shape(run, last):.2f}")
        self.save(figure, "3.4-circle")

    def deformed(self, axis, run, first, last):
        """Grains coloured by stripes of the first state, and the affine image of the first loop (dashed)."""
        loop, d = measures.first_loop(first, last), measures.diameter(run)
        stripe = np.floor(first.centres / (8 * d)).astype(int).sum(axis=1) % 2
        colours = np.where(stripe[:, None], [[0.62, 0.74, 0.86]], [[0.95, 0.93, 0.88]])
        disks(axis, last.centres, last["grains/r"], colours)
        image = last.centres[loop] - measures.talus.relative_to_affine(first, last, loop)[loop]
        closed(axis, image, color="#d55e00", lw=0.9, ls="--")
        outline(axis, last)
        fit(axis, np.concatenate([inside(last), image]))

    # P Figs. 3.7-3.9: displacements relative to the affine ones

    def displacements(self, name, kind, strains):
        run = self.sample(kind)
        if run is None:
            return print(name, "left out: no runs")
        frames = measures.frames(run, strains)
        figure, axes = maps(len(frames) - 1, frames[0])
        for axis, first, last in zip(axes, frames, frames[1:]):
            rest = measures.talus.relative_to_affine(first, last)
            kept = np.unique(first["cells/corner"])
            lines = MILLI * np.stack([first.centres[kept], first.centres[kept] + rest[kept]], axis=1)
            axis.add_collection(LineCollection(lines, colors="#102a5c", linewidths=0.45))
            axis.plot(*lines[:, 1].T, ".", ms=0.7, color="#d55e00", mew=0)
            outline(axis, first, lw=0.4, color="#999999")
            fit(axis, beads(axis, first))
            axis.set_title(f"{measures.KINDS[kind]}, {percent(first)} to {percent(last)}")
        self.save(figure, name)

    # P Figs. 3.10, 3.11: cells above a multiple of the mean

    def shaded(self, name, field, multiple, strains, colour):
        runs = self.samples(measures.KINDS)
        if not runs:
            return print(name, "left out: no runs")
        first = next(iter(runs.values())).begin(measures.STAGE)
        figure, axes = maps(len(runs), first, columns=3)
        for axis, (kind, run) in zip(axes, runs.items()):
            frame, = measures.frames(run, (strains.get(kind, strains["penalty"]),))
            value, area = frame["cells/" + field], frame["cells/area"]
            above = value > multiple * np.sum(value * area) / area.sum()
            axis.add_collection(PolyCollection(MILLI * frame.centres[frame["cells/corner"][above]], facecolors=colour, lw=0))
            outline(axis, frame)
            fit(axis, beads(axis, frame))
            axis.set_title(f"{measures.KINDS[kind]}, {percent(frame)}")
        self.save(figure, name)

    # P Fig. 3.12: circles that grow

    def pressure_circles(self):
        kinds = {kind: runs for kind, runs in self.kinds.items() if runs}
        if not kinds:
            return print("3.12-circles left out: no runs")
        widths = np.linspace(4, 44, 21)
        figure, axes = plt.subplots(2, 3, figsize=(8.4, 5), sharex=True, sharey=True)
        for axis, (kind, runs) in zip(axes.flat, kinds.items()):
            strain = {"pressure": 0.07, "membrane": 0.075}.get(kind, 0.085)
            ratio = np.array([measures.circles(run, strain, widths) for run in runs.values()])
            for place, (label, colour) in enumerate((("top", "#d55e00"), ("centre", "#000000"), ("bottom", "#0072b2"))):
                band(axis, widths, ratio[:, place], colour, label)
            axis.axhline(1, color="#999999", lw=0.5)
            axis.set_title(f"{measures.KINDS[kind]}, {100 * strain * measures.scale(next(iter(runs.values()))):.1f} %")
        for axis in axes[-1]:
            axis.set_xlabel("diameter of the circle / d")
        for axis in axes[:, 0]:
            axis.set_ylabel("p in the circle / p")
        axes[0, 0].legend(frameon=False, fontsize=7, title="circle at (samples)", title_fontsize=7)
        self.save(figure, "3.12-circles")

    # P Fig. 3.13: size

    def sizes(self):
        runs = self.samples(f"size{count}-order{order}" for count in SIZES for order in ORDERS)
        if not runs:
            return print("3.13-size left out: no runs")
        figure, axes = maps(len(runs), next(iter(runs.values())).frame(), columns=len(ORDERS))
        for axis, (kind, run) in zip(axes, runs.items()):
            last = run.frame()
            self.deformed(axis, run, run.begin(measures.STAGE), last)
            axis.set_title(f"N = {len(last['grains/id'])}, order {kind[-1]}, {percent(last)}\n"
                           f"shape index {measures.shape(run, last):.2f}")
        self.save(figure, "3.13-size")

    def shapes(self):
        figure, axis = plt.subplots(figsize=(4.6, 3.2))
        for kind, runs in self.kinds.items():
            if not runs:
                continue
            data = [np.array([(frame.axial_strain, measures.shape(run, frame)) for frame in run.frames
                              if frame.stage == measures.STAGE]) for run in runs.values()]
            grid = np.linspace(0, min(d[-1, 0] for d in data), 81)
            band(axis, 100 * grid, [np.interp(grid, *d.T, left=0) for d in data], COLOURS[kind], measures.KINDS[kind])
        axis.set_xlabel("axial strain [%]")
        axis.set_ylabel("shape index [mean diameters]")
        axis.legend(frameon=False, title="boundary (samples)", fontsize=7, title_fontsize=7)
        self.save(figure, "shape-index")


def main(folder, seed=None):
    figures = Figures(folder, None if seed is None else int(seed))
    figures.strain_rates()
    figures.circles_sheared()
    figures.volumetric()
    figures.displacements("3.7-displacement-pressure", "pressure", (0.10, 0.12, 0.14))
    figures.displacements("3.8-displacement-membrane", "membrane", (0.10, 0.115, 0.135))
    for kind in ("penalty", "order0", "order1", "order3"):
        figures.displacements("3.9-displacement-" + kind, kind, (0.12, 0.14, 0.155))
    instants = {"pressure": 0.07, "membrane": 0.075, "penalty": 0.085}
    figures.shaded("3.10-shear", "L_II", 2, instants, "#222222")
    figures.shaded("3.11-pressure", "pressure", 1.75, instants, "#b2182b")
    figures.pressure_circles()
    figures.sizes()
    figures.shapes()


if __name__ == "__main__":
    main(*sys.argv[1:])
