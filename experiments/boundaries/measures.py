"""What the figures and tables of this experiment measure in a run; README.md defines each quantity in words.

Lengths are counted in mean grain diameters, strains are engineering. Windows are meant for runs of 20 %: a run asked for
less has them shrunk in proportion."""
import re
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import talus  # noqa: E402

KINDS = {"pressure": "pressure", "membrane": "membrane", "penalty": "minimal, penalty", "order0": "minimal, order 0",
         "order1": "minimal, order 1", "order3": "minimal, order 3"}
STAGE = 1  # the one after confinement


def load(folder, kind):
    """The finished runs KIND-SEED, by seed."""
    runs = {}
    for path in sorted(Path(folder).glob(kind + "-*")):
        seed = re.fullmatch(re.escape(kind) + r"-(\d+)", path.name)
        if seed and (path / "run.json").exists():
            run = talus.Run(path)
            if run.info["status"] == "done":
                runs[int(seed[1])] = run
    return runs


def scale(run):
    """By what windows shrink in a run that is asked for less than 20 %."""
    return min(1.0, run.scene["stages"][STAGE]["strain"] / 0.20)


def diameter(run):
    return 2 * run.frames[0]["grains/r"].mean()


def frames(run, strains):
    """The stage's frames nearest to each of the strains; 0 is where it begins."""
    return [run.frame(strain=s * scale(run), stage=STAGE) if s > 0 else run.begin(STAGE) for s in strains]


def rows(run):
    """The stage's part of the series."""
    return run.series.where(run.series["stage"] == STAGE)


# Volumetric strain


def curve(run, column="volumetric_strain", rising="axial_strain"):
    series = rows(run)
    return np.abs(series[rising]), series[column]


def dilation(run):
    """Axial strain and volume per volume of grains, over that when the stage began, less 1: from the solid fraction, which
    knows nothing of how the loop came to be where it is."""
    strain, fraction = curve(run, "solid_fraction")
    return strain, fraction[0] / fraction - 1


def peak(run):
    """Largest volumetric strain up to 20 % and the axial strain there."""
    strain, value = curve(run)
    value = np.where(strain <= 0.2, value, -np.inf)
    return value.max(), strain[value.argmax()]


