# SPDX-License-Identifier: Apache-2.0
"""A material found from recorded strikes, with a picture of how well it explains them.

    found = carillon.fit.material(bowl, ["tap1.wav", "tap2.wav", "tap3.wav"], mass=0.24)
    found.plot()
    client.create_model("bowl.obj", material=found.material)

The program `carillon material` does the work (docs/fit.md), so it must be installed.
"""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import tempfile
from collections.abc import Iterable, Mapping
from typing import Any, Literal, Optional, Union

from google.protobuf import text_format

from carillon import programs
from carillon.sound import Sound
from carillon.v1 import material_pb2

Path = Union[str, "os.PathLike[str]"]
Body = Union[str, Any]  # a Model, or what names one on the command line


@dataclasses.dataclass(frozen=True)
class Line:
    """A line of a recording, with standard errors. `near_room`: it decays about as fast as the room. If a mode of
    the model explains it, `mode` (from 1) and the fields after it say how."""

    frequency_hz: float
    frequency_error_hz: float
    decay_per_s: float
    decay_error_per_s: float
    level_db: float
    signal_to_noise_db: float
    near_room: bool = False
    body: str = ""
    mode: Optional[int] = None
    model_hz: float = 0
    radiation_per_s: float = 0
    law_per_s: float = 0
    law_error_per_s: float = 0


@dataclasses.dataclass(frozen=True)
class Extraction:
    """The lines of recorded strikes. `room_t60_s` is None where no room was told apart. `gain_fall_db` is by how much
    an automatic gain control, a gate or a reduction of noise turned the level down at the blows, as the noise tells, or
    zero; it changes the decays. `clipped_s` is how long the recording that is clipped most is so, or zero."""

    lines: list[Line]
    strike_count: int
    room_t60_s: Optional[float]
    gain_fall_db: float = 0
    clipped_s: float = 0


@dataclasses.dataclass(frozen=True)
class Fit:
    """A material, and how it explains the recordings. Errors are standard errors, those of E/rho and of the damping are
    relative, the latter the median over the matched lines. `text` is the material as a file that `carillon ...
    --material-file` reads. `nearest_material` is the named material nearest to it, and `cautions` say what to check,
    for example if none is near. `laws` are the laws of damping, the chosen one
    first, as `carillon --json material fit` prints them, and empty where a room or noise hides most decays. `modes_hz`
    has the frequencies of all modes of each body with that material. `residual` is what the matched modes leave of the
    first strike, and `residual_shares` its share of the energy from one second to another."""

    material: material_pb2.Material
    text: str
    young_pa: float
    density_kg_per_m3: float
    poisson_ratio: float
    poisson_error: float
    young_over_density: float
    young_over_density_error: float
    matched: int
    rms: float
    log_odds: float
    lines: list[Line]
    laws: list[dict[str, Any]]
    damping_error: float
    nearest_material: str
    cautions: list[str]
    modes_hz: dict[str, list[float]]
    residual: Optional[Sound]
    residual_shares: list[tuple[float, float, float]]
    recordings: dict[str, list[Path]]

    def __repr__(self) -> str:
        return (f"Fit({self.nearest_material}?: E {self.young_pa / 1e9:.4g} GPa, Poisson's ratio "
                f"{self.poisson_ratio:.3f}, {self.density_kg_per_m3:.4g} kg/m^3, {self.matched} of {len(self.lines)} "
                f"lines matched, {100 * self.rms:.2g} % apart)")

    def plot(self, body: Optional[str] = None, axes: Any = None) -> Any:
        """Draws, for the first body or the one named, the spectrum of its recordings with the lines and the modes of
        the model, matched and unmatched, and below it decay over frequency with the law; needs matplotlib. `axes` are
        two. Returns them."""
        from carillon import plots
        return plots.plot_fit(self, next(iter(self.modes_hz)) if body is None else body, axes)


def extract(recordings: Union[Path, Iterable[Path]], *, program: str = "carillon") -> Extraction:
    """Lists the frequencies and the decays of recorded strikes on one body. Raises CarillonError, with the reasons of
    proto/errors.md, such as TOO_FEW_MODES."""
    found = json.loads(programs.run(program, None, "--json", "material", "extract", *_files(recordings)).stdout)
    return Extraction([Line(**mode) for mode in found["modes"]], found["strikes"], found["room_t60_s"],
                      found["gain_fall_db"], found["clipped_s"])


def material(model: Body, recordings: Union[Path, Iterable[Path]], *, mass: Optional[float] = None,
             density: Optional[float] = None, poisson: Optional[float] = None,
             young_range: Optional[tuple[float, float]] = None,
             damping: Literal["auto", "eta", "table", "rayleigh"] = "auto",
             others: Optional[Mapping[Body, Union[Path, Iterable[Path]]]] = None, server: Optional[str] = None,
             program: str = "carillon") -> Fit:
    """Finds the material of a body whose model the daemon at `server` has, from recorded strikes, or from tables of
    modes measured elsewhere (.csv). `mass` in kg or `density` in kg/m^3 must be given; `poisson` and `young_range`, Pa,
    if they are known. `others` are further bodies of the same material, with their recordings. Raises CarillonError,
    with the reasons of proto/errors.md, such as MATCH_AMBIGUOUS."""
    if mass is not None and density is not None:
        raise ValueError("mass and density exclude each other: the mass gives the density by the model's volume")
    bodies = {_name(body): _files(files) for body, files in {model: recordings, **(others or {})}.items()}
    first, *rest = bodies
    words: list[Any] = [first, *bodies[first]]
    for name in rest:
        words += ["--and", name, *bodies[name]]
    given = {"--mass": mass, "--density": density, "--poisson": poisson,
             "--young-range": young_range and ":".join(map(repr, young_range))}
    for option, value in given.items():
        words += [] if value is None else [option, value]
    with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
        out, rest_file = pathlib.Path(folder, "found.textproto"), pathlib.Path(folder, "rest.wav")
        found = json.loads(programs.run(program, server, "--json", "material", "fit", *words, "--damping", damping,
                                        "--out", out, "--residual", rest_file).stdout)
        text = out.read_text()
        residual = Sound.load(rest_file) if rest_file.exists() else None
    shares = [(part["from_s"], part["to_s"], part["share"]) for part in found.pop("residual", [])]
    same = [field.name for field in dataclasses.fields(Fit) if field.name in found and field.name != "lines"]
    return Fit(text_format.Parse(text, material_pb2.Material()), text, **{name: found[name] for name in same},
               lines=[Line(**line) for line in found["lines"]],
               modes_hz={body["name"]: body["modes_hz"] for body in found["bodies"]}, residual=residual,
               residual_shares=shares, recordings=bodies)


def _files(recordings: Union[Path, Iterable[Path]]) -> list[Path]:
    return [recordings] if isinstance(recordings, (str, os.PathLike)) else list(recordings)


def _name(body: Body) -> str:
    return body if isinstance(body, str) else body.name
