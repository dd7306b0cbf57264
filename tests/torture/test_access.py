# SPDX-License-Identifier: Apache-2.0
"""Who may do what over TCP: by tokens and certificates, and nobody else."""

import contextlib
import os
import re
import signal
import socket
import ssl
import subprocess
import time

import grpc

import carillon
import torture
from carillon.v1 import (
    admin_service_pb2, audio_service_pb2, contact_service_pb2, decomposition_service_pb2,
    modal_model_service_pb2, scene_service_pb2, scene_service_pb2_grpc, server_service_pb2)
from certificates import Authority, SecuredTest, access_line
from daemon import BIN, ROOT, ScratchTest, wait_until

ROLES = ("listen", "strike", "submit", "administer")
CONTRACT = (admin_service_pb2, audio_service_pb2, contact_service_pb2, decomposition_service_pb2,
            modal_model_service_pb2, scene_service_pb2, server_service_pb2)
TIMES = 100
CREATE = "/carillon.v1.SceneService/CreateScene"
MIXER = "/carillon.v1.AudioService/GetMixer"
LISTEN = "/carillon.v1.AudioService/Listen"
REFUSED = (grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.PERMISSION_DENIED, grpc.StatusCode.RESOURCE_EXHAUSTED)


def token_of(name):
    return f"{name}: a token for this test"


def line_of(name, roles):
    return access_line(name, roles, token_of(name))


def bearer(token):
    """The metadata of a call by who shows the token."""
    return (("authorization", f"Bearer {token}"),) if token else ()


def make_scene(channel, **options):
    """The name of a scene made over the channel."""
    scenes = scene_service_pb2_grpc.SceneServiceStub(channel)
    return scenes.CreateScene(scene_service_pb2.CreateSceneRequest(), **options).name


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


class NoAccessFileTest(ScratchTest):
    def test_a_scene_is_open_to_the_unix_socket_and_to_tcp_alike(self):
        self.serve("--listen", "127.0.0.1:0")
        servers = (self.daemon.server, self.daemon.listening[-1].split()[-1])
        for maker, user in (servers, servers[::-1]):
            with grpc.insecure_channel(maker) as made, grpc.insecure_channel(user) as used:
                scene_service_pb2_grpc.SceneServiceStub(used).DeleteScene(
                    scene_service_pb2.DeleteSceneRequest(name=make_scene(made)))