def local_peaks(run, smooth=0.002, prominence=5e-4):
    """Strains at which the volumetric strain, averaged over `smooth` of strain, has a peak from which it falls by at least
    `prominence` before it rises above it again."""
    strain, value = curve(run)
    grid = np.arange(0, min(strain[-1], 0.2 * scale(run)), 2e-4)
    width = max(1, round(smooth * scale(run) / 2e-4))
    value = np.convolve(np.interp(grid, strain, value), np.ones(width) / width, mode="valid")
    found, top, bottom = [], 0, 0
    for k in range(len(value)):
        if value[k] > value[top]:
            top = bottom = k
        elif value[k] < value[bottom]:
            bottom = k
        if value[k] - value[bottom] >= prominence and value[top] - value[bottom] >= prominence:
            found.append(grid[top + width // 2])
            top = bottom = k
    if value[top] - value[bottom] >= prominence:
        found.append(grid[top + width // 2])
    return found


# Localisation


def centroids(frame):
    return frame.centres[frame["cells/corner"]].mean(axis=1)


def cell_shear(first, last):
    """[t] shear (35) of the displacement gradient between two frames in the cells of the first, and their areas."""
    h, area = talus.cell_gradient(first, last)
    return np.hypot((h[:, 0, 0] - h[:, 1, 1]) / 2, (h[:, 0, 1] + h[:, 1, 0]) / 2), area


def smoothed(points, at, value, weight, width):
    """Mean of `value` round each of `points`, with the given weights and a Gaussian of standard deviation `width`."""
    result = np.empty(len(points))
    for k in range(0, len(points), 256):
        square = ((points[k:k + 256, None, :] - at[None, :, :]) ** 2).sum(axis=2)
        kernel = weight * np.exp(-0.5 * square / width**2)
        result[k:k + 256] = kernel @ value / kernel.sum(axis=1)
    return result


def shear_at_grains(run, first, last):
    """Shear round the grains that the cells of the first frame have for corners, smoothed over two diameters, and these
    grains."""
    shear, area = cell_shear(first, last)
    grains = np.unique(first["cells/corner"])
    return smoothed(first.centres[grains], centroids(first), shear, area, 2 * diameter(run)), grains


def gini(value, weight):
    """0: the same everywhere; towards 1: all of it in one place."""
    order = np.argsort(value)
    share, held = np.cumsum(weight[order]), np.cumsum((weight * value)[order])
    share, held = np.append(0, share / share[-1]), np.append(0, held / held[-1])
    return 1 - np.sum(np.diff(share) * (held[1:] + held[:-1]))


def localisation(run, begin=0.10, end=0.14):
    """Gini coefficient of the smoothed shear over a window."""
    value, _ = shear_at_grains(run, *frames(run, (begin, end)))
    return gini(value, np.ones(len(value)))


def persistence(run, strains=(0.10, 0.12, 0.14)):
    """Correlation of the smoothed shear of two windows, grain by grain."""
    first, middle, last = frames(run, strains)
    a, grains_a = shear_at_grains(run, first, middle)
    b, grains_b = shear_at_grains(run, middle, last)
    _, in_a, in_b = np.intersect1d(grains_a, grains_b, return_indices=True)
    return np.corrcoef(a[in_a], b[in_b])[0, 1]


# Pressure


def mean_pressure(frame, inside=slice(None)):
    area = frame["cells/area"][inside]
    return np.sum(area * frame["cells/pressure"][inside]) / area.sum()


def margins(frame):
    """For each cell: distance from the nearer end over the height, and from the nearer side over the width there."""
    at, loop = centroids(frame), frame.centres[frame["loop/node"]]
    bottom, top = loop[:, 1].min(), loop[:, 1].max()
    # the loop's width by height, from points close together on its edges
    share = np.linspace(0, 1, 20, endpoint=False)[:, None, None]
    rim = (loop * (1 - share) + np.roll(loop, -1, axis=0) * share).reshape(-1, 2)
    bins = 60

    def place(y):
        return np.clip(((y - bottom) / (top - bottom) * bins).astype(int), 0, bins - 1)

    left, right = np.full(bins, np.inf), np.full(bins, -np.inf)
    np.minimum.at(left, place(rim[:, 1]), rim[:, 0])
    np.maximum.at(right, place(rim[:, 1]), rim[:, 0])
    k = place(at[:, 1])
    end = np.minimum(at[:, 1] - bottom, top - at[:, 1]) / (top - bottom)
    return end, np.minimum(at[:, 0] - left[k], right[k] - at[:, 0]) / (right[k] - left[k])


LOADED = (0.05, 0.06, 0.07, 0.08, 0.09, 0.10)  # strains over which stresses are averaged


def concentration(run):
    """Mean pressure within a tenth of the height from the ends, and within a tenth of the width from the sides in the
    middle half of the height, over that of the assembly; standard deviation of the pressure smoothed over two diameters,
    over its mean."""
    found = []
    for frame in frames(run, LOADED):
        end, side = margins(frame)
        whole = mean_pressure(frame)
        grains = np.unique(frame["cells/corner"])
        smooth = smoothed(frame.centres[grains], centroids(frame), frame["cells/pressure"], frame["cells/area"],
                          2 * diameter(run))
        found.append((mean_pressure(frame, end < 0.1) / whole, mean_pressure(frame, (side < 0.1) & (end > 0.25)) / whole,
                      smooth.std() / smooth.mean()))
    return np.mean(found, axis=0)


def circles(run, strain, diameters):
    """[3, k] mean pressure over that of the assembly in circles of the given diameters (in mean diameters): hanging from
    the top, about the centre, standing on the bottom. nan where a circle is wider than the assembly is high."""
    frame, = frames(run, (strain,))
    at, loop, d = centroids(frame), frame.centres[frame["loop/node"]], diameter(run)
    bottom, top = loop[:, 1].min(), loop[:, 1].max()
    middle = np.array([loop[:, 0].min() + loop[:, 0].max(), bottom + top]) / 2
    result = np.full((3, len(diameters)), np.nan)
    for k, width in enumerate(np.asarray(diameters) * d):
        for place, y in enumerate((top - width / 2, middle[1], bottom + width / 2)):
            inside = np.hypot(*(at - [middle[0], y]).T) < width / 2
            if width <= top - bottom and inside.any():
                result[place, k] = mean_pressure(frame, inside) / mean_pressure(frame)
    return result


# Shape, errors, cost


def first_loop(first, last):
    """Grains of the first frame's loop that are not outside the last frame's."""
    loop = first["loop/node"]
    return loop[np.isin(loop, last["cells/corner"])]


def shape(run, last):
    """Root mean square distance of the loop's first grains from the affine image of their first positions, in mean
    diameters."""
    first = run.begin(STAGE)
    loop = first_loop(first, last)
    rest = talus.relative_to_affine(first, last, loop)[loop]
    return np.sqrt((rest**2).sum(axis=1).mean()) / diameter(run)


def rate_ratio(run):
    """Axial strain and ratio of the actual mean strain rate yy to the one imposed. (81)"""
    series, stage = rows(run), run.scene["stages"][STAGE]
    asked = stage["rate"] * (series["time"] - run.begin(STAGE).time)
    return series["axial_strain"], 1 - series["strain_rate_error_yy"] * (1 - asked) / stage["rate"]


def rate_error(run, skip=0.005):
    """Root mean square over the stage, from a strain of 0.5 %, of the largest error of an imposed strain rate over the
    rate."""
    series = rows(run).where(rows(run)["axial_strain"] > skip * scale(run))
    errors = np.abs([series["strain_rate_error_" + name] for name in ("xx", "yy", "xy")])
    worst = np.max(np.where(np.isnan(errors), 0, errors), axis=0)
    absent = np.isnan(errors).all()
    return np.nan if absent else np.sqrt(np.mean(worst**2)) / run.scene["stages"][STAGE]["rate"]


def cost(run):
    """CPU seconds of the stage per step."""
    stage = run.info["stages"][STAGE]
    return stage["cpu_time"] / stage["steps"]


def mean_and_error(values):
    """Mean and standard error over seeds; nan without a second one."""
    values = np.asarray(values, dtype=float)
    values = values[np.isfinite(values)]
    if not len(values):
        return np.nan, np.nan
    return values.mean(), values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
