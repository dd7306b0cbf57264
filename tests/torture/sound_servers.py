# SPDX-License-Identifier: Apache-2.0
"""Sound servers without a sound card that can be killed and started again."""

import os
import pathlib
import signal
import subprocess
import time

import numpy

import jack

LISTEN_S = 0.5
RECORDER_LIMIT_S = 10
RATE = 48000


class Server:
    """A process that is started again and again with one command."""

    def __init__(self, command, environment, log):
        self.command = command
        self.environment = environment
        self.log = log
        self.process = None

    def start(self):
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen(self.command, env=self.environment, stdin=subprocess.DEVNULL, stdout=log,
                                            stderr=subprocess.STDOUT)
        self.await_ready()

    def kill(self, number=signal.SIGKILL):
        self.process.send_signal(number)
        self.process.wait()

    def close(self):
        """Ends it as its user would."""
        if self.process is not None and self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.kill(signal.SIGTERM)

    def await_ready(self):
        raise NotImplementedError

    def recording(self):
        """Half a second of the samples that the server is given."""
        raise NotImplementedError


class JackServer(Server):
    DEVICE = jack.DEVICE

    def __init__(self, folder, rate=RATE):
        environment = dict(os.environ, JACK_DEFAULT_SERVER=f"carillon-torture-{os.getpid()}",
                           JACK_NO_AUDIO_RESERVATION="1", JACK_NO_START_SERVER="1")
        super().__init__(["jackd", "-R", "-P", "50", "-d", "dummy", "-r", str(rate), "-p", "128"], environment,
                         pathlib.Path(folder) / "jackd.log")

    def await_ready(self):
        subprocess.run(["jack_wait", "-w", "-t", "10"], env=self.environment, check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def close(self):
        """A jackd that was killed keeps one of the machine's eight places until its name is used again."""
        if self.process.poll() is not None:
            self.start()
        super().close()

    def recording(self):
        file = self.log.parent / "recording.float32"
        try:
            subprocess.run([jack.PROGRAMS / "record_jack", jack.PORT, str(LISTEN_S), file], env=self.environment,
                           stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, check=True, timeout=RECORDER_LIMIT_S)
        except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
            return numpy.zeros(1, numpy.float32)  # JACK has not taken the recorder in
        return numpy.fromfile(file, numpy.float32)


class PulseServer(Server):
    DEVICE = "portaudio:pulse"

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        socket = self.folder / "pulse" / "native"
        client = self.folder / "client.conf"
        client.write_text(f"autospawn = no\ndefault-server = unix:{socket}\n")
        alsa = self.folder / "asound.conf"
        alsa.write_text("</usr/share/alsa/alsa.conf>\npcm.pulse { type pulse }\nctl.pulse { type pulse }\n")
        environment = dict(os.environ, XDG_RUNTIME_DIR=str(self.folder), HOME=str(self.folder),
                           PULSE_CLIENTCONFIG=str(client), ALSA_CONFIG_PATH=str(alsa),
                           JACK_NO_START_SERVER="1", JACK_DEFAULT_SERVER=f"carillon-no-jack-{os.getpid()}")
        super().__init__(["pulseaudio", "-n", "--daemonize=no", "--use-pid-file=no", "--exit-idle-time=-1",
                          "--disable-shm=yes", "--realtime=no", "--high-priority=no",
                          "-L", f"module-null-sink sink_name=out rate={RATE}",
                          "-L", f"module-native-protocol-unix auth-anonymous=1 socket={socket}"],
                         environment, self.folder / "pulseaudio.log")
        socket.parent.mkdir()

    def await_ready(self):
        for _ in range(500):
            if subprocess.run(["pactl", "info"], env=self.environment, check=False, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL).returncode == 0:
                return
            time.sleep(0.02)
        raise AssertionError("pulseaudio did not start: " + self.log.read_text())

    def recording(self):
        with subprocess.Popen(["parec", "--device=out.monitor", "--format=float32le", f"--rate={RATE}", "--channels=1",
                               "--latency-msec=20"], env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL) as recorder:
            data = recorder.stdout.read(int(LISTEN_S * RATE) * 4)
            recorder.terminate()
        return numpy.frombuffer(data, numpy.float32)
