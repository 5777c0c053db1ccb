#!/usr/bin/env python3
"""A robot in software for the tests of franka-host: franka-sim (MuJoCo behind Franka's protocol), bound to 127.0.0.1.

    software_robot.py FOLDER [--lose SHARE] [--late SHARE] [--gap COMMAND] [--object WIDTH]

FOLDER gets a virtual environment with franka-sim (pip needs a package index the first time) and the robot's model, without meshes. The script
prints "ready" once the robot answers, then "second" after every 1000 states that it has sent, and ends when its standard input closes. It exits
with 77 if franka-sim cannot be installed. Each state that is sent advances the simulation by a millisecond, and the robot waits for the client's
answer, so a busy machine changes nothing. This tests protocol, limits and recovery, not latency. The robot reports no external wrench.
"""

import argparse
import os
import random
import re
import socket
import subprocess
import sys
import threading
import time
import venv
import xml.etree.ElementTree as ET
from pathlib import Path

PACKAGE = "franka-sim==1.1.7"
CANNOT_INSTALL = 77
# Wall time that a client has for an answer (s): less than the second without a state after which the client gives up.
PATIENCE = 0.5


def environment(folder: Path) -> Path:
    """Path of the Python of a virtual environment with franka-sim, which is installed if it is missing."""
    python = folder / "venv" / "bin" / "python"
    done = folder / "venv" / "installed"
    if not done.exists() or done.read_text() != PACKAGE:
        install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE]
        try:
            venv.create(folder / "venv", with_pip=True, clear=True)
            subprocess.run(install, check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError) as error:
            message = getattr(error, "stderr", None) or str(error)
            print(f"cannot install {PACKAGE}: {str(message).strip().splitlines()[-1]}", file=sys.stderr)
            sys.exit(CANNOT_INSTALL)
        done.write_text(PACKAGE)
    return python


def model(folder: Path) -> Path:
    """Path of an MJCF file made from the package's URDF: every joint and mass, but no meshes, which the package would download."""
    import franka_sim
    import mujoco

    urdf = ET.parse(Path(franka_sim.__file__).parent / "models" / "fr3.urdf")
    root = urdf.getroot()
    for link in root.iter("link"):
        for shape in link.findall("visual") + link.findall("collision"):
            link.remove(shape)
        if link.find("inertial") is None:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "mass", value="1e-3")
            ET.SubElement(inertial, "inertia", dict.fromkeys(("ixx", "iyy", "izz"), "1e-6") | dict.fromkeys(("ixy", "ixz", "iyz"), "0"))
    options = {"fusestatic": "false", "discardvisual": "true", "balanceinertia": "true", "boundmass": "1e-4", "boundinertia": "1e-7"}
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", options)
    bare, mjcf = folder / "fr3.urdf", folder / "fr3.xml"
    urdf.write(bare)
    mujoco.mj_saveLastXML(str(mjcf), mujoco.MjModel.from_xml_path(str(bare)))
    # A real robot's O_T_EE is the flange, link8, unless a tool is set. franka-sim takes the body named link7, 107 mm before the flange.
    arm = ET.parse(mjcf)
    for body in arm.iter("body"):
        body.set("name", {"link7": "wrist", "link8": "link7"}.get(body.get("name"), body.get("name")))
    # franka-sim's servos, which hold the arm between motions, are tuned for the joints of the model that it would download. A URDF has no rotors.
    for joint in arm.iter("joint"):
        joint.set("armature", "0.195")
        joint.set("damping", "1")
    arm.write(mjcf)
    return mjcf


