"""Tests of talus.py against a run of seconds and against closed forms. TALUS names the program."""
import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

import talus

HERE = Path(__file__).resolve().parent
PROGRAM = os.environ.get("TALUS", str(HERE.parent / "build/talus"))
SMALL = ["grains.count=100", "pack.width=11e-3", "stages.0.ramp=0.5", "stages.0.tolerance=0.2", "stages.0.unbalanced=0.05",
         "stages.1.rate=0.05", "stages.1.strain=0.01", "continuum.refresh={strain: 1}", "output.fields_every=0.05",
         "output.tracks=[3, 7]"]


class AgainstARun(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name) / "run"
        settings = [word for key in SMALL for word in ("--set", key)]
        scene = HERE / "boundaries/exact.yaml"
        subprocess.run([PROGRAM, "run", scene, "-o", cls.folder, "-t", "1", "-q", "--no-figures", *settings], check=True)
        cls.run_ = talus.Run(cls.folder)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def test_series(self):
        """EXACT: every number of the file, under its name without the unit."""
        with open(self.folder / "series.csv", newline="") as file:
            header, *rows = csv.reader(file)
        self.assertEqual(len(self.run_.series), len(rows))
        for c, name in enumerate(header):
            column = self.run_.series[name.split("[")[0]]
            np.testing.assert_array_equal(column, [float(row[c]) for row in rows])
        self.assertEqual(self.run_.series.unit("sigma_xx"), "Pa")
        self.assertEqual(self.run_.series.unit("step"), "")
        late = self.run_.series.where(self.run_.series["stage"] == 1)
        self.assertEqual(set(late["stage"]), {1.0})
        self.assertTrue("phi" in late and "nothing" not in late)

    def test_frames(self):
        """EXACT: data sets, attributes and units of the files; the frames asked for."""
        paths = sorted((self.folder / "fields").iterdir())
        self.assertEqual(len(self.run_.frames), len(paths))
        for frame, path in zip(self.run_.frames, paths):
            with h5py.File(path, "r") as file:
                self.assertEqual((frame.time, frame.step), (file.attrs["time"], file.attrs["step"]))
                np.testing.assert_array_equal(frame["grains/x"], file["grains/x"][:])
                np.testing.assert_array_equal(frame["cells/stress"], file["cells/stress"][:])
        last = self.run_.frame()
        self.assertEqual(last.unit("cells/stress"), "Pa")
        self.assertTrue("loop/node" in last and "membrane/x" not in last)
        self.assertIs(self.run_.frame(strain=1), last)
        self.assertIs(self.run_.frame(time=0), self.run_.frames[0])
        begin = self.run_.begin(1)
        self.assertEqual((begin.stage, begin.axial_strain), (0, 0))
        self.assertGreater(self.run_.frame(strain=0.005).axial_strain, 0.004)
        with self.assertRaises(AttributeError):
            last.nothing

    def test_scene_and_tracks(self):
        """EXACT: run.json; the tracked grains are those of the frames."""
        self.assertEqual(self.run_.info, json.loads((self.folder / "run.json").read_text()))
        self.assertEqual(self.run_.scene["grains"]["count"], 100)
        self.assertEqual(sorted(self.run_.tracks), [3, 7])
        last = self.run_.frame()
        for i, track in self.run_.tracks.items():
            self.assertEqual((track["time"][-1], track["x"][-1]), (last.time, last["grains/x"][i]))

    def test_means(self):
        """ROUND: the loop's mean gradient is that of the cells (33); so is its area. MODEL: it is the imposed strain but for
        products of fluctuations."""
        first, last = self.run_.frame(strain=0.0025), self.run_.frame()  # of one graph
        loop, moved = first["loop/node"], talus.displacement(first, last)
        gradient = talus.loop_gradient(first.centres[loop], moved[loop])
        cells, area = talus.cell_gradient(first, last)
        np.testing.assert_allclose(np.einsum("t,tab->ab", area, cells) / area.sum(), gradient, rtol=0, atol=1e-13)
        self.assertAlmostEqual(talus.polygon_area(first.centres[loop]), area.sum(), delta=1e-13 * area.sum())
        height = (1 - last.axial_strain) / (1 - first.axial_strain)
        np.testing.assert_allclose(gradient[:, 1], (0, height - 1), atol=1e-2 * (1 - height))
        rest = talus.relative_to_affine(first, last)
        np.testing.assert_allclose(talus.loop_gradient(first.centres[loop], rest[loop]), 0, atol=1e-13)
        part = loop[::2]
        rest = talus.relative_to_affine(first, last, part)
        np.testing.assert_allclose(talus.loop_gradient(first.centres[part], rest[part]), 0, atol=1e-13)
        np.testing.assert_allclose(rest[part].mean(axis=0), 0, atol=1e-16)


class ClosedForms(unittest.TestCase):
    def test_affine(self):
        """ROUND: a linear field on any polygon has its own gradient; a unit square has area 1 and no net normal."""
        rng = np.random.default_rng(1)
        angle = np.sort(rng.uniform(0, 2 * np.pi, 40))
        points = rng.uniform(0.5, 2, (40, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=1) + [3, -5]
        gradient = rng.normal(size=(2, 2))
        np.testing.assert_allclose(talus.loop_gradient(points, points @ gradient.T + [1, 2]), gradient, atol=1e-12)
        square = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
        self.assertEqual(talus.polygon_area(square), 1)
        np.testing.assert_array_equal(talus.loop_normals(square), [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


if __name__ == "__main__":
    sys.exit(unittest.main())
