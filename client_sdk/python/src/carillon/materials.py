# SPDX-License-Identifier: Apache-2.0
"""Materials, and the frequencies and decay rates that they give the modes of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, Optional, Protocol, Union

import numpy

from carillon import checks, errors
from carillon.connection import Connection
from carillon.v1 import material_pb2, modal_model_pb2, modal_model_service_pb2, radiation_pb2

Material = Union[str, material_pb2.Material, Mapping[str, Union[str, material_pb2.Material]]]
"""A name of the catalogue, a message, or a table from the regions of the mesh file to the material of each. The key ""
stands for all regions that the table does not name."""
Radiation = Literal["paper_coupling", "radiated_power", "modes_only"]


class ModelLike(Protocol):
    """A Model, or an AsyncModel."""

    @property
    def name(self) -> str: ...

    @property
    def material(self) -> Optional[Material]: ...


def material(preset: str = "", *, loss_factor: float | dict[float, float] | None = None,
             **figures: Any) -> material_pb2.Material:
    """Makes a material: a named one, figures that override those of the named one, or figures alone.

    `figures` are young_pa, poisson_ratio, density_kg_per_m3, alpha1_s and alpha2_per_s. `loss_factor` is a number, or a
    table from the frequency in Hz to the loss factor there.
    """
    made: material_pb2.Material = checks.message(material_pb2.Material, "material", {"preset": preset, **figures})
    if loss_factor is not None:
        table = loss_factor if isinstance(loss_factor, dict) else {1000.0: loss_factor}
        for frequency_hz, value in sorted(table.items()):
            made.loss_factor.add(frequency_hz=frequency_hz, loss_factor=value)
    return made


def to_message(given: Material) -> material_pb2.Material:
    if isinstance(given, material_pb2.Material):
        return given
    if isinstance(given, Mapping):
        if any(isinstance(value, (int, float)) for value in given.values()):
            raise TypeError(f"material is {dict(given)!r}, and a dictionary names the material of each region of the "
                            "mesh; give figures by carillon.material(young_pa=..., density_kg_per_m3=..., ...)")
        return material_pb2.Material(regions=[
            material_pb2.RegionMaterial(region=region, material=to_message(of_region))
            for region, of_region in given.items()])
    if not isinstance(given, str):
        raise TypeError(f"material is of type {type(given).__name__}; it must be a name such as \"oak\", or "
                        "carillon.material(...)")
    return material_pb2.Material(preset=given)


def to_radiation(name: Optional[Radiation]) -> radiation_pb2.RadiationModel:
    return checks.choice(radiation_pb2.RadiationModel, "RADIATION_MODEL_", "radiation", name)


def named(model: ModelLike | str, given: Optional[Material]) -> tuple[str, Optional[material_pb2.Material]]:
    """Returns the name of a model, and the material to sound with: the one given, or else the one that the model was
    asked for with. None leaves the choice to the daemon, which remembers it, too."""
    name = model if isinstance(model, str) else getattr(model, "name", None)
    if not isinstance(name, str) or not name:
        checks.refuse(model, "the model", "a Model, or its name")
    chosen = given if given is not None or isinstance(model, str) else model.material
    return name, None if chosen is None else to_message(chosen)


async def catalogue(connection: Connection) -> dict[str, material_pb2.Material]:
    """The daemon's materials by name, which a connection asks for once."""
    if connection.catalogue is None:
        request = modal_model_service_pb2.ListMaterialsRequest()
        answer = await connection.ask(connection.models_stub.ListMaterials, request)
        connection.catalogue = {item.name: item.material for item in answer.materials}
    return connection.catalogue


async def resolve(connection: Connection, given: Material) -> material_pb2.Material:
    """Replaces the name of a material by its figures."""
    message = to_message(given)
    known = await catalogue(connection)
    for preset in [message.preset, *(entry.material.preset for entry in message.regions)]:
        if preset and preset not in known:
            raise errors.CarillonError("UNKNOWN_MATERIAL", f"there is no material \"{preset}\"; "
                                       + (checks.suggestion(preset, known) or "Client.materials has all of them"))
    return resolved(message, known)


def resolved(given: material_pb2.Material, known: dict[str, material_pb2.Material]) -> material_pb2.Material:
    """Replaces the names of a material and of those of its regions by the figures of the catalogue, which the given
    figures override."""
    if given.regions:
        return material_pb2.Material(regions=[
            material_pb2.RegionMaterial(region=entry.region, material=resolved(entry.material, known))
            for entry in given.regions])
    if not given.preset:
        return given
    made = material_pb2.Material()
    made.CopyFrom(known[given.preset])
    if given.loss_factor:
        del made.loss_factor[:]
    made.MergeFrom(given)
    made.preset = ""
    return made


