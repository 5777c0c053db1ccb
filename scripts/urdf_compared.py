#!/usr/bin/env python3
"""Regenerate crates/physics/reference/urdf_compared.csv: public descriptions of arms, read by this project, by Pinocchio and by MuJoCo.

    python3 -m venv VENV && VENV/bin/pip install pin==4.1.0 mujoco==3.17.0 xacro==2.1.1 numpy
    git clone https://github.com/OWNER/NAME CLONES/NAME            # for each repository in ARMS; a bare clone will do
    VENV/bin/python scripts/urdf_compared.py CLONES
    VENV/bin/python scripts/urdf_compared.py ARM.urdf TOOL [BASE]  # prints the row of one file and writes nothing

Needs cargo. The example `urdf_states` reads a file and writes 20 states of the arm between the links BASE and TOOL. Pinocchio and MuJoCo read the
same file, hold all other joints at zero, and are asked for the same states in the frame of BASE, which stands upright. Columns: repository,
commit, file (with the arguments of xacro), base (`-` for the root), tool, joints; the largest differences from Pinocchio in pose (m, and parts
of the rotation matrix), Jacobian (m), mass matrix (kg m2) and bias torques (Nm); the largest of these from MuJoCo, or why it refuses the file;
and why this project refuses it, if it does. A row has either differences or that line. Ends with 1 if one of the differences is above TOLERANCE.
MuJoCo 3.2.7 is too old: it turns the frames of inertia of a UR10e wrongly, and differs by up to 0.5.
"""

