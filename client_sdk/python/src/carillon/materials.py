# SPDX-License-Identifier: Apache-2.0
"""Materials, and the frequencies and decay rates that they give the modes of a model."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, Optional, Protocol, Union

import numpy

from carillon import checks, errors
from carillon.connection import Connection
from carillon.v1 import material_pb2, modal_model_service_pb2, radiation_pb2

Material = Union[str, material_pb2.Material]
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
    if not isinstance(given, str):
        raise TypeError(f"material is of type {type(given).__name__}; it must be a name such as \"oak\", or "
                        "carillon.material(...)")
    return material_pb2.Material(preset=given)


def to_radiation(name: Optional[Radiation]) -> radiation_pb2.RadiationModel:
    return checks.choice(radiation_pb2.RadiationModel, "RADIATION_MODEL_", "radiation", name)


def named(model: ModelLike | str, given: Optional[Material]) -> tuple[str, Optional[material_pb2.Material]]:
    """Returns the name of a model, and the material to sound with: the one given, or else the one that the model was
    asked for with. None leaves the choice to the daemon, which remembers it, too."""
    name = model if isinstance(model, str) else model.name
    if not name:
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
    if message.preset and message.preset not in known:
        raise errors.CarillonError("UNKNOWN_MATERIAL", f"there is no material \"{message.preset}\"; "
                                   + (checks.suggestion(message.preset, known)
                                      or "Client.materials has all of them"))
    return resolved(message, known)


def resolved(given: material_pb2.Material, known: dict[str, material_pb2.Material]) -> material_pb2.Material:
    """Replaces the name of a material by the figures of the catalogue, which the given figures override."""
    if not given.preset:
        return given
    made = material_pb2.Material()
    made.CopyFrom(known[given.preset])
    if given.loss_factor:
        del made.loss_factor[:]
    made.MergeFrom(given)
    made.preset = ""
    return made


def loss_factor_at(given: material_pb2.Material, frequency_hz: numpy.ndarray) -> numpy.ndarray:
    """Interpolates log eta linearly over log frequency; eta is constant outside the table."""
    if not given.loss_factor or not given.loss_factor[0].loss_factor:  # where one is zero, all are
        return numpy.zeros_like(frequency_hz)
    table = numpy.log([(point.frequency_hz, point.loss_factor) for point in given.loss_factor])
    return numpy.exp(numpy.interp(numpy.log(frequency_hz), table[:, 0], table[:, 1]))


def modes_of(eigenvalues: numpy.ndarray, given: material_pb2.Material,
             size: float) -> tuple[numpy.ndarray, numpy.ndarray]:
    """Returns the damped frequencies, Hz, and the decay rates, 1/s, of a body of this material and size relative to
    the model, by the material alone. An overdamped mode has frequency zero. See docs/physics.md."""
    omega = numpy.sqrt(eigenvalues * given.young_pa / given.density_kg_per_m3) / size
    eta = loss_factor_at(given, omega / (2 * numpy.pi))
    decay = (given.alpha1_s * omega**2 + given.alpha2_per_s + eta * omega) / 2
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
