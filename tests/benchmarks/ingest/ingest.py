# SPDX-License-Identifier: Apache-2.0
"""What ingest.cc does, in Python.

Usage: ingest.py SERVER SCENE rows|columns IMPULSES_A_MESSAGE SECONDS DELAY_S
"""

import json
import sys
import time

import numpy

import carillon
from carillon.contacts import make_step, vector
from carillon.v1 import contact_pb2

OBJECT_COUNT, POINT, IMPULSE, DURATION_S = 16, (0, 0.008, 0.01), (0, 0, -1e-5), 1e-3
# Steps that may wait before the sender rests; the client would drop them at 4096.
MOST_WAITING = 256


def maker(form, count):
    """Returns the function that makes the step of a time."""
    handles = 1 + numpy.arange(count) % OBJECT_COUNT
    if form == "columns":
        impacts = carillon.Impacts(handles, numpy.tile(POINT, (count, 1)), numpy.tile(IMPULSE, (count, 1)),
                                   durations=DURATION_S)
        return lambda time_s: make_step(time_s, impacts=impacts)

    def make_rows(time_s):
        step = contact_pb2.ContactStep(time_s=time_s)
        for handle in handles.tolist():
            step.contacts.add(kind=contact_pb2.CONTACT_KIND_IMPACT, object=handle, point_m=vector(POINT),
                              impulse_newton_seconds=vector(IMPULSE), duration_s=DURATION_S)
        return step

    return make_rows


def main():
    server, scene, form, count, seconds, delay = sys.argv[1:]
    make = maker(form, int(count))
    with carillon.connect(server) as c:
        stream = carillon.Scene(c, scene).stream(step=1e-3, delay=float(delay))
        begin, cpu_before = time.monotonic(), time.process_time()
        while (elapsed := time.monotonic() - begin) < float(seconds):
            if stream.waiting_step_count < MOST_WAITING:
                stream.send(make(elapsed))
            else:
                time.sleep(2e-4)
        report = stream.close()
        print(json.dumps({
            "seconds": time.monotonic() - begin, "cpu_s": time.process_time() - cpu_before,
            "accepted": report.accepted_count, "late": report.late_count, "dropped": report.dropped_count,
            "rejected": report.rejected_count, "steps": report.step_count}))


if __name__ == "__main__":
    main()