import csv
import importlib.metadata
import io
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pinocchio
import xacro
from whole_file import whole_file
from xacro import substitution_args

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "crates" / "physics" / "reference" / "urdf_compared.csv"
# Differences above this are more than rounding.
TOLERANCE = 1e-9
COLUMNS = "repository commit file base tool joints pose jacobian mass bias mujoco refused".split()
FRANKA = ("frankarobotics/franka_description", "566ba44abc48be2fca16050c406562e22f85793b")
GEPETTO = ("Gepetto/example-robot-data", "39aa94379908fa743da90b21dc9e1fb8308f746b")
KORTEX = ("Kinovarobotics/ros_kortex", "6cd75d45f4d00413d73fe2af96f4d0c7d8f234be")
MODELS = ("RobotLocomotion/models", "4723170e1c8ee8bc59c342bb5c491ab8f263f1fb")
DATASET = ("Daniella1/urdf_files_dataset", "81f4cdac42c3a51ba88833180db5bf3697988c87")
# Repository and commit, file, base, tool.
ARMS = [
    *(
        (*FRANKA, f"robots/{arm}/{arm}.urdf.xacro {more}", "", f"{arm}_link8")
        for arm in ("fer", "fr3", "fp3", "fr3v2")
        for more in ("hand:=false", "hand:=true", "hand:=true gazebo:=true")
    ),
    *((*FRANKA, "robots/fr3_duo/fr3_duo.urdf.xacro", "", f"{side}_fr3v2_link8") for side in ("left", "right")),
    *((*GEPETTO, f"robots/panda_description/urdf/{name}.urdf", "", "panda_link8") for name in ("panda", "panda_collision")),
    *(
        (*GEPETTO, f"robots/ur_description/urdf/{name}.urdf", "", "tool0")
        for name in "ur3_robot ur3_gripper ur5_robot ur5_gripper ur5_joint_limited_robot ur10_robot ur10_joint_limited_robot".split()
    ),
    (*GEPETTO, "robots/kinova_description/robots/kinova.urdf", "", "j2s6s200_end_effector"),
    (*GEPETTO, "robots/tiago_description/robots/tiago.urdf", "", "arm_tool_link"),
    *(
        (*GEPETTO, f"robots/tiago_description/robots/{name}.urdf", "torso_lift_link", tool)
        for name, tool in (("tiago", "arm_tool_link"), ("tiago_no_hand", "arm_7_link"), ("tiago_dual", "arm_left_tool_link"))
    ),
    *(
        (*GEPETTO, "robots/tiago_pro_description/robots/tiago_pro.urdf", base, "arm_right_7_link")
        for base in ("", "torso_lift_link")
    ),
    *((*GEPETTO, "robots/baxter_description/urdf/baxter.urdf", base, f"{side}_hand_link") for base, side in (("", "left"), ("torso", "right"))),
    (*GEPETTO, "robots/talos_data/robots/talos_full_v2.urdf", "", "arm_left_7_link"),
    *(
        (*GEPETTO, f"robots/talos_data/robots/{name}.urdf", "torso_2_link", f"{link}")
        for name in ("talos_full_v2", "talos_reduced", "talos_reduced_corrected")
        for link in ("arm_left_7_link", "gripper_right_base_link")
    ),
    (*GEPETTO, "robots/talos_data/robots/talos_left_arm.urdf", "", "arm_left_7_link"),
    *((*GEPETTO, "robots/pr2_description/urdf/pr2.urdf", base, "l_wrist_roll_link") for base in ("", "torso_lift_link")),
    (*GEPETTO, "robots/z1_description/urdf/z1.urdf", "", "link06"),
    (*GEPETTO, "robots/bravo7_description/urdf/bravo7_no_ee.urdf", "", "link7"),
    *(
        (*KORTEX, f"kortex_description/arms/{name}.urdf", "", tool)
        for name, tool in (
            ("gen3/6dof/urdf/GEN3-6DOF_VISION_URDF_ARM_V01", "end_effector_link"),
            ("gen3/7dof/urdf/GEN3-7DOF-VISION_ARM_URDF_V12", "end_effector_link"),
            ("gen3_lite/6dof/urdf/GEN3-LITE", "END_EFFECTOR"),
        )
    ),
    (*MODELS, "iiwa_description/urdf/iiwa14_primitive_collision.urdf", "", "iiwa_link_ee"),
    (*MODELS, "iiwa_description/urdf/dual_iiwa14_polytope_collision.urdf", "", "left_iiwa_link_ee"),
    (*MODELS, "ur_description/urdf/ur3e_cylinders_collision.urdf", "", "ur_tool0"),
    (*MODELS, "jaco_description/urdf/j2s7s300_arm.urdf", "", "j2s7s300_link_7"),
    *(
        (*DATASET, f"urdf_files/{name}.urdf", base, tool)
        for name, base, tool in (
            ("matlab/iiwa_description/urdf/kukaIiwa7", "", "iiwa_link_ee"),
            ("matlab/iiwa_description/urdf/kukaIiwa14", "", "iiwa_link_ee"),
            ("ros-industrial/kuka/kuka_lbr_iiwa_support/urdf/lbr_iiwa_14_r820", "", "tool0"),
            ("ros-industrial/xacro_generated/universal_robots/ur_description/urdf/ur5e", "", "tool0"),
            ("ros-industrial/xacro_generated/universal_robots/ur_description/urdf/ur10e", "", "tool0"),
            ("ros-industrial/xacro_generated/universal_robots/ur_description/urdf/ur16e", "", "tool0"),
            ("matlab/kortex_v12_description/robots/kinovaGen3V12", "", "end_effector_link"),
            ("matlab/sawyer_description/urdf/rethinkSawyer", "", "right_hand"),
            ("oems/baxter_rethink_robotics/baxter_description/urdf/baxter", "", "left_hand"),
            ("matlab/yumi_description/urdf/abbYuMi", "", "gripper_r_base"),
        )
    ),
]


