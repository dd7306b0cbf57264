# SPDX-License-Identifier: Apache-2.0
"""Connections that say nothing, or too much, do not keep others out for long."""

import contextlib
import resource
import socket
import subprocess
import sys
import time
import unittest

import grpc

import torture
from carillon.v1 import audio_service_pb2
from certificates import self_signed
from daemon import BIN, Daemon

DESCRIPTORS = 1024
ACCEPTED_AGAIN_S = 1.0 if torture.LONG else 30.0
# After this time the daemon closes connections that have not sent their HTTP/2 settings.
HANDSHAKE_S = 5.0


# A client that opens many connections, says so, and waits to be killed.
CROWDING = """
import socket, sys, time
made = []
for _ in range(int(sys.argv[2])):
    made.append(socket.socket(socket.AF_UNIX))
    made[-1].connect(sys.argv[1])
print("ready", flush=True)
time.sleep(1000)
"""


class ConnectionTest(torture.ScratchTest):
    def serve(self, *arguments):
        """A daemon whose limit of descriptors cannot be raised."""
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", *arguments,
                             prefix=("prlimit", f"--nofile={DESCRIPTORS}:{DESCRIPTORS}"))
        self.addCleanup(self.daemon.kill)
        self.port = int(self.daemon.listening[1].rsplit(":", 1)[1])

    def answers(self, address):
        channel = grpc.insecure_channel(address, options=[("grpc.use_local_subchannel_pool", 1)])
        with contextlib.closing(channel), contextlib.suppress(grpc.RpcError):
            call = channel.unary_unary("/carillon.v1.AudioService/GetMixer",
                                       audio_service_pb2.GetMixerRequest.SerializeToString,
                                       audio_service_pb2.GetMixerResponse.FromString)
            call(audio_service_pb2.GetMixerRequest(), timeout=2)
            return True
        return False

    def silent(self, family, address, count):
        """Connections that send nothing; some of them are refused."""
        made = []
        for _ in range(count):
            connection = socket.socket(family, socket.SOCK_STREAM)
            connection.settimeout(2)
            with contextlib.suppress(OSError):
                connection.connect(address)
            made.append(connection)
        return made

    def addresses(self):
        return ((socket.AF_UNIX, str(self.folder / "socket"), self.daemon.server),
                (socket.AF_INET, ("127.0.0.1", self.port), f"127.0.0.1:{self.port}"))

    def test_the_listener_accepts_again_when_silent_connections_are_closed(self):
        self.serve()
        for family, address, server in self.addresses():
            for _ in range(torture.rounds(1, 20)):
                with self.subTest(server=server):
                    silent = self.silent(family, address, 1100)
                    for connection in silent:
                        connection.close()
                    again_s = torture.wait_until(lambda server=server: self.answers(server), ACCEPTED_AGAIN_S)
                    print(f"{server}: accepts {again_s:.2f} s after 1,100 silent connections", flush=True)

    def test_silent_connections_are_closed_after_a_while(self):
        self.serve()
        silent = self.silent(socket.AF_INET, ("127.0.0.1", self.port), 1100)
        waited_s = torture.wait_until(lambda: self.answers(f"127.0.0.1:{self.port}"),
                                      HANDSHAKE_S + ACCEPTED_AGAIN_S + 4)
        print(f"accepts {waited_s:.2f} s after 1,100 connections that stay silent", flush=True)
        for connection in silent:
            connection.close()

    def test_one_process_cannot_take_all_connections(self):
        self.serve()
        crowding = subprocess.Popen([sys.executable, "-c", CROWDING, self.folder / "socket", "1000"],
                                    stdout=subprocess.PIPE, text=True)
        self.addCleanup(crowding.stdout.close)
        self.addCleanup(crowding.wait)
        self.addCleanup(crowding.kill)
        self.assertEqual(crowding.stdout.readline(), "ready\n")
        torture.wait_until(lambda: "its share (--client-share)" in self.log(), HANDSHAKE_S)
        self.assertTrue(self.answers(self.daemon.server))
        self.assertEqual(self.log().count("closed a new connection from"), 1, self.log())

    def log(self):
        return (self.folder / "log").read_text()

    def test_tls_accepts_again_too(self):
        certificate, key = self_signed(self.folder)
        self.serve("--tls-certificate", certificate, "--tls-key", key)
        for connection in self.silent(socket.AF_INET, ("127.0.0.1", self.port), 1100):
            connection.close()

        def answers():
            return subprocess.run([BIN / "carillon", "--server", f"127.0.0.1:{self.port}", "--tls-roots", certificate,
                                   "status"], capture_output=True, check=False, timeout=60).returncode == 0
        torture.wait_until(answers, ACCEPTED_AGAIN_S + 1)

    def test_many_calls_at_once_on_one_connection_are_answered_in_bounded_memory(self):
        self.serve()
        self.assertTrue(self.answers(self.daemon.server))
        process = self.daemon.process
        before_mib = torture.resident_mib(process)
        count = torture.rounds(2_000, 20_000)
        client = self.daemon.client()
        begin_s = time.monotonic()
        calls = [client.audio.GetMixer.future(audio_service_pb2.GetMixerRequest()) for _ in range(count)]
        most_mib = before_mib
        for call in calls:
            call.result()
            most_mib = max(most_mib, torture.resident_mib(process)) if call is calls[len(calls) // 2] else most_mib
        print(f"{count} calls at once: {time.monotonic() - begin_s:.1f} s, {before_mib:.0f} MiB before, "
              f"{most_mib:.0f} MiB amid, {torture.resident_mib(process):.0f} MiB after", flush=True)
        self.assertLess(torture.resident_mib(process) - before_mib, 100)


if __name__ == "__main__":
    unittest.main()
