# SPDX-License-Identifier: Apache-2.0
"""Curved ten-node tetrahedra of Gmsh: Carillon beside CalculiX and SciPy on the same mesh, and beside Lamb's sphere.

CalculiX integrates stiffness and mass of a C3D10 with four points, Carillon exactly or nearly so. The matrices that are
given to SciPy are assembled here, once with four points and once by Gauss-Jacobi rules of five points: the first must
agree with CalculiX, the second with Carillon.
"""

import dataclasses
import json
import subprocess
import sys

import numpy
import scipy.sparse
import scipy.sparse.linalg
import scipy.special

import calculix
import compare
import lamb

MAX_DIFFERENCE = 1e-4
HIGH_HZ = 20000
LAMB_MODES = 10

KERNEL = 'SetFactory("OpenCASCADE");\n'
CYLINDER = KERNEL + "Cylinder(1) = {0, 0, 0, 0, 0, 0.1, 0.012};\n"
FORK = KERNEL + """
Rectangle(1) = {-0.016, -0.004, 0, 0.008, 0.008};
bend[] = Extrude {{0, -1, 0}, {0, 0, 0}, Pi} {Surface{1};};
Box(11) = {-0.016, -0.004, 0, 0.008, 0.008, 0.08};
Box(12) = {0.008, -0.004, 0, 0.008, 0.008, 0.08};
Box(13) = {-0.003, -0.004, -0.05, 0.006, 0.008, 0.038};
BooleanUnion(20) = {Volume{bend[1]}; Delete;}{Volume{11, 12, 13}; Delete;};
"""
SPHERE = KERNEL + "Sphere(1) = {0, 0, 0, 0.05};\n"
SPHERE_RADIUS_M = .05


@dataclasses.dataclass
class Body:
    name: str
    geometry: str
    edge_m: float
    high_hz: float


BODIES = [Body("cylinder", CYLINDER, .005, HIGH_HZ), Body("cylinder", CYLINDER, .0032, HIGH_HZ),
          Body("fork", FORK, .0035, HIGH_HZ), Body("fork", FORK, .0022, HIGH_HZ)]
SPHERES = [Body("sphere", SPHERE, edge, 90000) for edge in (.016, .0094, .006)]


def make_mesh(body, folder):
    """Gmsh's curved mesh, as body.inp."""
    (folder / "body.geo").write_text(
        body.geometry + f"Mesh.ElementOrder = 2; Mesh.SecondOrderLinear = 0;\n"
        f"Mesh.MeshSizeMin = {body.edge_m}; Mesh.MeshSizeMax = {body.edge_m};\n", encoding="ascii")
    subprocess.run(["gmsh", "-3", "body.geo", "-format", "inp", "-o", "body.inp"], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL)


def read_mesh(path):
    """Nodes used, and elements of ten nodes that count them from zero."""
    numbers, nodes, elements, block = [], [], [], ""
    for line in path.read_text(encoding="ascii").splitlines():
        if line.startswith("*"):
            block = line.replace(" ", "").upper()
        elif block == "*NODE":
            words = line.split(",")
            numbers.append(int(words[0]))
            nodes.append([float(word) for word in words[1:4]])
        elif block.startswith("*ELEMENT,TYPE=C3D10"):
            elements.append([int(word) for word in line.split(",")[1:11]])
    place = {number: i for i, number in enumerate(numbers)}
    elements = numpy.array([[place[n] for n in element] for element in elements])
    used, elements = numpy.unique(elements, return_inverse=True)
    return numpy.array(nodes)[used], elements.reshape(-1, 10)


def many_points():
    """Barycentric points and weights of a sum of one: Gauss-Jacobi, collapsed, exact for degree nine."""
    points, weights = [], []
    rules = [scipy.special.roots_jacobi(5, power, 0) for power in (2, 1, 0)]
    (x, wx), (y, wy), (z, wz) = [((1 + at) / 2, weight) for at, weight in rules]
    for i in range(5):
        for j in range(5):
            for k in range(5):
                a, b = x[i], (1 - x[i]) * y[j]
                c = (1 - a - b) * z[k]
                points.append([1 - a - b - c, a, b, c])
                weights.append(wx[i] * wy[j] * wz[k])
    return numpy.array(points), numpy.array(weights) / sum(weights)


def four_points():
    return calculix.POINTS["quadratic"], numpy.full(4, .25)


def derivatives(point):
    """Of the shape functions, by the last three barycentric coordinates: 10 by 3."""
    by_all = numpy.zeros((10, 4))
    for i in range(4):
        by_all[i, i] = 4 * point[i] - 1
    for e, (i, j) in enumerate(calculix.EDGES):
        by_all[4 + e, i], by_all[4 + e, j] = 4 * point[j], 4 * point[i]
    return by_all[:, 1:] - by_all[:, :1]


def assemble(nodes, elements, material, rule):
    """K and M of the isoparametric elements."""
    young, poisson, density = material
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    shear = young / (2 * (1 + poisson))
    places = nodes[elements]
    stiffness = numpy.zeros((len(elements), 10, 3, 10, 3))
    mass = numpy.zeros((len(elements), 10, 10))
    for point, weight in zip(*rule):
        by_reference = derivatives(point)
        jacobian = numpy.einsum("eni,nj->eij", places, by_reference)
        volume = weight / 6 * numpy.linalg.det(jacobian)
        gradient = numpy.einsum("nj,eji->eni", by_reference, numpy.linalg.inv(jacobian))
        outer = numpy.einsum("e,eia,ejb->eiajb", volume, gradient, gradient)
        stiffness += lame * outer + shear * outer.swapaxes(2, 4)
        trace = shear * numpy.einsum("eiaja->eij", outer)
        for a in range(3):
            stiffness[:, :, a, :, a] += trace
        values = calculix.shape_functions("quadratic", point)
        mass += density * volume[:, None, None] * numpy.outer(values, values)
    return sparse(stiffness, elements, len(nodes)), scipy.sparse.kron(
        scatter(mass, elements, len(nodes)), scipy.sparse.identity(3)).tocsc()