def text_of(clones, repository, commit, file):
    """The URDF at that commit. A .xacro file is processed with the arguments behind its name."""
    path, *arguments = file.split()
    name = repository.split("/")[1]

    def git(*command):
        return subprocess.run(["git", "-C", clones / name, *command], check=True, capture_output=True).stdout

    if not path.endswith(".xacro"):
        return git("show", f"{commit}:{path}").decode()
    with tempfile.TemporaryDirectory() as folder:
        for each in git("ls-tree", "-r", "--name-only", commit).decode().splitlines():
            if each.endswith((".xacro", ".yaml")):
                there = Path(folder) / name / each
                there.parent.mkdir(parents=True, exist_ok=True)
                there.write_bytes(git("show", f"{commit}:{each}"))
        # Without ROS xacro does not know where a package is.
        substitution_args._eval_find = lambda package: f"{folder}/{package}"
        mappings = dict(argument.split(":=") for argument in arguments)
        return xacro.process_file(f"{folder}/{name}/{path}", mappings=mappings).toprettyxml(indent=" ")


class Pinocchio:
    """The arm as Pinocchio reads it."""

    def __init__(self, text, base, tool):
        self.model = model = pinocchio.buildModelFromXML(text)
        self.data = model.createData()
        # The type is given because a joint may have the same name as a link.
        names = (base or model.frames[1].name, tool)
        self.base, self.tool = (model.getFrameId(name, pinocchio.FrameType.BODY) for name in names)
        above, way = (list(model.supports[model.frames[frame].parentJoint]) for frame in (self.base, self.tool))
        self.joints = [model.joints[joint] for joint in way if joint not in above]
        pinocchio.framesForwardKinematics(model, self.data, pinocchio.neutral(model))
        self.upright = self.data.oMf[self.base].copy()
        model.gravity.linear = self.upright.rotation @ [0, 0, -9.81]

    def state(self, q, qd):
        model, data = self.model, self.data
        place, speed = pinocchio.neutral(model), np.zeros(model.nv)
        for joint, angle, rate in zip(self.joints, q, qd, strict=True):
            place[joint.idx_q : joint.idx_q + joint.nq] = [angle] if joint.nq == 1 else [np.cos(angle), np.sin(angle)]
            speed[joint.idx_v] = rate
        at = [joint.idx_v for joint in self.joints]
        pinocchio.computeJointJacobians(model, data, place)
        pinocchio.framesForwardKinematics(model, data, place)
        pose = self.upright.actInv(data.oMf[self.tool])
        jacobian = pinocchio.getFrameJacobian(model, data, self.tool, pinocchio.LOCAL_WORLD_ALIGNED)[:, at]
        jacobian = np.kron(np.eye(2), self.upright.rotation.T) @ jacobian
        mass = pinocchio.crba(model, data, place)[np.ix_(at, at)]
        mass = np.triu(mass) + np.triu(mass, 1).T
        return pose.homogeneous[:3], jacobian, mass, pinocchio.nonLinearEffects(model, data, place, speed)[at]


class MuJoCo:
    """The arm as MuJoCo reads it."""

    def __init__(self, text, base, tool):
        root = ET.fromstring(text)
        for link in root.iter("link"):
            for shape in link.findall("visual") + link.findall("collision"):
                link.remove(shape)
        for old in root.findall("mujoco"):
            root.remove(old)
        # No link may be fused, so that the tool can be found, and no inertia may be changed.
        ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false", balanceinertia="false")
        self.model = model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
        self.data = data = mujoco.MjData(model)
        # A root link that MuJoCo does not have as a body is its world.
        first = max(0, mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, base)) if base else 0
        body = self.tool = model.body(tool).id
        self.at = []
        while body not in (0, first):
            self.at[:0] = [model.jnt_qposadr[i] for i in range(model.njnt) if model.jnt_bodyid[i] == body]
            body = model.body_parentid[body]
        mujoco.mj_forward(model, data)
        self.place, self.turn = data.xpos[first].copy(), data.xmat[first].reshape(3, 3).copy()
        model.opt.gravity = self.turn @ [0, 0, -9.81]

    def state(self, q, qd):
        model, data, at = self.model, self.data, self.at
        data.qpos[:], data.qvel[:] = 0, 0
        data.qpos[at], data.qvel[at] = q, qd
        mujoco.mj_forward(model, data)
        mass, linear, angular = np.zeros((model.nv, model.nv)), np.zeros((3, model.nv)), np.zeros((3, model.nv))
        for column, one in zip(mass, np.eye(model.nv), strict=True):
            mujoco.mj_mulM(model, data, column, one)
        mujoco.mj_jacBody(model, data, linear, angular, self.tool)
        turn = self.turn.T
        pose = np.column_stack((turn @ data.xmat[self.tool].reshape(3, 3), turn @ (data.xpos[self.tool] - self.place)))
        return pose, np.vstack((turn @ linear, turn @ angular))[:, at], mass[np.ix_(at, at)], data.qfrc_bias[at]


