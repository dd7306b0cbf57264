# SPDX-License-Identifier: Apache-2.0
"""How the sound of contacts that `carillon.motion` finds in the poses of frames differs from the sound of the engine's
own contacts: levels of octaves, peak, and the envelope of 5 ms."""

import numpy

SAMPLE_RATE_HZ, ENGINE_HZ = 48000, 2400
FRAME_RATES = (24, 30, 60, 120, 240)
OCTAVES_HZ = (250, 500, 1000, 2000, 4000, 8000)
AUDIBLE_DB = 30  # octaves this far below the loudest one do not count
GAIN = 0.01  # no limiter shall make levels alike
COLUMNS = ("scene", "frames/s", *(f"{hz} Hz" for hz in OCTAVES_HZ), "peak", "envelope: median difference, correlation",
           "unexplained", "ambiguous")


def scenes():
    """A hollow block of wood and a hollow box of concrete that fall on a corner and tumble."""
    import falls
    import scene_makers
    floor, block = scene_makers.blocks(None)["bodies"][:2]
    sides, mass = (0.2, 0.14, 0.06), 1.21
    box = {"name": "box", "shape": {"boxes": [{"sides_m": sides}]}, "mass_kg": mass,
           "inertia_kg_m2": falls.box_inertia(mass, sides), "material": "concrete", "wall_m": 0.006,
           "max_frequency_hz": 8000}
    start = {"position_m": (0, 0, 0.3), "velocity_m_per_s": (0.3, 0, 0),
             "orientation": (0.84419, 0.3485584, -0.4056972, -0.03549596)}
    return {body["name"]: {"friction": 0.5, "restitution": 0.3, "seconds": 1.2,
                           "bodies": [floor, {**body, **start}]} for body in ({**block, "name": "block"}, box)}


def decibels(power):
    return 10 * numpy.log10(power + 1e-30)


def octaves_db(samples):
    power = numpy.abs(numpy.fft.rfft(samples)) ** 2
    hz = numpy.fft.rfftfreq(len(samples), 1 / SAMPLE_RATE_HZ)
    edge = 2 ** 0.5
    return {centre: decibels(power[(hz >= centre / edge) & (hz < centre * edge)].sum()) for centre in OCTAVES_HZ}


def envelope_db(samples):
    frames = int(0.005 * SAMPLE_RATE_HZ)
    return decibels(numpy.square(samples[:len(samples) // frames * frames].reshape(-1, frames)).mean(1))


def render(client, trace):
    for body in trace.objects:
        body.gain = GAIN
    return client.render(trace, sample_rate_hz=SAMPLE_RATE_HZ, tail_s=1).mono


def find(server, scene, steps):
    """The contacts of the scene's one body, of which each step has the pose."""
    import carillon.motion
    import falls
    body = scene["bodies"][1]
    bodies = {body["name"]: carillon.motion.Body(falls.mesh_of(body, falls.SCENES), body["material"],
                                                 wall=body["wall_m"], mass=body["mass_kg"])}
    poses = {body["name"]: tuple(zip(*((step.poses.position_m, step.poses.orientation) for step in steps)))}
    return carillon.motion.contacts(bodies, [step.time_s for step in steps], poses, floor=0,
                                    friction=1.2 * scene["friction"], server=server)


def row(truth, found, samples):
    frames = max(len(truth), len(samples))
    truth, samples = (numpy.pad(one, (0, frames - len(one))) for one in (truth, samples))
    true_db, found_db = octaves_db(truth), octaves_db(samples)
    audible = max(true_db.values()) - AUDIBLE_DB
    levels = [f"{found_db[hz] - true_db[hz]:+.1f}" if true_db[hz] > audible else "-" for hz in OCTAVES_HZ]
    envelopes = envelope_db(truth), envelope_db(samples)
    loud = envelopes[0] > envelopes[0].max() - 60
    return [*levels, f"{decibels((abs(samples).max() / abs(truth).max()) ** 2):+.1f}",
            f"{numpy.median(abs(envelopes[0] - envelopes[1])[loud]):.1f} dB, "
            f"{numpy.corrcoef(envelopes[0][loud], envelopes[1][loud])[0, 1]:.2f}",
            f"{100 * found.unexplained:.2f} %", f"{100 * found.ambiguous:.0f} %"]


def rows(daemon, build):
    """Yields a row for each scene and rate of frames."""
    import carillon
    import falls
    with carillon.connect(daemon.server) as client:
        for label, scene in scenes().items():
            path = daemon.folder / f"{label}.contacts"
            falls.record("bullet", falls.create_models(client, scene), path, rate=ENGINE_HZ, build=build)
            trace = carillon.Trace.read(path)
            truth = render(client, trace)
            for rate in FRAME_RATES:
                try:
                    found = find(daemon.server, scene, trace.steps[::ENGINE_HZ // rate])
                except carillon.CarillonError as error:
                    yield label, rate, error.reason
                    continue
                yield label, rate, *row(truth, found, render(client, found.trace))
