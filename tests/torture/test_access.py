# SPDX-License-Identifier: Apache-2.0
"""Who may do what over TCP: by tokens and certificates, and nobody else."""

import contextlib
import hashlib
import os
import pathlib
import re
import signal
import socket
import ssl
import subprocess
import tempfile
import time
import unittest

import grpc

import carillon
import torture
from carillon.v1 import (
    admin_service_pb2, audio_service_pb2, contact_service_pb2, decomposition_service_pb2,
    modal_model_service_pb2, scene_service_pb2, scene_service_pb2_grpc, server_service_pb2)
from certificates import Authority
from daemon import BIN, ROOT, Daemon

ROLES = ("listen", "strike", "submit", "administer")
CONTRACT = (admin_service_pb2, audio_service_pb2, contact_service_pb2, decomposition_service_pb2,
            modal_model_service_pb2, scene_service_pb2, server_service_pb2)
TIMES = 100
CREATE = "/carillon.v1.SceneService/CreateScene"
REFUSED = (grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED, grpc.StatusCode.RESOURCE_EXHAUSTED)


def token_of(name):
    return f"{name}: a token for this test"


def line_of(name, roles):
    return f"{name} {roles} sha256:{hashlib.sha256(token_of(name).encode()).hexdigest()}\n"


def documented_roles():
    """The table of docs/limits_and_access.md: the role of each method."""
    page = (ROOT / "docs/limits_and_access.md").read_text()
    rows = re.findall(r"^\| (\w+|its run's token) \| (`.+) \|$", page, re.MULTILINE)
    return {f"/carillon.{'worker.' if private else ''}v1.{service}/{method}": role
            for role, calls in rows
            for service, private, methods in re.findall(r"`(\w+)`( \(private\))?: ([^;]+)", calls)
            for method in re.findall(r"`(\w+)`", methods)}


def methods_of_contract():
    for module in CONTRACT:
        for service in module.DESCRIPTOR.services_by_name.values():
            for method in service.methods:
                yield f"/{service.full_name}/{method.name}"


class NoAccessFileTest(unittest.TestCase):
    def test_a_scene_is_open_to_the_unix_socket_and_to_tcp_alike(self):
        with tempfile.TemporaryDirectory(prefix="carillon-") as folder:
            daemon = Daemon(pathlib.Path(folder), "--listen", "127.0.0.1:0")
            self.addCleanup(daemon.stop)
            servers = (daemon.server, daemon.listening[-1].split()[-1])
            for maker, user in (servers, servers[::-1]):
                with grpc.insecure_channel(maker) as made, grpc.insecure_channel(user) as used:
                    scene = scene_service_pb2_grpc.SceneServiceStub(made).CreateScene(
                        scene_service_pb2.CreateSceneRequest()).name
                    scene_service_pb2_grpc.SceneServiceStub(used).DeleteScene(
                        scene_service_pb2.DeleteSceneRequest(name=scene))


