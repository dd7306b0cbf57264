# SPDX-License-Identifier: Apache-2.0
"""The errors in print of the paper, each with a number that confirms or refutes it."""

import math

import numpy
from bench import head, row as line

CORNERS = numpy.array([(0, 0, 0), (.03, .002, 0), (.004, .025, .001), (.002, .003, .02)])


def equation_12(material, prefactor):
    """Elastic energy of a uniform strain in one tetrahedron by the matrix of equation 12 with a prefactor in units of
    the volume, over the energy of linear elasticity."""
    beta = numpy.linalg.inv(numpy.vstack([CORNERS.T, numpy.ones(4)]))[:, :3]
    volume = numpy.linalg.det(CORNERS[1:] - CORNERS[0]) / 6
    one = numpy.eye(3)
    stiffness = prefactor * volume * (
        material.lame_lambda * numpy.einsum("ia,jb->iajb", beta, beta)
        + material.lame_mu * numpy.einsum("ib,ja->iajb", beta, beta)
        + material.lame_mu * numpy.einsum("ab,ik,jk->iajb", one, beta, beta)).reshape(12, 12)
    strain = 1e-3 * numpy.array([(1, .2, 0), (.2, -.5, .3), (0, .3, .7)])
    moved = (CORNERS @ strain).reshape(12)
    energy = volume * (material.lame_lambda * numpy.trace(strain)**2 / 2 + material.lame_mu * (strain**2).sum())
    return moved @ stiffness @ moved / 2 / energy


def first_velocity(factor):
    """The velocity at t = 0 of equation 8 with the constants of equations 16 and 17, over that of the impulse dt g.
    They have the factor 2."""
    step_s, force, high = 1e-3, 2., -3 + 500j
    low = high.conjugate()
    one, other = factor * step_s * force / (high - low), factor * step_s * force / (low - high)
    return ((one * high + other * low) / (step_s * force)).real


def decays_off(rows):
    """The rows whose printed decay is not that of their printed frequency to the last digit: (name, printed, right)."""
    found = []
    for row in rows:
        right, printed = row.material.decay_per_s(row.printed.damped_hz), row.printed.decay_per_s
        # The frequency, too, is printed to a tenth.
        reach = abs(row.material.decay_per_s(row.printed.damped_hz + .05) - right)
        if abs(right - printed) > .05 + reach:
            found.append((row.name, printed, right))
    return found


def verdict(confirmed):
    return "confirmed" if confirmed else "**refuted**"


def possible_ratio(low, high, size=1):
    """Bounds of the ratio of natural frequencies of one body in two materials, whatever its shape and mesh: stiffness
    is lambda A + mu B with A and B positive semidefinite, so that every eigenvalue lies between both scalings. `size`:
    of the body of `low` over that of `high`."""
    density = low.density / high.density
    bounds = [size * math.sqrt(above / below * density) for above, below in
              ((high.lame_lambda, low.lame_lambda), (high.lame_mu, low.lame_mu))]
    return min(bounds), max(bounds)


def of_equations(chime):
    """Rows about equations. `chime`: D3 in Table 2, (measured, computed) Hz."""
    from rows import table1
    material = table1()[0].material
    printed, right = equation_12(material, .5), equation_12(material, 1)
    measured, computed = chime
    yield line("eq. 12", "prefactor vol/2", "vol",
               f"energy of a strained tetrahedron over that of linear elasticity: {printed:.3f} with vol/2, "
               f"{right:.3f} with vol; D3 would be {computed / math.sqrt(2):.1f} Hz instead of {computed:.1f}, "
               f"measured {measured}", verdict(abs(printed - .5) < 1e-9 and abs(right - 1) < 1e-9))
    low, high = 20 * 2 * math.pi, 20000 * 2 * math.pi
    yield line("3.4, step 3", "3.18 to 3,180 rad/s", "125.7 to 125,664 rad/s",
               f"20 Hz is {low:.1f} rad/s, 20 kHz {high:,.0f}; the printed bounds are 20/(2 pi) = "
               f"{20 / 2 / math.pi:.2f} and {20000 / 2 / math.pi:,.0f}", verdict(abs(20 / 2 / math.pi - 3.18) < .005))
    yield line("eq. 16 to 18", "2 dt g", "dt g",
               f"velocity just after an impulse dt g, by equation 8, over dt g: {first_velocity(2):.3f} as printed, "
               f"{first_velocity(1):.3f} without the factor", verdict(abs(first_velocity(2) - 2) < 1e-9))


def of_table1(rows, solved):
    """Rows about Table 1."""
    ceramic, metal, boxes, blocks, wood, aluminum = (rows[name] for name in (
        "bunny (ceramic)", "bunny (metal)", "boxes", "blocks", "shelf (wood)", "shelf (aluminum)"))
    ratio = solved[metal.name].natural_hz / solved[ceramic.name].natural_hz
    metal_hz = ceramic.natural_hz * ratio
    least, most = possible_ratio(ceramic.material, metal.material)
    yield line("Table 1, bunny (metal)", "855.9 Hz, 19.5 1/s", "about 3027 Hz, 18.1 1/s",
               f"our two bunnies stand as 1 : {ratio:.3f}, and any must as 1 : {least:.3f} to {most:.3f}; 855.9 Hz of "
               f"the ceramic one becomes {metal_hz:.1f} Hz with {metal.material.decay_per_s(metal_hz):.2f} 1/s; ours "
               f"of metal: {solved[metal.name].natural_hz:.1f} Hz", verdict(abs(metal_hz - 3027) < 5))
    boxes_decay = boxes.material.decay_per_s(boxes.printed.damped_hz)
    off = [name for name, _, _ in decays_off(rows.values())]
    yield line("Table 1, boxes", "decay 49.0 1/s", "29.0 1/s",
               f"{boxes_decay:.2f} 1/s from the row's own 159.1 Hz; rows whose decay does not follow from their "
               f"frequency: {', '.join(off)}", verdict(abs(boxes_decay - 29) < .05))
    boxes_hz = math.sqrt((blocks.natural_hz / 10)**2 - (boxes_decay / 2 / math.pi)**2)
    yield line("Table 1, boxes", "159.1 Hz", f"{boxes_hz:.1f} Hz on the mesh of the blocks",
               f"a tenth of the natural {blocks.natural_hz:.1f} Hz of the blocks, damped; the printed pair stands as "
               f"1 : {blocks.natural_hz / boxes.natural_hz:.3f} in natural frequency, which damping does not explain",
               "found here")
    least, most = possible_ratio(wood.material, aluminum.material)
    yield line("Table 1, shelf (wood)", "154.6 Hz", "unknown",
               f"to the shelf of aluminum as 1 : {aluminum.natural_hz / wood.natural_hz:.3f}; with the printed "
               f"constants any one shape and mesh gives 1 : {least:.3f} to {most:.3f}, so that shape, mesh or a "
               "constant differs",
               "found here")


def table(rows, solved, chime):
    """`rows` by name, `solved` the best of each by name, `chime` (measured, computed) Hz of D3 in Table 2."""
    return [*head("where", "printed", "right", "computed here", "verdict"), *of_equations(chime),
            *of_table1(rows, solved)]
