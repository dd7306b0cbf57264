# SPDX-License-Identifier: Apache-2.0
"""Sound as an array, which can be saved, played in a notebook, measured and plotted."""

from __future__ import annotations

import base64
import dataclasses
import io
import os
import pathlib
import wave
from typing import Any, Optional

import numpy

from carillon import checks
from carillon.v1 import audio_service_pb2


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Sound:
    """Frames x channels of float32; full scale is 1. `lost_frame_count` frames were not received. `first_frame` of a
    recording is the number of its first frame since the daemon's start, as `report.first_frame` of a stream. `summary`
    has what the daemon measured while it rendered the sound offline: loudness, pressure, findings about the contacts.
    `blows` are the impulses that sounded, if Client.render was asked for them with tell_blows=True."""

    samples: numpy.ndarray
    sample_rate_hz: int
    lost_frame_count: int = 0
    summary: Optional[audio_service_pb2.RenderSummary] = None
    blows: tuple[audio_service_pb2.Blow, ...] = ()
    first_frame: Optional[int] = None

    def __repr__(self) -> str:
        return (f"<Sound: {self.seconds:.3g} s, {self.sample_rate_hz} Hz, "
                f"{checks.counted(self.samples.shape[1], 'channel')}, peak {self.peak:.3g}>")

    @property
    def seconds(self) -> float:
        return len(self.samples) / self.sample_rate_hz

    @property
    def peak(self) -> float:
        return float(numpy.abs(self.samples).max(initial=0))

    @property
    def mono(self) -> numpy.ndarray:
        """The mean of the channels."""
        mean: numpy.ndarray = self.samples.mean(axis=1)
        return mean

    def normalized(self, peak: float = 0.9) -> Sound:
        """Returns the sound with this peak; silence stays silent. The modes of a rendering end at -140 dB of full scale
        all the same: for a soft sound use Client.render(trace, normalize=True), or give it a full_scale_pa."""
        return dataclasses.replace(self, samples=self.samples * (peak / self.peak if self.peak else 1))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a WAV file of 24-bit samples; samples beyond full scale are clipped. Raises ValueError if the name of
        the file is that of another format."""
        suffix = pathlib.PurePath(path).suffix.lower()
        if suffix not in ("", ".wav", ".wave"):
            raise ValueError(f"{os.fspath(path)} must end with .wav, because the file is a WAV file")
        with open(path, "wb") as file:
            file.write(self.wave_bytes())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Sound:
        """Reads a WAV file of 16, 24 or 32-bit integers. Raises wave.Error for another."""
        with wave.open(os.fspath(path), "rb") as file:
            width, channels = file.getsampwidth(), file.getnchannels()
            data = numpy.frombuffer(file.readframes(file.getnframes()), numpy.uint8).reshape(-1, width)
            if width < 2:
                raise wave.Error(f"{os.fspath(path)} has samples of 8 bits")
            words = numpy.zeros((len(data), 4), numpy.uint8)
            words[:, 4 - width:] = data
            samples = words.view("<i4").astype(numpy.float32) / numpy.float32(2**31)
            return cls(samples.reshape(-1, channels), file.getframerate())

    def wave_bytes(self) -> bytes:
        words = numpy.rint(numpy.clip(self.samples, -1, 1) * (2**23 - 1)).astype("<i4")
        file = io.BytesIO()
        with wave.open(file, "wb") as out:
            out.setnchannels(self.samples.shape[1])
            out.setsampwidth(3)
            out.setframerate(self.sample_rate_hz)
            out.writeframes(words.view(numpy.uint8).reshape(-1, 4)[:, :3].tobytes())
        return file.getvalue()

    def spectrum(self) -> tuple[numpy.ndarray, numpy.ndarray]:
        """Returns frequencies, Hz, and magnitudes of the mean of the channels under the falling half of Blackman's
        window, which suits a sound that begins with a strike."""
        count = len(self.samples)
        magnitude = numpy.abs(numpy.fft.rfft(self.mono * numpy.blackman(2 * count)[count:]))
        return numpy.fft.rfftfreq(count, 1 / self.sample_rate_hz), magnitude

    def loudest_frequency_hz(self) -> float:
        """Returns the frequency of the highest peak of the spectrum."""
        frequencies, magnitude = self.spectrum()
        return float(frequencies[numpy.argmax(magnitude)])

    def plot(self, axes: Any = None) -> Any:
        """Draws the waveform; needs matplotlib. Returns its axes."""
        from carillon import plots
        return plots.plot_sound(self, axes)

    def plot_spectrum(self, axes: Any = None) -> Any:
        """Draws the spectrum in decibels; needs matplotlib. Returns its axes."""
        from carillon import plots
        return plots.plot_spectrum(self, axes)

    def _repr_html_(self) -> str:
        """A player for notebooks."""
        data = base64.b64encode(self.wave_bytes()).decode()
        return (f'<figure><audio controls src="data:audio/wav;base64,{data}"></audio><figcaption>{self.seconds:.2f} s, '
                f"{self.sample_rate_hz} Hz, peak {self.peak:.3f}</figcaption></figure>")