class AccessTest(SecuredTest):
    LINES = (*(line_of(role, role) for role in ROLES), line_of("other", "strike"), line_of("fresh", "listen"),
             "console listen certificate:console.example.org\n")

    @contextlib.contextmanager
    def channel(self, certificate=None, key=None):
        files = [path and path.read_bytes() for path in (self.authority.certificate, key, certificate)]
        with grpc.secure_channel(self.address, grpc.ssl_channel_credentials(*files),
                                 [("grpc.use_local_subchannel_pool", 1)]) as channel:
            yield channel

    @staticmethod
    def outcome(channel, method, token=None, request=b""):
        """The status of a call, and the reason in its message. OK as soon as a response comes."""
        call = channel.stream_stream(method)(iter([request]), metadata=bearer(token), timeout=20)
        try:
            next(call)
            call.cancel()
            return grpc.StatusCode.OK, ""
        except StopIteration:
            return grpc.StatusCode.OK, ""
        except grpc.RpcError as error:
            return error.code(), error.details().split(":")[0]

    def outcome_over(self, connected):
        """That of a call with a right token."""
        with connected as channel:
            return self.outcome(channel, CREATE, token_of("strike"))

    def logged(self, pattern):
        """How many lines of the log match, with those that were counted instead."""
        counted = re.findall(r"(\d+) more lines about refused access", self.daemon.log())
        return len(re.findall(pattern, self.daemon.log())) + sum(map(int, counted))

    def test_every_method_needs_the_role_that_the_page_names(self):
        self.serve_secured(*self.LINES)
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
        self.serve_secured(*self.LINES)
        self.attempts = 0
        foreign = Authority(self.folder, "foreign").issue("strike")
        delete = "/carillon.v1.SceneService/DeleteScene"
        with self.channel() as channel:
            scene = make_scene(channel, metadata=bearer(token_of("strike")))
            start = contact_service_pb2.StreamContactsRequest(
                start=contact_service_pb2.ContactStreamStart(scene=scene, step_s=0.1)).SerializeToString()
            remove = scene_service_pb2.DeleteSceneRequest(name=scene).SerializeToString()
            contacts = "/carillon.v1.ContactService/StreamContacts"
            self.attack("no token", TIMES, lambda: self.outcome(channel, CREATE))
            self.attack("wrong role", TIMES, lambda: self.outcome(channel, CREATE, token_of("listen")))
            other = token_of("other")
            self.attack("another's scene", TIMES, lambda: self.outcome(channel, delete, other, remove))
            self.attack("contacts in another's scene", TIMES, lambda: self.outcome(channel, contacts, other, start))
            self.attack("without TLS", 0, lambda: self.outcome_over(
                grpc.insecure_channel(self.address, [("grpc.use_local_subchannel_pool", 1)])))
            self.attack("a certificate of another authority", 0, lambda: self.outcome_over(self.channel(*foreign)))
            self.attack("wrong token", TIMES, lambda: self.outcome(channel, CREATE, "guess"))
            self.assertEqual(self.outcome(channel, delete, token_of("strike"), remove)[0], grpc.StatusCode.OK)
        self.daemon.stop()
        self.assertEqual(self.logged("a call of /[^ ]+ from ipv4:127.0.0.1:[0-9]+ was refused"), self.attempts)

    def test_a_scene_alone_is_heard_by_its_owner_and_administrators_only(self):
        self.serve_secured(line_of("band", "strike,listen"), line_of("rival", "strike,listen"),
                           line_of("chief", "listen,administer"), line_of("guest", "listen"))
        with self.channel() as channel:
            scene = make_scene(channel, metadata=bearer(token_of("band")))
            request = audio_service_pb2.ListenRequest(scene=scene).SerializeToString()
            for name, reason in (("band", ""), ("chief", ""), ("rival", "SCENE_OF_ANOTHER"),
                                 ("guest", "SCENE_OF_ANOTHER")):
                self.assertEqual(self.outcome(channel, LISTEN, token_of(name), request)[1], reason, name)
            self.assertEqual(self.outcome(channel, LISTEN, token_of("guest"))[0], grpc.StatusCode.OK)

    def test_guessing_is_slowed_and_those_who_were_let_in_before_do_not_notice(self):
        self.serve_secured(*self.LINES)
        with self.channel() as channel:
            self.assertEqual(self.outcome(channel, MIXER, token_of("listen"))[0], grpc.StatusCode.OK)
            begin_s = time.monotonic()
            reasons = [self.outcome(channel, MIXER, f"guess {i}")[1] for i in range(torture.rounds(500, 10_000))]
            taken_s = time.monotonic() - begin_s
            examined = reasons.count("TOKEN_WRONG")
            print(f"{len(reasons)} guesses in {taken_s:.1f} s, {examined} of them looked at", flush=True)
            self.assertLessEqual(examined, 10 + taken_s + 1)
            self.assertEqual(set(reasons), {"TOKEN_WRONG", "TOO_MANY_FAILURES"})
            self.assertEqual(self.outcome(channel, MIXER, token_of("listen"))[0], grpc.StatusCode.OK)
            wait_until(lambda: self.outcome(channel, MIXER, token_of("fresh"))[0] == grpc.StatusCode.OK)

    def serial_served(self):
        context = ssl.create_default_context(cafile=str(self.authority.certificate))
        host, port = self.address.rsplit(":", 1)
        with socket.create_connection((host, int(port))) as plain, \
                context.wrap_socket(plain, server_hostname=host) as connection:
            return connection.getpeercert()["serialNumber"]

    def test_sighup_takes_new_files_and_drops_no_stream(self):
        self.serve_secured(*self.LINES)
        with self.channel() as channel:
            listening = channel.unary_stream(LISTEN)(b"", metadata=bearer(token_of("listen")))
            next(listening)
            before = self.serial_served()
            for new, old in zip(self.authority.issue("next"), (self.certificate, self.key)):
                new.replace(old)
            self.write_access(line_of("strike", "strike"))
            self.daemon.process.send_signal(signal.SIGHUP)
            wait_until(lambda: self.serial_served() != before)
            for _ in range(20):
                next(listening)
            self.assertEqual(self.outcome(channel, MIXER, token_of("listen"))[1], "TOKEN_WRONG")
            self.assertEqual(self.outcome(channel, MIXER, token_of("strike"))[0], grpc.StatusCode.OK)
            self.key.chmod(0o644)
            self.write_access(line_of("listen", "listen"))
            self.daemon.process.send_signal(signal.SIGHUP)
            wait_until(lambda: "nothing was changed" in self.daemon.log())
            self.assertEqual(self.outcome(channel, MIXER, token_of("strike"))[0], grpc.StatusCode.OK)

    def refused_start(self, *arguments, listen="127.0.0.1:0"):
        done = subprocess.run([BIN / "carillond", "--data-dir", self.folder / "data", "--audio-device", "null",
                               "--listen", listen, *map(str, arguments)],
                              capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr

    def test_files_that_are_unsafe_or_useless_are_refused_at_the_start(self):
        tls = ("--tls-certificate", self.certificate, "--tls-key", self.key)
        self.write_access()
        self.assertIn("ACCESS_FILE_REQUIRED", self.refused_start(*tls, listen="0.0.0.0:0"))
        for mode in (0o666, 0o644, 0o660, 0o604):
            self.key.chmod(mode)
            self.assertRegex(self.refused_start(*tls), "TLS_UNUSABLE: .*chmod 600")
        self.key.chmod(0o600)
        self.access.chmod(0o644)
        self.assertRegex(self.refused_start("--access-file", self.access), "ACCESS_FILE_UNUSABLE: .*chmod 600")
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
        self.write_access("console listen certificate:console.example.org\n")
        token = subprocess.run(["sh", "-euc", script], check=True, capture_output=True, text=True).stdout.strip()
        self.serve_secured(self.access.read_text())
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
