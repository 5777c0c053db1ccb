"""Holds an arm that was read from a URDF against MuJoCo, which reads the URDF by itself.

    cargo run --release -p physics --example urdf_to_mjcf ARM.urdf TOOL > arm.xml
    python scripts/urdf_mujoco.py ARM.urdf TOOL arm.xml        # mujoco (3.2.7 was tried)

Prints the largest differences of tool pose, mass matrix and bias torques over 100 random states, and exits with 1 if one of them is more
than rounding.
"""

import sys
import xml.etree.ElementTree as ET

import mujoco
import numpy as np

urdf, tool, mjcf = sys.argv[1:4]

# As MuJoCo likes it: no meshes, no fused links, so that the tool can be found.
root = ET.parse(urdf).getroot()
for link in root.iter("link"):
    for shape in link.findall("visual") + link.findall("collision"):
        link.remove(shape)
options = {"fusestatic": "false", "discardvisual": "true", "balanceinertia": "false"}
ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", options)
for old in root.findall("mujoco")[:-1]:
    root.remove(old)
theirs = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
ours = mujoco.MjModel.from_xml_path(mjcf)

# The joints between their root and their tool, in order.
place, body = [], theirs.body(tool).id
while body:
    place[:0] = [theirs.jnt_qposadr[i] for i in range(theirs.njnt) if theirs.jnt_bodyid[i] == body]
    body = theirs.body_parentid[body]
print(f"{len(place)} of {theirs.njnt} joints")
random = np.random.default_rng(28)
worst = dict.fromkeys(("position (m)", "rotation", "mass (kg m2)", "bias (Nm)"), 0.0)
for _ in range(100):
    q = random.uniform(*ours.jnt_range.T)
    qd = random.uniform(-1, 1, ours.nv)
    found = []
    for model, at, hand in ((ours, range(ours.nv), "right_hand"), (theirs, place, tool)):
        data = mujoco.MjData(model)
        data.qpos[list(at)], data.qvel[list(at)] = q, qd
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, mass, data.qM)
        mass -= np.diag(model.dof_armature)
        body = data.body(hand)
        found.append((body.xpos.copy(), body.xmat.copy(), mass[np.ix_(list(at), list(at))], data.qfrc_bias[list(at)]))
    for name, a, b in zip(worst, *found):
        difference = float(np.abs(a - b).max())
        worst[name] = max(worst[name], difference if np.isfinite(difference) else np.inf)
for name, value in worst.items():
    print(f"{name}: {value:.1e}")
sys.exit(max(worst.values()) > 1e-6)