def scatter(values, indices, count):
    rows = numpy.repeat(indices, indices.shape[1], axis=1).ravel()
    columns = numpy.tile(indices, (1, indices.shape[1])).ravel()
    return scipy.sparse.coo_matrix((values.ravel(), (rows, columns)), shape=(count, count)).tocsc()


def sparse(stiffness, elements, count):
    unknowns = (3 * elements[:, :, None] + numpy.arange(3)).reshape(len(elements), 30)
    return scatter(stiffness.reshape(len(elements), 30, 30), unknowns, 3 * count)


def scipy_frequencies(nodes, elements, material, rule, count):
    stiffness, mass = assemble(nodes, elements, material, rule)
    factor = scipy.sparse.linalg.splu((stiffness - compare.SHIFT * mass).tocsc(), permc_spec="MMD_AT_PLUS_A",
                                      diag_pivot_thresh=0, options={"SymmetricMode": True})
    inverse = scipy.sparse.linalg.LinearOperator(stiffness.shape, factor.solve)
    eigenvalues = scipy.sparse.linalg.eigsh(stiffness, count + 6, mass, sigma=compare.SHIFT, OPinv=inverse,
                                            return_eigenvectors=False)
    return numpy.sqrt(numpy.sort(eigenvalues)[6:]) / (2 * numpy.pi)


def calculix_frequencies(nodes, elements, material, folder, environment, count):
    nodes.tofile(folder / "nodes")
    elements.astype(numpy.int32).tofile(folder / "elements")
    body = compare.Body("body", None, "quadratic", "consistent", material)
    calculix.write_input(folder / "theirs.inp", folder, body, count + 6)
    subprocess.run(["ccx", "-i", "theirs"], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return calculix.read_frequencies(folder / "theirs.dat")[6:]


def decompose(body, folder, options, environment):
    """Carillon's report."""
    young, poisson, density = compare.ALUMINIUM
    command = [options.build / "bin/carillon-precompute", folder / "body.inp", "--out", folder / "model", "--json",
               "--young", repr(young), "--poisson", repr(poisson), "--density", repr(density), "--band",
               f"20:{body.high_hz}", "--threads", "1"]
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, env=environment, check=False)
    if done.returncode != 0:
        sys.exit(f"{body.name}: Carillon failed")
    return json.loads(done.stdout)


def column(report, name):
    return numpy.array([mode[name] for mode in report["modes"]])


def compare_solvers(body, folder, options, environment):
    make_mesh(body, folder)
    ours = column(decompose(body, folder, options, environment), "frequency_hz")
    nodes, elements = read_mesh(folder / "body.inp")
    same = (nodes, elements, compare.ALUMINIUM)
    theirs = calculix_frequencies(*same, folder, environment, len(ours))
    exact = scipy_frequencies(*same, many_points(), len(ours))
    four = scipy_frequencies(*same, four_points(), len(ours))
    differences = [calculix.difference(*pair) for pair in ((ours, exact), (four, theirs))]
    verdict = "" if max(differences) <= MAX_DIFFERENCE else " (too large)"
    print(f"| {body.name} | {len(nodes)} | {len(ours)} | {ours[0]:.3f} | {theirs[0]:.3f} | {differences[0]:.1e} "
          f"| {differences[1]:.1e}{verdict} | {abs(ours[0] / theirs[0] - 1):.1e} "
          f"| {calculix.difference(ours, theirs):.1e} |", flush=True)


def compare_with_lamb(body, folder, options, environment):
    make_mesh(body, folder)
    report = decompose(body, folder, options, environment)
    young, poisson, density = compare.ALUMINIUM
    shear_speed = numpy.sqrt(young / (2 * (1 + poisson) * density))
    ours, estimated = column(report, "frequency_hz"), column(report, "estimated_error")
    true = lamb.etas(poisson, len(ours)) * shear_speed / (2 * numpy.pi * SPHERE_RADIUS_M)
    errors = ours / true - 1
    seconds = sum(phase["cpu_seconds"] for phase in report["phases"])
    print(f"| {report['nodes']} | {len(ours)} | {100 * abs(errors[:LAMB_MODES]).max():.4f} % "
          f"| {100 * abs(errors).max():.3f} % | {(estimated / errors).min():.2f}, "
          f"{numpy.median(estimated / errors):.2f}, {(estimated / errors).max():.2f} | {seconds:.1f} |", flush=True)


def curved(options, folder, environment):
    print("| body | nodes | modes to 20 kHz | first, Carillon Hz | first, CalculiX Hz | Carillon from SciPy, "
          "exact rule, every mode | SciPy, four points, from CalculiX | Carillon from CalculiX, first mode "
          "| every mode |\n" + "| --- " * 9 + "|", flush=True)
    for number, body in enumerate(BODIES):
        if not options.only or body.name in options.only:
            place = folder / str(number)
            place.mkdir()
            compare_solvers(body, place, options, environment)
    print("\n| nodes of the sphere | modes | largest error of the ten lowest | of all | estimated over true: least, "
          "median, most | CPU s |\n" + "| --- " * 6 + "|", flush=True)
    for number, body in enumerate(SPHERES):
        if not options.only or body.name in options.only:
            place = folder / f"sphere{number}"
            place.mkdir()
            compare_with_lamb(body, place, options, environment)
