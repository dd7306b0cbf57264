# SPDX-License-Identifier: Apache-2.0
"""Contact traces that Python does not read."""

import pathlib
import tempfile
import unittest

import carillon


class DamagedTraceTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="carillon-")))

    def test_damaged_and_newer_traces_are_refused(self):
        trace = carillon.Trace(1 / 60)
        trace.step(0.5)
        file = self.folder / "damaged.contacts"
        trace.write(file)
        whole = file.read_bytes()
        header = bytes([4, 0x0A, 2, 8, 1])
        newer = bytes([4, 0x0A, 2, 8, 9])
        unknown_kind = bytes([3, 0x7A, 1, 0])
        for data, reason in ((whole[:-3], "TRACE_MALFORMED"), (b"", "TRACE_MALFORMED"), (newer, "TRACE_TOO_NEW"),
                             (bytes([2, 0x0A, 0]), "TRACE_MALFORMED"), (header + unknown_kind, "TRACE_MALFORMED"),
                             (b"\xff" * 9 + b"\x01", "TRACE_MALFORMED"), (b"\xff" * 100, "TRACE_MALFORMED")):
            with self.subTest(data=data[:20]):
                file.write_bytes(data)
                with self.assertRaises(carillon.CarillonError) as refused:
                    carillon.Trace.read(file)
                self.assertEqual(refused.exception.reason, reason)


if __name__ == "__main__":
    unittest.main()