class AccessTest(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory(prefix="carillon-")
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)
        self.authority = Authority(self.folder)
        self.certificate, self.key = self.authority.issue("server")
        self.access = self.folder / "access"
        self.write_access(*(line_of(role, role) for role in ROLES), line_of("other", "strike"),
                          line_of("fresh", "listen"), "console listen certificate:console.example.org\n",
                          "common listen,strike certificate:common\n")

    def write_access(self, *lines):
        self.access.touch(0o600)
        self.access.write_text("# who may do what\n" + "".join(lines))

    def serve(self):
        self.daemon = Daemon(self.folder, "--listen", "127.0.0.1:0", "--tls-certificate", self.certificate,
                             "--tls-key", self.key, "--tls-client-roots", self.authority.certificate,
                             "--access-file", self.access)
        self.addCleanup(self.daemon.kill)
        self.address = self.daemon.listening[1].split()[-1]

    @contextlib.contextmanager
    def channel(self, certificate=None, key=None):
        files = [path and path.read_bytes() for path in (self.authority.certificate, key, certificate)]
        with grpc.secure_channel(self.address, grpc.ssl_channel_credentials(*files),
                                 [("grpc.use_local_subchannel_pool", 1)]) as channel:
            yield channel

    @staticmethod
    def outcome(channel, method, token=None, request=b""):
        """The status of a call, and the reason in its message. OK as soon as a response comes."""
        metadata = (("authorization", f"Bearer {token}"),) if token else ()
        call = channel.stream_stream(method)(iter([request]), metadata=metadata, timeout=20)
        try:
            next(call)
            call.cancel()
            return grpc.StatusCode.OK, ""
        except StopIteration:
            return grpc.StatusCode.OK, ""
        except grpc.RpcError as error:
            return error.code(), error.details().split(":")[0]

    def outcome_without_tls(self):
        with grpc.insecure_channel(self.address, [("grpc.use_local_subchannel_pool", 1)]) as channel:
            return self.outcome(channel, CREATE, token_of("strike"))

    def outcome_with(self, files):
        with self.channel(*files) as channel:
            return self.outcome(channel, CREATE, token_of("strike"))

    def logged(self, pattern):
        """How many lines of the log match, with those that were counted instead."""
        log = (self.folder / "log").read_text()
        counted = re.findall(r"(\d+) more lines about refused access", log)
        return len(re.findall(pattern, log)) + sum(map(int, counted))

    def test_every_method_needs_the_role_that_the_page_names(self):
        self.serve()
        roles = documented_roles()
        self.assertEqual(set(methods_of_contract()), set(roles))
        with self.channel() as channel:
            for method, needed in roles.items():
                if needed == "its run's token":
                    continue
                if needed == "none":
                    self.assertEqual(self.outcome(channel, method)[0], grpc.StatusCode.OK, method)
                    continue
                self.assertEqual(self.outcome(channel, method)[1], "CREDENTIAL_MISSING", method)
                for role in ROLES:
                    code, reason = self.outcome(channel, method, token_of(role))
                    let_in = needed in ("any", role)
                    self.assertEqual(reason != "ROLE_MISSING", let_in, (method, role, code, reason))
                    self.assertEqual(code not in REFUSED, let_in, (method, role, code, reason))

    def attack(self, what, count, attempt):
        """Makes the attempt 100 times; each must be refused, for a reason of its own."""
        reasons = [attempt() for _ in range(TIMES)]
        let_in = sum(code not in (*REFUSED, grpc.StatusCode.UNAVAILABLE) for code, _ in reasons)
        print(f"{what}: {let_in} of {TIMES} let in; {sorted({reason for _, reason in reasons})}", flush=True)
        self.assertEqual(let_in, 0)
        self.attempts += count

    def test_a_hundred_attempts_of_each_kind_let_nobody_in_and_are_logged(self):
        self.serve()
        self.attempts = 0
        foreign = Authority(self.folder, "foreign").issue("strike")
        create, delete = CREATE, "/carillon.v1.SceneService/DeleteScene"
        with self.channel() as channel:
            scenes = scene_service_pb2_grpc.SceneServiceStub(channel)
            scene = scenes.CreateScene(scene_service_pb2.CreateSceneRequest(),
                                       metadata=(("authorization", f"Bearer {token_of('strike')}"),)).name
            start = contact_service_pb2.StreamContactsRequest(
                start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.1)).SerializeToString()
            remove = scene_service_pb2.DeleteSceneRequest(name=scene).SerializeToString()
            contacts = "/carillon.v1.ContactService/StreamContacts"
            self.attack("no token", TIMES, lambda: self.outcome(channel, create))
            self.attack("wrong role", TIMES, lambda: self.outcome(channel, create, token_of("listen")))
            other = token_of("other")
            self.attack("another's scene", TIMES, lambda: self.outcome(channel, delete, other, remove))
            self.attack("contacts in another's scene", TIMES, lambda: self.outcome(channel, contacts, other, start))
            self.attack("without TLS", 0, self.outcome_without_tls)
            self.attack("a certificate of another authority", 0, lambda: self.outcome_with(foreign))
            self.attack("wrong token", TIMES, lambda: self.outcome(channel, create, "guess"))
            self.assertEqual(self.outcome(channel, delete, token_of("strike"), remove)[0], grpc.StatusCode.OK)
        self.daemon.stop()
        self.assertEqual(self.logged("a call of /[^ ]+ from ipv4:127.0.0.1:[0-9]+ was refused"), self.attempts)

    def test_a_scene_alone_is_heard_by_its_owner_and_administrators_only(self):
        self.write_access(line_of("band", "strike,listen"), line_of("rival", "strike,listen"),
                          line_of("chief", "listen,administer"), line_of("guest", "listen"))
        self.serve()
        listen = "/carillon.v1.AudioService/Listen"
        with self.channel() as channel:
            scene = scene_service_pb2_grpc.SceneServiceStub(channel).CreateScene(
                scene_service_pb2.CreateSceneRequest(),
                metadata=(("authorization", f"Bearer {token_of('band')}"),)).name
            request = audio_service_pb2.ListenRequest(scene=scene).SerializeToString()
            for name, reason in (("band", ""), ("chief", ""), ("rival", "SCENE_OF_ANOTHER"),
                                 ("guest", "SCENE_OF_ANOTHER")):
                self.assertEqual(self.outcome(channel, listen, token_of(name), request)[1], reason, name)
            self.assertEqual(self.outcome(channel, listen, token_of("guest"))[0], grpc.StatusCode.OK)

    def test_guessing_is_slowed_and_those_who_were_let_in_before_do_not_notice(self):
        self.serve()
        method = "/carillon.v1.AudioService/GetMixer"
        with self.channel() as channel:
            self.assertEqual(self.outcome(channel, method, token_of("listen"))[0], grpc.StatusCode.OK)
            begin_s = time.monotonic()
            reasons = [self.outcome(channel, method, f"guess {i}")[1] for i in range(torture.rounds(500, 10_000))]
            taken_s = time.monotonic() - begin_s
            examined = reasons.count("TOKEN_WRONG")
            print(f"{len(reasons)} guesses in {taken_s:.1f} s, {examined} of them looked at", flush=True)
            self.assertLessEqual(examined, 10 + taken_s + 1)
            self.assertEqual(set(reasons), {"TOKEN_WRONG", "TOO_MANY_FAILURES"})
            self.assertEqual(self.outcome(channel, method, token_of("listen"))[0], grpc.StatusCode.OK)
            torture.wait_until(
                lambda: self.outcome(channel, method, token_of("fresh"))[0] == grpc.StatusCode.OK, 30)

    def serial_served(self):
        context = ssl.create_default_context(cafile=str(self.authority.certificate))
        host, port = self.address.rsplit(":", 1)
        with socket.create_connection((host, int(port))) as plain, \
                context.wrap_socket(plain, server_hostname=host) as connection:
            return connection.getpeercert()["serialNumber"]

    def test_sighup_takes_new_files_and_drops_no_stream(self):
        self.serve()
        with self.channel() as channel:
            listening = channel.unary_stream("/carillon.v1.AudioService/Listen")(
                b"", metadata=(("authorization", f"Bearer {token_of('listen')}"),))
            next(listening)
            before = self.serial_served()
            for new, old in zip(self.authority.issue("next"), (self.certificate, self.key)):
                new.replace(old)
            self.write_access(line_of("strike", "strike"))
            self.daemon.process.send_signal(signal.SIGHUP)
            torture.wait_until(lambda: self.serial_served() != before, 30)
            for _ in range(20):
                next(listening)
            method = "/carillon.v1.AudioService/GetMixer"
            self.assertEqual(self.outcome(channel, method, token_of("listen"))[1], "TOKEN_WRONG")
            self.assertEqual(self.outcome(channel, method, token_of("strike"))[0], grpc.StatusCode.OK)
            self.key.chmod(0o644)
            self.write_access(line_of("listen", "listen"))
            self.daemon.process.send_signal(signal.SIGHUP)
            torture.wait_until(lambda: "nothing was changed" in (self.folder / "log").read_text(), 30)
            self.assertEqual(self.outcome(channel, method, token_of("strike"))[0], grpc.StatusCode.OK)

    def refused_start(self, *arguments, listen="127.0.0.1:0"):
        done = subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "--audio-device", "null",
                               "--listen", listen, *map(str, arguments)],
                              capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr

    def test_files_that_are_unsafe_or_useless_are_refused_at_the_start(self):
        tls = ("--tls-certificate", self.certificate, "--tls-key", self.key)
        self.assertIn("ACCESS_FILE_REQUIRED", self.refused_start(*tls, listen="0.0.0.0:0"))
        for mode in (0o666, 0o644, 0o660, 0o604):
            self.key.chmod(mode)
            self.assertRegex(self.refused_start(*tls), "TLS_UNUSABLE: .*chmod 600")
        self.key.chmod(0o600)
        self.access.chmod(0o644)
        self.assertRegex(self.refused_start("--access-file", self.access), "ACCESS_FILE_UNUSABLE: .*chmod 600")
        self.access.chmod(0o600)
        for line in ("robot\n", "robot fly sha256:" + "0" * 64 + "\n", "robot listen token\n",
                     "robot listen sha256:0\n", "anybody listen certificate:x\n"):
            self.write_access(line)
            self.assertRegex(self.refused_start("--access-file", self.access), "ACCESS_FILE_UNUSABLE: .*line 2")
        old, old_key = self.authority.issue("old", end="20210101000000Z")
        self.assertRegex(self.refused_start("--tls-certificate", old, "--tls-key", old_key),
                         "TLS_UNUSABLE: .*expired on Jan  1 00:00:00 2021 GMT")
        self.assertRegex(self.refused_start("--tls-certificate", old, "--tls-key", self.key), "TLS_UNUSABLE")
        _, another = self.authority.issue("another")
        self.assertRegex(self.refused_start("--tls-certificate", self.certificate, "--tls-key", another),
                         "TLS_UNUSABLE: .*is not the key")
        self.assertRegex(self.refused_start(*tls, "--tls-client-roots", old), "TLS_UNUSABLE: .*expired")

    def test_the_documented_command_makes_a_token_that_all_clients_can_show(self):
        page = (ROOT / "docs/limits_and_access.md").read_text()
        script = re.search(r"```sh\n(token=.*?)```", page, re.DOTALL).group(1)
        script = script.replace("/etc/carillon/access", str(self.access))
        token = subprocess.run(["sh", "-euc", script], check=True, capture_output=True, text=True).stdout.strip()
        self.serve()
        console, console_key = self.authority.issue("console", alternative="DNS:console.example.org")
        command = [BIN / "carillon", "--server", self.address, "--tls-roots", self.authority.certificate]
        file = self.folder / "token"
        file.write_text(token + "\n")
        for arguments, environment, status in (
                ((), {}, 1), (("--token", token), {}, 0), ((), {"CARILLON_TOKEN": token}, 0),
                (("--token-file", file), {}, 0), (("--tls-certificate", console, "--tls-key", console_key), {}, 0)):
            done = subprocess.run([*command, *map(str, arguments), "status"], env={**os.environ, **environment},
                                  capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, status, (arguments, done.stderr))
        for credentials in ({"token": token}, {"tls_certificate": console, "tls_key": console_key}):
            with carillon.connect(self.address, tls_roots=self.authority.certificate, **credentials) as client:
                self.assertEqual(client.status().device, "null")
        with carillon.connect(self.address, tls_roots=self.authority.certificate, token=token) as client, \
                client.scene() as scene, scene.stream(step=0.1):
            self.assertEqual(len(client.scenes()), 1)
        with carillon.connect(self.address, tls_roots=self.authority.certificate) as client, \
                self.assertRaises(carillon.CarillonError) as refused:
            client.status()
        self.assertEqual(refused.exception.reason, "CREDENTIAL_MISSING")


if __name__ == "__main__":
    unittest.main()
