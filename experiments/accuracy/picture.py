#!/usr/bin/python3
"""One panel per study, error of each metric against the dial: picture.py RESULTS/NAME.csv... > docs/accuracy.svg

The tables are `study.csv` of `talus study`. Errors in per cent of the reference's mean with one standard error; under
each setting its cost, CPU seconds relative to the reference."""
import csv
import math
import sys

WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 480, 270, 44, 34, 52
COLOURS = {"mean_slip": "#0072b2", "stress_ratio": "#d55e00", "volumetric_strain": "#009e73", "coordination": "#000"}
NAMES = {"mean_slip": "slip", "stress_ratio": "stress ratio", "volumetric_strain": "volumetric strain",
         "coordination": "coordination"}


def number(text):
    return float(text) if text not in ("", "nan") else math.nan


def quantity(metric):
    return next((name for name in COLOURS if metric.startswith(name)), None)


def rows_of(path):
    with open(path, newline="", encoding="utf-8") as file:
        return [row for row in csv.DictReader(file) if quantity(row["metric"])]


def dials(rows):
    """Names of the columns between the setting and the metric."""
    return list(rows[0])[1:list(rows[0]).index("metric")]


def title(path, rows):
    study = path.rsplit("/", 1)[-1].split(".")[0]
    names = ", ".join(dials(rows))
    return names if study in names else f"{study}: {names}"


def text(x, y, what, size=11, anchor="middle", colour="#222"):
    what = str(what).replace("&", "&amp;").replace("<", "&lt;")
    return f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" text-anchor="{anchor}" fill="{colour}">{what}</text>'


def percent(row):
    """Error and its standard error in per cent of the reference's mean."""
    mean = number(row["mean"]) - number(row["error"])
    return 100 * number(row["error"]) / abs(mean), 100 * number(row["error_standard_error"]) / abs(mean)


def panel(path, x0, y0):
    rows = rows_of(path)
    settings = list(dict.fromkeys(row["setting"] for row in rows if row["reference"] != "yes"))
    reference = next(row for row in rows if row["reference"] == "yes")
    metrics = list(dict.fromkeys(quantity(row["metric"]) for row in rows))
    points = {(row["setting"], quantity(row["metric"])): percent(row) for row in rows if row["reference"] != "yes"}
    reach = max([abs(e) + s for e, s in points.values() if math.isfinite(e + s)] + [1])
    reach = min(reach, 60)
    right, bottom = x0 + WIDTH - 10, y0 + HEIGHT - BOTTOM

    def across(k):
        return x0 + LEFT + (k + 0.5) * (right - x0 - LEFT) / len(settings)

    def up(value):
        value = max(-reach, min(reach, value))
        return (y0 + TOP + bottom) / 2 - value / reach * (bottom - y0 - TOP) / 2 * 0.96

    out = [text(x0 + LEFT, y0 + 20, title(path, rows), 14, "start"),
           text(right, y0 + 20, "reference " + reference["setting"], 11, "end", "#666"),
           f'<rect x="{x0 + LEFT}" y="{y0 + TOP}" width="{right - x0 - LEFT}" height="{bottom - y0 - TOP}" '
           'fill="none" stroke="#bbb"/>']
    step = next(s for s in (0.5, 1, 2, 5, 10, 20, 50) if reach / s < 4)
    tick = -int(reach / step)
    while tick * step <= reach:
        y = up(tick * step)
        out.append(f'<path d="M{x0 + LEFT} {y:.1f}H{right}" stroke="{"#888" if tick == 0 else "#e4e4e4"}"/>')
        out.append(text(x0 + LEFT - 4, y + 4, f"{tick * step:g}", 10, "end"))
        tick += 1
    for k, setting in enumerate(settings):
        cost = next(number(r["cpu_time[s]"]) for r in rows if r["setting"] == setting)
        size = 10 if len(settings) < 7 else 8
        values = [value.split("=")[-1] for value in setting.split(", ")]
        for line, value in enumerate(values):
            out.append(text(across(k), bottom + 13 + 11 * line, value, size))
        share = cost / number(reference["cpu_time[s]"])
        out.append(text(across(k), bottom + 13 + 11 * len(values), f"{share:.2g}", size, colour="#666"))
        for m, metric in enumerate(metrics):
            error, deviation = points.get((setting, metric), (math.nan, math.nan))
            if not math.isfinite(error):
                continue
            x = across(k) + (m - (len(metrics) - 1) / 2) * min(9, 60 / len(settings))
            colour = COLOURS[metric]
            out.append(f'<path d="M{x:.1f} {up(error - deviation):.1f}V{up(error + deviation):.1f}" stroke="{colour}"/>')
            if abs(error) > reach:
                out.append(text(x, up(error) + (4 if error < 0 else 10), f"{error:.0f}", 9, colour=colour))
            else:
                out.append(f'<circle cx="{x:.1f}" cy="{up(error):.1f}" r="3" fill="{colour}"/>')
    return out


paths, columns = sys.argv[1:], 2
lines = math.ceil(len(paths) / columns)
print(f'<svg xmlns="http://www.w3.org/2000/svg" font-family="DejaVu Sans,sans-serif" '
      f'viewBox="0 0 {columns * WIDTH} {lines * HEIGHT + 50}">')
print('<rect width="100%" height="100%" fill="#fff"/>')
print(text(10, 20, "error (% of the reference), 8 seeds, bars: one standard error; below each setting its cost over "
           "the reference's", 13, "start"))
where = 10
for metric in COLOURS:
    print(text(where, 40, "● " + NAMES[metric], 13, "start", COLOURS[metric]))
    where += 8 * len(NAMES[metric]) + 40
for index, path in enumerate(paths):
    print("\n".join(panel(path, index % columns * WIDTH, index // columns * HEIGHT + 50)))
print("</svg>")
