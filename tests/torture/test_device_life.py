# SPDX-License-Identifier: Apache-2.0
"""Sound servers die, hang, come late and come back under a sounding scene: the sound is back within two seconds."""

import os
import pathlib
import resource
import signal
import subprocess
import tempfile
import time

import numpy

import jack
import torture
from daemon import wait_until

# On a busy machine a test must only end; deploy/torture.sh measures.
BACK_S = 2.0 if torture.LONG else 30.0
NOTICED_S = 2.0 if torture.LONG else 30.0
SILENT = 1e-6
LISTEN_S = 0.5
RECORDER_LIMIT_S = 10


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

    # Subclasses have await_ready(), and recording(): half a second of the samples that the server is given.


class JackServer(Server):
    DEVICE = jack.DEVICE

    def __init__(self, folder, rate=jack.RATE):
        super().__init__(jack.command(rate), jack.ENVIRONMENT, pathlib.Path(folder) / "jackd.log")

    def await_ready(self):
        if not jack.is_ready():
            raise AssertionError("jackd did not start: " + self.log.read_text())

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
                          "-L", f"module-null-sink sink_name=out rate={jack.RATE}",
                          "-L", f"module-native-protocol-unix auth-anonymous=1 socket={socket}"],
                         environment, self.folder / "pulseaudio.log")
        socket.parent.mkdir()

    def await_ready(self):
        wait_until(lambda: subprocess.run(["pactl", "info"], env=self.environment, check=False,
                                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0)

    def recording(self):
        with subprocess.Popen(["parec", "--device=out.monitor", "--format=float32le", f"--rate={jack.RATE}",
                               "--channels=1", "--latency-msec=20"], env=self.environment, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL) as recorder:
            data = recorder.stdout.read(int(LISTEN_S * jack.RATE) * 4)
            recorder.terminate()
        return numpy.frombuffer(data, numpy.float32)


class DeviceLifeTest(torture.ServedTest):
    def serve(self, device, environment=None):
        super().serve("--audio-device", device, environment=environment)
        self.scene = torture.SoundingScene(self.daemon)
        self.addCleanup(self.scene.stop)

    def start_jack(self, rate=jack.RATE):
        server = JackServer(self.folder, rate)
        server.start()
        self.addCleanup(server.close)
        return server

    def serve_on_jack(self):
        server = self.start_jack()
        self.serve(server.DEVICE, server.environment)
        return server

    def plays(self):
        return self.scene.mixer().device_message == ""

    def health(self):
        return self.daemon.health("carillon.v1.AudioService")

    def assert_all_goes_on(self):
        """Mixer, contacts and listeners go on without the device."""
        before, accepted, heard = self.scene.mixer(), self.scene.answer.accepted_count, self.scene.heard
        frames = before.format.sample_rate_hz // 2
        wait_until(lambda: self.scene.mixer().frame_count > before.frame_count + frames, NOTICED_S)
        wait_until(lambda: self.scene.answer.accepted_count > accepted + 5, NOTICED_S)
        wait_until(lambda: self.scene.heard.block.first_frame > heard.block.first_frame + frames, NOTICED_S)

    def assert_sounds(self, server):
        """The server's own recorder hears the scene; it may begin with silence."""
        wait_until(lambda: numpy.abs(server.recording()).max() > SILENT, BACK_S)

    def lose_and_find(self, server, how):
        """One loss: (seconds until it was noticed, seconds from the server's return to the device's)."""
        server.kill(how)
        noticed_s = wait_until(lambda: not self.plays(), NOTICED_S)
        self.assertEqual(self.scene.mixer().device, "null")
        self.assertEqual(self.health(), "NOT_SERVING")
        self.assert_all_goes_on()
        server.start()
        back_s = wait_until(self.plays, BACK_S)
        self.assertEqual(self.health(), "SERVING")
        self.assert_sounds(server)
        return noticed_s, back_s

    def lose_often(self, server, losses):
        server.start()
        self.addCleanup(server.close)
        self.serve(server.DEVICE, server.environment)
        self.assertEqual(self.health(), "SERVING")
        self.assert_sounds(server)
        times = []
        for loss in range(losses):
            times.append(self.lose_and_find(server, (signal.SIGKILL, signal.SIGTERM)[loss % 2]))
            print(f"{type(server).__name__}: noticed after {times[-1][0]:.2f} s, back after {times[-1][1]:.2f} s",
                  flush=True)
        self.assertGreaterEqual(self.daemon.log().count("plays again"), losses, self.daemon.log())
        self.stop_in_time()

    def test_jack_killed_and_started_again(self):
        self.lose_often(JackServer(self.folder), torture.rounds(3, 20))

    def test_pulseaudio_killed_and_started_again(self):
        self.lose_often(PulseServer(self.folder), torture.rounds(2, 20))

    def test_a_server_that_starts_after_the_daemon_is_used(self):
        scratch = self.folder
        for device in ("auto", JackServer.DEVICE):
            with self.subTest(device=device):
                # Each daemon has its own socket, since gRPC would offer the old connection for the same one.
                self.folder = pathlib.Path(tempfile.mkdtemp(dir=scratch))
                server = JackServer(self.folder)
                self.serve(device, server.environment)
                self.assertEqual(self.scene.mixer().device, "null")
                server.start()
                wait_until(self.plays, BACK_S + 10)
                self.assert_sounds(server)
                self.scene.stop()
                self.stop_in_time()
                server.close()

    def test_a_stop_after_the_server_was_killed_takes_less_than_five_seconds(self):
        for _ in range(torture.rounds(2, 20)):
            server = self.serve_on_jack()
            server.kill()
            self.stop_in_time()
            self.scene.stop()

    def test_a_server_that_hangs_is_left_and_used_again(self):
        server = self.serve_on_jack()
        server.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: not self.plays(), 2 * NOTICED_S)
        self.assert_all_goes_on()
        server.process.send_signal(signal.SIGCONT)
        wait_until(self.plays, BACK_S + 3.0)  # an attempt that hangs with the server is given up after 3 s
        self.assert_sounds(server)
        self.stop_in_time()

    def test_a_server_of_another_rate_is_waited_for_and_named(self):
        server = self.serve_on_jack()
        server.kill()
        other = self.start_jack(rate=44100)
        wait_until(lambda: "48000 Hz" in self.scene.mixer().device_message, NOTICED_S)
        self.assert_all_goes_on()
        other.kill()
        server.start()
        wait_until(self.plays, BACK_S)
        self.assert_sounds(server)
        self.stop_in_time()

    def test_the_daemon_stopped_and_continued_sounds_on(self):
        server = self.serve_on_jack()
        for _ in range(torture.rounds(1, 20)):
            self.daemon.process.send_signal(signal.SIGSTOP)
            time.sleep(3)
            self.daemon.process.send_signal(signal.SIGCONT)
            wait_until(self.plays, BACK_S)
            self.assert_sounds(server)
        wait_until(lambda: "the sound has gaps: " in self.daemon.log(), NOTICED_S)
        self.stop_in_time()

    def test_a_file_on_a_full_disk_is_continued_when_there_is_space(self):
        file = self.folder / "sound.wav"
        self.serve(f"file:{file}")
        for _ in range(torture.rounds(1, 20)):
            size = file.stat().st_size + 100_000
            resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
            wait_until(lambda: not self.plays(), NOTICED_S + 3.0)
            self.assertIn("sound.wav", self.scene.mixer().device_message)
            self.assertEqual(self.health(), "NOT_SERVING")
            lost = self.scene.mixer().lost_frame_count
            self.assert_all_goes_on()
            self.assertGreater(self.scene.mixer().lost_frame_count, lost)
            resource.prlimit(self.daemon.process.pid, resource.RLIMIT_FSIZE, [resource.RLIM_INFINITY] * 2)
            wait_until(self.plays, BACK_S)
            self.assertEqual(self.health(), "SERVING")
            wait_until(lambda: file.stat().st_size > size, NOTICED_S)
        self.stop_in_time()
        header = file.read_bytes()[:4096].index(b"data") + 8
        self.assertEqual((file.stat().st_size - header) % 4, 0)
