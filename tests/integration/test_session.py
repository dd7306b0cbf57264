# SPDX-License-Identifier: Apache-2.0
"""What JACK is given in a session under a competing load is, bit for bit, the offline rendering of its trace.

CARILLON_SESSION_SECONDS says how long it goes on: 600 is the whole campaign, and there a missed block is no excuse.
"""

import os
import pathlib
import tempfile
import unittest

import session

SECONDS = int(os.environ.get("CARILLON_SESSION_SECONDS", "0"))


class SessionTest(unittest.TestCase):
    def test_a_session_sounds_as_the_rendering_of_its_trace(self):
        with tempfile.TemporaryDirectory(prefix="carillon-") as scratch:
            played = session.Session(pathlib.Path(scratch))
            self.addCleanup(played.stop)
            found = played.run(SECONDS or 8)
        print(found, flush=True)
        # Only xruns that cost a frame count. JACK also tells of cycles in which it was late itself.
        missed = found["missed_cycles"] + found["lost_frames"] + found["late"] + found["merged_or_shed"]
        if missed > 0 and not (SECONDS and found["realtime"]):
            self.skipTest("too busy for sound here, or no real-time priority: something was missed")
        self.assertEqual(missed, 0)
        self.assertEqual((found["rejected"], found["dropped"]), (0, 0))
        self.assertEqual(found["frames"], found["rendered_frames"])
        self.assertEqual(found["differing_frames"], 0)
        self.assertGreater(found["sounding_frames"], found["frames"] / 2)
        self.assertGreaterEqual(found["decompositions"], 1)


if __name__ == "__main__":
    unittest.main()
