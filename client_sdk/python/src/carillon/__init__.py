# SPDX-License-Identifier: Apache-2.0
"""The Python client of Carillon, the daemon that makes rigid-body simulations audible.

    import carillon

    with carillon.connect() as c:
        bell = c.create_model("bell.obj", material="bell_bronze")
        sound = bell.render_strike(point=(0, 0, 0.1), impulse=(0, 0, -0.01))
        sound.save("bell.wav")

`connect` talks to a running daemon. `carillon.aio.connect` does the same for asyncio. Every refusal is a CarillonError,
whose `reason` programs can act upon.
"""

from carillon import aio, fit, motion
from carillon.address import default_server
from carillon.client import Client, connect
from carillon.contacts import ContactForces, Contacts, Impacts, Poses, striker
from carillon.errors import (
    CarillonError, ContactWarning, HearingWarning, LabelWarning, ServerUnavailable, TransferWarning)
from carillon.jobs import Job
from carillon.materials import material
from carillon.meshes import MeshFile
from carillon.models import Model
from carillon.performing import Ambisonics, Ears, HearingEnvironment, Omni, Performance, Stereo
from carillon.scenes import Scene, SoundingObject
from carillon.sound import Sound
from carillon.streams import ContactStream
from carillon.traces import Trace
from carillon.version import __version__

__all__ = ["Ambisonics", "CarillonError", "Client", "ContactForces", "ContactStream", "ContactWarning", "Contacts",
           "Ears", "HearingEnvironment", "HearingWarning", "Impacts", "Job", "LabelWarning", "MeshFile", "Model",
           "Omni", "Performance", "Poses", "Scene", "ServerUnavailable", "Sound", "SoundingObject", "Stereo", "Trace",
           "TransferWarning", "__version__", "aio", "connect", "default_server", "fit", "material", "motion", "striker"]
