#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Computes the tables of O'Brien, Shen, Gatchalian 2002 anew, and writes docs/REPRODUCTION.md.

    run.py --build BUILD [--out docs]

Writes REPRODUCTION.md with pictures/figure3.png, figure4.png, figure5.png and sound_models.png, and six sounds into
BUILD/paper. Exits with 1, without the page, where an error in print is refuted, a chime is off by more than 2 % from
the measured one or, with linear elements, 1.5 % from the computed one, or one that was tuned is off by 1 Hz.
deploy/paper.sh installs what this needs.
"""

import json
import math
import pathlib
import string
import sys
import tempfile

sys.dont_write_bytecode = True
HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / folder) for folder in ("", "decomposition", "truth")]
import bench  # noqa: E402
import bodies  # noqa: E402
import programs  # noqa: E402
import table2  # noqa: E402
from bench import head, row as line  # noqa: E402
from table2 import percent  # noqa: E402


def clock(seconds):
    """As the paper prints it."""
    hours, rest = divmod(round(seconds), 3600)
    minutes, left = divmod(rest, 60)
    return " ".join(f"{count} {unit}" for count, unit in ((hours, "h"), (minutes, "min"), (left, "s")) if count)


def frequency_table(rows, linear, best):
    yield from head("row", "the paper, Hz", "linear, Hz (nodes, elements)", "quadratic, Hz (nodes, elements)",
                    "estimated error", "size at which ours has the paper's frequency")
    for row in rows:
        low, high = linear[row.name], best[row.name]
        size = high.natural_hz / row.natural_hz
        yield line(row.name, f"{row.printed.damped_hz} ({row.printed.nodes})",
                   f"{low.base['damped_frequency_hz']:.1f} ({low.nodes}, {low.elements})",
                   f"{high.base['damped_frequency_hz']:.1f} ({high.nodes}, {high.elements})",
                   f"{100 * high.base['estimated_error']:.2f} %", f"x {size:.3f}")


def decay_table(rows, best):
    yield from head("row", "printed, 1/s", "from the printed frequency, 1/s", "ours, 1/s", "our T60, s")
    for row in rows:
        decay = best[row.name].decay_per_s
        yield line(row.name, row.printed.decay_per_s, f"{row.material.decay_per_s(row.printed.damped_hz):.2f}",
                   f"{decay:.2f}", f"{math.log(1000) / decay:.3g}")


def time_table(rows, linear, best):
    yield from head("row", "method, paper", "time, paper", "modes to 20 kHz", "CPU s, linear", "times less",
                    "CPU s, quadratic (modes)")
    for row in rows:
        low, high = linear[row.name], best[row.name]
        yield line(row.name, row.printed.method, clock(row.printed.seconds), len(low.modes), f"{low.cpu_s:.2f}",
                   f"{row.printed.seconds / low.cpu_s:,.0f}", f"{high.cpu_s:.2f} ({len(high.modes)})")


RATIOS = [("shelf (plastic)", "shelf (aluminum)"), ("shelf (wood)", "shelf (aluminum)"), ("bowl 2", "bowl 1"),
          ("bunny (ceramic)", "bunny (metal)"), ("boxes", "blocks")]


def ratio_table(rows, best):
    """Natural frequencies of rows that share a shape."""
    from errata import possible_ratio
    yield from head("rows", "the paper, damped as printed", "the paper, natural", "ours, natural", "possible")
    for below, above in RATIOS:
        low, high = rows[below], rows[above]
        least, most = possible_ratio(low.material, high.material, 10 if below == "boxes" else 1)
        yield line(f"{below} : {above}", f"1 : {high.printed.damped_hz / low.printed.damped_hz:.4f}",
                   f"1 : {high.natural_hz / low.natural_hz:.4f}",
                   f"1 : {best[above].natural_hz / best[below].natural_hz:.4f}",
                   f"1 : {least:.4f} to {most:.4f}")


def chime_tables(solver, aluminum):
    """The lines of two tables, and the quadratic frequency of each chime at its measured length in Hz."""
    options = ["--keep-surface", "--band", "20:2500", *aluminum.options()]
    first = head("note", "length, m", "measured, Hz", "computed in the paper, Hz", "quadratic, Hz (nodes, CPU s)",
                 "from measured", "beam theory, Hz", "linear, Hz (nodes, CPU s)", "from the paper's")
    second = head("note", "ideal, Hz", "adjusted length, m", "the paper, Hz", "quadratic, Hz", "from the paper's",
                  "`tune`: length, m", "from the paper's", "Hz", "from the ideal, Hz", "solves")
    found, tuned_to = {}, {}
    for note, (ideal, length, measured, computed, adjusted, tuned) in table2.CHIMES.items():
        best = solver.solve(bodies.tube(length, 16, round(100 * length)), note, options)
        linear = solver.solve(bodies.tube(length, 48, 195), f"{note}, linear", [*options, "--element", "linear"])
        if table2.off(linear.natural_hz, computed, 1.5):
            sys.exit(f"{note}: {linear.natural_hz:.2f} Hz with linear elements, {computed} in the paper")
        other = solver.solve(bodies.tube(adjusted, 16, round(100 * adjusted)), f"{note}, adjusted", options)
        found[note] = best.natural_hz
        first.append(line(note, length, measured, computed, f"{best.natural_hz:.2f} ({best.nodes}, {best.cpu_s:.1f})",
                          percent(best.natural_hz, measured), f"{table2.timoshenko_hz(length):.2f}",
                          f"{linear.natural_hz:.2f} ({linear.nodes}, {linear.cpu_s:.1f})",
                          percent(linear.natural_hz, computed)))
        ours = tune(solver.folder, note, length, ideal, options)
        tuned_to[note] = ours["frequency_hz"] - ideal
        second.append(line(note, ideal, adjusted, tuned, f"{other.natural_hz:.2f}", percent(other.natural_hz, tuned),
                           f"{ours['length_m']:.4f}", f"{1000 * (ours['length_m'] - adjusted):+.1f} mm",
                           f"{ours['frequency_hz']:.2f}", f"{tuned_to[note]:+.2f}", ours["solves"]))
    return first, second, found, max(map(abs, tuned_to.values()))


def tune(folder, note, length, ideal_hz, options):
    """What `carillon model tune` makes of a chime of the measured length."""
    import meshes
    path = folder / f"{note}_measured.obj"
    path.write_bytes(meshes.obj(*bodies.tube(length, 16, round(100 * length))))
    with programs.studio() as studio:
        studio.command("model", "create", path, "--label", note, "--wait", *options)
        return json.loads(studio.command("--json", "model", "tune", note, "--to", ideal_hz, "--by", "length"))


def compute(options, folder):
    """What the page is filled with, and whether all is as it must be."""
    import errata
    import figures
    import rows as paper
    import sound_models
    solver = paper.Solver(options.build, folder)
    rows = {row.name: row for row in paper.table1()}
    best = {name: solver.best(row) for name, row in rows.items()}
    linear = {name: solver.as_in_paper(row) for name, row in rows.items()}
    chimes, tuned, found, out_of_tune_hz = chime_tables(solver, rows["chime (D3)"].material)
    errors = errata.table(rows, best, (table2.CHIMES["D3"][2], found["D3"]))
    pictures = options.out / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    figures.figure3(folder, rows["bowl 1"], best["bowl 1"], pictures / "figure3.png")
    responses = figures.figure4(folder, rows["bunny (ceramic)"], pictures / "figure4.png")
    peaks = figures.figure5(rows, folder, pictures / "figure5.png")
    sounds = sound_models.compare(solver, rows, pictures / "sound_models.png", options.build / "paper")
    tables = {"frequencies": frequency_table(rows.values(), linear, best), "decays": decay_table(rows.values(), best),
              "times": time_table(rows.values(), linear, best), "ratios": ratio_table(rows, best), "chimes": chimes,
              "tuned": tuned, "errors": errors, "sounds": sounds}
    filled = {name: "\n".join(lines) for name, lines in tables.items()}
    filled |= sentences(rows, linear, best, peaks)
    filled |= {f"{name}_peaks": ", ".join(f"{hz:.0f}" for hz in highest) for name, highest in responses.items()}
    worst = max(abs(found[note] / chime[2] - 1) for note, chime in table2.CHIMES.items())
    filled["worst_chime"] = f"{100 * worst:.2f}"
    return filled, worst < .02 and out_of_tune_hz < 1 and "refuted" not in filled["errors"]


def sentences(rows, linear, best, peaks):
    """The figures within the page's text."""
    def too_high(name):
        return f"{linear[name].natural_hz / best[name].natural_hz:.2f}"

    blocks = rows["blocks"].natural_hz / best["blocks"].natural_hz
    residual = max(solved.residual for solved in (*best.values(), *linear.values()))
    faster = [row.printed.seconds / linear[name].cpu_s for name, row in rows.items()]
    return {"blocks_high": too_high("blocks"), "blocks_paper": f"{blocks:.2f}", "chime_high": too_high("chime (D3)"),
            "bowl_high": too_high("bowl 1"), "bunny_high": too_high("bunny (ceramic)"),
            "shelf_high": too_high("shelf (aluminum)"), "letter_high": too_high("the end (T)"),
            "residual": f"{residual:.1g}", "least_faster": f"{min(faster):,.0f}", "most_faster": f"{max(faster):,.0f}",
            "block_peak": f"{peaks['blocks'][0]:.0f}", "box_peak": f"{peaks['boxes'][0]:.0f}",
            "block_half": f"{peaks['blocks'][1]:.0f}", "box_half": f"{peaks['boxes'][1]:.0f}"}


def main():
    parser = bench.parser(__doc__)
    parser.add_argument("--out", type=pathlib.Path, default=bench.ROOT / "docs")
    options = parser.parse_args()
    bench.use(options.build, "client_sdk/examples/falls")
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        filled, good = compute(options, pathlib.Path(folder))
    page = string.Template((HERE / "REPRODUCTION.md.in").read_text()).substitute(filled)
    if not good:
        sys.exit("an error in print is refuted, or a chime is off by more than 2 %, or is tuned no better than 1 Hz:\n"
                 + page)
    (options.out / "REPRODUCTION.md").write_text(page)
    print(f"written: {options.out / 'REPRODUCTION.md'}")


if __name__ == "__main__":
    main()