class Network(socket.socket):
    """The robot's socket with faults: it loses states and commands, delivers some commands a cycle late, and once loses 30 commands in a row."""

    def __init__(self, whole: socket.socket, faults: argparse.Namespace) -> None:
        super().__init__(fileno=whole.detach())
        self.faults, self.random, self.states, self.commands, self.held = faults, random.Random(7), 0, 0, None
        self.unanswered = False  # Whether no answer to the latest state will come within its cycle.

    def sendto(self, state: bytes, address: tuple) -> int:
        if self.held is not None:
            super().sendto(self.held, ("127.0.0.1", self.getsockname()[1]))
            self.held = None
        self.states += 1
        if self.states % 1000 == 0:
            print("second", flush=True)
        self.unanswered = self.random.random() < self.faults.lose
        return len(state) if self.unanswered else super().sendto(state, address)

    def recvfrom(self, size: int) -> tuple:
        command, sender = super().recvfrom(size)
        if sender[1] == self.getsockname()[1]:
            return command, sender
        self.commands += 1
        luck, gap = self.random.random(), self.faults.gap
        if gap is not None and gap <= self.commands < gap + 30 or luck < self.faults.lose + self.faults.late:
            self.held = command if luck >= self.faults.lose else None
            self.unanswered = True
            raise BlockingIOError
        return command, sender


def serve(folder: Path, faults: argparse.Namespace) -> None:
    os.environ["FR3_MJCF"] = str(model(folder))
    from franka_sim import FrankaSimServer
    from franka_sim.mujoco_franka_sim import MujocoFrankaSim

    class Physics(MujocoFrankaSim):
        """Advances with each state that the robot sends, and by the wall clock while no client is connected."""

        moving = threading.Lock()

        def step(self, steps: int = 1) -> None:
            with self.moving:
                super().step(steps)

        def run_simulation(self) -> None:
            while self.running:
                if not server.transmitting_state:
                    self.step()
                time.sleep(self.dt)

    class Server(FrankaSimServer):
        _DRAIN_GATE_TIMEOUT = PATIENCE

        def start_command_receiver(self) -> None:
            self.udp_socket = Network(self.udp_socket, faults)
            super().start_command_receiver()

        def _drain_gate(self, answer_deadline: float = 0.0) -> float:
            # Waits longer for a client that the operating system does not schedule, unless the answer is known to be lost.
            lost = getattr(self.udp_socket, "unanswered", True)
            return super()._drain_gate(answer_deadline + (0.0 if lost else PATIENCE))

        def _account_for_communication_cycle(self) -> None:
            super()._account_for_communication_cycle()
            self.physics_sim.step()

        def _absorb_within_motion_limits(self, command: dict, fresh: bool = True) -> bool:
            # A real robot drops a command that arrives after its cycle.
            return fresh and super()._absorb_within_motion_limits(command, fresh=fresh)

    server = Server(
        host="127.0.0.1",
        physics_sim=Physics(),
        gripper_object_width=faults.object,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
    )
    # Ends when the parent process ends, even if it was killed: standard input closes then.
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    threading.Thread(target=wait_until_ready, daemon=True).start()
    server.start()


def wait_until_ready() -> None:
    # Looks for a listening 127.0.0.1:1337 in the kernel's table. A trial connection would be a failed handshake for the robot.
    listens = re.compile(r"^ *\d+: 0100007F:0539 \S+ 0A ", re.MULTILINE)
    while not listens.search(Path("/proc/net/tcp").read_text()):
        time.sleep(0.1)
    print("ready", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=lambda path: Path(os.path.abspath(path)))
    parser.add_argument("--lose", type=float, default=0.0, help="share of the states, and of the commands, that are lost")
    parser.add_argument("--late", type=float, default=0.0, help="share of the commands that come a cycle late, which a robot drops")
    parser.add_argument("--gap", type=int, help="of each connection, the command from which on 30 in a row are lost")
    parser.add_argument("--object", type=float, help="width of what is between the fingers (m)")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    python = environment(arguments.folder)
    if Path(sys.prefix) != arguments.folder / "venv":
        os.execv(python, [python, __file__, *sys.argv[1:]])
    serve(arguments.folder, arguments)


if __name__ == "__main__":
    main()
