# SPDX-License-Identifier: Apache-2.0
"""The scenes of the examples: blocks and boxes that a ball knocks over, falling letters, a bowl that rolls on its rim.

Each function returns a scene (docs/decisions/0042), and writes the meshes that it names into a folder.
"""

import math

import bunnies
import falls

FLOOR = {"name": "floor", "shape": {"plane": {}}}
WOOD_KG_PER_M3 = 550  # of the material block_wood
WALL_SHARE = 0.05


def write_obj(path, vertices, faces):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def blocks(_folder, side=0.05):
    """Six hollow blocks of wood in a pile, three, two and one, and a ball of wood that rolls into them."""
    mass = WOOD_KG_PER_M3 * side**3 * (1 - (1 - 2 * WALL_SHARE)**3)
    sides = [side] * 3
    bodies = [FLOOR]
    for row in range(3):
        for column in range(3 - row):
            across = (column - (2 - row) / 2) * 1.1 * side
            bodies.append({
                "name": f"block {len(bodies)}", "shape": {"boxes": [{"sides_m": sides}]}, "mass_kg": mass,
                "inertia_kg_m2": falls.box_inertia(mass, sides), "position_m": [0, across, (row + 0.5) * side],
                "material": "block_wood", "wall_m": WALL_SHARE * side, "max_frequency_hz": 1000 / side})
    radius, speed = 0.6 * side, 2 * math.sqrt(side / 0.05)
    heavy = 3 * mass
    bodies.append({"name": "ball", "shape": {"ball": {"radius_m": radius}}, "mass_kg": heavy,
                   "inertia_kg_m2": [0.4 * heavy * radius**2] * 3, "position_m": [-8 * side, 0.1 * side, radius],
                   "velocity_m_per_s": [speed, 0, 0], "angular_velocity_rad_per_s": [0, speed / radius, 0]})
    return {"friction": 0.5, "restitution": 0, "bodies": bodies, "extent_m": 10 * side,
            "seconds": 2.5}


def boxes(folder):
    """The same ten times as large: the frequencies are a tenth."""
    return blocks(folder, side=0.5)


# Rows of cells from the top; all letters are of one thickness.
LETTERS = {
    "T": ("#######", "#######", "..###..", "..###..", "..###..", "..###..", "..###..", "..###..", "..###.."),
    "H": ("##...##", "##...##", "##...##", "#######", "#######", "##...##", "##...##", "##...##", "##...##"),
    "E": ("#######", "#######", "##.....", "#####..", "#####..", "##.....", "##.....", "#######", "#######"),
    "N": ("##...##", "###..##", "###..##", "####.##", "##.####", "##..###", "##..###", "##...##", "##...##"),
    "D": ("#####..", "######.", "##..###", "##...##", "##...##", "##...##", "##..###", "######.", "#####.."),
}
CELL_M, DEPTH_M, LETTER_KG_PER_M3 = 0.025, 0.05, 2700


def cells_of(letter):
    """The middles of its cells in its plane, about their mean."""
    rows = LETTERS[letter]
    cells = [(column, len(rows) - row) for row, line in enumerate(rows) for column, mark in enumerate(line)
             if mark == "#"]
    return cells, [sum(cell[axis] for cell in cells) / len(cells) for axis in (0, 1)]


def letter_mesh(letter):
    """Its cells as a block: a square for each side of a cell that no other cell shares."""
    cells, (mean_x, mean_z) = cells_of(letter)
    vertices, faces, filled = {}, [], set(cells)

    def corner(x, y, z):
        return vertices.setdefault((x, y, z), len(vertices))

    def square(*corners):
        a, b, c, d = (corner(*at) for at in corners)
        faces.extend(((a, b, c), (a, c, d)))

    for x, z in cells:
        square((x, 0, z), (x + 1, 0, z), (x + 1, 0, z + 1), (x, 0, z + 1))
        square((x, 1, z), (x, 1, z + 1), (x + 1, 1, z + 1), (x + 1, 1, z))
        if (x - 1, z) not in filled:
            square((x, 0, z), (x, 0, z + 1), (x, 1, z + 1), (x, 1, z))
        if (x + 1, z) not in filled:
            square((x + 1, 0, z), (x + 1, 1, z), (x + 1, 1, z + 1), (x + 1, 0, z + 1))
        if (x, z - 1) not in filled:
            square((x, 0, z), (x, 1, z), (x + 1, 1, z), (x + 1, 0, z))
        if (x, z + 1) not in filled:
            square((x, 0, z + 1), (x + 1, 0, z + 1), (x + 1, 1, z + 1), (x, 1, z + 1))
    placed = [(CELL_M * (x - 0.5 - mean_x), DEPTH_M * (y - 0.5), CELL_M * (z - 0.5 - mean_z)) for x, y, z in vertices]
    return placed, faces


def letter_body(letter, folder):
    """A letter that stands in the plane of x and z. Its moments leave out what its asymmetry adds beside the axes."""
    write_obj(folder / f"{letter}.obj", *letter_mesh(letter))
    cells, means = cells_of(letter)
    cell = LETTER_KG_PER_M3 * CELL_M**2 * DEPTH_M
    places = [(CELL_M * (x - means[0]), CELL_M * (z - means[1])) for x, z in cells]
    own = falls.box_inertia(cell, [CELL_M, DEPTH_M, CELL_M])
    away = [sum(cell * z * z for _, z in places), sum(cell * (x * x + z * z) for x, z in places),
            sum(cell * x * x for x, _ in places)]
    return {"name": letter, "mesh": f"{letter}.obj", "mass_kg": cell * len(cells), "material": "letter_t",
            "inertia_kg_m2": [len(cells) * a + b for a, b in zip(own, away)], "max_frequency_hz": 10000,
            "shape": {"boxes": [{"sides_m": [CELL_M * count, DEPTH_M, CELL_M],
                                 "position_m": [CELL_M * (first + count / 2 - 0.5 - means[0]), 0,
                                                CELL_M * (z - means[1])]}
                                for z, first, count in runs_of(cells)]}}


