# SPDX-License-Identifier: Apache-2.0
"""Certificates for tests, made by the program openssl, and daemons that know their callers over TCP."""

import hashlib
import pathlib
import subprocess

from daemon import ScratchTest

CURVE = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
CONFIGURATION = """
[ca]
default_ca = own
[own]
dir = {folder}
database = {folder}/index
new_certs_dir = {folder}
rand_serial = yes
default_md = sha256
policy = any
copy_extensions = copy
unique_subject = no
[any]
commonName = supplied
"""


def openssl(*arguments):
    subprocess.run(["openssl", *map(str, arguments)], check=True, capture_output=True)


def self_signed(folder, name="carillon"):
    """Returns the PEM files of a certificate for 127.0.0.1, valid for two days, and its key."""
    certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
    openssl("req", "-x509", *CURVE, "-subj", f"/CN={name}", "-addext", "subjectAltName=IP:127.0.0.1", "-days", "2",
            "-keyout", key, "-out", certificate)
    return certificate, key


class Authority:
    """Signs certificates; `certificate` is the PEM file of its own."""

    def __init__(self, folder, name="authority"):
        self.folder = pathlib.Path(folder, name)
        self.folder.mkdir()
        (self.folder / "index").touch()
        (self.folder / "openssl.cnf").write_text(CONFIGURATION.format(folder=self.folder))
        self.certificate, self.key = self.folder / "certificate.pem", self.folder / "key.pem"
        openssl("req", "-x509", *CURVE, "-subj", f"/CN={name}", "-days", "2", "-keyout", self.key,
                "-out", self.certificate)

    def issue(self, name, *, alternative="IP:127.0.0.1", end="20491231235959Z"):
        """Returns the PEM files of a certificate and its key."""
        request, certificate, key = (self.folder / f"{name}.{kind}" for kind in ("request", "pem", "key"))
        names = ("-addext", f"subjectAltName={alternative}") if alternative else ()
        openssl("req", "-new", *CURVE, "-subj", f"/CN={name}", *names, "-keyout", key, "-out", request)
        openssl("ca", "-batch", "-notext", "-config", self.folder / "openssl.cnf", "-cert", self.certificate,
                "-keyfile", self.key, "-startdate", "20200101000000Z", "-enddate", end, "-in", request,
                "-out", certificate)
        return certificate, key


def access_line(name, roles, token):
    """What an access file says of those who show this token."""
    return f"{name} {roles} sha256:{hashlib.sha256(token.encode()).hexdigest()}\n"


class SecuredTest(ScratchTest):
    """Serves over TLS, at `address`, to those that its access file names."""

    def setUp(self):
        super().setUp()
        self.authority = Authority(self.folder)
        self.certificate, self.key = self.authority.issue("server")
        self.access = self.folder / "access"

    def write_access(self, *lines):
        self.access.touch(0o600)
        self.access.write_text("# who may do what\n" + "".join(lines))

    def serve_secured(self, *lines):
        self.write_access(*lines)
        self.serve("--listen", "127.0.0.1:0", "--tls-certificate", self.certificate, "--tls-key", self.key,
                   "--tls-client-roots", self.authority.certificate, "--access-file", self.access)
        self.address = self.daemon.listening[1].split()[-1]