def matched(given: material_pb2.Material, regions: Sequence[modal_model_pb2.ModalModelRegion],
            known: dict[str, material_pb2.Material]) -> material_pb2.Material:
    """Returns a resolved material with one entry for each region of a model, in the model's order, and with the model's
    reference as its figures."""
    if bool(regions) != bool(given.regions):
        raise errors.CarillonError("REGION_MATERIAL_DIFFERS", "either the model has several materials and one is "
                                   "given, or the reverse")
    if not regions:
        return given
    of_region = {entry.region.lower(): entry.material for entry in given.regions}
    made = material_pb2.Material()
    for region in regions:
        name = region.properties.region.lower()
        found = of_region.get(name) or of_region.get("") or known.get(name)
        if found is None:
            raise errors.CarillonError("REGION_MATERIAL_DIFFERS", f"the region \"{name}\" of the model has no material")
        made.regions.add(region=name, material=found)
    first = regions[0].properties
    made.young_pa = made.regions[0].material.young_pa / first.relative_young
    made.density_kg_per_m3 = made.regions[0].material.density_kg_per_m3 / first.relative_density
    return made


def loss_factor_at(given: material_pb2.Material, frequency_hz: numpy.ndarray) -> numpy.ndarray:
    """Interpolates log eta linearly over log frequency; eta is constant outside the table."""
    if not given.loss_factor or not given.loss_factor[0].loss_factor:  # where one is zero, all are
        return numpy.zeros_like(frequency_hz)
    table = numpy.log([(point.frequency_hz, point.loss_factor) for point in given.loss_factor])
    return numpy.exp(numpy.interp(numpy.log(frequency_hz), table[:, 0], table[:, 1]))


def modes_of(eigenvalues: numpy.ndarray, given: material_pb2.Material,
             size: float, regions: Sequence[modal_model_pb2.ModalModelRegion] = ()
             ) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Returns the damped frequencies, Hz, and the decay rates, 1/s, of a body of this material and size relative to
    the model, by the material alone. An overdamped mode has frequency zero. In a body of several materials, to whose
    `regions` the material was matched, each region damps a mode in proportion to its part of the energies. See
    docs/physics.md."""
    omega = numpy.sqrt(eigenvalues * given.young_pa / given.density_kg_per_m3) / size
    damping = [(entry.material, numpy.array(region.strain_energy_parts), numpy.array(region.kinetic_energy_parts))
               for entry, region in zip(given.regions, regions)] or [(given, numpy.ones(1), numpy.ones(1))]
    decay = numpy.zeros_like(omega)
    for of_region, strain, kinetic in damping:
        eta = loss_factor_at(of_region, omega / (2 * numpy.pi))
        decay += (strain * (of_region.alpha1_s * omega**2 + eta * omega) + kinetic * of_region.alpha2_per_s) / 2
    return numpy.sqrt(numpy.maximum(0, omega**2 - decay**2)) / (2 * numpy.pi), decay


def radiation_decays_of(eigenvalues: numpy.ndarray, given: material_pb2.Material, size: float,
                        transfers: Iterable[modal_model_service_pb2.TransferSummary]) -> numpy.ndarray:
    """Returns the decay rates by radiation, 1/s, rho_air Lambda I/(2 c rho size), of the transfer that is nearest to
    the material and serves it; zeros if none does."""
    speed = (given.young_pa / given.density_kg_per_m3) ** 0.5

    def distance(transfer: modal_model_service_pb2.TransferSummary) -> float:
        return abs(float(numpy.log(speed / (transfer.header.speed_ratio * transfer.header.sound_speed_m_per_s))))

    fitting = [transfer for transfer in transfers
               if distance(transfer) <= 0.05 and len(transfer.power_integrals) == len(eigenvalues)]
    if not fitting:
        return numpy.zeros_like(eigenvalues)
    nearest = min(fitting, key=distance)
    air = nearest.header.air_density_kg_per_m3 / (2 * nearest.header.sound_speed_m_per_s)
    decays: numpy.ndarray = (air * eigenvalues * given.young_pa / given.density_kg_per_m3**2 / size
                             * numpy.array(nearest.power_integrals))
    return decays
