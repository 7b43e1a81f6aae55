"""Tests of measures.py against closed forms, on runs made up for the purpose."""
import sys
import unittest
from types import SimpleNamespace

import numpy as np

import measures


class Made(dict):
    """A frame of given arrays."""

    def __init__(self, strain, **arrays):
        super().__init__({key.replace("__", "/"): value for key, value in arrays.items()})
        self.axial_strain, self.stage = strain, measures.STAGE

    @property
    def centres(self):
        return self["grains/position"]


def lattice(side=24, transform=np.eye(2)):
    """A square of grains of diameter 1, its cells and its loop; positions after a linear map."""
    at = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="xy"), axis=2).reshape(-1, 2).astype(float)
    k = np.arange(side * side).reshape(side, side)
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, 1:].ravel(), k[1:, :-1].ravel()
    loop = np.concatenate([k[0, :-1], k[:-1, -1], k[-1, :0:-1], k[:0:-1, 0]])
    return at @ transform.T, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]), loop


def frame(strain, at, corner, loop, pressure=1.0):
    count = len(corner)
    return Made(strain, grains__position=at, grains__r=np.full(len(at), 0.5), cells__corner=corner, loop__node=loop,
                cells__area=np.full(count, 0.5), cells__pressure=np.broadcast_to(pressure, count))


def made_run(*frames, **columns):
    run = SimpleNamespace(frames=list(frames), scene={"stages": [{}, {"strain": 0.2, "rate": 5e-3}]})
    run.begin = lambda stage: frames[0]
    run.frame = lambda strain, stage: min(frames, key=lambda f: abs(f.axial_strain - strain))
    if columns:
        run.series = measures.talus.Table(list(columns), np.stack(list(columns.values()), axis=1))
    return run


class Measures(unittest.TestCase):
    def test_gini(self):
        """ROUND: nothing differs: 0; all in one of n: 1 - 1/n; uniformly distributed values: 1/3."""
        self.assertAlmostEqual(measures.gini(np.ones(9), np.arange(1, 10.0)), 0, delta=1e-14)
        self.assertAlmostEqual(measures.gini(np.eye(1, 50)[0], np.ones(50)), 1 - 1 / 50, delta=1e-14)
        self.assertAlmostEqual(measures.gini(np.linspace(0, 1, 4001), np.ones(4001)), 1 / 3, delta=1e-3)

    def test_homogeneous_strain(self):
        """ROUND: an affine motion is not localised, keeps its shape, and has the shear of its gradient."""
        at, corner, loop = lattice()
        map_ = np.array([[1.1, 0.05], [0.0, 0.9]])
        run = made_run(frame(0.0, at, corner, loop), frame(0.2, at @ map_.T + [3, 1], corner, loop))
        shear, area = measures.cell_shear(*run.frames)
        np.testing.assert_allclose(shear, np.hypot(0.1, 0.025), rtol=1e-12)
        self.assertAlmostEqual(measures.localisation(run, 0.0, 0.2), 0, delta=1e-12)
        self.assertAlmostEqual(measures.shape(run, run.frames[1]), 0, delta=1e-12)

    def test_band(self):
        """MODEL: two halves that slide along each other are localised; a row moved out by one diameter gives the shape
        index of its share of the loop, up to what the affine map takes up."""
        at, corner, loop = lattice()
        slid = at + np.where(at[:, 1:] > 11.5, [2.0, 0.0], [0.0, 0.0])
        run = made_run(frame(0.0, at, corner, loop), frame(0.2, slid, corner, loop))
        self.assertGreater(measures.localisation(run, 0.0, 0.2), 0.6)
        self.assertGreater(measures.shape(run, run.frames[1]), 0.3)

    def test_pressure(self):
        """ROUND: uniform pressure: 1 everywhere and no variation. Higher by a half in the outer tenths at the ends: that
        is found there and in circles that lie in them, not at the centre."""
        at, corner, loop = lattice(31)
        run = made_run(frame(0.05, at, corner, loop))
        np.testing.assert_allclose(measures.concentration(run), (1, 1, 0), atol=1e-12)
        middle = at[corner].mean(axis=1)[:, 1] / 30
        pressure = np.where((middle < 0.1) | (middle > 0.9), 1.5, 1.0)
        run = made_run(frame(0.05, at, corner, loop, pressure))
        ends, _, variation = measures.concentration(run)
        self.assertAlmostEqual(ends, 1.5 / 1.1, delta=1e-12)
        self.assertGreater(variation, 0.1)
        circles = measures.circles(run, 0.05, (3, 24))
        np.testing.assert_allclose(circles[:, 0], np.array([1.5, 1, 1.5]) / 1.1, rtol=1e-12)
        self.assertTrue(np.all(circles[[0, 2], 1] < 1.2) and circles[1, 1] < 1)

    def test_peaks(self):
        """EXACT: the local peaks of a curve that has two, and its largest value."""
        strain = np.linspace(0, 0.2, 2001)
        value = 0.01 - 4 * np.abs(np.abs(strain - 0.10) - 0.04) ** 2  # peaks at 6 and 14 %, 0.0036 at 10 %
        run = made_run(stage=np.ones(2001), axial_strain=strain, volumetric_strain=value, solid_fraction=0.8 / (1 + value))
        np.testing.assert_allclose(measures.local_peaks(run), (0.06, 0.14), atol=1e-3)
        self.assertAlmostEqual(measures.peak(run)[0], 0.01, delta=1e-12)
        np.testing.assert_allclose(measures.dilation(run)[1], (1 + value) / (1 + value[0]) - 1, atol=1e-12)

    def test_rate(self):
        """ROUND: an actual rate of 0.9 of the imposed one, which grows as 1/(1 - rate t), reads 0.9 all along."""
        time = np.linspace(0, 40, 401)
        imposed = -5e-3 / (1 - 5e-3 * time)
        run = made_run(SimpleNamespace(time=0.0), stage=np.ones(401), time=time, axial_strain=5e-3 * time,
                       strain_rate_error_yy=-0.1 * imposed)
        np.testing.assert_allclose(measures.rate_ratio(run)[1], 0.9, rtol=1e-12)


if __name__ == "__main__":
    sys.exit(unittest.main())