def runs_of(cells):
    """(row, first column, number of columns) of cells side by side."""
    runs = []
    for x, z in sorted(cells, key=lambda cell: (cell[1], cell[0])):
        if runs and runs[-1][0] == z and runs[-1][1] + runs[-1][2] == x:
            runs[-1][2] += 1
        else:
            runs.append([z, x, 1])
    return runs


def letters(folder):
    """THE END, which falls upright, one letter after the other, and topples."""
    bodies = [FLOOR]
    for number, letter in enumerate("THEEND"):
        at = (number - 2.5) * 0.22 + (0.05 if number > 2 else -0.05)
        bodies.append({**letter_body(letter, folder), "position_m": [at, 0, 0.3 + 0.1 * number],
                       "orientation": falls.product(falls.about((1, 0, 0), 12 + 2 * number),
                                                    falls.about((0, 1, 0), (-1)**number * 6))})
    return {"friction": 0.4, "restitution": 0, "bodies": bodies, "extent_m": 1.4, "seconds": 2.5}


BOWL_RADIUS_M, BOWL_WALL_M = 0.08, 0.004


def bowl_mesh(around=48, down=12):
    """Half a sphere that opens along +z, about its centre of mass if it were thin."""
    vertices, faces = [], []
    for radius in (BOWL_RADIUS_M, BOWL_RADIUS_M - BOWL_WALL_M):
        for ring in range(down):
            angle = math.pi / 2 * (1 - ring / down)
            vertices += [(radius * math.sin(angle) * math.cos(2 * math.pi * i / around),
                          radius * math.sin(angle) * math.sin(2 * math.pi * i / around),
                          BOWL_RADIUS_M / 2 - radius * math.cos(angle)) for i in range(around)]
        vertices.append((0, 0, BOWL_RADIUS_M / 2 - radius))
    inner = down * around + 1
    for i in range(around):
        j = (i + 1) % around
        for ring in range(down - 1):
            for upper, lower in ((ring, ring + 1),):
                a, b = upper * around, lower * around
                faces += [(a + i, b + i, b + j), (a + i, b + j, a + j)]
                a, b = inner + b, inner + a
                faces += [(a + i, b + i, b + j), (a + i, b + j, a + j)]
        last = (down - 1) * around
        faces += [(last + i, last + around, last + j), (inner + last + j, inner + last + around, inner + last + i)]
        faces += [(inner + i, i, j), (inner + i, j, inner + j)]
    return vertices, faces


# How the rim's plane leans at first, and how fast the bowl falls.
BOWL_LEANS_DEGREES, BOWL_FALLS_M_PER_S = 30, 0.5


def rolling(leans_degrees, radius_m, height_m, across_m2, along_m2):
    """The angular velocity in the world, rad/s, of a body that leans about x and rolls on a rim without its centre of
    mass moving: the torque of its weight about the centre turns its angular momentum as the body precesses. The centre
    of mass is at a height above the rim's plane; the moments of inertia are divided by the mass."""
    sine, cosine = math.sin(math.radians(leans_degrees)), math.cos(math.radians(leans_degrees))
    lever = radius_m * cosine - height_m * sine
    precession = math.sqrt(9.81 * lever / (sine * (across_m2 * cosine - along_m2 * height_m / radius_m * sine)))
    up_slope, axis = (0, -cosine, sine), (0, sine, cosine)
    return [precession * sine * (a + height_m / radius_m * b) for a, b in zip(up_slope, axis)]


def bowl(folder, material="bowl_metal"):
    """A bowl that falls on its rim, aslant, and rolls on it until it lies."""
    vertices, faces = bowl_mesh()
    write_obj(folder / "bowl.obj", vertices, faces)
    mass, height, square = 0.4, BOWL_RADIUS_M / 2, BOWL_RADIUS_M**2
    across, along, leans = square * 5 / 12, square * 2 / 3, math.radians(BOWL_LEANS_DEGREES)
    return {"friction": 0.4, "restitution": 0, "roughness_depth": 0.3, "irregularity_length_m": 0.0005, "extent_m": 0.4,
            "look_at_m": (0, 0, 0.1), "camera_m": (0.25, -0.7, 0.3), "seconds": 6, "bodies": [FLOOR, {
                "name": "bowl", "mesh": "bowl.obj", "shape": {"hull": {"corners_m": vertices[:12 * 48 + 1]}},
                "mass_kg": mass, "inertia_kg_m2": [mass * across, mass * across, mass * along],
                "position_m": [0, 0, BOWL_RADIUS_M * math.sin(leans) + height * math.cos(leans) + 0.001],
                "orientation": falls.about((1, 0, 0), 180 - BOWL_LEANS_DEGREES),
                "velocity_m_per_s": [0, 0, -BOWL_FALLS_M_PER_S],
                "angular_velocity_rad_per_s": rolling(BOWL_LEANS_DEGREES, BOWL_RADIUS_M, height, across, along),
                "material": material, "max_frequency_hz": 16000}]}


def wooden_bowl(folder):
    """The same motion in wood."""
    return bowl(folder, "bowl_wood")


EXAMPLES = {"blocks": blocks, "boxes": boxes, "letters": letters, "bowl": bowl, "wooden_bowl": wooden_bowl,
            "bunnies": bunnies.bunnies}
