"""Reads what `talus run -o DIR` wrote (docs/formats.md); needs python3-numpy and python3-h5py.

    run = talus.Run("DIR")
    run.series["stress_ratio"]                  # a column of series.csv; run.series.unit("sigma_xx") is "Pa"
    run.frame(strain=0.07)["cells/pressure"]    # of the frame nearest to 7 % axial strain

run.info is run.json, run.scene the scene as resolved, run.tracks[id]["x"] a tracked grain. Arrays are numpy's and read
when asked for, units SI, grain i is row i of every grain array and column of `corner`, signs those of the files."""
import csv
import json
from pathlib import Path

import h5py
import numpy as np


class Table:
    """Named columns of a CSV file whose header reads name[unit],name,...; an absent number is nan."""

    def __init__(self, header, rows):
        split = [name.rstrip("]").split("[") for name in header]
        self.units = {s[0]: s[1] if len(s) > 1 else "" for s in split}
        numbers = np.array(rows, dtype=float).reshape(len(rows), len(header))
        self.columns = {s[0]: numbers[:, c] for c, s in enumerate(split)}

    @classmethod
    def read(cls, path):
        with open(path, newline="") as file:
            header, *rows = csv.reader(file)
        return cls(header, rows)

    def __getitem__(self, name):
        return self.columns[name]

    def __contains__(self, name):
        return name in self.columns

    def __len__(self):
        return len(next(iter(self.columns.values())))

    def unit(self, name):
        return self.units[name]

    def where(self, rows):
        """The same columns with some rows only: a mask, or their numbers."""
        part = object.__new__(Table)
        part.units, part.columns = self.units, {name: column[rows] for name, column in self.columns.items()}
        return part


class Frame:
    """One fields/NNNNNN.h5: frame["grains/x"], read at the first use; time, step, stage and axial_strain."""

    def __init__(self, path):
        self.path, self.arrays = Path(path), {}
        with h5py.File(path, "r") as file:
            self.attributes = {key: value.item() for key, value in file.attrs.items()}

    def __getattr__(self, name):
        try:
            return self.__dict__["attributes"][name]
        except KeyError:
            raise AttributeError(name) from None

    def __getitem__(self, name):
        if name not in self.arrays:
            with h5py.File(self.path, "r") as file:
                self.arrays[name] = file[name][:]
        return self.arrays[name]

    def __contains__(self, name):
        with h5py.File(self.path, "r") as file:
            return name in file

    def unit(self, name):
        with h5py.File(self.path, "r") as file:
            unit = file[name].attrs["unit"]
        return unit.decode() if isinstance(unit, bytes) else unit

    @property
    def centres(self):
        """[n, 2] centres of all grains [m]."""
        return self["grains/position"][:, :2]


class Run:
    """A run folder, finished or not."""

    def __init__(self, folder):
        self.folder = Path(folder)
        self.info = json.loads((self.folder / "run.json").read_text())
        self.scene = self.info["scene"]
        self.series = Table.read(self.folder / "series.csv")
        self.frames = [Frame(path) for path in sorted((self.folder / "fields").glob("*.h5"))]

    @property
    def tracks(self):
        """Columns of tracks.csv by grain id."""
        table = Table.read(self.folder / "tracks.csv")
        return {int(i): table.where(table["id"] == i) for i in np.unique(table["id"])}

    def frame(self, strain=None, time=None, stage=None):
        """The frame nearest to an axial strain or a time; the last of several that are as near (so strain=0 is the state
        in which compression begins), of one stage if it is given; without arguments the last frame."""
        frames = [f for f in self.frames if stage is None or f.stage == stage]
        if strain is None and time is None:
            return frames[-1]
        off = [abs(f.axial_strain - strain if time is None else f.time - time) for f in frames]
        return frames[max(k for k, d in enumerate(off) if d <= min(off) + 1e-12)]

    def begin(self, stage):
        """The frame in which a stage begins: the last one of the stages before it, or the first of all."""
        return ([f for f in self.frames if f.stage < stage] or self.frames)[-1]


def displacement(first, last):
    """[n, 2] displacement of all grains between two frames [m]."""
    return last.centres - first.centres


def loop_normals(points):
    """[m, 2] normals N_A (32) of a counter-clockwise polygon [m, 2]: half the sum of its two outward edge vectors."""
    chord = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    return 0.5 * np.stack([chord[:, 1], -chord[:, 0]], axis=1)


def polygon_area(points):
    x, y = points.T
    return 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)


def loop_gradient(points, vectors):
    """Mean gradient (32) over a polygon [m, 2] of what is `vectors` [m, 2] at its corners and linear along its edges."""
    return vectors.T @ loop_normals(points) / polygon_area(points)


def relative_to_affine(first, last, loop=None):
    """[n, 2] displacement less the affine one: the mean displacement gradient over the loop of the first frame (or another
    polygon of grains), and no mean displacement of the loop's grains."""
    loop, moved = first["loop/node"] if loop is None else loop, displacement(first, last)
    affine = first.centres @ loop_gradient(first.centres[loop], moved[loop]).T
    return moved - affine - (moved - affine)[loop].mean(axis=0)


def cell_gradient(first, last):
    """[t, 2, 2] displacement gradient H (34) of the first frame's cells up to the last frame, and their areas [t]."""
    corner, moved = first["cells/corner"], displacement(first, last)
    edges = first.centres[corner[:, 1:]] - first.centres[corner[:, :1]]
    jumps = moved[corner[:, 1:]] - moved[corner[:, :1]]
    return np.linalg.solve(edges, jumps).transpose(0, 2, 1), first["cells/area"]
