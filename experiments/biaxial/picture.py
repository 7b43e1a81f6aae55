#!/usr/bin/python3
"""The README's picture from the last frame of a run: picture.py RUN > docs/biaxial.svg (needs python3-h5py).

Left: grains, contact forces as lines of a width proportional to the force. Right: deviatoric strain rate of the cells over
its mean."""
import sys

import h5py
import numpy as np

RUN, SCALE = sys.argv[1], 7e3  # pixels per metre
frames = h5py.File(RUN + "/fields.h5", "r")["frames"]
frame = frames[sorted(frames)[-1]]
grains, contacts, cells = frame["grains"], frame["contacts"], frame["cells"]
x, y, r = (np.array(grains[name]) for name in "xyr")
left, top = (x - r).min(), (y + r).max()
width, height = SCALE * ((x + r).max() - left), SCALE * (top - (y - r).min())
u, v, r = SCALE * (x - left), SCALE * (top - y), SCALE * r
gap = 40

print(f'<svg xmlns="http://www.w3.org/2000/svg" width="700" viewBox="-5 -5 {2 * width + gap + 10:.0f} {height + 10:.0f}">')
print('<rect x="-5" y="-5" width="100%" height="100%" fill="#fff"/>')
print('<g fill="#ddd" stroke="#aaa" stroke-width=".5">')
print("".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="{c:.1f}"/>' for a, b, c in zip(u, v, r)))
print('</g><g stroke="#1b2a5c" stroke-linecap="round">')
i, j, force = (np.array(contacts[name]) for name in ("i", "j", "fn"))
for a, b, f in zip(i, j, force / force.mean()):
    if f > 0.2:
        print(f'<path d="M{u[a]:.1f} {v[a]:.1f}L{u[b]:.1f} {v[b]:.1f}" stroke-width="{1.5 * f:.1f}"/>')
print("</g>")
print(f'<g transform="translate({width + gap:.0f} 0)" stroke="#fff" stroke-width=".3">')
rate, area = np.array(cells["L_II"]), np.array(cells["area"])
rate /= (rate * area).sum() / area.sum()
corners = np.array([cells["i"], cells["j"], cells["k"]]).T
LIGHT, DARK = np.array([244, 244, 240]), np.array([120, 20, 10])
for corner, value in zip(corners, rate):
    colour = LIGHT + (DARK - LIGHT) * min(1.0, value / 5)
    points = " ".join(f"{u[k]:.1f},{v[k]:.1f}" for k in corner)
    print('<polygon points="%s" fill="#%02x%02x%02x"/>' % ((points,) + tuple(int(c) for c in colour)))
print("</g></svg>")
