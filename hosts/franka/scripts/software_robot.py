#!/usr/bin/env python3
"""A robot in software for the tests of franka-host: franka-sim (MuJoCo behind Franka's protocol), bound to 127.0.0.1.

    software_robot.py FOLDER

FOLDER takes a virtual environment with franka-sim (pip needs a package index the first time) and the robot's model, without meshes. Prints
"ready" once it answers, and ends when its standard input does. Exits with 77 if franka-sim cannot be installed. It counts its clock
in cycles, so it tests protocol, limits and recovery, not latency; it reports no external wrench.
"""

import os
import re
import subprocess
import sys
import threading
import time
import venv
import xml.etree.ElementTree as ET
from pathlib import Path

PACKAGE = "franka-sim==1.1.7"
CANNOT_INSTALL = 77


def environment(folder: Path) -> Path:
    """The Python of a virtual environment that has franka-sim."""
    python = folder / "venv" / "bin" / "python"
    done = folder / "venv" / "installed"
    if not done.exists():
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
    """The package's own description of the arm as MJCF: no meshes, which it would download, but every joint and mass."""
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
    # A robot's O_T_EE is the flange, link8, unless a tool is set; franka-sim's is the body called link7, 107 mm before it.
    arm = ET.parse(mjcf)
    for body in arm.iter("body"):
        body.set("name", {"link7": "wrist", "link8": "link7"}.get(body.get("name"), body.get("name")))
    # Its servos, which hold the arm between motions, want the joints of the model that it would download; a URDF has no rotors.
    for joint in arm.iter("joint"):
        joint.set("armature", "0.195")
        joint.set("damping", "1")
    arm.write(mjcf)
    return mjcf


def serve(folder: Path) -> None:
    os.environ["FR3_MJCF"] = str(model(folder))
    from franka_sim import FrankaSimServer

    server = FrankaSimServer(host="127.0.0.1", enable_gripper=False, enforce_comm_constraints=True, enforce_motion_limits=True)
    # It ends with whoever started it, even if that was killed.
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    threading.Thread(target=wait_until_ready, daemon=True).start()
    server.start()


def wait_until_ready() -> None:
    # 127.0.0.1:1337 in the kernel's list, listening: to knock would be a handshake that fails.
    listens = re.compile(r"^ *\d+: 0100007F:0539 \S+ 0A ", re.MULTILINE)
    while not listens.search(Path("/proc/net/tcp").read_text()):
        time.sleep(0.1)
    print("ready", flush=True)


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER")
    folder = Path(sys.argv[1]).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder)
    if Path(sys.prefix) != folder / "venv":
        os.execv(python, [python, __file__, str(folder)])
    serve(folder)


if __name__ == "__main__":
    main()