def ours(file, tool, base):
    """Number of joints and states of this project's own model; or None and the line that refuses the file."""
    command = ["cargo", "run", "--release", "--quiet", "-p", "physics", "--example", "urdf_states", "--", file, tool]
    made = subprocess.run(command + [base] * bool(base), cwd=ROOT, capture_output=True, text=True)
    if made.returncode:
        return None, made.stderr.strip()
    first, *lines = made.stdout.splitlines()
    n = int(first)
    states = []
    for line in lines:
        parts = np.split(np.array(line.split(), float), np.cumsum([n, n, 3, 4, n * n, n]))
        q, qd, place, quaternion, mass, bias, jacobian = parts
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, quaternion)
        pose = np.column_stack((rotation.reshape(3, 3), place))
        states.append((q, qd, (pose, jacobian.reshape(6, n), mass.reshape(n, n), bias)))
    return n, states


def differences(states, other):
    """The largest of pose, Jacobian, mass matrix and bias torques."""
    found = [[np.abs(a - b).max() for a, b in zip(own, other.state(q, qd), strict=True)] for q, qd, own in states]
    return np.max(found, axis=0)


def compare(text, base, tool):
    """The last columns of a row, and whether all differences are below TOLERANCE."""
    with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
        file.write(text)
        file.flush()
        joints, states = ours(file.name, tool, base)
    if joints is None:
        return {"refused": states}, True
    parts = differences(states, Pinocchio(text, base, tool))
    row = {"joints": joints} | {name: f"{part:.1e}" for name, part in zip(COLUMNS[6:10], parts)}
    good = parts.max() < TOLERANCE
    try:
        worst = differences(states, MuJoCo(text, base, tool)).max()
        row["mujoco"] = f"{worst:.1e}"
        good &= worst < TOLERANCE
    except ValueError as error:
        row["mujoco"] = re.sub(r"\s+", " ", str(error)).strip()
    return row, good


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    if len(sys.argv) > 2:
        file, tool, base = [*sys.argv[1:], ""][:3]
        row, good = compare(Path(file).read_text(), base, tool)
        for column, value in row.items():
            print(f"{column}: {value}")
        return not good
    clones, bad = Path(sys.argv[1]), []
    text = io.StringIO()
    versions = f"pinocchio {pinocchio.__version__}, mujoco {mujoco.__version__}, xacro {importlib.metadata.version('xacro')}"
    text.write(f"# {versions}; made by scripts/urdf_compared.py\n")
    rows = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    rows.writeheader()
    for repository, commit, file, base, tool in ARMS:
        row, good = compare(text_of(clones, repository, commit, file), base, tool)
        row |= {"repository": repository, "commit": commit[:12], "file": file, "base": base or "-", "tool": tool}
        rows.writerow(row)
        print(*(str(row.get(column, "")) for column in COLUMNS[2:]))
        bad += [file] * (not good)
    with whole_file(OUT) as out:
        out.write(text.getvalue())
    for file in bad:
        print(f"{file}: differs", file=sys.stderr)
    return bool(bad)


if __name__ == "__main__":
    sys.exit(main())
